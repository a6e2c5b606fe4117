"""What may be the position, and what may drive it: a force, two pressures, or a motor's command."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from identification.arrays import Array
from identification.columns import weights
from identification.columns.column import Column
from identification.columns.header import words_of
from identification.columns.pairs import Pairs, Seen
from identification.log import RigKind
from identification.signals.relations import ForceLaw, force_laws
from identification.thresholds import HALF

MOST_BODIES, MOST_CHAMBERS = 8, 8  # that physics is asked about
FIRST_AXIS = 2.0  # log-odds for the axis that comes first, of several alike
FAR_BEHIND = 7.0  # log-odds behind the likeliest position, from which one is not tried
SAME_POSITION = 0.95  # correlation with the position, that no command has
SAME_ENDS = 0.05  # of the travel, within which a body stops at the ends of its set point
EXACTLY = 0.02  # of a drive, left by its law along what it surely moves
MORE_EXACTLY = 0.5  # of what its law leaves of a drive, left along what is rather the position
HEADER_SAYS = 2.0  # log-odds by a header, without which no role is sure


@dataclass(frozen=True, eq=False)
class Way:
    """A body and what drives it: the columns by role, their law, the force (n,), log-odds."""

    seen: Seen
    kind: RigKind
    columns: Mapping[str, Column]
    law: ForceLaw
    force: Array
    score: float
    area_ratio: float = 1.0

    @property
    def y(self) -> Column:
        return self.seen.y


def bodies(pairs: Pairs, only: Column | None) -> list[tuple[Seen, float]]:
    """The columns that may be the position, likeliest first, with their log-odds so far."""
    found = []
    derived = weights.among_derivatives(pairs)
    for k, one in enumerate(pairs.signals):
        head = weights.said(one, "y")
        if one is not only and (only is not None or head <= -4.0 or one.header.speed):
            continue
        if one.motion is not None:
            found.append((head + weights.moves_like_a_body(one) + derived[k], k))
    named = [k for _, k in found if weights.said(pairs.signals[k], "y") >= HEADER_SAYS]
    if named:  # beside a position that is called one no reference or model is any
        beside = ("reference", "model")
        found = [one for one in found if pairs.signals[one[1]].header.purpose not in beside]
    if only is None and any(one.header.speed for one in pairs.signals):
        found = [one for one in found if weights.said(pairs.signals[one[1]], "y") >= 0.0]
    if not found:
        return []
    axes = {k: pairs.signals[k].axis for _, k in found}
    first = min(filter(None, axes.values()), default=None)
    found = [(own + (FIRST_AXIS if axes[k] == first else 0.0), k) for own, k in found]
    found.sort(reverse=True)
    likely = [one for one in found if one[0] > found[0][0] - FAR_BEHIND][:MOST_BODIES]
    pairs.bodies = {k: Seen(pairs, k) for _, k in likely}
    return [(pairs.bodies[k], score) for score, k in likely]


def ways_of(
    seen: Seen, own: float, drive: Sequence[float], acting: Sequence[float]
) -> Iterator[Way]:
    """What may drive the body: a force, the difference of two pressures, or the command itself.

    drive, acting: log-odds of each signal as either, by what it is of the others.
    """
    laws, y, pairs = seen.laws, seen.y, seen.pairs
    places = [i for i, one in enumerate(pairs.signals) if weights.said(one, "y") >= HEADER_SAYS]
    for k, law in enumerate(laws):
        one = pairs.signals[k]
        another = bool(one.axis and y.axis and one.axis != y.axis)
        if one is y or _are_several(one, y) or (another and law.share < HALF):
            continue
        as_force, as_command = weights.said(one, "F"), weights.said(one, "u")
        least = -3.0 if one.header.unit else -HEADER_SAYS
        if max(as_force, as_command) < least:
            continue
        named = max(as_force, as_command) >= HEADER_SAYS
        of = [seen.at, *places] if named else range(len(laws))
        inertia = law.share > weights.EXACT_VELOCITY and (law.friction or 1.0) < weights.NO_FRICTION
        if np.max(pairs.rate[of, k]) > weights.EXACT_VELOCITY or (inertia and not named):
            continue  # the velocity of a position, or what nobody calls a drive is of whatever
        v_share = float(seen.v_share[k])
        less_way = one.way_gone < weights.LEAST_WAY * y.way_gone  # which no force on it does
        physics = weights.driving(law, v_share, less_way) + weights.together(y, one) + own
        force = law.way * seen.smooth[:, k]
        if as_force >= -HEADER_SAYS:
            yield Way(seen, "force", {"F": one}, law, force, 0.5 + as_force + physics + drive[k])
        if as_command >= least and not _is_set_point(seen, k):
            score = as_command + physics + acting[k] + (0.0 if named else weights.of_a_motor(one))
            yield Way(seen, "motor", {"u": one}, law, force, score)
    if laws:
        yield from _chambers(seen, own)


def _are_several(one: Column, other: Column) -> bool:
    """Whether two columns are the same of several motors, distinguished by a number alone."""
    heads = one.header, other.header
    names = [[word for word in words_of(head.name) if not word.isdigit()] for head in heads]
    roles_named = {"position", "force", "command"} & set(heads[0].means)
    return bool(roles_named) and names[0] == names[1] and heads[0].unit == heads[1].unit


def _is_set_point(seen: Seen, k: int) -> bool:
    """Whether a command is where the position goes: in counts, as those of a stepper, or in the
    size of the position, which follows it, or goes on to both its ends; or by the command that a
    controller makes of both."""
    one = seen.pairs.signals[k]
    unit = one.header.unit
    if unit is not None:
        counts = unit.quantity in ("count", "position")
        return counts and abs(seen.pairs.alike[seen.at, k]) > SAME_POSITION
    size = float(np.std(seen.y.x))
    same = abs(float(np.std(one.x)) - size) < weights.SAME_UNIT * size
    like = seen.lead(k).likeness
    if same and like > SAME_POSITION:
        return True
    low, high = one.x.min() - seen.y.x.min(), one.x.max() - seen.y.x.max()
    if like > weights.CALLED_ALIKE and max(abs(low), abs(high)) < SAME_ENDS * np.ptp(seen.y.x):
        return True
    return like > weights.CALLED_ALIKE and seen.is_followed_by_control(k)


def _chambers(seen: Seen, own: float) -> Iterator[Way]:
    """Two pressures of one size as a drive, with the ratio of areas that explains most."""
    signals, x = seen.pairs.signals, seen.pairs.x
    likely = [
        (weights.said(one, "p"), k)
        for k, one in enumerate(signals)
        if one is not seen.y and weights.said(one, "p") > -3.0 and one.x.min() >= 0.0
    ]
    likely = sorted(likely, reverse=True)[:MOST_CHAMBERS]
    for i, j in combinations(sorted(k for _, k in likely), 2):
        a, b = weights.in_one_unit(signals[i], signals[j])
        first, second = a * x[:, i], b * x[:, j]
        if not 0.2 < first.mean() / max(float(second.mean()), 1e-300) < 5.0:
            continue
        f = np.column_stack([first - ratio * second for ratio in weights.AREA_RATIOS])
        smooth = np.column_stack(
            [a * seen.smooth[:, i] - ratio * b * seen.smooth[:, j] for ratio in weights.AREA_RATIOS]
        )
        laws = force_laws(seen.motion, seen.y.x, f, smooth)
        at = int(np.argmax([law.share for law in laws]))
        law, ratio = laws[at], weights.AREA_RATIOS[at]
        way = weights.driving(weights.turned(law), float(seen.v_share[i]), False) - 1.0
        way += weights.MIRRORED if _mirrored(seen.laws[i], seen.laws[j]) else 0.0
        way += 0.5 * (weights.said(signals[i], "p") + weights.said(signals[j], "p"))
        way += weights.together(seen.y, signals[i]) + weights.together(signals[i], signals[j])
        pair = (signals[i], signals[j]) if law.way > 0 else (signals[j], signals[i])
        yield Way(
            seen, "electro-pneumatic", dict(zip(("p_p", "p_n"), pair, strict=True)), law,
            law.way * smooth[:, at], own + way, ratio if law.way > 0 else 1.0 / ratio,
        )  # fmt: skip


def _mirrored(one: ForceLaw, other: ForceLaw) -> bool:
    """Whether each of two columns alone looks like the force, but with opposite signs.

    Of two chambers the one is filled as the other is emptied; a force beside a pressure is no such.
    """
    alike = min(one.share, other.share) > weights.FORCE_LIKENESS
    return alike and one.way * other.way < 0.0


def with_reference(way: Way) -> float:
    """Log-odds of a way with the likeliest reference of its position beside it."""
    taken = [way.y, *way.columns.values()]
    gains = [gain_of_reference(way.seen, k) for k, one in enumerate(way.seen.pairs.signals)
             if one not in taken and not moves_rather(way, k)]  # fmt: skip
    return way.score + max([0.0, *gains])


def _asks_for_speed(seen: Seen, k: int) -> bool:
    """Whether the speed of the position follows a column, and the position itself less so."""
    alike = np.abs(seen.pairs.alike[k])
    speeds = seen.pairs.rate[seen.at] > weights.ALL_VELOCITY
    speeds[k] = False
    return bool(np.max(alike[speeds], initial=0.0) > max(alike[seen.at], weights.CALLED_ALIKE))


def moves_rather(way: Way, k: int) -> bool:
    """Whether what drives the body drives another column far more exactly: then that is the
    position, and the body here a copy of it, late or by a model."""
    other = None if way.y.header.purpose == "measured" else way.seen.pairs.bodies.get(k)
    if other is None or len(way.columns) != 1 or not other.laws:
        return False
    (drive,) = way.columns.values()
    left = 1.0 - other.laws[way.seen.pairs.signals.index(drive)].share
    return left < min(EXACTLY, MORE_EXACTLY * (1.0 - way.law.share))


def gain_of_reference(seen: Seen, k: int) -> float:
    """Log-odds that a column is the reference; kept, since it does not depend on the drive."""
    if k not in seen.as_reference:
        one = seen.pairs.signals[k]
        asks = "command" in one.header.means and _is_set_point(seen, k)
        head = max(0.0 if asks else -np.inf, weights.said(one, "r"))
        other = weights.together(seen.y, one) < 0.0 and one.header.purpose != "reference"
        if other or _asks_for_speed(seen, k):
            head = weights.RULED_OUT  # another axis's position, which goes with this one
        more = weights.ahead_of(seen, k) + weights.together(seen.y, one) if head >= -3.0 else 0.0
        seen.as_reference[k] = head + more
    return seen.as_reference[k]
