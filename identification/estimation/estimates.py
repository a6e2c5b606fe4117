"""What a log identifies of each parameter: events and speeds before, interval widths after.

A number that the log does not support is not given: a parameter without the events that carry it,
without an interval, with one wider than itself, or at a bound is reported as None with the reason.
`reported_estimate` is that rule, for every command and file: friction, actuator and effects alike.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array, IntArray
from identification.effects._base import AT_REST, Acting, Param
from identification.estimation.windowed_run.parameters import AT_ZERO
from identification.log import Rig
from identification.model.estimates import NORMAL_95, Estimate
from identification.model.karnopp import NAMES, NEGATIVE
from identification.model.plant import units_of
from identification.simulation.karnopp_step import BAND_N, BAND_P, SLIP_N, SLIP_P, STUCK
from identification.thresholds import AS_GOOD_AS_NONE, EVENTS_NEEDED

SLIDING_SAMPLES = 50  # samples of sliding a direction needs
SMALL_TERM = 0.05  # sd relative to the force beside it at which a term is known to be small
LEAST_SD = 1e-9  # deviation over the value, below which it is rounding and no interval
FIXED_AT_DEFAULT = "fixed at its default: the logs do not support another value"
NO_CHANGE_WHY = "no interval: nothing that these logs show changes with it"
EXCITE = "excite it more (speeds, reversals, rests) or log for longer"


@dataclass(frozen=True)
class Events:
    """What happened in the fitted run, (positive, negative): rests that ended, crossings of the
    band's limit, samples of sliding, and the fastest sliding speed [m/s]; force: the applied one's
    spread [N], 0 where it is not known; moved: samples in which the body itself surely moves."""

    breakaways: tuple[int, int]
    crossings: tuple[int, int]
    sliding: tuple[int, int]
    fastest: tuple[float, float]
    force: float = 0.0
    moved: tuple[int, int] = (0, 0)


def events_of(modes: Sequence[IntArray], speeds: Sequence[Array], force: float = 0.0) -> Events:
    """Events counted over the modes (n,) and velocities (n,) of simulated runs; force: applied."""
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
    return Events((s0, s1), (c0, c1), (n0, n1), (v0, v1), force)


def reported_estimate(
    value: float, unit: str, sd: float | None, *, interval: tuple[float, float] | None = None,
    bounds: tuple[float, float] = (-np.inf, np.inf), at_bound: float = AT_ZERO, beside: float = 0.0,
) -> Estimate:  # fmt: skip
    """An estimate by the one rule of what is reported: a value with its interval, or None and why.

    value, sd, 95 % `interval` (by default a normal spread's) and bounds in `unit`; at_bound:
    distance from a bound that counts as there; beside: of a term of a sum, the size that matters.
    An interval of no width, one wider than the value itself or a value at a bound gives None. The
    rule is ours.
    """
    if sd is None or not np.isfinite(sd) or not sd > LEAST_SD * abs(value):
        return Estimate(None, unit, reason=NO_CHANGE_WHY, assumed=value)
    low, high = interval or (value - NORMAL_95 * sd, value + NORMAL_95 * sd)
    wrong = _beyond(value, bounds)
    where = _bound_of(value, bounds, at_bound)
    wide = not high - low <= abs(value)
    small = sd <= SMALL_TERM * beside and low <= 0.0 <= high
    if wrong is None and (where == 0.0 or wide) and small:
        most = max(abs(low), abs(high))
        reason = f"not significantly different from 0 (|x| < {most:.2g}, 95 %)"
        return Estimate(None, unit, sd, reason=reason, assumed=value, at_most=most)
    if wrong is None and where is not None:
        wrong = (
            "at its bound: not significantly different from 0"
            if where == 0.0
            else f"at its bound {where:.4g}: the logs only say that it lies there or beyond"
        )
    if wrong is None and wide:
        wrong = (
            f"found {value:.3g}, but the interval {low:.2g} to {high:.2g} is wider than the value:"
            f" not identifiable from these logs; {EXCITE}"
        )
    if wrong is not None:
        return Estimate(None, unit, reason=wrong, assumed=value)
    return Estimate(value, unit, sd, max(low, bounds[0]), min(high, bounds[1]))


def counted(many: int, what: str) -> str:
    """So many of something, in words."""
    return f"{many} {what}{'' if many == 1 else 's'}"


def widened(one: Estimate, times: float) -> Estimate:
    """The same estimate with an interval so many times as wide, of its sign; ours."""
    if one.value is None or one.sd is None or one.low is None or one.high is None:
        return one
    low, high = (one.value + times * (end - one.value) for end in (one.low, one.high))
    bounds = (0.0, np.inf) if one.value > 0.0 else (-np.inf, 0.0)
    return reported_estimate(
        one.value, one.unit, times * one.sd, interval=(low, high), bounds=bounds, at_bound=0.0
    )


def _beyond(value: float, bounds: tuple[float, float]) -> str | None:
    """Reason where a value lies beyond its bounds, which for most is a matter of sign."""
    if bounds[0] <= value <= bounds[1]:
        return None
    said = "of the wrong sign" if 0.0 in bounds else "which it cannot be"
    return f"found {value:.3g}, {said}: something else is in this force; see residual"


def _bound_of(value: float, bounds: tuple[float, float], reach: float) -> float | None:
    """The bound at which a value lies, None where it lies at none."""
    return next((bound for bound in bounds if abs(value - bound) <= reach), None)


def estimates(
    values: Mapping[str, float], sd: Mapping[str, float], events: Events, rig: Rig, log: str
) -> dict[str, Estimate]:
    """Estimate of each parameter from its value and standard deviation, by name."""
    units = units_of(rig.motion, rig.command_unit)
    found = {}
    for name, value in values.items():
        reason = silent_reason(name, events, log) or _no_stick(name, values, sd, events)
        if reason:
            found[name] = Estimate(None, units[name], reason=reason, assumed=value)
        else:
            low = _least_stick(name, values, sd) if name.startswith("F_s") else 0.0
            bounds = (-np.inf, -low) if name in NEGATIVE else (low, np.inf)
            found[name] = reported_estimate(
                value, units[name], sd[name], bounds=bounds, beside=_beside(name, values, events),
                at_bound=_slight(name, events),
            )  # fmt: skip
        if found[name].value is None and (unmoved := _unmoved(name, events, log)):
            found[name] = Estimate(None, units[name], reason=unmoved, assumed=value)
    return found


def _least_stick(name: str, values: Mapping[str, float], sd: Mapping[str, float]) -> float:
    """What the stick limit of a parameter's direction is at least, without its sign: the Coulomb
    level, by the lower end of its 95 % interval. Ours; of the model, F_s >= F_c: Karnopp, J. Dyn.
    Sys. 107 (1985) 100."""
    level = "F_cn" if name.endswith("n") else "F_cp"
    return max(values.get(level, 0.0) - NORMAL_95 * (sd.get(level) or 0.0), 0.0)


def _no_stick(
    name: str, values: Mapping[str, float], sd: Mapping[str, float], events: Events
) -> str | None:
    """Reason why a stick limit, and the band in which it acts, do not show: the limit is hardly
    more than it is at least, with which every rest would end."""
    limit = "F_sn" if name.endswith("n") else "F_sp"
    if not name.startswith(("F_s", "dv")) or limit not in values:
        return None
    least = _least_stick(name, values, sd)
    if abs(values[limit]) > least + _slight(limit, events):
        return None
    return (
        f"no {limit} above the Coulomb level ({least:.3g} at least) shows: not identifiable from"
        f" these logs; {EXCITE}"
    )


def silent_reason(name: str, events: Events, log: str) -> str | None:
    """Reason why a log's events do not identify a parameter, if so, and what to add to it."""
    if name not in NAMES or name == "m":
        return None
    side = 1 if name.endswith("n") else 0
    way = ("positive", "negative")[side]
    if name.startswith("F_s") and events.breakaways[side] < EVENTS_NEEDED:
        return (
            f"{log}: {counted(events.breakaways[side], 'breakaway')} in the {way} direction, at"
            f" least {EVENTS_NEEDED} needed; add slow reversals or longer rests"
        )
    if name.startswith("dv") and events.crossings[side] < EVENTS_NEEDED:
        return (
            f"{log}: {counted(events.crossings[side], 'crossing')} of the band's limit in the {way}"
            f" direction, at least {EVENTS_NEEDED} needed; add starts and stops"
        )
    if events.sliding[side] < SLIDING_SAMPLES <= events.moved[side]:
        return (
            f"{log}: in the {way} direction the body moves in {events.moved[side]} samples, the"
            f" fitted run slides in {events.sliding[side]}: it does not follow the log there; check"
            " the card's signs and units"
        )
    return _too_little(events.sliding[side], way, log)


def _too_little(sliding: int, way: str, log: str) -> str | None:
    """Reason why so many samples of sliding do not identify the friction of a direction, if so."""
    if sliding >= SLIDING_SAMPLES:
        return None
    return (
        f"{log}: {sliding} samples of sliding in the {way} direction, at least"
        f" {SLIDING_SAMPLES} needed; add motion that way"
    )


def _unmoved(name: str, events: Events, log: str) -> str | None:
    """Reason of a parameter without a value, of a direction in which the body never moved."""
    side = 1 if name.endswith("n") else 0
    if name == "m" or name not in NAMES or events.moved[side] or not any(events.moved):
        return None
    return _too_little(0, ("positive", "negative")[side], log)


def _slight(name: str, events: Events) -> float:
    """Size of next to nothing: beside what a parameter of friction would have if it took all of the
    log's force, or speed."""
    fastest, size = max(events.fastest), 0.0
    if name.startswith("dv"):
        size = fastest
    elif name.startswith("F_v"):
        size = events.force / fastest if fastest > 0.0 else 0.0
    elif name in NAMES and name != "m":
        size = events.force
    return max(AT_ZERO, AS_GOOD_AS_NONE * size)


def _beside(name: str, value_of: Mapping[str, float], events: Events) -> float:
    """Size at which a term of sliding friction would be as large as the term beside it, 0 where
    there is none: a viscous term is known where it is far below the Coulomb force."""
    side = 1 if name.endswith("n") else 0
    fastest = events.fastest[side]
    if name.startswith("F_v") and fastest > 0:
        return abs(value_of.get(("F_cp", "F_cn")[side], 0.0)) / fastest
    if name in ("F_cp", "F_cn"):
        return abs(value_of.get(("F_vp", "F_vn")[side], 0.0)) * fastest
    return 0.0


def effect_estimates(effects: Sequence[Acting], sd: Mapping[str, float]) -> dict[str, Estimate]:
    """Estimates of the effects' parameters, as key.name; sd: deviations by that name."""
    out = {}
    for acting in effects:
        for p in acting.effect.params:
            name = f"{acting.key}.{p.name}"
            out[name] = of_effect(p, acting.values[p.name], sd.get(name), beside_in(acting, p))
    return out


def beside_in(acting: Acting, p: Param) -> float:
    """Size of the largest other term of an effect's sum in the unit of this one [p.unit], 0 where
    there is none: a wave's cosine is known to be small beside its sine."""
    linear = acting.effect.linear
    others = [one.name for one in acting.effect.params if one.unit == p.unit and one is not p]
    sizes = [abs(acting.values[name]) for name in others if name in linear]
    return max(sizes, default=0.0) if p.name in linear else 0.0


def of_effect(p: Param, value: float, sd: float | None, beside: float = 0.0) -> Estimate:
    """Estimate of an effect's parameter from its value and deviation [p.unit]; beside: the size at
    which it would be as large as another term of the effect (`beside_in`).

    A part of the law's form that no log has moved from its default is given as that, without an
    interval: it belongs to the equation.
    """
    if p.at_default(value) and not sd:
        return Estimate(value, p.unit, reason=FIXED_AT_DEFAULT)
    share = p.name == "asymmetry" or p.name in AT_REST  # of the effect itself
    return reported_estimate(
        value, p.unit, sd, bounds=(p.low, p.high), at_bound=LEAST_SD * abs(p.typical or 1.0),
        beside=1.0 if share else beside,
    )  # fmt: skip
