"""Which column is which signal: all roles at once, by what the headers say and the signals do.

Positions are ranked by their own course and by their derivatives among the columns. The likely
ones are tried with every way to drive them, the best of these with every other role of the columns
that are left; the largest sum of log-odds (`weights`) decides.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
from scipy.optimize import linear_sum_assignment

from identification.arrays import Array
from identification.log import RigKind
from identification.signals.relations import (
    GIVES_SIGN,
    ForceLaw,
    Lead,
    actuator_share,
    force_law,
    force_laws,
)
from workbench.steps.first_card.columns import Column
from workbench.steps.first_card.pairs import MOST_CONSTANT, SURELY_TURNED, Pairs, Seen, follows
from workbench.steps.first_card.weights import (
    ALL_VELOCITY,
    AREA_RATIOS,
    FORCE_LIKENESS,
    LEAST_SCORE,
    MIRRORED,
    OF_A_CONTROLLER,
    RULED_OUT,
    SURE,
    acts,
    ahead_of,
    among_derivatives,
    drives,
    driving,
    in_one_unit,
    less_way,
    limits,
    moves_like_a_body,
    of_a_motor,
    said,
    together,
    turned,
)

MOST_BODIES, MOST_WAYS, MOST_CHAMBERS = 8, 14, 8  # that physics is asked about
FIRST_AXIS = 2.0  # log-odds for the axis that comes first, of several alike
FAR_BEHIND = 7.0  # log-odds behind the likeliest position, from which one is not tried
FRICTION_GIVES_SIGN = 5e-3  # share of a force that its step at the reversal explains, the same
HARDLY_ITS_LAW = 0.05  # the same of columns that are rather no position and force of one body
MOSTLY_ITS_LAW = 0.5  # share of a force that its law explains, without work the same
WORK_GIVES_SIGN = 0.3  # share of the exchanged work, the same of what its law hardly explains
COMMAND_GIVES_SIGN = 0.2  # share of a command that its law explains, from which its sign is known
MOST_BY_CHANGE, MOST_UNNAMED = 4.0, 1.5  # log-odds that a force's change gives a command at most
SAME_POSITION = 0.95  # correlation with the position, that no command has
MOVES_NOTHING = 0.05  # share of a force's change, that noise explains at most
MOST_NEARER = 2.0  # log-odds that a velocity gives for what it is the derivative of, at most more
EXACTLY = 0.02  # of a drive, left by its law along what it surely moves
MORE_EXACTLY = 0.5  # of what its law leaves of a drive, left along what is rather the position
CLEAR = 1.0  # log-odds that the next best column is behind at least, for a role to be sure
HEADER_SAYS = 2.0  # log-odds by a header, without which no role is sure

Sign = float


@dataclass(frozen=True, eq=False)
class Roles:
    """Signals by canonical name, their signs, and how sure each is (log-odds over the next).

    law: what of the driving signal is inertia and friction along y; area_ratio: of the chambers;
    why: reasons by signal; rivals: the next best column of each, where there is one; ahead: of the
    kind of rig over the next best one [log-odds], whose roles are `other`.
    """

    kind: RigKind
    columns: Mapping[str, Column]
    signs: Mapping[str, Sign]
    odds: Mapping[str, float]
    why: Mapping[str, str]
    law: ForceLaw
    area_ratio: float = 1.0
    rivals: Mapping[str, Column] = field(default_factory=dict)
    ahead: float = np.inf
    other: "Roles | None" = None


@dataclass(frozen=True, eq=False)
class _Way:
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


@dataclass(frozen=True, eq=False)
class _Choice:
    way: _Way
    others: Mapping[str, Column]
    gains: Mapping[str, float]
    next_best: Mapping[str, Column]
    behind: Mapping[str, float] = field(default_factory=dict)

    @property
    def score(self) -> float:
        return self.way.score + sum(self.gains.values())

    @property
    def columns(self) -> dict[str, Column]:
        """Every column of the choice by its role."""
        return {"y": self.way.y, **self.way.columns, **self.others}


def known_roles(signals: Sequence[Column], only: Column | None = None) -> Roles | None:
    """The signals of a log; None where no column moves as a body that another one drives.

    only: the column that is to be the position, where somebody has said so.
    """
    if len(signals) < 2:
        return None
    pairs = Pairs(signals)
    behind = limits(pairs)
    drive = [drives(pairs, k, behind) for k in range(len(signals))]
    acting = [drives(pairs, k, {}) + acts(pairs, k, behind) for k in range(len(signals))]
    ways = [way for seen, own in _bodies(pairs, only) for way in _ways(seen, own, drive, acting)]
    if not ways:
        return None
    ways.sort(key=lambda one: -_with_reference(one))
    choices = [_filled(way) for way in ways[:MOST_WAYS]]
    choices.sort(key=lambda one: -one.score)
    best = choices[0]
    same = (one for one in choices if one.way.y is best.way.y)
    other = next((one for one in same if one.way.kind != best.way.kind), None)
    rest = None if other is None else _roles_of(other, [one for one in choices if one is not best])
    ahead = np.inf if other is None else best.score - other.score
    return replace(_roles_of(best, choices), other=rest, ahead=ahead)


def _roles_of(best: _Choice, choices: Sequence[_Choice]) -> Roles:
    """The roles by one choice beside the others."""
    return Roles(
        kind=best.way.kind,
        columns=best.columns,
        signs=_signs(best),
        odds=_odds(best, choices),
        why=_reasons(best),
        law=best.way.law,
        area_ratio=best.way.area_ratio,
        rivals=_rivals(best, choices),
    )


def _bodies(pairs: Pairs, only: Column | None) -> list[tuple[Seen, float]]:
    """The columns that may be the position, likeliest first, with their log-odds so far."""
    found = []
    derived = among_derivatives(pairs)
    for k, one in enumerate(pairs.signals):
        head = said(one, "y")
        if one is not only and (only is not None or head <= -4.0 or one.header.speed):
            continue
        if one.motion is not None:
            found.append((head + moves_like_a_body(one) + derived[k], k))
    named = [k for _, k in found if said(pairs.signals[k], "y") >= HEADER_SAYS]
    if named:  # beside a position that is called one no reference or model is any
        beside = ("reference", "model")
        found = [one for one in found if pairs.signals[one[1]].header.purpose not in beside]
    if only is None and any(one.header.speed for one in pairs.signals):
        found = [one for one in found if said(pairs.signals[one[1]], "y") >= 0.0]
    if not found:
        return []
    first = min((pairs.signals[k].axis for _, k in found if pairs.signals[k].axis), default="")
    found = sorted(
        ((own + (FIRST_AXIS if first and pairs.signals[k].axis == first else 0.0), k)
         for own, k in found),
        reverse=True,
    )  # fmt: skip
    likely = [one for one in found if one[0] > found[0][0] - FAR_BEHIND][:MOST_BODIES]
    pairs.bodies = {k: Seen(pairs, k) for _, k in likely}
    return [(pairs.bodies[k], score) for score, k in likely]


def _ways(
    seen: Seen, own: float, drive: Sequence[float], acting: Sequence[float]
) -> Iterator[_Way]:
    """What may drive the body: a force, the difference of two pressures, or the command itself.

    drive, acting: log-odds of each signal as either, by what it is of the others.
    """
    laws, y, pairs = seen.laws, seen.y, seen.pairs
    named = [one for one in pairs.signals if max(said(one, "F"), said(one, "u")) >= HEADER_SAYS]
    # what the velocity follows may well drive a valve, where nothing else is said to drive
    alone = named[0] if len(named) == 1 and "velocity" not in named[0].header.means else None
    for k, law in enumerate(laws):
        one = pairs.signals[k]
        if one is y:
            continue
        as_force, as_command = said(one, "F"), said(one, "u")
        if max(as_force, as_command) <= -3.0:
            continue
        v_share = 0.0 if one is alone else float(seen.v_share[k])
        physics = driving(law, v_share, less_way(y, one)) + together(y, one) + own
        physics += OF_A_CONTROLLER if k in seen.controlled else 0.0
        force = law.way * seen.smooth[:, k]
        if as_force > -3.0:
            yield _Way(seen, "force", {"F": one}, law, force, 0.5 + as_force + physics + drive[k])
        if as_command > -3.0 and not _is_set_point(seen, k):
            score = as_command + physics + of_a_motor(one) + acting[k]
            yield _Way(seen, "motor", {"u": one}, law, force, score)
    if laws:
        yield from _chambers(seen, own)


def _is_set_point(seen: Seen, k: int) -> bool:
    """Whether a column in counts, as those of a stepper, is where the position goes."""
    unit = seen.pairs.signals[k].header.unit
    counts = unit is not None and unit.quantity in ("count", "position")
    return counts and abs(seen.pairs.alike[seen.at, k]) > SAME_POSITION


def _chambers(seen: Seen, own: float) -> Iterator[_Way]:
    """Two pressures of one size as a drive, with the ratio of areas that explains most."""
    signals, x = seen.pairs.signals, seen.pairs.x
    likely = [
        (said(one, "p"), k)
        for k, one in enumerate(signals)
        if one is not seen.y and said(one, "p") > -3.0 and one.x.min() >= 0.0
    ]
    likely = sorted(likely, reverse=True)[:MOST_CHAMBERS]
    for i, j in combinations(sorted(k for _, k in likely), 2):
        a, b = in_one_unit(signals[i], signals[j])
        first, second = a * x[:, i], b * x[:, j]
        if not 0.2 < first.mean() / max(float(second.mean()), 1e-300) < 5.0:
            continue
        f = np.column_stack([first - ratio * second for ratio in AREA_RATIOS])
        smooth = np.column_stack(
            [a * seen.smooth[:, i] - ratio * b * seen.smooth[:, j] for ratio in AREA_RATIOS]
        )
        laws = force_laws(seen.motion, seen.y.x, f, smooth)
        at = int(np.argmax([law.share for law in laws]))
        law, ratio = laws[at], AREA_RATIOS[at]
        way = driving(turned(law), float(seen.v_share[i]), False) - 1.0
        way += MIRRORED if _mirrored(seen.laws[i], seen.laws[j]) else 0.0
        way += 0.5 * (said(signals[i], "p") + said(signals[j], "p"))
        way += together(seen.y, signals[i]) + together(signals[i], signals[j])
        pair = (signals[i], signals[j]) if law.way > 0 else (signals[j], signals[i])
        yield _Way(
            seen, "electro-pneumatic", dict(zip(("p_p", "p_n"), pair, strict=True)), law,
            law.way * smooth[:, at], own + way, ratio if law.way > 0 else 1.0 / ratio,
        )  # fmt: skip


def _mirrored(one: ForceLaw, other: ForceLaw) -> bool:
    """Whether each of two columns alone looks like the force, but with opposite signs.

    Of two chambers the one is filled as the other is emptied; a force beside a pressure is no such.
    """
    alike = min(one.share, other.share) > FORCE_LIKENESS
    return alike and one.way * other.way < 0.0


def _with_reference(way: _Way) -> float:
    """Log-odds of a way with the likeliest reference of its position beside it."""
    taken = [way.y, *way.columns.values()]
    gains = [_gain_of_reference(way.seen, k) for k, one in enumerate(way.seen.pairs.signals)
             if one not in taken and not _moves_rather(way, k)]  # fmt: skip
    return way.score + max([0.0, *gains])


def _moves_rather(way: _Way, k: int) -> bool:
    """Whether what drives the body drives another column far more exactly: then that is the
    position, and the body here a copy of it, late or by a model."""
    other = way.seen.pairs.bodies.get(k)
    if other is None or len(way.columns) != 1 or not other.laws:
        return False
    (drive,) = way.columns.values()
    left = 1.0 - other.laws[way.seen.pairs.signals.index(drive)].share
    return left < min(EXACTLY, MORE_EXACTLY * (1.0 - way.law.share))


def _gain_of_reference(seen: Seen, k: int) -> float:
    """Log-odds that a column is the reference; kept, since it does not depend on the drive."""
    if k not in seen.as_reference:
        one = seen.pairs.signals[k]
        head = max(0.0, said(one, "r")) if k in seen.controlled else said(one, "r")
        more = ahead_of(seen, k) + together(seen.y, one) if head >= -3.0 else 0.0
        seen.as_reference[k] = head + more
    return seen.as_reference[k]


def _filled(way: _Way) -> _Choice:
    """The best roles of the columns that are neither the position nor drive the body."""
    taken = [way.y, *way.columns.values()]
    rest = [k for k, one in enumerate(way.seen.pairs.signals) if one not in taken]
    roles = ["r", "v", "a", "temperature"]
    roles += ["u"] if "u" not in way.columns else []
    roles += ["F"] if way.kind == "electro-pneumatic" else []
    if not rest:
        return _Choice(way, {}, {}, {})
    signals, moved = way.seen.pairs.signals, way.seen.moves(way.force)
    gain = np.array([[_gain(way, k, role, float(moved[k])) for role in roles] for k in rest])
    bounded = np.maximum(gain, LEAST_SCORE)
    rows, places = linear_sum_assignment(-bounded)
    others, gains, next_best, margins = {}, {}, {}, {}
    for i, j in zip(rows.tolist(), places.tolist(), strict=True):
        if bounded[i, j] <= LEAST_SCORE:
            continue
        role, others[roles[j]], gains[roles[j]] = roles[j], signals[rest[i]], float(bounded[i, j])
        behind = [m for m in np.argsort(-gain[:, j]).tolist() if m != i and gain[m, j] > -3.0]
        if behind:
            next_best[role] = signals[rest[behind[0]]]
            margins[role] = float(gain[i, j] - gain[behind[0], j])
            gains[role] = float(min(gains[role], 2.0 * (gain[i, j] - gain[behind[0], j]) + 4.0))
    return _Choice(way, others, gains, next_best, margins)


def _gain(way: _Way, k: int, role: str, moved: float) -> float:
    """Log-odds of a role of one more column, beside position and drive.

    moved: how much more the force's change follows it than the other way round.
    """
    seen, one = way.seen, way.seen.pairs.signals[k]
    head = said(one, role) + together(seen.y, one)
    if role == "r":
        return RULED_OUT if _moves_rather(way, k) else _gain_of_reference(seen, k)
    if role in ("u", "v", "a") and head < -3.0:
        return head
    if role == "v":
        share = seen.v_share[k] if seen.v_constant[k] < MOST_CONSTANT else 0.0
        if share <= ALL_VELOCITY:
            return head + (-0.5 if share > 0.8 else -3.0)
        nearer = np.log10((1.0 - ALL_VELOCITY) / max(1.0 - float(share), 1e-9))
        return head + 2.5 + float(np.clip(nearer, 0.0, MOST_NEARER))
    if role == "u":
        one_way = 1.5 if one.x.min() * one.x.max() > 0.0 else 0.0
        most = MOST_BY_CHANGE if head >= HEADER_SAYS else MOST_UNNAMED
        if head < HEADER_SAYS and abs(seen.pairs.alike[seen.at, k]) > SAME_POSITION:
            return -3.0  # one more position, of a model or another sensor
        if one.noisy and moved < MOVES_NOTHING:
            return -3.0
        return head + float(np.clip(8.0 * moved - 1.0 - one_way, -2.0, most))
    return head + 1.0 if role == "F" else head - 1.0


def _gives_sign(law: ForceLaw) -> bool:
    """Whether a law gives the sign of a force or command: by its work, or by friction in it."""
    if abs(law.work) > GIVES_SIGN:
        return law.share > COMMAND_GIVES_SIGN or abs(law.work) > WORK_GIVES_SIGN
    onwards = law.friction is None  # one way: along it
    in_it = law.friction is not None and law.friction > FRICTION_GIVES_SIGN
    return (onwards or in_it) and law.share > MOSTLY_ITS_LAW


def _signs(best: _Choice) -> dict[str, Sign]:
    """1 or -1 by signal: with which a force drives the body, and a command the force."""
    way, seen = best.way, best.way.seen
    out = dict.fromkeys(best.columns, 1.0)
    if way.kind != "electro-pneumatic":
        (name,) = way.columns
        out[name] = way.law.way if _gives_sign(way.law) else 1.0
    if "u" in best.others:
        u = best.others["u"].x
        out["u"] = actuator_share(way.force, seen.motion.v, u, seen.motion.cutoff)[1]
    if "r" in best.others:
        found = _lead_of(best)
        out["r"] = -1.0 if found.likeness < -SURELY_TURNED else 1.0
    if "F" in best.others:
        law = force_law(seen.motion, seen.y.x, best.others["F"].x)
        out["F"] = 1.0 if law is None else law.way
    return out


def _odds(best: _Choice, choices: Sequence[_Choice]) -> dict[str, float]:
    """How far the best choice is ahead of the best that gives each signal another column.

    No role is sure whose header says nothing of it, or of columns that do not move as a body that
    is driven, or a reference that nothing follows.
    """
    out = {}
    law = best.way.law
    moves = law.share > HARDLY_ITS_LAW or abs(law.work) > WORK_GIVES_SIGN
    for role, column in best.columns.items():
        rivals = [one.score for one in choices if one.columns.get(role) is not column]
        ahead = best.score - max(rivals, default=-np.inf)
        own = best.gains.get(role)
        odds = min(ahead, own) if own is not None else ahead
        odds = min(odds, SURE - CLEAR + best.behind.get(role, CLEAR))
        named = said(column, role[0] if role in ("p_p", "p_n") else role) >= HEADER_SAYS
        found = _lead_of(best) if role == "r" else None
        known = found is None or (follows(found) and not found.either)
        out[role] = odds if named and moves and known else min(odds, SURE - 1.0)
    return out


def _lead_of(best: _Choice) -> Lead:
    """By how much the position is behind its reference."""
    seen = best.way.seen
    return seen.lead(seen.pairs.signals.index(best.others["r"]))


def _rivals(best: _Choice, choices: Sequence[_Choice]) -> dict[str, Column]:
    """The column that each signal would be otherwise."""
    out = dict(best.next_best)
    for role, column in best.columns.items():
        for one in choices[1:]:
            other = one.columns.get(role)
            if role not in out and other is not None and other is not column:
                out[role] = other
    return out


def _reasons(best: _Choice) -> dict[str, str]:
    """In words why each column has its role."""
    law = best.way.law
    of = f"{law.share:.0%} of it is inertia and friction"
    work = f", and friction takes {abs(law.work):.0%} of its work" if abs(law.work) > 0.1 else ""
    out = {name: f"{of} along the position{work}" for name in best.way.columns}
    two = best.way.kind == "electro-pneumatic"
    if two:
        out = dict.fromkeys(out, f"of the difference of the two {of}")
    out["y"] = "moves as a body does, and " + (
        "two pressures drive it" if two else "a force drives it"
    )
    if "r" in best.others:
        found = _lead_of(best)
        turned = ", turned in sign" if found.likeness < 0.0 else ""
        late = ", or unturned half a period later" if found.either else ""
        out["r"] = (
            f"the position follows it{turned} ({abs(found.likeness):.0%} alike){late}"
            if follows(found)
            else "its header says so; the position does not follow it"
        )
    if "u" in best.others:
        out["u"] = "the force's change follows it"
    if "v" in best.others:
        out["v"] = "is the derivative of the position"
    return out
