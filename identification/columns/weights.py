"""Log-odds of what a column is: by its header, and by how it hangs together with the position.

All numbers are by hand, chosen on the seeds that `benchmarks/init_files.py` names: 3 is "rather
sure". A word may be wrong and so may a regression; the sum decides.
"""

from collections.abc import Mapping

import numpy as np

from identification.arrays import Array
from identification.columns.column import FEW_LEVELS, Column, halved_counts
from identification.columns.header import Quantity
from identification.columns.pairs import SURELY_TURNED, Pairs, Seen
from identification.signals.relations import ForceLaw
from identification.thresholds import OF_ACCOUNT

ROLES_OF: Mapping[Quantity, tuple[str, ...]] = {
    "time": (),
    "position": ("y", "r"),
    "velocity": ("v",),
    "acceleration": ("a",),
    "force": ("F",),
    "pressure": ("p",),
    "command": ("u",),
    "temperature": ("temperature",),
    "count": (),
    "other": (),
}
EXPLAINED = 0.9  # share of a drive by its law along what no header calls a position
SURE = 3.0  # log-odds from which a role is called sure
BY_UNIT, AGAINST_UNIT = 4.0, -6.0
LEAST_SCORE = 0.0  # of a role beside none at all
AREA_RATIOS = (0.6, 0.8, 1.0, 1.25, 1.67)  # areas of the two chambers that are tried
USUAL_FRICTION = 0.02  # share of a force that the step at the reversal alone explains
A_DECADE_OF_FRICTION, LEAST_OF_FRICTION = 1.1, -0.75  # for a force by that share, in all
LITTLE_FRICTION = 1e-3  # share of a velocity that a step at the reversal explains at most
NO_FRICTION = 3e-4  # the same, of any signal that is no force
SURELY_VELOCITY = 0.99  # share of a signal, from which it is the velocity of another
ALL_VELOCITY = 0.97  # share of a signal, from which it is the velocity and no force
EXACT_VELOCITY = 0.9995  # the same, from which it was made of the position, whatever its name
MAKES_AN_ERROR = 2.0  # for a reference whose difference from the position is logged too
BEHIND = -6.0  # for a reference that is behind the position, as another sensor or a model is
ROUGHER = 3.0  # times the position's noise, that a reference hardly has
SAME_UNIT = 0.15  # that the slope between reference and position is off a power of ten
FORCE_LIKENESS = 0.9  # share of a signal that is inertia and friction, the same
MIRRORED = 4.0  # for two columns as chambers that look like forces of opposite sign
SAME_AXIS, OTHER_AXIS = 1.0, -5.0  # for two columns, by the axes that their headers name
SAME_STEM, OTHER_STEM = 1.5, -3.0  # for a reference that repeats a position's name
ACTS, BEFORE_LIMIT = 1.5, -4.0  # for a command behind a limiter, and before it
MOST_COMMANDS = 12  # among which a limiter is looked for
A_VELOCITY = -12.0  # for a drive that is the velocity alone
AN_ERROR = -6.0  # for a drive that is an error
STEPS_OF_COUNTS = 1.5  # for a position whose steps are parts of an encoder's count
OF_A_COPY = -5.0  # for a reference that is filtered from a position, or filtered to one
STEADY = 3.0  # times its spread that the mean of a signal of one sign is, which drives nothing
RULED_OUT = -9.0
OF_FEW_LEVELS = -5.0  # for a force that takes a few values, as what a controller adds for friction
FLAG_AS_REFERENCE = -3.0
OF_A_MODEL = -9.0  # for what another model says, beside what is measured
A_DECADE_ALIKE, MOST_ALIKE = (1.5, 4.5)  # a decade by which a reference is nearer to the position
A_DECADE_LEFT, MOST_LEFT = 2.5, 5.0  # a decade by which less than a tenth of a force is unexplained
TURNED_WITH_IT = ("work", "balance", "coulomb", "m", "inertia")  # by the sign of a force
CALLED_ALIKE = 0.6  # likeness to the position, that its reference has at least
LEAST_ALIKE = 0.3  # correlation of a reference with the position, without any shift
LEAST_WAY = 0.8  # of the position's way in units of its range, that a force goes at least


