"""Where a parameter in which an effect is not linear is tried first: from its unit and the log."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.effects._base import Effect, Param
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.standstill import MEAN, rest_stretches
from identification.signals.sampling import samples

SPEEDS = (0.02, 0.04, 0.07, 0.12, 0.2, 0.33, 0.55, 0.9, 1.5)  # of the speed rarely exceeded
PLACES_OF_TRAVEL = (0.1, 0.25, 0.4, 0.55, 0.65, 0.75, 0.85, 0.92, 0.97)  # of half the travel
SPOTS, SPOT_WIDTHS = 13, (0.015, 0.04, 0.1, 0.25)  # places along the travel, and shares of it
PLAYS = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2)  # of the travel
SHORTEST_TIME, MANY_SAMPLES = 0.5, 32.0  # samples, between which a short time is tried
LATE = 0.2  # s, up to which a short time is tried too
SHARES_OF_DURATION = (0.03, 0.08, 0.2, 0.5, 1.5)  # of the log's duration
RESTS = (0.1, 0.2, 0.4, 0.8, 1.5, 3.0, 8.0)  # of the median rest
TYPICAL = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
POWERS = (1.3, 1.6, 2.0, 2.5, 3.0, 4.0)  # at 1 it is viscous friction itself
# Of a position at the end of the travel, by which a bent scale is off; powers of the position to
# which a coefficient belongs, by its unit
BENDS = (-0.1, -0.03, -0.01, -0.003, 0.0, 0.003, 0.01, 0.03, 0.1)
PER_POSITION = {"1/m": 1, "1/rad": 1, "1/m**2": 2, "1/rad**2": 2}
REPEATS, PENDULUM = 1.5, 0.4  # periods on the travel at least, and of gravity where it turns
ALONG = 0.5  # the same, of friction along the stroke
SHARPEST = 0.02  # s, shortest passage of one period that the windows still show
LONG_TIME = 1.0  # s, typical value from which a time is compared with the log and not its period


def shape_grid(effect: Effect, p: Param, logs: Sequence[MotionLog]) -> Array:
    """Values of `p` to try first, sorted; they also bound its refinement."""
    one = max(logs, key=lambda each: each.log.duration)
    y, h = one.log["y"], one.log.h
    travel, middle = float(np.ptp(y)), 0.5 * float(np.max(y) + np.min(y))
    speed = float(np.quantile(np.abs(one.signals["v"]), 0.95))
    if p.default is not None and not p.linear:
        return np.array([p.default])
    if p.role == "period":
        found = _periods(effect, one, travel)
    elif p.role == "place":
        found = middle + travel * np.linspace(-0.5, 0.5, SPOTS)
    elif p.role == "width":
        found = travel * np.array(SPOT_WIDTHS)
    elif p.unit in ("m/s", "rad/s"):
        found = speed * np.array(SPEEDS)
    elif p.unit in ("m", "rad") and p.low < 0:
        found = middle + np.sign(p.typical) * 0.5 * travel * np.array(PLACES_OF_TRAVEL)
    elif p.unit in ("m", "rad"):
        found = travel * np.array(PLAYS)
    elif p.unit == "s" and effect.place.in_stops:
        found = median_rest(logs, p.typical) * np.array(RESTS)
    elif p.unit == "s":
        found = (
            one.log.duration * np.array(SHARES_OF_DURATION)
            if p.typical >= LONG_TIME
            else _short_times(h)
        )
    elif p.unit == "V":
        found = float(np.quantile(np.abs(one.signals["u"]), 0.7)) * np.array(SPEEDS)
    elif p.name == "n":
        found = np.array(POWERS)
    elif p.role == "bend":
        found = np.array(BENDS) / max(float(np.max(np.abs(y))), 1e-12) ** PER_POSITION.get(
            p.unit, 1
        )
    elif p.low < 0 < p.high:
        found = p.typical * np.array([-3.0, -1.0, -0.3, 0.3, 1.0, 3.0])
    else:
        found = p.typical * np.array(TYPICAL)
    return np.unique(np.clip(found, p.low, p.high))


def median_rest(logs: Sequence[MotionLog], otherwise: float) -> float:
    """Median time at rest [s] before a motion that may be a breakaway."""
    times = [
        (high - low) * one.log.h
        for one in logs
        for low, high in rest_stretches(one, 3 * samples(MEAN, one.log.h))
    ]
    return float(np.median(times)) if times else otherwise


def _short_times(h: float) -> Array:
    """Times [s] of a few samples, and doubled from there up to LATE."""
    most = max(MANY_SAMPLES, LATE / h)
    return h * 2.0 ** np.arange(np.log2(SHORTEST_TIME), np.ceil(np.log2(most)) + 0.5)


def fewest_periods(effect: Effect, one: MotionLog) -> float:
    """Periods that the travel has to hold: of a force, such that it is seen to repeat; of a turning
    machine (a pendulum makes no full turn) and of what friction does along the stroke, a good part
    of one."""
    return (PENDULUM if one.rotary else REPEATS) if effect.place.drives else ALONG


def _periods(effect: Effect, one: MotionLog, travel: float) -> Array:
    """Periods [m] to try."""
    slow = float(np.quantile(np.abs(one.signals["v"]), 0.5))
    shortest = max(SHARPEST * slow, 1e-3 * travel)
    force, fewest = effect.place.drives, fewest_periods(effect, one)
    most = max(travel / shortest, 2.0 * fewest)
    most = min(most, 200.0 if force else 12.0)
    return travel / np.arange(fewest, most + 0.25, 0.4)
