"""Search for what shows only in how the body starts and stops: bands and stick limits."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import product

import numpy as np

from identification.arrays import Array
from identification.estimation.global_search import evolve
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.motion_log import shortened
from identification.estimation.windowed_run.run_errors import Judge, judge, loss
from identification.model.estimates import Drive
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant

SHORT_WINDOW = 1.0  # s, of the windows in which the search begins
FIRST_BANDS = (0.15, 0.5, 1.0)
STICKS = (0.9, 1.0, 1.15, 1.4)
CLOSER = (0.75, 0.92, 1.0, 1.08, 1.3)
# Of `stick_search`: s of each log; the widest band over the usual speed, the slowest one over the
# velocity's noise, and how far apart they are at most; stick limits over the Coulomb level; factors
# close by; members and generations
PIECE = 20.0
WIDEST_BAND, SLOWEST_BAND, BANDS_SPAN = 0.4, 0.5, 200.0
LIMITS_PER_COULOMB = (0.96, 2.8)
NEAR_BAND, NEAR_LIMIT = 1.6, 1.06
SIDE_CROWD, SIDE_GENERATIONS = 24, 10


def start_band(plant: Plant, logs: Sequence[MotionLog], drive: Drive, band: float) -> Plant:
    """The plant at the best of a few band widths and stick limits, then of a direction. Ours."""
    p = plant.friction
    tried = [
        replace(p, dv_p=width * band, dv_n=-width * band, F_sp=more * p.F_sp, F_sn=more * p.F_sn)
        for width, more in product(FIRST_BANDS, STICKS)
    ]
    errors_of = judge(plant, logs, drive, SHORT_WINDOW)
    best = _best_of(plant, tried, errors_of)
    p = best.friction
    up = [replace(p, dv_p=a * p.dv_p, F_sp=b * p.F_sp) for a, b in product(CLOSER, CLOSER)]
    p = _best_of(plant, up, errors_of).friction
    down = [replace(p, dv_n=a * p.dv_n, F_sn=b * p.F_sn) for a, b in product(CLOSER, CLOSER)]
    return _best_of(plant, down, errors_of)


def widest_band(logs: Sequence[MotionLog]) -> float:
    """The widest band [m/s] that a plant of these logs may have; infinite where nothing moves."""
    pace = np.concatenate([np.abs(one.signals["v"][one.signals["d"] != 0]) for one in logs])
    return WIDEST_BAND * float(np.median(pace)) if len(pace) else np.inf


def stick_search(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, rng: np.random.Generator
) -> Plant:
    """The plant with the bands and stick limits with which its run follows, wherever they lie.

    For a plant whose other parameters the equations give: of either direction two unknowns are
    left, which are searched by themselves, first from the slowest motion that the logs show to
    their usual speed and from the Coulomb level to several times that, then close by. Source:
    differential evolution, Storn, Price (1997); the order is ours.
    """
    part = [shortened(one, PIECE) for one in logs]
    top = widest_band(part)
    slow = max(SLOWEST_BAND * min(one.noise.v for one in part), top / BANDS_SPAN)
    if not slow < top < np.inf:
        return plant
    for close in (False, True):
        errors_of = judge(plant, part, drive, SHORT_WINDOW)
        for up in (False, True):
            p = plant.friction
            band, stick = (p.dv_p, p.F_sp) if up else (-p.dv_n, -p.F_sn)
            coulomb = p.F_cp if up else p.F_cn
            least, most = LIMITS_PER_COULOMB
            low, high = (slow, least * coulomb), (top, most * coulomb)
            if close:
                low = (band / NEAR_BAND, stick / NEAR_LIMIT)
                high = (band * NEAR_BAND, stick * NEAR_LIMIT)
            plant = _searched_side(plant, up, np.log([low, high]), errors_of, rng)
    return plant


def _searched_side(
    plant: Plant, up: bool, ends: Array, errors_of: Judge, rng: np.random.Generator
) -> Plant:
    """The plant with the best band and stick limit of one direction; ends (2, 2): logarithms of the
    least and of the most of both."""
    p = plant.friction
    low, high = ends

    def at(z: Array) -> Plant:
        band, stick = np.exp(low + z * (high - low)).tolist()
        own = {"dv_p": band, "F_sp": stick} if up else {"dv_n": -band, "F_sn": -stick}
        return replace(plant, friction=replace(p, **own))

    here = np.log([p.dv_p, p.F_sp] if up else [-p.dv_n, -p.F_sn])
    first = rng.uniform(size=(SIDE_CROWD, 2))
    first[0] = np.clip((here - low) / (high - low), 0.0, 1.0)
    with ThreadPoolExecutor(2) as pool:
        found = evolve(
            lambda every: np.array(list(pool.map(lambda z: loss(errors_of(at(z))), every))),
            first, SIDE_GENERATIONS, rng,
        )  # fmt: skip
    best: Array = found.members[0]
    return at(best)


def _best_of(plant: Plant, tried: Sequence[Karnopp], errors_of: Judge) -> Plant:
    """The plant with the friction that leaves least."""
    plants = [replace(plant, friction=nine) for nine in tried]
    with ThreadPoolExecutor(2) as pool:
        costs = list(pool.map(lambda one: loss(errors_of(one)), plants))
    return plants[int(np.argmin(costs))]
