"""Log-odds of what a column is: by its header, and by how it hangs together with the position.

All numbers are by hand, chosen on the seeds that `benchmarks/init_files.py` names: 3 is "rather
sure". A word may be wrong and so may a regression; the sum decides.
"""

from collections.abc import Mapping

import numpy as np

from identification.arrays import Array
from identification.signals.relations import ForceLaw, derivative, lead
from workbench.cards.headers import Quantity
from workbench.cards.units import conversion
from workbench.steps.first_card.columns import Column

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
SURE = 3.0  # log-odds from which a role is called sure
BY_UNIT, AGAINST_UNIT = 4.0, -6.0
LEAST_SCORE = 0.0  # of a role beside none at all
AREA_RATIOS = (0.6, 0.8, 1.0, 1.25, 1.67)  # areas of the two chambers that are tried
LITTLE_FRICTION = 1e-3  # share of a velocity that a step at the reversal explains at most
NO_FRICTION = 3e-4  # the same, of any signal that is no force
ALL_VELOCITY = 0.97  # share of a signal, from which it is the velocity and no force
SURELY_TURNED = 0.9  # likeness from which a reference has the other sign
SAME_UNIT = 0.15  # that the slope between reference and position is off a power of ten
LOOKS_LIKE_A_FORCE = 0.9  # share of a signal that is inertia and friction, the same
MIRRORED = 4.0  # for two columns as chambers that look like forces of opposite sign
LEAST_WAY = 0.8  # of the position's way in units of its range, that a force goes at least


def said(one: Column, role: str) -> float:
    """Log-odds of a role by the header alone."""
    head = one.header
    total = 0.0
    for quantity, weight in head.means.items():
        if role in ROLES_OF[quantity]:
            total = max(total, weight if role != "r" else 0.5 * weight)
    if head.means and total == 0.0:
        total -= 1.5
    if head.unit is not None:
        total += _by_unit(one, role) * (0.3 if head.doubtful else 1.0)
    if head.purpose == "reference":
        total += {"r": 4.0, "y": -5.0, "F": -4.0, "p": -4.0, "v": -3.0}.get(role, 0.0)
    elif head.purpose == "measured":
        total += {"y": 1.5, "r": -5.0, "F": 0.5, "p": 0.5, "v": 0.5}.get(role, 0.0)
    elif head.purpose == "error":
        total -= 6.0
    if one.bits is not None:
        total += {"F": -3.0, "u": 1.0}.get(role, 0.0)
    return total


def _by_unit(one: Column, role: str) -> float:
    assert one.header.unit is not None
    quantity, unit = one.header.unit.quantity, one.header.unit.card
    if quantity == "count":
        return {"y": 2.0, "r": 1.0, "u": 1.0}.get(role, -4.0)
    if quantity == "command":
        raw = 2.5 if unit in ("V", "mV", "1") else BY_UNIT
        return raw if role == "u" else {"1": 0.0}.get(unit, AGAINST_UNIT)
    return BY_UNIT if role in ROLES_OF[quantity] else AGAINST_UNIT


def moves_like_a_body(y: Column) -> float:
    """Log-odds of a position by its own course: a body's velocity is far above its noise."""
    assert y.motion is not None
    v_noise = max(y.motion.v_noise, 1e-300)
    clear = float(np.std(y.motion.v)) / v_noise
    levels = len(np.unique(y.x))
    return float(np.clip(2.0 * np.log10(clear) - 1.5, -3.0, 2.5)) - (3.0 if levels < 20 else 0.0)


def in_one_unit(one: Column, other: Column) -> tuple[Array, Array]:
    """Two pressures [Pa] where both headers give units of pressure, else as they are."""
    units = [column.header.unit for column in (one, other)]
    if any(unit is None or unit.quantity != "pressure" for unit in units):
        return one.x, other.x
    factors = [conversion(unit.card, "Pa") for unit in units if unit is not None]
    first, second = (1.0 if of is None else of.factor for of in factors)
    return first * one.x, second * other.x


def of_a_motor(one: Column) -> float:
    """Log-odds of a command rather than a force, by its own values."""
    finite = one.values[np.isfinite(one.values)]
    low, high = float(finite.min()), float(finite.max())
    limited = low == -high and np.sum(finite == high) > 2
    one_way = -3.0 if low * high > 0.0 else 0.0
    return one_way + (1.5 if limited else 0.0) + (1.0 if max(-low, high) <= 12.0 else -0.5)


def turned(law: ForceLaw) -> ForceLaw:
    """The law of the signal with the sign of a force."""
    if law.way > 0.0:
        return law
    return law._replace(
        way=1.0, work=-law.work, balance=-law.balance, coulomb=-law.coulomb, m=-law.m
    )


def driving(y: Column, f: Array, law: ForceLaw) -> float:
    """Log-odds that a signal drives the body, by what of it is inertia and friction."""
    assert y.motion is not None
    score = 6.0 * float(np.clip((law.share - 0.3) / 0.65, -0.7, 1.0)) + 2.0 * abs(law.work)
    if law.friction is None:
        return score - 2.0
    score += 1.0 if law.way * law.coulomb > 0.0 else -2.0
    if law.m * law.way < 0.0 and law.share > 0.5:
        score -= 0.5
    if law.friction < LITTLE_FRICTION and derivative(y.motion, f).share > ALL_VELOCITY:
        score -= 8.0
    elif law.friction < NO_FRICTION:
        score -= 3.0
    if law.way < 0.0:
        score -= 1.0
    if _way_gone(f) < LEAST_WAY * _way_gone(y.x):
        score -= 3.0
    return score


def _way_gone(x: Array) -> float:
    """The way that a signal goes, in units of its range."""
    size = max(1, len(x) // 2000)
    count = len(x) // size
    means = x[: count * size].reshape(count, size).mean(axis=1)
    width = float(np.ptp(means))
    return float(np.sum(np.abs(np.diff(means)))) / width if width > 0 else 0.0


def ahead_of(y: Column, one: Column) -> float:
    """Log-odds that a column is the position's reference: alike, ahead of it, without noise."""
    assert y.motion is not None
    found = lead(one.x, y.x)
    if found.likeness < 0.6:
        return -3.0
    score = 4.0 * found.likeness - 2.0
    score += 2.0 if found.samples > 0.3 else (-4.0 if found.samples < -0.3 else 0.0)
    if derivative(y.motion, one.x).share > ALL_VELOCITY:
        score -= 4.0
    slope = np.log10(max(float(np.std(y.x)) / max(float(np.std(one.x)), 1e-300), 1e-300))
    score += 1.0 if abs(slope - round(slope)) < SAME_UNIT / np.log(10.0) else -1.0
    calm = one.noise / max(float(np.std(one.x)), 1e-300)
    return score + (1.0 if calm < y.noise / max(float(np.std(y.x)), 1e-300) else -1.0)
