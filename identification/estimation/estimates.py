"""What a log can tell of each parameter: events and speeds before, interval widths after.

A number that the log does not support is not given: a parameter without the events that carry it,
or with an interval as wide as itself, is reported as None with the reason.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from identification.arrays import Array, IntArray
from identification.effects._base import Acting, Param
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES, NEGATIVE
from identification.model.plant import units_of
from identification.simulation.karnopp_step import BAND_N, BAND_P, SLIP_N, SLIP_P, STUCK
from identification.thresholds import EVENTS_NEEDED, WIDEST_SD

SLIDING_SAMPLES = 50  # samples of sliding a direction needs
NORMAL_SETS = 1024  # parameter sets that stand for a normal spread
UNTOLD = 1e3  # times a parameter's size, of a deviation from which nothing is known of it
SMALL_TERM = 0.05  # sd relative to the force beside it at which a term is known to be small


@dataclass(frozen=True)
class Events:
    """What happened in the fitted run, (positive, negative): rests that ended, crossings of the
    band's limit, samples of sliding, and the fastest sliding speed [m/s]."""

    breakaways: tuple[int, int]
    crossings: tuple[int, int]
    sliding: tuple[int, int]
    fastest: tuple[float, float]


def events_of(modes: Sequence[IntArray], speeds: Sequence[Array]) -> Events:
    """Events counted over the modes (n,) and velocities (n,) of simulated runs."""
    both = []
    for side, (slip, band) in enumerate(((SLIP_P, BAND_P), (SLIP_N, BAND_N))):
        sign = 1.0 if side == 0 else -1.0
        starts = crossings = sliding = 0
        fastest = 0.0
        for mode, v in zip(modes, speeds, strict=True):
            rest, moving = mode == STUCK, sign * v > 0
            starts += int(np.count_nonzero(rest[:-1] & moving[1:]))
            starts += int(np.count_nonzero(rest[:-1] & (mode[1:] == band) & ~moving[1:]))
            slides = mode == slip
            crossings += int(np.count_nonzero(slides[1:] != slides[:-1]))
            sliding += int(np.count_nonzero(slides))
            if slides.any():
                fastest = max(fastest, float(np.max(sign * v[slides])))
        both.append((starts, crossings, sliding, fastest))
    (s0, c0, n0, v0), (s1, c1, n1, v1) = both
    return Events((s0, s1), (c0, c1), (n0, n1), (v0, v1))


def estimates(
    names: Sequence[str],
    center: Array,
    samples: Array,
    events: Events,
    rotary: bool,
    log: str,
) -> Mapping[str, Estimate]:
    """Estimate of each of `names` from its value (d,) and equally likely samples (k, d)."""
    units = units_of("rotary" if rotary else "linear")
    value_of = dict(zip(names, center, strict=True))
    found = {}
    for column, name in enumerate(names):
        drawn = samples[:, column]
        value = float(center[column])
        sd = float(np.std(drawn))
        # The spread of finite samples is itself uncertain: never narrower than 1.96 sd.
        low = min(float(np.quantile(drawn, 0.025)), value - 1.96 * sd)
        high = max(float(np.quantile(drawn, 0.975)), value + 1.96 * sd)
        reason = _missing(name, events, log) or _too_wide(name, value, sd, value_of, events)
        if reason:
            found[name] = Estimate(None, units[name], reason=reason, assumed=value)
        else:
            low, high = _signed(name, low, high)
            found[name] = Estimate(value, units[name], sd, low, high)
    return found


def normal_samples(values: Array, sd: Array) -> Array:
    """Sets (k, d) of a normal spread about the values (d,), each parameter by itself."""
    quantiles = norm.ppf((np.arange(NORMAL_SETS) + 0.5) / NORMAL_SETS)
    return np.asarray(values + sd * quantiles[:, np.newaxis])


def _signed(name: str, low: float, high: float) -> tuple[float, float]:
    """An interval cut where the model's sign ends."""
    if name in ("dv_n", "F_sn"):
        return low, min(high, 0.0)
    return max(low, 0.0), high


def _missing(name: str, events: Events, log: str) -> str | None:
    """Reason why the events of the log cannot carry a parameter, if so."""
    if name not in NAMES or name == "m":
        return None
    side = 1 if name.endswith("n") else 0
    way = ("positive", "negative")[side]
    if name.startswith("F_s") and events.breakaways[side] < EVENTS_NEEDED:
        return (
            f"{log}: {events.breakaways[side]} breakaways in the {way} direction, at least"
            f" {EVENTS_NEEDED} needed; add slow reversals or longer rests"
        )
    if name.startswith("dv") and events.crossings[side] < EVENTS_NEEDED:
        return (
            f"{log}: {events.crossings[side]} crossings of the band's limit in the {way}"
            f" direction, at least {EVENTS_NEEDED} needed; add starts and stops"
        )
    if events.sliding[side] < SLIDING_SAMPLES:
        return (
            f"{log}: {events.sliding[side]} samples of sliding in the {way} direction, at least"
            f" {SLIDING_SAMPLES} needed; add motion that way"
        )
    return None


def _too_wide(
    name: str, value: float, sd: float, value_of: Mapping[str, float], events: Events
) -> str | None:
    """Reason where the sign is wrong, or the spread as large as what the parameter could mean."""
    if value * (-1.0 if name in NEGATIVE else 1.0) < 0.0:
        return (
            f"found {value:.3g}, of the wrong sign: something else is in this force; see residual"
        )
    scale = 0.0
    side = 1 if name.endswith("n") else 0
    coulomb = abs(value_of.get(("F_cp", "F_cn")[side], 0.0))
    if name.startswith("F_v") and events.fastest[side] > 0:
        # A viscous term near zero is known when it is small beside the Coulomb force.
        scale = coulomb / events.fastest[side]
    if name in ("F_cp", "F_cn"):
        other = abs(value_of.get(("F_vp", "F_vn")[side], 0.0)) * events.fastest[side]
        scale = other
    if sd <= max(WIDEST_SD * abs(value), SMALL_TERM * scale):
        return None
    return (
        f"found {value:.3g} with a standard deviation of {sd:.2g}: the log does not tell it;"
        " excite it more (speeds, reversals, rests) or log for longer"
    )


def effect_estimates(effects: Sequence[Acting], sd: Mapping[str, float]) -> dict[str, Estimate]:
    """Estimates of the effects' parameters, as key.name; sd: deviations by that name."""
    out = {}
    for acting in effects:
        for p in acting.effect.params:
            name = f"{acting.key}.{p.name}"
            out[name] = of_effect(p, acting.values[p.name], sd.get(name))
    return out


def of_effect(p: Param, value: float, sd: float | None) -> Estimate:
    """Estimate of an effect's parameter; None where its deviation says that the logs do not."""
    if untold(sd, value, p.typical):
        return Estimate(None, p.unit, reason="these logs say nothing of it", assumed=value)
    return normal(value, p.unit, sd)


def normal(value: float, unit: str, sd: float | None) -> Estimate:
    """Estimate with the interval of a normal spread; without a deviation the value was held."""
    if sd is None:
        return Estimate(value, unit, reason="held")
    return Estimate(value, unit, sd, value - 1.96 * sd, value + 1.96 * sd)


def untold(sd: float | None, value: float, typical: float) -> bool:
    """Whether a deviation is so far beyond its parameter that the logs say nothing of it."""
    return sd is not None and not sd < UNTOLD * max(abs(value), abs(typical))
