"""Search for a plant by a run that is corrected toward the measured velocity.

A free run that is driven by a force alone turns on every stop: a little too much friction, and the
body stays where it should have passed. The distance to the log then has many narrow minima, all
around the right one. A damping between the body and the measured velocity, D (v_log - v), keeps the
run near the log whatever the friction (as an observer does; Abarbanel, Creveling, Farsian, Kostuk,
SIAM Journal on Applied Dynamical Systems 8 (2009) 1341), so what is left changes smoothly with the
parameters. It is searched in a wide range first, then without added damping in a narrow one.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from identification.arrays import Array, BoolArray
from identification.effects._base import MAX_SIGNALS, Acting, Param
from identification.estimation.global_search import evolve
from identification.estimation.regression.effect_columns import (
    LEAST_LEFT_BY_LOAD,
    by_load,
    in_columns,
)
from identification.estimation.regression.equation_rows import FIVE, SURE_OF_DIRECTION, MotionLog
from identification.estimation.regression.standstill import rest_stretches
from identification.estimation.windowed_run.parameters import names_of, plant_with, values_of, wide
from identification.estimation.windowed_run.run_errors import Judge, judge, loss
from identification.estimation.windowed_run.stick_search import SHORT_WINDOW
from identification.model.estimates import Drive
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant

TAU = 0.1  # s, in which a body with added damping takes on the log's velocity
STRONG = 1.5  # times the body's own viscous friction, that is added at least
DAMPED_SAMPLES = 10  # the same at least, in samples
SHAKEN = 0.1  # of the Coulomb level, that the velocity's noise may make by the added damping
REST_SAMPLES = 5  # samples of a rest, in which its velocity counts as 0
# Members and generations, of a plant with effects and (its runs are quick) without.
CROWD, PLAIN_CROWD = (32, 30), (48, 40)
FIRST_SPREAD = 0.25  # of the first members
NARROWER = 0.3  # of that spread, for mass and sliding friction


@dataclass(frozen=True)
class Range:
    """How far around a plant is searched: shares of mass and sliding friction and of the stick
    limits, factors on the band and on effects; open: from no more than the regression gives;
    uneven: around an asymmetry that is 0; known: by name, how far at most, where that is less."""

    five: float
    stick: float
    band: float
    effect: float
    open: bool
    uneven: float = 0.0
    known: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))


FAR_RANGE = Range(0.03, 0.0, 2.5, 4.0, True)
SLIDING_RANGE = Range(0.005, 0.0, 2.5, 4.0, True)  # where that much is known
BAND_RANGE = Range(0.004, 0.03, 2.5, 1.1, False)  # where the equations give all but the band
BREAKS_RANGE = Range(0.004, 0.12, 8.0, 3.0, False)  # growth may have bent stick limits and bands
MIDWAY_RANGE = Range(0.005, 0.1, 1.5, 4.0, False)
CLOSE_RANGE = Range(0.005, 0.05, 1.4, 1.4, False)
SIDES_RANGE = Range(0.005, 0.05, 1.4, 1.4, False, 0.5)  # where directions may be unequal
# Where sliding is known, growing stiction is not
GROWTH_RANGE = Range(0.0, 0.01, 1.02, 3.0, False, 0.5)
FINER_RANGE = Range(0.0, 0.003, 1.01, 1.3, False, 0.1)  # the same, nearly found
SCALED = [0, 1, 2, 3, 4, 7, 8]  # of the nine, those that a share of the force scales
KNOWN_SLIDING = 0.002  # share within which sliding is searched where an effect acts in stops alone
ASYMMETRY_REACH = 0.15  # by which an asymmetry that is not 0 is searched
LEAST_BAND = 0.15  # of the slowest significant speed, that a band is at least
# Times the Coulomb level: least, usual and most of a stick limit
STICK_PER_COULOMB = (0.95, 1.6, 3.0)
STICK_REACH = 1.15  # times a stick limit, up to which it is searched


def nudged_search(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, rng: np.random.Generator,
    stages: Sequence[tuple[float, Range]] = ((1.0, FAR_RANGE), (0.0, CLOSE_RANGE)),
) -> Plant:  # fmt: skip
    """The plant with about the parameters with which a run driven by the force follows the logs.

    stages: share of the added damping (1: in full, 0: none) and range of one search after the
    other. Sources: Abarbanel, Creveling, Farsian, Kostuk (2009); Storn, Price (1997).
    """
    by_force = any(by_load(acting.effect) for acting in plant.effects)
    first = plant
    for share, around in stages:
        if share > 0.0 and by_force:  # the added force would be a load too
            continue
        if share == 0.0 and plant is not first:
            plant = nearer((plant, first), logs, drive)
        plant = _searched(plant, logs, drive, rng, share, around)
    return plant


def nearer(plants: Sequence[Plant], logs: Sequence[MotionLog], drive: Drive) -> Plant:
    """The plant whose free run leaves least in short windows."""
    errors_of = judge(plants[-1], logs, drive, SHORT_WINDOW)
    return min(plants, key=lambda one: loss(errors_of(one)))


def load_share(friction: Karnopp, acting: Acting) -> float:
    """Share of the applied force that load-dependent friction leaves to the motion."""
    none = np.zeros(MAX_SIGNALS)
    level = friction.F_cp
    taken = acting.effect.value(0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, level, level, none, acting.array)
    return max(1.0 - taken, LEAST_LEFT_BY_LOAD)


def less_load(base: Plant, acting: Acting) -> Plant:
    """The plant with what load-dependent friction takes of the force taken off its parameters."""
    nine = base.friction.array.copy()
    nine[SCALED] *= load_share(base.friction, acting)
    return replace(base, friction=Karnopp.from_array(nine))


def loaded(plant: Plant) -> Plant:
    """The plant with what its own load-dependent friction takes of the force taken off."""
    for acting in plant.effects:
        plant = less_load(plant, acting) if by_load(acting.effect) else plant
    return plant


def more_load(plant: Plant) -> Plant:
    """The plant without what load-dependent friction takes of the force: as a plain one appears."""
    loads = [acting for acting in plant.effects if by_load(acting.effect)]
    nine = plant.friction.array.copy()
    for acting in loads:
        nine[SCALED] /= load_share(plant.friction, acting)
    return replace(plant, friction=Karnopp.from_array(nine))


def judge_nudged(plant: Plant, logs: Sequence[MotionLog], drive: Drive, share: float) -> Judge:
    """Errors of a plant like this one with a share of the added damping (`run_errors.judge`).

    Source: Abarbanel et al. (2009); `README.md`, (6).
    """
    damping = share * nudging(plant, logs)
    if damping == 0.0:
        return judge(plant, logs, drive, SHORT_WINDOW)
    pulled = [nudged(one, plant, damping) for one in logs]
    errors_of = judge(damped(plant, damping), pulled, drive, SHORT_WINDOW)
    return lambda tried: errors_of(damped(tried, damping))


def nudged(one: MotionLog, plant: Plant, damping: float) -> MotionLog:
    """The log with the force [N] in it by which a damping [N s/m] corrects a body toward it.

    Source: Abarbanel et al. (2009).
    """
    v = one.signals["v"].copy()
    for low, high in rest_stretches(one, REST_SAMPLES):
        v[low:high] = 0.0
    force = damping * np.append(0.5 * (v[1:] + v[:-1]), v[-1])
    more = {"F": one.log["F"] + force}
    if isinstance(plant.actuator, Motor):
        more["u"] = one.log["u"] + force / plant.actuator.k_a
    return replace(one, log=one.log.with_signals(**more))


def nudging(plant: Plant, logs: Sequence[MotionLog]) -> float:
    """Damping [N s/m] that corrects a body toward the measured velocity, but hardly by its noise.

    After Abarbanel et al. (2009); the size is ours: `README.md`, (6).
    """
    p = plant.friction
    noise = max(one.v_noise for one in logs)
    tau = max(TAU, *(DAMPED_SAMPLES * one.log.h for one in logs))
    strong = max(p.m / tau, STRONG * max(p.F_vp, p.F_vn))
    return float(min(strong, SHAKEN * min(p.F_cp, p.F_cn) / max(noise, 1e-300)))


def damped(plant: Plant, damping: float) -> Plant:
    """The plant with so much more viscous friction [N s/m]."""
    p = plant.friction
    return replace(plant, friction=replace(p, F_vp=p.F_vp + damping, F_vn=p.F_vn + damping))


def _searched(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, rng: np.random.Generator, share: float,
    around: Range,
) -> Plant:  # fmt: skip
    """The best plant in this range, with this share of the added damping."""
    size, generations = CROWD if plant.effects else PLAIN_CROWD
    errors_of = judge_nudged(plant, logs, drive, share)
    # Load-dependent friction and everything else scale each other: they are searched apart.
    plant = more_load(plant)
    names = names_of(plant, drive)
    low, high = limits(plant, names, SURE_OF_DIRECTION * max(one.v_noise for one in logs), around)
    by_log = _by_log(names, low, high)

    def at(z: Array) -> Plant:
        x = low + z * (high - low)
        x[by_log] = low[by_log] * (high[by_log] / low[by_log]) ** z[by_log]
        return loaded(plant_with(plant, names, x))

    here = _place(values_of(plant, names), low, high, by_log)
    spread = FIRST_SPREAD * np.where(np.isin(names, FIVE), NARROWER, 1.0)
    first = np.clip(here + spread * rng.standard_normal((size, len(names))), 0.0, 1.0)
    first[0] = here
    with ThreadPoolExecutor(2) as pool:
        found = evolve(
            lambda every: np.array(list(pool.map(lambda z: loss(errors_of(at(z))), every))),
            first, generations, rng,
        )  # fmt: skip
    best: Array = found.members[0]
    return at(best)


def limits(plant: Plant, names: Sequence[str], slow: float, around: Range) -> tuple[Array, Array]:
    """Bounds (k,) of each parameter; slow [m/s]: speed from which a motion is significant."""
    p = plant.friction
    # Growing stiction does not bias what sliding identifies: that is known closely already.
    stops = bool(plant.effects) and all(a.effect.place.in_stops for a in plant.effects)
    five = min(around.five, KNOWN_SLIDING) if stops else around.five
    params = {f"{a.key}.{one.name}": one for a in plant.effects for one in a.effect.params}
    columns = [f"{a.key}.{one}" for a in plant.effects if in_columns(a.effect) for one in a.values]
    low, high = [], []
    for name, value in zip(names, values_of(plant, names).tolist(), strict=True):
        size = abs(value)
        if name in ("dv_p", "dv_n"):
            size = max(size, slow) if around.open else size
            least = LEAST_BAND if around.open else 1.0 / around.band
            ends = [np.sign(value) * size * least, np.sign(value) * size * around.band]
        elif name in ("F_sp", "F_sn") and around.open:
            coulomb = p.F_cp if name == "F_sp" else p.F_cn
            most = min(
                max(STICK_PER_COULOMB[1], STICK_REACH * size / coulomb), STICK_PER_COULOMB[2]
            )
            ends = [
                np.sign(value) * STICK_PER_COULOMB[0] * coulomb,
                np.sign(value) * most * coulomb,
            ]
        elif name in columns and params[name].spare and value == 0.0:
            ends = [0.0, 0.0]  # sliding shows none
        elif name in params:
            ends = _of_effect(params[name], value, around)
        else:
            part = around.stick if name in ("F_sp", "F_sn") else five
            ends = [value - part * size, value + part * size]
        off = around.known.get(name, np.inf)
        low.append(max(ends[0], value - off))
        high.append(min(ends[1], value + off))
    return np.array(low), np.array(high)


def _of_effect(p: Param, value: float, around: Range) -> list[float]:
    """Bounds of one parameter of an effect; an asymmetry of 0 stays unless it is searched."""
    factor = around.effect
    if p.name == "asymmetry":
        off = ASYMMETRY_REACH if value != 0.0 else around.uneven
        return [max(value - off, p.low), min(value + off, p.high)]
    if p.held(value):
        return [value, value]
    factor = factor if p.linear else min(factor, wide(p))
    if p.low < 0.0:
        off = (factor - 1.0) * (abs(value) if value else p.typical)
        ends = [value - off, value + off]
    else:
        ends = [value / factor, value * factor]
    return [float(np.clip(x, p.low, p.high)) for x in ends]


def _by_log(names: Sequence[str], low: Array, high: Array) -> BoolArray:
    """Whether a parameter is searched by its logarithm: bands and effects of one sign."""
    own = np.array(
        [name in ("dv_p", "dv_n") or ("." in name and "asymmetry" not in name) for name in names]
    )
    return np.asarray(own & (low * high > 0.0) & (low != high), dtype=np.bool_)


def _place(x: Array, low: Array, high: Array, by_log: BoolArray) -> Array:
    """Values (k,) in the unit cube of the bounds."""
    out = np.full(len(x), 0.5)
    wide = high != low
    out[wide] = (x[wide] - low[wide]) / (high[wide] - low[wide])
    own = by_log & (x * low > 0.0)
    out[own] = np.log(x[own] / low[own]) / np.log(high[own] / low[own])
    return np.asarray(np.clip(out, 0.0, 1.0), dtype=np.float64)
