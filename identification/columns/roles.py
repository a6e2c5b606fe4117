"""Which column is which signal: all roles at once, by what the headers say and the signals do.

Positions are ranked by their own course and by their derivatives among the columns. The likely
ones are tried with every way to drive them, the best of these with every other role of the columns
that are left; the largest sum of log-odds (`weights`) decides.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from identification.columns import weights
from identification.columns.column import Column
from identification.columns.pairs import MOST_CONSTANT, SURELY_TURNED, Pairs, follows
from identification.columns.ways import (
    HEADER_SAYS,
    SAME_POSITION,
    Way,
    bodies,
    gain_of_reference,
    moves_rather,
    ways_of,
    with_reference,
)
from identification.log import RigKind
from identification.signals.differentiate import differentiate
from identification.signals.relations import (
    GIVES_SIGN,
    ForceLaw,
    Lead,
    actuator_share,
    by_inertia,
    force_law,
)
from identification.thresholds import TWICE

MOST_WAYS = 14  # ways to drive a body, that every other role is asked about
FRICTION_GIVES_SIGN = 5e-3  # share of a force that its step at the reversal explains, the same
HARDLY_ITS_LAW = 0.05  # the same of columns that are rather no position and force of one body
# Times smoother than by its own noise, that a position is looked at
MORE_SMOOTHED = (2.0, 4.0, 8.0)
MOSTLY_ITS_LAW = 0.5  # share of a force that its law explains, without work the same
WORK_GIVES_SIGN = 0.3  # share of the exchanged work, the same of what its law hardly explains
COMMAND_GIVES_SIGN = 0.2  # share of a command that its law explains, from which its sign is known
MOST_BY_CHANGE, MOST_UNNAMED = 4.0, 1.5  # log-odds that a force's change gives a command at most
MOVES_NOTHING = 0.05  # share of a force's change, that noise explains at most
MOST_NEARER = 2.0  # log-odds that a velocity gives for what it is the derivative of, at most more
NO_BODY = -2.5  # log-odds of a way, that no header speaks for, below which it is none
CLEAR = 1.0  # log-odds that the next best column is behind at least, for a role to be sure

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


CONSTANT_WHY = "constant in the longest run, as a step, and different in others"


@dataclass(frozen=True, eq=False)
class _Choice:
    way: Way
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
    behind = weights.limits(pairs)
    drive = [weights.drives(pairs, k, behind) for k in range(len(signals))]
    acting = [
        weights.drives(pairs, k, {}) + weights.acts(pairs, k, behind) for k in range(len(signals))
    ]
    ways = [way for seen, own in bodies(pairs, only) for way in ways_of(seen, own, drive, acting)]
    if not ways:
        return None
    ways.sort(key=lambda one: -with_reference(one))
    choices = [_filled(way) for way in ways[:MOST_WAYS]]
    choices.sort(key=lambda one: -one.score)
    head, way = weights.said(choices[0].way.y, "y"), choices[0].way
    denied = head < weights.LEAST_SCORE and way.law.share < weights.EXPLAINED
    unlikely = choices[0].score < NO_BODY and head < HEADER_SAYS
    idle = not (_moves(way.law) or _is_named(way) or are_constant(way.columns))
    wrong = any(one.header.purpose == "error" for one in signals)  # said of what is made of it
    if idle or ((denied or unlikely) and not wrong):
        return None
    choices[0] = replace(choices[0], way=_seen_smoother(choices[0].way))
    best = choices[0]
    same = (one for one in choices if one.way.y is best.way.y)
    other = next((one for one in same if one.way.kind != best.way.kind), None)
    rest = None if other is None else _roles_of(other, [one for one in choices if one is not best])
    ahead = np.inf if other is None else best.score - other.score
    return replace(_roles_of(best, choices), other=rest, ahead=ahead)


def _moves(law: ForceLaw) -> bool:
    """Whether what drives a body moves it at all, by this law."""
    return law.share > HARDLY_ITS_LAW or abs(law.work) > WORK_GIVES_SIGN


def _is_named(way: Way) -> bool:
    """Whether a header says of what drives the body that it does so, or there is none."""
    own = [weights.said(x, k[0]) if x.raw.header else np.inf for k, x in way.columns.items()]
    return max(own) >= HEADER_SAYS


def _seen_smoother(way: Way) -> Way:
    """The way with the law that more smoothing shows, of a drive that it then explains mostly.

    Of a motion one way, in which all but a constant is inertia: by the position's own smoothing its
    acceleration may be noise or steps. Both ways friction's step is seen without, and blurred so.
    """
    own = way.law
    if own.share >= MOSTLY_ITS_LAW or own.friction is not None or len(way.columns) != 1:
        return way
    (drive,), y = way.columns.values(), way.seen.y
    motions = (differentiate(y.x, 1.0, way.seen.motion.cutoff / less) for less in MORE_SMOOTHED)
    laws = [law for one in motions if (law := force_law(one, y.x, drive.x)) is not None]
    onwards = [law for law in laws if law.friction is None]
    best = max(onwards, key=lambda law: law.share, default=own)
    return replace(way, law=best) if best.share >= MOSTLY_ITS_LAW else way


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


def _filled(way: Way) -> _Choice:
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
    bounded = np.maximum(gain, weights.LEAST_SCORE)
    rows, places = linear_sum_assignment(-bounded)
    others, gains, next_best, margins = {}, {}, {}, {}
    for i, j in zip(rows.tolist(), places.tolist(), strict=True):
        if bounded[i, j] <= weights.LEAST_SCORE:
            continue
        role, others[roles[j]], gains[roles[j]] = roles[j], signals[rest[i]], float(bounded[i, j])
        behind = [m for m in np.argsort(-gain[:, j]).tolist() if m != i and gain[m, j] > -3.0]
        if behind:
            next_best[role] = signals[rest[behind[0]]]
            margins[role] = float(gain[i, j] - gain[behind[0], j])
            gains[role] = float(min(gains[role], 2.0 * (gain[i, j] - gain[behind[0], j]) + 4.0))
    return _Choice(way, others, gains, next_best, margins)


def _gain(way: Way, k: int, role: str, moved: float) -> float:
    """Log-odds of a role of one more column, beside position and drive.

    moved: how much more the force's change follows it than the other way round.
    """
    seen, one = way.seen, way.seen.pairs.signals[k]
    head = weights.said(one, role) + weights.together(seen.y, one)
    if role == "r":
        return weights.RULED_OUT if moves_rather(way, k) else gain_of_reference(seen, k)
    if role in ("u", "v", "a") and head < -3.0:
        return head
    if role == "v":
        share = seen.v_share[k] if seen.v_constant[k] < MOST_CONSTANT else 0.0
        if share <= weights.ALL_VELOCITY:
            return head + (-0.5 if share > 0.8 else -3.0)
        nearer = np.log10((1.0 - weights.ALL_VELOCITY) / max(1.0 - float(share), 1e-9))
        return head + 2.5 + float(np.clip(nearer, 0.0, MOST_NEARER))
    if role == "u":
        one_way = 1.5 if one.x.min() * one.x.max() > 0.0 else 0.0
        most = MOST_BY_CHANGE if head >= HEADER_SAYS else MOST_UNNAMED
        if abs(seen.pairs.alike[seen.at, k]) > SAME_POSITION:
            return -3.0  # one more position, of a model or another sensor, be it in volts
        if (one.noisy and moved < MOVES_NOTHING) or weights.is_steady(one):
            return -3.0  # nothing, or what supplies the motor
        if one.current and one.x.min() >= 0.0 and seen.y.way_gone > TWICE:
            return -3.0  # both ways a motor takes current: of its supply
        forces = [seen.pairs.signals.index(of) for name, of in way.columns.items() if name == "F"]
        if any(abs(seen.pairs.alike[at, k]) > weights.EXACT_VELOCITY for at in forces):
            return -3.0  # the force once more, as the current that it was made of
        return head + float(np.clip(8.0 * moved - 1.0 - one_way, -2.0, most))
    if role == "F":  # beside two pressures, whose force it is like
        alike = abs(float(np.corrcoef(way.force, one.x)[0, 1]))
        return head + 1.0 if alike > WORK_GIVES_SIGN else -3.0
    return head - 1.0


def _gives_sign(law: ForceLaw) -> bool:
    """Whether a law gives the sign of a drive: by its work, its friction, or its inertia."""
    if abs(law.work) > GIVES_SIGN:
        return law.share > COMMAND_GIVES_SIGN or abs(law.work) > WORK_GIVES_SIGN
    onwards = law.friction is None  # one way: along it
    in_it = law.friction is not None and law.friction > FRICTION_GIVES_SIGN
    return (onwards or in_it or by_inertia(law)) and law.share > MOSTLY_ITS_LAW


def sign_shown_by(law: ForceLaw) -> str:
    """In words what a body does with the sign that its law gives."""
    both = law.friction is not None and abs(law.work) <= GIVES_SIGN
    return "the mass is positive" if both and by_inertia(law) else "friction takes energy"


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
    moves = _moves(best.way.law) and not are_constant(best.way.columns)
    for role, column in best.columns.items():
        rivals = [one.score for one in choices if one.columns.get(role) is not column]
        ahead = best.score - max(rivals, default=-np.inf)
        own = best.gains.get(role)
        odds = min(ahead, own) if own is not None else ahead
        odds = min(odds, weights.SURE - CLEAR + best.behind.get(role, CLEAR))
        named = weights.said(column, role[0] if role in ("p_p", "p_n") else role) >= HEADER_SAYS
        if role == "r":  # called one, or well before the position
            found = _lead_of(best)
            named &= column.header.purpose == "reference" or found.samples > 1.0
            named &= follows(found) and not found.either
        out[role] = odds if named and moves else min(odds, weights.SURE - 1.0)
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


def are_constant(columns: Mapping[str, Column]) -> bool:
    """Whether what drives is constant in the longest run, as in one of several steps."""
    return all(np.ptp(one.x) == 0.0 for one in columns.values())


def _reasons(best: _Choice) -> dict[str, str]:
    """In words why each column has its role."""
    law = best.way.law
    of = f"{law.share:.0%} of it is inertia and friction"
    work = f", and friction takes {abs(law.work):.0%} of its work" if abs(law.work) > 0.1 else ""
    reason = CONSTANT_WHY if are_constant(best.way.columns) else f"{of} along the position{work}"
    out = dict.fromkeys(best.way.columns, reason)
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
    if "F" in best.others:
        out["F"] = "the force of the two pressures goes with it"
    if "v" in best.others:
        out["v"] = "is the derivative of the position"
    return out
