"""The run that discriminates the effects of which a machine may have one: T-optimal."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from design.experiment.allocation import t_optimal
from design.experiment.precision import Machine, evaluated, information_by_segment, stacked
from design.experiment.search import Criterion, Evaluated, Joint
from identification.arrays import Array
from identification.experiment.information import Information
from identification.experiment.structures import NO_EFFECT, discriminated

NEGLIGIBLE_CHANGE = 1.0  # square in units of the noise, beside which a difference begins to count


@dataclass(frozen=True)
class Pair:
    """Places, in the information, of an effect, of all that its rival can change instead, and both
    names."""

    one: int
    others: tuple[int, ...]
    names: tuple[str, str]


def pairs_of(information: Information, keys: Sequence[str]) -> tuple[Pair, ...]:
    """Each effect against none, and against each other one, the plant's parameters being free."""
    own = tuple(i for i, name in enumerate(information.names) if name not in keys)
    place = {name: information.names.index(name) for name in keys}
    out = []
    for one in keys:
        out.append(Pair(place[one], own, (one, NO_EFFECT)))
        out += [Pair(place[one], (*own, place[k]), (one, k)) for k in keys if k != one]
    return tuple(out)


def separation(machines: Sequence[Machine], keys: Sequence[str]) -> Criterion:
    """The criterion: the mean, over pairs and machines, of the log of what discriminates them."""

    def value_of(matrix: Array, pairs: Sequence[Pair]) -> float:
        left = [discriminated(matrix, one.one, one.others) for one in pairs]
        return float(np.mean(np.log(np.array(left) + NEGLIGIBLE_CHANGE)))

    def evaluate(r: Array) -> Evaluated | None:
        found = evaluated(machines, r)
        if found is None:
            return None
        worst, information, _ = found
        pairs = pairs_of(information[0], keys)
        values = [
            value_of(own.matrix, pairs) - one.chance_penalty(own)
            for one, own in zip(machines, information, strict=True)
        ]
        return Evaluated(worst, min(values), information)

    def joint(seen: Sequence[Evaluated]) -> Joint:
        information = information_by_segment(seen)
        pairs, matrices = pairs_of(information[0][0], keys), stacked(information)

        def measure(times: Array) -> float:
            return value_of(np.tensordot(times, matrices[0], 1), pairs)

        def value(times: Array) -> float:
            return min(value_of(np.tensordot(times, M, 1), pairs) for M in matrices)

        return Joint(
            lambda seconds, room: t_optimal(matrices[0], pairs, seconds, room), measure, value
        )

    return Criterion(evaluate, joint)
