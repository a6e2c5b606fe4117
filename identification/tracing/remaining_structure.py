"""The structure that is left when nothing more is found: on which signals it depends."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from identification.arrays import Array, BoolArray, IntArray
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import (
    BREAKAWAY,
    MECHANICAL,
    REST,
    MotionLog,
)
from identification.estimation.regression.row_fit import RowFit, mean_square
from identification.estimation.regression.weighted_rows import BLOCKS
from identification.estimation.structure_fit import FittedStructure, band
from identification.estimation.windowed_run.run_errors import soft
from identification.estimation.windowed_run.windows import left_in_windows, starts, window_of
from identification.model.estimates import Drive
from identification.signals.sampling import USUAL_PERIOD, samples
from identification.thresholds import ADEQUATE, ASTRAY
from identification.tracing.dependence import MOST_SIGNALS, dependence
from identification.tracing.regression.stepwise import Choice
from identification.tracing.residuals import joined, signals_at, signals_of
from identification.tracing.result import Dependence, Residual

FEWEST_ROWS = 30
BEND = 0.05  # s, half of the stretch on which an error's rate and curvature are estimated
THINNED = 10  # samples of 2 ms, of a free run or of the missing force, of which one is judged
LEFT_OUT_STRETCHES = 64  # of a log, every eighth of which is left out together


def remaining_structure(choice: Choice, after: FittedStructure) -> Dependence:
    """The strongest structure that is left in any equation, if there is any."""
    best, most = Dependence((), 0.0), 0.0
    for equation, o in choice.base.items():
        if o.robust and mean_square(o) < ADEQUATE:
            continue
        keep = judged_rows(o, after) if equation == MECHANICAL else o.rows.speed >= o.slowest
        found = _in_equation(choice, equation, keep)
        if found is None:
            continue
        named, left = found
        if named.depends_on and (much := left * np.count_nonzero(keep)) > most:
            best, most = named, much
    return best


def _in_equation(choice: Choice, equation: str, keep: BoolArray) -> tuple[Dependence, float] | None:
    """On what an equation's residual depends at these rows, and the square [noise units] that the
    signals named explain; None where there are too few rows."""
    o = choice.base[equation]
    if np.count_nonzero(keep) < FEWEST_ROWS:
        return None
    every = signals_at(choice.end, equation)
    way = upward(choice.end, equation, every)[keep]
    motor = all(one.by_motor for one in choice.end.logs)
    if equation == BREAKAWAY:  # force and command at breakaway are what is judged
        every = {k: v for k, v in every.items() if k not in ("F", "u", "v", "reversal")}
    if equation == MECHANICAL:
        # Of the measured force the residual is itself a part: the model's is judged.
        every["F"] = o.rows.b - o.fit.residual * o.rows.sd
        if motor:
            every.pop("u", None)
    if equation == REST:  # as it is defined there, it is the position's own noise
        every.pop("v")
    if any(effect.place.elastic for effect, _ in choice.end.chosen):
        every.pop("reversal", None)  # its rise is judged in the free run
    signals = {k: v[keep] for k, v in every.items()}
    r = o.fit.residual[keep]
    if o.robust:
        limit = 3.0 * np.sqrt(max(mean_square(o), 1.0))
        r = np.clip(r, -limit, limit)
        # Those far off draw on the mean, on which no signal has a part.
        r = r - np.where(way, _mean(r[way]), _mean(r[~way]))
    found = dependence(r, signals, way, _stretches(len(r)))
    names = found.depends_on
    if equation == REST and names:  # it is left since the body stands still, and not before
        names = (*names, "reversal")
    named = replace(found, depends_on=_with_command(names, motor))
    return named, found.explained * float(np.mean(r**2))


def _stretches(n: int) -> IntArray:
    """Block of each of n rows, (n,): fine stretches in turn, or no function of time could be
    judged."""
    return np.asarray(np.arange(n) * LEFT_OUT_STRETCHES // n % BLOCKS)


def upward(stage: EffectRows, equation: str, signals: Mapping[str, Array]) -> BoolArray:
    """Whether each row of an equation moves, starts or is pushed in positive direction, (r,)."""
    if equation == BREAKAWAY:
        return np.concatenate([events.direction > 0 for events in stage.events])
    pushed = signals.get("F" if equation == REST else "v")
    if pushed is None:  # the same at every row
        return np.ones(len(next(iter(signals.values()))), dtype=np.bool_)
    return np.asarray(pushed >= 0)


def _mean(r: Array) -> float:
    """Mean, 0 of nothing."""
    return float(np.mean(r)) if len(r) else 0.0


def _with_command(names: tuple[str, ...], motor: bool) -> tuple[str, ...]:
    """Signals named (k,), the command beside its rate and, where it makes the force, the force."""
    also = {"du": ("u",), "F": ("u",) if motor else (), "u": ("F",) if motor else ()}
    every = [each for name in names for each in (name, *also.get(name, ()))]
    return tuple(dict.fromkeys(every))[:MOST_SIGNALS]


def judged_rows(o: RowFit, after: FittedStructure) -> BoolArray:
    """Rows of sliding above the band of a free run that is followed, or else the regression's."""
    followed = not after.prescribed and after.misfit <= ASTRAY
    slowest = min(o.slowest, band(after)) if followed else o.slowest
    return np.asarray(o.rows.speed >= slowest)


