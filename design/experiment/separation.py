"""The run that tells apart the effects of which a machine may have one: T-optimal."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from design.experiment.allocation import Allocation, t_optimal
from design.experiment.precision import LOOSE, PER_LOOSE, Machine, looked_at
from design.experiment.search import Criterion, Seen
from identification.arrays import Array
from identification.experiment.information import Information
from identification.experiment.structures import NO_EFFECT, told_apart

NEGLIGIBLE = 1.0  # square in units of the noise, beside which a difference begins to tell


@dataclass(frozen=True)
class Pair:
    """Places, in the information, of an effect, of all that its rival can change instead, and both
    names."""

    one: int
    others: tuple[int, ...]
    names: tuple[str, str]


def pairs_of(told: Information, keys: Sequence[str]) -> tuple[Pair, ...]:
    """Each effect against none, and against each other one, the plant's parameters being free."""
    own = tuple(i for i, name in enumerate(told.names) if name not in keys)
    place = {name: told.names.index(name) for name in keys}
    out = []
    for one in keys:
        out.append(Pair(place[one], own, (one, NO_EFFECT)))
        out += [Pair(place[one], (*own, place[k]), (one, k)) for k in keys if k != one]
    return tuple(out)


def separation(machines: Sequence[Machine], keys: Sequence[str]) -> Criterion:
    """The criterion: the mean, over pairs and machines, of the log of what tells them apart."""

    def value_of(matrix: Array, pairs: Sequence[Pair]) -> float:
        left = [told_apart(matrix, one.one, one.others) for one in pairs]
        return float(np.mean(np.log(np.array(left) + NEGLIGIBLE)))

    def look(r: Array) -> Seen | None:
        found = looked_at(machines, r)
        if found is None:
            return None
        worst, told = found
        pairs = pairs_of(told[0], keys)
        value = np.mean([value_of(one.matrix, pairs) for one in told])
        luck = PER_LOOSE * max(max(one.loose for one in told) - LOOSE, 0.0)
        return Seen(worst, float(value) - luck, told)

    def shared(seen: Sequence[Seen], seconds: Array, room: float) -> Allocation:
        first = _matrices(seen)[0]
        return t_optimal(first, pairs_in(seen), seconds, room)

    def pairs_in(seen: Sequence[Seen]) -> tuple[Pair, ...]:
        told: list[Information] = seen[0].told  # type: ignore[assignment]
        return pairs_of(told[0], keys)

    def joined(seen: Sequence[Seen], times: Array) -> float:
        pairs = pairs_in(seen)
        return float(np.mean([value_of(np.tensordot(times, M, 1), pairs) for M in _matrices(seen)]))

    def _matrices(seen: Sequence[Seen]) -> list[Array]:
        each: list[list[Information]] = [one.told for one in seen]  # type: ignore[misc]
        return [np.array([told[i].matrix for told in each]) for i in range(len(machines))]

    return Criterion(look, look, shared, joined)