def said(one: Column, role: str) -> float:
    """Log-odds of a role by the header, and by the few values that a column takes."""
    head = one.header
    asked, total = head.purpose in ("reference", "demand"), 0.0
    share = head.unit is not None and head.unit.plain in ("%", "1")
    by_unit = 0.0 if head.unit is None else _by_unit(one, role) * (0.3 if head.doubtful else 1.0)
    for quantity, weight in head.means.items():
        if role in ROLES_OF[quantity]:
            total = max(total, weight if role != "r" else 0.5 * weight)
        elif role == "u" and quantity == "force" and (asked or share):
            total = max(total, 0.5 * weight)  # a force that is asked for, or a share of the rated
    if head.means and total == 0.0 and (by_unit < BY_UNIT or "other" in head.means):
        total -= 0.5 + max(head.means.values())
    total += by_unit
    total += _by_purpose(one, role)
    if one.bits is not None:
        total += {"F": -6.0, "u": 1.0}.get(role, 0.0)
    if len(one.levels) <= FEW_LEVELS and role == "F":
        total += OF_FEW_LEVELS
    if one.flag:
        driven = role == "u" and "command" in head.means
        total += FLAG_AS_REFERENCE if role == "r" else 0.0 if driven else RULED_OUT
    return total


def _by_purpose(one: Column, role: str) -> float:
    """What "target", "actual", "error" or "predicted" in a header makes of a role."""
    purpose, means = one.header.purpose, one.header.means
    if purpose == "reference":
        other = means and "position" not in means
        own = {"r": -3.0 if other else 4.0, "y": -6.9, "F": -4.0, "p": -4.0, "v": -3.0, "u": -1.0}
        return own.get(role, 0.0)
    if purpose == "measured":
        commands = 0.5 if means else -1.0  # what is given to a motor is hardly measured
        return {"y": 1.5, "r": -5.0, "F": 0.5, "p": 0.5, "v": 0.5, "u": commands}.get(role, 0.0)
    if purpose == "demand":  # what is measured beside it acts
        return -2.0 if role == "u" else 0.0
    if purpose == "filtered":
        return {"r": OF_A_COPY, "y": -1.0}.get(role, 0.0)
    return {"error": -6.0, "model": OF_A_MODEL}.get(purpose, 0.0)


def _by_unit(one: Column, role: str) -> float:
    assert one.header.unit is not None
    quantity, unit = one.header.unit.quantity, one.header.unit.card
    if quantity == "count":
        return {"y": 2.0, "r": 1.0, "u": 1.0}.get(role, -4.0)
    if quantity == "command":
        raw = 2.5 if unit in ("V", "mV", "1") else BY_UNIT
        means = one.header.means
        if unit == "%" and max(means, key=lambda of: means[of], default="") == "position":
            return 0.0  # a share of its travel
        return raw if role == "u" else {"1": 0.0}.get(unit, AGAINST_UNIT)
    return BY_UNIT if role in ROLES_OF[quantity] else AGAINST_UNIT


def together(one: Column, other: Column) -> float:
    """Log-odds of two columns in one card, by the axes that their headers name, and by their units:
    what turns and what slides have another body between them."""
    units = [x.header.unit for x in (one, other) if not x.header.doubtful]
    moved = [unit.rotary for unit in units if unit and unit.quantity in ("position", "force")]
    if moved in ([True, False], [False, True]):
        return OTHER_AXIS
    if not (one.axis and other.axis):
        return 0.0
    return SAME_AXIS if one.axis == other.axis else OTHER_AXIS


def moves_like_a_body(y: Column) -> float:
    """Log-odds of a position by its own course: a body's velocity is far above its noise."""
    assert y.motion is not None
    v_noise = max(y.motion.v_noise, 1e-300)
    clear = float(np.sqrt(np.mean(y.motion.v**2))) / v_noise
    few = len(y.levels) < 20
    counted = STEPS_OF_COUNTS if not y.header.means and halved_counts(y.numbers) else 0.0
    return counted + float(np.clip(2.0 * np.log10(clear) - 1.5, -3.0, 2.5)) - (3.0 if few else 0.0)