def strongest(
    choice: Choice, after: FittedStructure, logs: Sequence[MotionLog], drive: Drive,
    missing: Residual | None,
) -> Dependence:  # fmt: skip
    """The strongest of the structures left in the equations, in the free run and in the force that
    is missing while the body slides."""
    found = [remaining_structure(choice, after)]
    if missing is not None:
        found.append(in_force(missing, motor=all(one.by_motor for one in logs)))
    if not after.prescribed:
        found.append(in_run(after, logs, drive))
    return max(found, key=lambda one: one.explained if one.depends_on else 0.0)


def in_force(missing: Residual, *, motor: bool) -> Dependence:
    """Signals on which the force depends that is missing while the body slides, sample by sample;
    motor: it is driven by its command."""
    if len(missing.t) < FEWEST_ROWS or "v" not in missing.signals:
        return Dependence((), 0.0)
    h = float(np.median(np.abs(np.diff(missing.t))))
    at = np.arange(0, len(missing.t), max(1, round(THINNED * USUAL_PERIOD / h)))
    if len(at) < FEWEST_ROWS:
        return Dependence((), 0.0)
    signals = {name: x[at] for name, x in missing.signals.items()}
    left, way = missing.after[at], np.asarray(signals["v"] >= 0)
    if "F" in signals:  # of which the force that is missing is itself a part
        signals["F"] = signals["F"] - left
    left = left - np.where(way, _mean(left[way]), _mean(left[~way]))
    scale = 3.0 * float(np.median(np.abs(left))) or 1.0
    found = dependence(np.clip(left, -scale, scale), signals, way, _stretches(len(at)))
    return replace(found, depends_on=_with_command(found.depends_on, motor))


def in_run(after: FittedStructure, logs: Sequence[MotionLog], drive: Drive) -> Dependence:
    """Signals on which the free run's position error depends, or its rate, or its curvature (the
    force that is missing); or else how large they are, where their sign is a matter of chance."""
    errors, rates, bends = list[Array](), list[Array](), list[Array]()
    windows, each = list[IntArray](), list[dict[str, Array]]()
    count = 0
    for one in logs:
        begun = starts(one, drive)
        r = left_in_windows(after.plant, one, drive)
        if r is None:
            return Dependence((), 0.0)
        at = np.arange(0, len(one.log), max(THINNED, samples(THINNED, one.log.h)))
        own = {k: v[at] for k, v in signals_of(one).items()}
        window = window_of(begun, len(one.log))
        if "u" in own:
            own["du"] = np.gradient(one.signals["u"], one.log.h)[at]
        half = max(1, round(BEND / one.log.h))
        errors.append(r[0][at])
        rates.append(_change(r[0], at, half, window, 1))
        bends.append(_change(r[0], at, half, window, 2))
        windows.append(window[at] + count)
        each.append(own)
        count += len(begun.at)
    signals = joined(each)
    # An error lasts to the end of its window, so windows are left out whole; and what is lost at
    # one stop must not outweigh all others.
    block = np.concatenate(windows) % BLOCKS
    way = np.asarray(signals["v"] >= 0)
    whole, rate, bend = (soft(np.concatenate(x)) for x in (errors, rates, bends))
    sizes = [x**2 - np.mean(x**2) for x in (rate, bend)]
    of = partial(dependence, signals=signals, up=way, block=block)
    structures = [of(x) for x in (whole, rate, bend)]
    structures = [one for one in structures if one.depends_on] or [of(x) for x in sizes]
    structures = sorted(
        (one for one in structures if one.depends_on), key=lambda one: -one.explained
    )
    if not structures:
        return Dependence((), 0.0)
    named = tuple(dict.fromkeys(name for one in structures for name in one.depends_on))
    motor = all(one.by_motor for one in logs)
    return replace(structures[0], depends_on=_with_command(named, motor))


def _change(r: Array, at: IntArray, half: int, window: IntArray, order: int) -> Array:
    """First or second difference of r (n,) about samples `at` over so many on either side, (k,); 0
    where they lie in other windows."""
    low, high = np.maximum(at - half, 0), np.minimum(at + half, len(r) - 1)
    found = r[high] - r[low] if order == 1 else r[high] - 2.0 * r[at] + r[low]
    return np.asarray(np.where(window[low] == window[high], found, 0.0))
