"""Search for what shows only in how the body starts and stops: bands and stick limits."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import product

import numpy as np

from identification.arrays import Array
from identification.estimation.global_search import evolved
from identification.estimation.regression.breakaway import LIMITS_PER_COULOMB, usual_limits
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.motion_log import shortened
from identification.estimation.windowed_run.run_errors import Judge, judge, loss
from identification.estimation.windowed_run.windows import RUN_WINDOW
from identification.model.estimates import NORMAL_95, Drive
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.model.size import Size

SHORT_WINDOW = 1.0  # s, of the windows in which the search begins
FIRST_BANDS = (0.15, 0.5, 1.0)
STICKS = (0.9, 1.0, 1.15, 1.4)
CLOSER = (0.75, 0.92, 1.0, 1.08, 1.3)
# Of `stick_search`: s of each log; the widest band over the usual speed, the slowest one over the
# velocity's noise, and how far apart they are at most; factors close by; members and generations
PIECE = 20.0
WIDEST_BAND, SLOWEST_BAND, BANDS_SPAN = 0.4, 0.5, 200.0
NEAR_BAND, NEAR_LIMIT = 1.6, 1.06
NO_BAND = 1e-9  # m/s or rad/s
NEARER_BY, LIMITS_TRIED = (1.25, 1.05, 1.01), 24  # factors, between which so many limits are tried
FARTHEST_LIMIT, LIMIT_HALVINGS = 0.5, 10  # of a stick limit, between what its range is looked for
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
            low, high = (min(slow, band), least * coulomb), (top, most * coulomb)
            if close:
                low = (band / NEAR_BAND, stick / NEAR_LIMIT)
                high = (band * NEAR_BAND, stick * NEAR_LIMIT)
            plant = _searched_side(plant, up, np.log([low, high]), errors_of, rng)
    return plant


def nearest_limits(plant: Plant, logs: Sequence[MotionLog], drive: Drive) -> Plant:
    """The plant with the stick limits close by, with its band or without, with which most of its
    stops are those of the logs, one direction after the other: no slope leads to them. Ours."""
    errors_of = judge(plant, logs, drive, RUN_WINDOW, every=True)
    for reach in NEARER_BY:
        for name, band, none in (("F_sp", "dv_p", NO_BAND), ("F_sn", "dv_n", -NO_BAND)):
            p = plant.friction
            limits = getattr(p, name) * np.geomspace(1.0 / reach, reach, LIMITS_TRIED)
            both = product(limits.tolist(), {getattr(p, band), none})
            tried = [replace(p, **{name: limit, band: width}) for limit, width in both]
            plant = _best_of(plant, [p, *tried], errors_of)
    return plant


def stick_ranges(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, seconds: float, independent: int
) -> dict[str, tuple[float, float]]:
    """95 % ranges [N] of F_sp and F_sn under a zero-order-hold force, by the cost of runs in
    windows of so many seconds, at the best of a few bands; independent: how many errors are.

    Between two steps of such a force a limit changes nothing, so that no derivative of the run
    says how well it is known. Source: profile likelihood, Venzon, Moolgavkar, Appl. Stat. 37 (1988)
    87.
    """
    errors_of, p = judge(plant, logs, drive, seconds), plant.friction
    least = loss(errors_of(plant))
    most = least * (1.0 + NORMAL_95**2 / independent)

    def beyond(name: str, band: str, limit: float) -> bool:
        """Whether a limit is significantly less likely, whatever the band."""
        bands = {getattr(p, band), float(np.copysign(NO_BAND, limit))}
        tried = [replace(p, **{name: limit, band: one}) for one in bands]
        return all(loss(errors_of(replace(plant, friction=one))) > most for one in tried)

    def end(name: str, band: str, way: float) -> float:
        value, inside, outside = getattr(p, name), 0.0, FARTHEST_LIMIT
        for step in FARTHEST_LIMIT * 0.5 ** np.arange(LIMIT_HALVINGS)[::-1]:
            if beyond(name, band, value * (1.0 + way * step)):
                outside = float(step)
                break
            inside = float(step)
        return float(value * (1.0 + way * 0.5 * (inside + outside)))

    sides = [(*names, way) for names in (("F_sp", "dv_p"), ("F_sn", "dv_n")) for way in (-1.0, 1.0)]
    with ThreadPoolExecutor(2) as pool:
        ends = list(pool.map(lambda one: end(*one), sides))
    return {"F_sp": (ends[0], ends[1]), "F_sn": (ends[2], ends[3])}


def without_band(plant: Plant, logs: Sequence[MotionLog]) -> Plant:
    """The plant without a band in either direction, its stick limits those of most breakaways by
    themselves, or the Coulomb levels where there are none. Source: as `usual_limits`."""
    p, none = plant.friction, Size(0.0, np.inf)
    bare = replace(plant, friction=replace(p, dv_p=NO_BAND, dv_n=-NO_BAND))
    limits, _ = usual_limits(logs, bare)
    F_sp = max(limits.get("F_sp", none).value, p.F_cp)
    F_sn = min(limits.get("F_sn", none).value, -p.F_cn)
    return replace(bare, friction=replace(bare.friction, F_sp=F_sp, F_sn=F_sn))


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
        best = evolved(
            lambda every: np.array(list(pool.map(lambda z: loss(errors_of(at(z))), every))),
            first, SIDE_GENERATIONS, rng,
        )  # fmt: skip
    return at(best)


def _best_of(plant: Plant, tried: Sequence[Karnopp], errors_of: Judge) -> Plant:
    """The plant with the friction that leaves least."""
    plants = [replace(plant, friction=nine) for nine in tried]
    with ThreadPoolExecutor(2) as pool:
        costs = list(pool.map(lambda one: loss(errors_of(one)), plants))
    return plants[int(np.argmin(costs))]