def among_derivatives(pairs: Pairs) -> Array:
    """Log-odds of each column as a position, by what it is the derivative of, and what its own."""
    bodies = [i for i, one in enumerate(pairs.signals) if said(one, "y") > -4.0]
    speeds = [j for j, one in enumerate(pairs.signals) if said(one, "v") > -1.0]
    of_others = np.max(pairs.rate_but_constant[bodies], axis=0, initial=0.0)
    own = np.max(pairs.rate[:, speeds], axis=1, initial=0.0)
    derived = np.where(of_others > ALL_VELOCITY, -6.0, 0.0)
    derived += np.where(of_others > SURELY_VELOCITY, -4.0, 0.0)
    return derived + np.where(own > ALL_VELOCITY, 1.0, 0.0)


def in_one_unit(one: Column, other: Column) -> tuple[float, float]:
    """Factors of two pressures to [Pa] where both headers give units of pressure, else 1."""
    if one.pascals is None or other.pascals is None:
        return 1.0, 1.0
    return one.pascals, other.pascals


def of_a_motor(one: Column) -> float:
    """Log-odds of a command rather than a force, by its own values."""
    finite = one.values[np.isfinite(one.values)]
    low, high = float(finite.min()), float(finite.max())
    limited = low == -high and np.sum(finite == high) > 2
    return (1.5 if limited else 0.0) + (1.0 if max(-low, high) <= 12.0 else -0.5)


def limits(pairs: Pairs) -> dict[int, int]:
    """Commands before a limiter or a sum: what comes out of it, each by its place."""
    likely = [(max(said(one, "u"), said(one, "F")), k) for k, one in enumerate(pairs.signals)]
    likely = sorted((one for one in likely if one[0] > -1.0), reverse=True)[:MOST_COMMANDS]
    return pairs.behind(sorted(k for _, k in likely))


def drives(pairs: Pairs, k: int, behind: Mapping[int, int]) -> float:
    """Log-odds of what drives a body by what it is of others: what stands before no limiter or sum
    (behind: what comes out, for each), and, where nothing calls it a drive, is no error."""
    head, before = pairs.signals[k].header, BEFORE_LIMIT if k in behind else 0.0
    drive = head.unit is not None and head.unit.quantity in ("force", "command")
    if drive or max(head.means.get("force", 0.0), head.means.get("command", 0.0)) >= BY_UNIT / 2:
        return before
    return before + (AN_ERROR if k in pairs.errors else 0.0)


def acts(pairs: Pairs, k: int, behind: Mapping[int, int]) -> float:
    """Log-odds of a command by its place before or behind a limiter, and of a steady supply."""
    x = pairs.signals[k].x
    one_way = -3.0 if x.min() * x.max() > 0.0 else 0.0
    place = BEFORE_LIMIT if k in behind else ACTS if k in behind.values() else 0.0
    return one_way + place - (3.0 if is_steady(pairs.signals[k]) else 0.0)


def is_steady(one: Column) -> bool:
    """Whether a column stays far from zero, as a supply does."""
    return bool(one.x.min() * one.x.max() > 0.0 and abs(one.x.mean()) > STEADY * one.x.std())


def turned(law: ForceLaw) -> ForceLaw:
    """The law of the signal with the sign of a force."""
    if law.way > 0.0:
        return law
    return law._replace(way=1.0, **{name: -getattr(law, name) for name in TURNED_WITH_IT})


