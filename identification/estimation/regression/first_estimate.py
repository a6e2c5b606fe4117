"""First estimate of the nine parameters, of a size from which a search begins.

The paper names a three-step method of a companion paper without giving it; this one is ours: least
squares of the force on the motion gives m, F_cp, F_cn, F_vp, F_vn; stick limits and band are of
their usual size beside these.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.errors import NotIdentifiable
from identification.estimation.regression.equation_rows import (
    FIVE,
    NOTHING_KNOWN,
    MotionLog,
    mechanical,
)
from identification.estimation.regression.weighted_rows import least_squares
from identification.signals.differentiate import Motion, differentiate

NO_MOTION = 1.5  # times the noise below which a position's own spread is no motion
OF_FASTEST = 0.05  # of the fastest speed, a band of which nothing is known
USUAL_STICK = 1.2  # times the Coulomb level, of a stick limit of which nothing is known
SEARCH_FACTOR = 4.0  # the search goes this factor beyond a first estimate
FASTEST_QUANTILE = 0.995  # quantile of the speed taken as the largest


@dataclass(frozen=True)
class FirstEstimate:
    """Nine values in the order of karnopp.NAMES; low, high (9,): range of their sizes in which a
    search looks."""

    nine: Array
    low: Array
    high: Array


def first_estimate(one: MotionLog) -> FirstEstimate:
    """First estimate of the nine from position and force.

    Raises NotIdentifiable where nothing in the log moves. Of sliding, Messenger, Bortz (2021); the
    rest is ours.
    """
    log = one.log
    motion = differentiate(log["y"], log.h)
    fastest = float(np.quantile(np.abs(motion.v), FASTEST_QUANTILE))
    if float(np.std(log["y"])) < NO_MOTION * motion.noise:
        raise NotIdentifiable(
            f"{log.name}: no motion above the noise of the position ({motion.noise:.3g}"
            f" {'rad' if one.rotary else 'm'}); record a run in which the body moves"
        )
    force = np.abs(log["F"] - np.mean(log["F"]))
    level = float(np.quantile(force, 0.9))
    sliding = _sliding(one)
    m, coulomb_p, coulomb_n, viscous_p, viscous_n = _magnitudes(sliding, motion, level, fastest)
    stick_p, stick_n, edge = USUAL_STICK * coulomb_p, USUAL_STICK * coulomb_n, OF_FASTEST * fastest
    nine = np.array([m, coulomb_p, coulomb_n, viscous_p, viscous_n, edge, -edge, stick_p, -stick_n])
    scale = max(coulomb_p, coulomb_n, stick_p, stick_n)
    # A motor's force has no ramps that would show a narrow band: do not search one.
    narrow = fastest / (500 if one.zoh else 3000)
    low = np.array([m / SEARCH_FACTOR, 0, 0, 0, 0, narrow, narrow, 0, 0])
    steepest = 2 * max(viscous_p, viscous_n, 0.1 * scale / fastest)
    high = np.array(
        [m * SEARCH_FACTOR, *[2 * scale] * 2, *[steepest] * 2, *[fastest / 2] * 2, *[3 * scale] * 2]
    )
    return FirstEstimate(nine, low, high)


def _sliding(one: MotionLog) -> dict[str, float] | None:
    """Mass and sliding friction by the rows of one direction, however few; a direction without rows
    is taken to be as the other. None where there are too few for five numbers."""
    rows = mechanical(one, NOTHING_KNOWN)
    if len(rows.b) <= len(FIVE):
        return None
    five = dict(zip(FIVE, least_squares(rows.X, rows.b).tolist(), strict=True))
    for way, other in (("p", "n"), ("n", "p")):
        if not np.any(rows.X[:, FIVE.index(f"F_c{way}")]):
            five |= {f"F_{kind}{way}": five[f"F_{kind}{other}"] for kind in "cv"}
    return five


def _magnitudes(
    sliding: Mapping[str, float] | None, motion: Motion, level: float, fastest: float
) -> tuple[float, float, float, float, float]:
    """Bounded to be positive: mass and friction that could explain forces of this level."""
    peak = float(np.quantile(np.abs(motion.a), FASTEST_QUANTILE))
    mass = level / max(peak, 1e-12)
    if sliding is None:
        return mass, 0.5 * level, 0.5 * level, 0.5 * level / fastest, 0.5 * level / fastest
    m = sliding["m"] if sliding["m"] > 0.01 * mass else 0.3 * mass
    floor = 0.02 * level
    return (
        m,
        max(sliding["F_cp"], floor),
        max(sliding["F_cn"], floor),
        max(sliding["F_vp"], 0.0),
        max(sliding["F_vn"], 0.0),
    )