def driving(law: ForceLaw, v_share: float, less_way: bool) -> float:
    """Log-odds that a signal drives the body, by what of it is inertia and friction.

    v_share: of it that is the velocity alone; less_way: whether it goes less than the position.
    """
    score = 6.0 * float(np.clip((law.share - 0.3) / 0.65, -0.7, 1.0)) + 2.0 * abs(law.work)
    score += float(np.clip(-A_DECADE_LEFT * np.log10(max(1.0 - law.share, 1e-9)) - A_DECADE_LEFT,
                           0.0, MOST_LEFT))  # fmt: skip
    if law.friction is None:
        return score - 2.0 + (A_VELOCITY if v_share > ALL_VELOCITY else 0.0)
    score += 1.0 if law.way * law.coulomb > 0.0 else -2.0
    decades = float(np.log10(max(law.friction, 1e-9) / USUAL_FRICTION))
    score += float(np.clip(A_DECADE_OF_FRICTION * decades, LEAST_OF_FRICTION, A_DECADE_OF_FRICTION))
    if law.m * law.way < 0.0 and law.share > 0.5:
        score -= 0.5
    # A velocity that is filtered, and so late, is a damping beside a mass below 0: no force is.
    late = law.m * law.way < 0.0 and min(law.share, abs(law.work)) > ALL_VELOCITY
    if law.friction < LITTLE_FRICTION and (late or v_share > ALL_VELOCITY):
        score += A_VELOCITY
    elif law.friction < NO_FRICTION:
        score -= 3.0
    if law.way < 0.0:
        score -= 1.0
    return score - (3.0 if less_way else 0.0)


def ahead_of(seen: Seen, k: int) -> float:
    """Log-odds that a column is the position's reference: alike, ahead of it, without noise."""
    y, one = seen.y, seen.pairs.signals[k]
    if abs(seen.pairs.alike[seen.at, k]) < LEAST_ALIKE:
        own = one.header.unit or one.header.means.get("position", 0.0) >= SURE
        return -3.0 if own else RULED_OUT  # a target of what the log has not
    found = seen.lead(k)
    called = one.header.purpose == "reference"
    like = max(found.likeness, _alike_then(y.x, one.x, round(found.samples)))
    sure = called or like >= SURELY_TURNED
    if found.likeness < CALLED_ALIKE or not (sure or seen.is_followed_by_control(k)):
        return -3.0
    score = min(-A_DECADE_ALIKE * float(np.log10(max(1.0 - like, 1e-9))), MOST_ALIKE)
    if not called and (found.samples <= 0.3 or _of_place_alone(one.x, y.x)):
        return RULED_OUT  # another sensor of the position, or a height of the arm
    score += 2.0 if found.samples > 0.3 else (BEHIND if found.samples < -0.3 else 0.0)
    slope = np.log10(max(float(np.std(y.x)) / max(float(np.std(one.x)), 1e-300), 1e-300))
    score += 1.0 if abs(slope - round(slope)) < SAME_UNIT / np.log(10.0) else -1.0
    rough = one.noise / max(float(np.std(one.x)), 1e-300)
    rough /= max(y.noise / max(float(np.std(y.x)), 1e-300), 1e-300)
    score += 1.0 if rough < 1.0 else -1.0 if rough < ROUGHER else -2.0
    pair = (min(k, seen.at), max(k, seen.at))
    if any(pair in of for of in seen.pairs.errors.values()):
        score += MAKES_AN_ERROR
    return score + _named_for(seen, k)


def _of_place_alone(x: Array, y: Array) -> bool:
    """Whether what a line leaves of x (n,) along a position is a bent function of the position, as
    a robot's hand is of a joint: what follows is late, each way at another place."""
    z = (y - y.mean()) / np.std(y)
    line, bent = (float(np.var(x - np.polyval(np.polyfit(z, x, n), z))) for n in (1, 5))
    return bent < OF_ACCOUNT * line


def _alike_then(y: Array, r: Array, ahead: int) -> float:
    """Correlation of a position with what is ahead of it by so many samples."""
    late, early = (y[ahead:], r[: len(r) - ahead]) if ahead >= 0 else (y[:ahead], r[-ahead:])
    return float(np.corrcoef(late, early)[0, 1])


def _named_for(seen: Seen, k: int) -> float:
    """Log-odds that a reference is that of y, where its header repeats a position's name."""
    stems = seen.pairs.stems
    if not stems[k]:
        return 0.0
    if stems[k] == stems[seen.at]:
        return SAME_STEM
    return OTHER_STEM if stems.count(stems[k]) > 1 else 0.0
