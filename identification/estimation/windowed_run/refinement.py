"""Joint refinement of a plant with effects on its free run, from estimates already close.

The regression gives mass, sliding friction and effects; band and stick limits show only in how
the body starts and stops. All are refined together on the position (and force, where the command
drives) in windows, with the regression's estimates as a prior. No global search is needed.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import Literal

import numpy as np

from identification.arrays import Array, BoolArray, IntArray
from identification.effects._base import Param
from identification.estimation.gauss_newton import FINE_STEP, Minimum, gauss_newton
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.windowed_run.windows import (
    COARSE,
    RUN_WINDOW,
    WHOLE,
    freed,
    noise_errors,
    starts,
    walks,
    window_of,
    window_residual,
)
from identification.model.estimates import Drive
from identification.model.karnopp import NAMES, NEGATIVE, Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.progress import Halted
from identification.simulation.effect_table import LONGEST_BRISTLE
from identification.thresholds import COMPLETE, FOLLOWED, NEARLY_FOLLOWED

SHORT_WINDOW = 1.0  # s, of the windows in which the search begins
# Windows [s] with hardly a stop in each, and the share of their residuals that counts in full:
# where a stop comes late, no more than its own window is lost, so the minimum is wide.
BRIEF_WINDOWS = ((0.1, 0.5), (0.1, 0.0), (0.3, 0.0), (1.0, 0.0))
BRIEF_SAMPLES = 20  # that a brief window has at least
# Of a parameter, or of so much of its unit, that it changes in them
BRIEF_REACH, LEAST_OF_UNIT = 0.4, 0.5
PASSING = 0.03  # share of the cost, below which a step that only leads on is the last
RESCUES = 3  # searches beside, of a run that leaves more than noise
NO_USE = 0.8  # of the misfit, above which another search is of no use
BAND_GRID = (0.12, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0, 1.1, 1.3, 1.7, 2.3, 3.5)
STICK_GRID = (0.8, 0.86, 0.9, 0.94, 0.97, 0.985, 1.0, 1.015, 1.03, 1.06, 1.1, 1.16, 1.25)
REACHED = 60.0  # misfit up to which brief windows may lead to the minimum
# Of `onward` at most, each to leave this share of the misfit before
ONWARD_ROUNDS, ONWARD_GAIN = 4, 0.9
# At most, of a refinement, of one on a bristle and of a quick one
REFIT_STEPS, BRISTLE_STEPS, QUICK_STEPS = 12, 10, 4
IN_REACH = 20.0  # misfit up to which a bristle is refined with a simulation's short sub-steps
MOTOR_WINDOW = 8.0  # s, of those in which a motor is followed in the end
NOISE_DRAWS = 60  # of every signal's noise, from which the parameters' deviations follow
NOISE_LOSS = 0.8732  # mean robust square of white noise of unit variance
LUCKY_WINDOWS = 0.15  # of the windows, that luck may have spoilt
CANNOT_BE_FOLLOWED = 1e6  # error of a run that cannot be followed
ROBUST_FROM = 3.0  # residual in noise units from which it counts less
FARTHEST = 300.0  # the same, at most, while much is far off
FIRST_SHARE, HALF_SHARE = 0.9, 0.5  # share of the residuals that then count in full
NARROW = 0.3  # of its value, that the mass keeps at least in a search
SHAPE_REACH, PERIOD_REACH = 2.0, 1.2  # how far a search moves what an effect is not linear in
LOOSE = 3.0  # times its standard deviation that the regression is trusted as a prior
FIRST_BANDS = (0.15, 0.5, 1.0)
STICKS = (0.9, 1.0, 1.15, 1.4)
CLOSER = (0.75, 0.92, 1.0, 1.08, 1.3)


@dataclass(frozen=True, eq=False)
class Refit:
    """The plant refined and its misfit.

    names (d,): parameters that were free; prior: their deviations from the regression, where they
    have one; spread: gives `covariance` (d, d), which takes many runs.
    """

    plant: Plant
    misfit: float
    names: tuple[str, ...]
    prior: Mapping[str, float]
    spread: Callable[[], Array]

    @cached_property
    def covariance(self) -> Array:
        """Of the errors of `names`, (d, d)."""
        return self.spread()

    @cached_property
    def sd(self) -> dict[str, float]:
        """Standard deviations by name (effects as key.name)."""
        deviations = np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).tolist()
        least = self.prior if self.misfit > FOLLOWED else {}
        return {n: max(s, least.get(n, 0.0)) for n, s in zip(self.names, deviations, strict=True)}


def names_of(plant: Plant, drive: Drive) -> list[str]:
    """Names of the parameters that are refined, effects' as key.name."""
    out = list(NAMES)
    if drive == "command" and isinstance(plant.actuator, Actuator):
        out += ["k1", "k2"]
    for acting in plant.effects:
        out += [f"{acting.key}.{p.name}" for p in acting.effect.params]
    return out


def values_of(plant: Plant, names: Sequence[str]) -> Array:
    """Their values."""
    every = dict(zip(NAMES, plant.friction.array.tolist(), strict=True))
    if isinstance(plant.actuator, Actuator):
        every |= {"k1": plant.actuator.k1, "k2": plant.actuator.k2}
    for acting in plant.effects:
        every |= {f"{acting.key}.{k}": v for k, v in acting.values.items()}
    return np.array([every[name] for name in names])


def units_in(plant: Plant, names: Sequence[str], x: Array) -> Array:
    """Sizes (k,) in whose parts the values x (k,) are changed; of a value of 0 the typical one."""
    typical = {f"{a.key}.{p.name}": p.typical for a in plant.effects for p in a.effect.params}
    of_none = np.array([abs(typical.get(name, 1.0)) or 1.0 for name in names])
    unit = np.where(x != 0.0, np.abs(x), of_none)
    unit[[name.endswith("asymmetry") for name in names]] = 1.0
    return np.asarray(unit)


def wide(p: Param) -> float:
    """Factor within which a search keeps what an effect is not linear in.

    The equations tell a period closely, and one far beyond the travel is another effect.
    """
    return PERIOD_REACH if p.role == "period" else SHAPE_REACH


def plant_with(plant: Plant, names: Sequence[str], x: Array) -> Plant:
    """The plant with these values, put at their bounds where they lie outside."""
    every = dict(zip(names, x.tolist(), strict=True))
    nine = [every.get(name, getattr(plant.friction, name)) for name in NAMES]
    for i, name in enumerate(NAMES):
        size = abs(getattr(plant.friction, name))
        # A mass next to nothing would take a run next to for ever.
        least = max(1e-9, NARROW * size) if name == "m" else 1e-9
        nine[i] = min(nine[i], -least) if name in NEGATIVE else max(nine[i], least)
    actuator: Actuator | Motor | None = plant.actuator
    if isinstance(actuator, Actuator) and "k1" in every:
        actuator = Actuator(max(every["k1"], 1e-9), max(every["k2"], 0.0))
    effects = []
    for acting in plant.effects:
        own = {}
        for p in acting.effect.params:
            here = acting.values[p.name]
            low, high = p.low, p.high
            if not p.linear and here > 0:
                low, high = max(low, here / wide(p)), min(high, here * wide(p))
            own[p.name] = float(np.clip(every.get(f"{acting.key}.{p.name}", here), low, high))
        effects.append(acting.effect.acting(own))
    return Plant(Karnopp(*nine), actuator, tuple(effects))


def even(plant: Plant) -> dict[str, float]:
    """A prior that holds every shape that is at its default (an asymmetry of 0), nothing else."""
    return {
        f"{a.key}.{p.name}": 0.0
        for a in plant.effects
        for p, value in zip(a.effect.params, a.p, strict=True)
        if p.held(value)
    }


class HaltedRefit(Halted):
    """A refinement that was halted, at the plant that it had come to."""

    def __init__(self, plant: Plant) -> None:
        super().__init__()
        self.plant = plant


Effort = Literal["quick", "near", "far", "rough", "whole"]
Judge = Callable[[Plant], Array]


def judge(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, seconds: float, bristle: float = COARSE
) -> Judge:
    """Errors of a plant like this one, in units of the sensors' noise: position (and, by command,
    force) over all logs, less what the windows' unsure states account for.

    bristle [s]: longest sub-step of one.
    """
    free = [freed(plant, one, drive, starts(one, drive, seconds, bristle)) for one in logs]
    sizes = [len(one.log) * (2 if drive == "command" and not one.held else 1) for one in logs]

    def errors_of(tried: Plant) -> Array:
        parts = []
        for one, own, size in zip(logs, free, sizes, strict=True):
            r = window_residual(tried, one, drive, own)
            if r is None or not np.all(np.isfinite(r)):
                parts.append(np.full(size, CANNOT_BE_FOLLOWED))
                continue
            parts.append(np.clip(r, -CANNOT_BE_FOLLOWED, CANNOT_BE_FOLLOWED).ravel())
        return np.concatenate(parts)

    return errors_of


def loss(r: Array) -> float:
    """Robust cost."""
    return float(np.sum(np.log1p((r / ROBUST_FROM) ** 2)) * ROBUST_FROM**2)


def soft(r: Array, far: float = ROBUST_FROM) -> Array:
    """Errors whose square sum is a robust cost: those beyond `far` count ever less."""
    return np.asarray(np.sign(r) * np.sqrt(np.log1p((r / far) ** 2)) * far)


def start_band(plant: Plant, logs: Sequence[MotionLog], drive: Drive, band: float) -> Plant:
    """The plant at the best of a few band widths and stick limits, then of either direction."""
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


def by_side(plant: Plant, logs: Sequence[MotionLog], drive: Drive) -> Plant:
    """The plant with the best band and stick limit of either direction on a wide grid."""
    errors_of = judge(plant, logs, drive, SHORT_WINDOW)
    p = plant.friction
    up = [replace(p, dv_p=a * p.dv_p, F_sp=b * p.F_sp) for a, b in product(BAND_GRID, STICK_GRID)]
    best = _best_of(plant, up, errors_of)
    p = best.friction
    down = [replace(p, dv_n=a * p.dv_n, F_sn=b * p.F_sn) for a, b in product(BAND_GRID, STICK_GRID)]
    return _best_of(best, down, errors_of)


def _best_of(plant: Plant, tried: Sequence[Karnopp], errors_of: Judge) -> Plant:
    """The plant with the friction that leaves least."""
    plants = [replace(plant, friction=nine) for nine in tried]
    with ThreadPoolExecutor(2) as pool:
        costs = list(pool.map(lambda one: loss(errors_of(one)), plants))
    return plants[int(np.argmin(costs))]


@dataclass(frozen=True, eq=False)
class _Unknowns:
    """A plant's parameters as the unknowns of a refinement, in units of their sizes.

    names, x0, unit (k,): all of them; at (d,): those that are free; trust (k,): the regression's
    deviations; steps: at most, of one minimum; little: share of the cost below which a step is the
    last; reached: the last minimum (d,), if any.
    """

    plant: Plant
    logs: Sequence[MotionLog]
    drive: Drive
    names: tuple[str, ...]
    x0: Array
    unit: Array
    at: IntArray
    trust: Array
    steps: int
    little: float
    reached: list[Array] = field(default_factory=list)

    @classmethod
    def of(
        cls, plant: Plant, logs: Sequence[MotionLog], drive: Drive, prior: Mapping[str, float],
        steps: int, little: float,
    ) -> "_Unknowns":  # fmt: skip
        """The parameters that `prior` leaves open: a shape at its bound has no say."""
        names = names_of(plant, drive)
        x0 = values_of(plant, names)
        trust = np.array([prior.get(name, np.inf) for name in names])
        at = np.array([i for i, name in enumerate(names) if prior.get(name, 1.0) != 0.0])
        unit = units_in(plant, names, x0)
        return cls(plant, logs, drive, tuple(names), x0, unit, at, trust, steps, little)

    @property
    def start(self) -> Array:
        """The unknowns (d,) of the plant itself."""
        return self.x0[self.at] / self.unit[self.at]

    def full(self, x: Array) -> Array:
        """All parameters (k,) of the unknowns (d,)."""
        out = self.x0.copy()
        out[self.at] = x * self.unit[self.at]
        return out

    def plant_at(self, x: Array) -> Plant:
        """The plant of the unknowns (d,)."""
        return plant_with(self.plant, self.names, self.full(x))

    def of_plant(self, plant: Plant) -> Array:
        """The unknowns (d,) of another plant."""
        return np.asarray(values_of(plant, self.names)[self.at] / self.unit[self.at])

    def misfit(self, x: Array, bristle: float = COARSE) -> float:
        """What the free run of the unknowns (d,) leaves."""
        return misfit(self.plant_at(x), self.logs, self.drive, bristle)

    def refined(
        self, x: Array, seconds: float, tie: bool, part: float = 0.0, bristle: float = COARSE,
        reach: Array | float = np.inf, little: float | None = None,
    ) -> Minimum:  # fmt: skip
        """The nearest minimum over windows of so many seconds; tie: held by the regression."""
        now = self.plant_at(x)
        errors_of = judge(now, self.logs, self.drive, seconds, bristle)
        # While most is far off, what is far off must still pull.
        far = float(np.clip(np.quantile(np.abs(errors_of(now)), part), ROBUST_FROM, FARTHEST))
        tied = np.flatnonzero(np.isfinite(self.trust) & (self.trust > 0))

        def bent(at: Array) -> Array:
            r = soft(errors_of(self.plant_at(at)), far)
            pull = (self.full(at)[tied] - self.x0[tied]) / (LOOSE * self.trust[tied])
            return np.concatenate([r, pull]) if tie else np.asarray(r)

        last = self.little if little is None else little
        found = gauss_newton(bent, x, self.steps, reach=reach, little=last)
        self.reached[:] = [found.x]
        return found


def refit(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, *, prior: dict[str, float],
    band: float = 0.0, effort: Effort = "whole", rescues: int = 0,
) -> Refit:  # fmt: skip
    """All parameters refined together.

    band [m/s]: about the speed below which sliding friction does not hold; prior: standard
    deviations from the regression by name (others are free); effort: "quick" takes a few
    steps from the plant as it is, "near" goes on from there, "far" comes there through brief
    windows, "rough" looks for the band first and goes on while much is gained, "whole" as long as
    anything is; rescues: how often at most another band is looked for, where more than noise
    is left.
    """
    quick = effort == "quick"
    if effort in ("rough", "whole"):
        plant = start_band(plant, logs, drive, band)
    slow = on_bristle(plant)  # its sub-steps are ten times shorter
    steps = QUICK_STEPS if quick else REFIT_STEPS
    steps = min(steps, BRISTLE_STEPS) if slow else steps
    passing = PASSING if effort == "rough" else 0.0
    unknowns = _Unknowns.of(plant, logs, drive, prior, steps, passing)
    try:
        at, found = _minimum(unknowns, effort, rescues)
    except Halted:
        if not unknowns.reached:
            raise
        raise HaltedRefit(unknowns.plant_at(unknowns.reached[0])) from None
    free, unit = unknowns.at, unknowns.unit

    def spread() -> Array:
        # Where what is left is no noise, a window counts as one sample.
        factor = RUN_WINDOW / logs[0].log.h if found > FOLLOWED else 1.0
        scale = np.outer(unit[free], unit[free])
        if not any(walks(one, drive) for one in logs):
            return factor * at.covariance() * scale
        if found <= COMPLETE:
            noise = _noise(unknowns.plant_at(at.x), logs, drive)
            if noise is not None:
                return at.covariance_by(noise) * scale
        return factor * at.covariance(_windows(logs, drive)) * scale

    names = tuple(unknowns.names[i] for i in free)
    return Refit(unknowns.plant_at(at.x), found, names, dict(prior), spread)


def _minimum(unknowns: _Unknowns, effort: Effort, rescues: int) -> tuple[Minimum, float]:
    """The minimum that a refinement of this effort ends in, and its misfit."""
    plant, logs, drive = unknowns.plant, unknowns.logs, unknowns.drive
    quick, slow = effort == "quick", on_bristle(plant)
    at = _approached(unknowns, effort)
    # Free of the regression, and over a whole run, in which no window's start errs: where the model
    # follows. Elsewhere what it lacks would bend what the equations tell.
    hopeless = effort == "rough" and at.mean > NEARLY_FOLLOWED
    rounds = [] if quick or hopeless else [RUN_WINDOW]
    steady = drive == "command" and not any(walks(one, drive) for one in logs)
    longest = MOTOR_WINDOW if plant_is_motor(plant) else WHOLE
    if steady and not slow and rounds:
        rounds.append(longest)
    for seconds in rounds:
        again = unknowns.refined(at.x, seconds, False)
        at = again if again.followed else at
    at, found = _ended(unknowns, at, quick)
    if not (quick or slow):
        at, found = _rescued(unknowns, at, found, rescues, longest if steady else None)
    if slow and not quick and COMPLETE < found < IN_REACH and loose(plant, drive):
        # Without a spring the errors of the sub-steps add up.
        trial = unknowns.refined(at.x, RUN_WINDOW, False, bristle=LONGEST_BRISTLE)
        left_by = unknowns.misfit(trial.x, LONGEST_BRISTLE)
        if left_by < found:
            at, found = trial, left_by
    return at, found


def _approached(unknowns: _Unknowns, effort: Effort) -> Minimum:
    """The minimum held by the regression, come to as the effort says."""
    x = unknowns.start
    if effort in ("rough", "whole"):
        x = unknowns.refined(x, SHORT_WINDOW, True, FIRST_SHARE).x
    for seconds, part in BRIEF_WINDOWS if effort == "far" else ():
        brief = max(seconds, *(BRIEF_SAMPLES * one.log.h for one in unknowns.logs))
        reach = BRIEF_REACH * np.maximum(np.abs(x), LEAST_OF_UNIT)
        x = unknowns.refined(x, brief, False, part, reach=reach, little=PASSING).x
    return unknowns.refined(x, RUN_WINDOW, True, HALF_SHARE)


def _ended(unknowns: _Unknowns, at: Minimum, quick: bool) -> tuple[Minimum, float]:
    """The minimum itself and its misfit."""
    found = unknowns.misfit(at.x)
    if quick or not at.followed:
        return at, found
    finer = gauss_newton(at.fun, at.x, unknowns.steps, FINE_STEP)
    left_by = unknowns.misfit(finer.x)
    return (finer, left_by) if left_by < max(found, COMPLETE) else (at, found)


def _rescued(
    unknowns: _Unknowns, at: Minimum, found: float, rescues: int, longest: float | None
) -> tuple[Minimum, float]:
    """The best minimum from other bands and stick limits, as long as that helps.

    longest [s]: windows in which it is followed in the end, None where no run is.
    """
    for _ in range(rescues):
        if found <= COMPLETE:
            break
        # Band and stick limits have narrow minima, and many: another one of either direction.
        other = by_side(unknowns.plant_at(at.x), unknowns.logs, unknowns.drive)
        trial = unknowns.refined(unknowns.of_plant(other), RUN_WINDOW, False)
        if longest is not None:
            longer = unknowns.refined(trial.x, longest, False)
            trial = longer if longer.followed else trial
        trial, better = _ended(unknowns, trial, quick=False)
        before = found
        if better < found:
            at, found = trial, better
        if better > NO_USE * before:
            break
    return at, found


def briefly(plant: Plant, logs: Sequence[MotionLog], drive: Drive) -> Refit:
    """The plant refined through brief windows, with directions that may be unequal."""
    held = {name: 0.0 for name in even(plant) if not name.endswith("asymmetry")}
    return refit(plant, logs, drive, prior=held, effort="far")


def onward(plant: Plant, logs: Sequence[MotionLog], drive: Drive) -> Refit:
    """The plant refined through brief windows while that helps."""
    best: Refit | None = None
    left_by = misfit(plant, logs, drive)
    for _ in range(ONWARD_ROUNDS):
        try:
            found = briefly(plant, logs, drive)
        except Halted:
            if best is None:
                raise
            break
        gained = found.misfit < ONWARD_GAIN * left_by
        best = found if best is None or found.misfit < best.misfit else best
        if not gained or not COMPLETE < best.misfit < REACHED:
            break
        plant, left_by = best.plant, best.misfit
    assert best is not None
    return best


def _noise(plant: Plant, logs: Sequence[MotionLog], drive: Drive) -> Array | None:
    """Errors (draws, n) over all logs, which the noise of every signal alone makes of a run."""
    parts = []
    rng = np.random.default_rng(0)  # a quadrature: nothing random; every log has noise of its own
    for one in logs:
        found = freed(plant, one, drive, starts(one, drive))
        if found is None:
            return None
        draws = [noise_errors(plant, one, drive, found, rng) for _ in range(NOISE_DRAWS)]
        if any(r is None for r in draws):
            return None
        parts.append(np.array([soft(r.ravel()) for r in draws if r is not None]))
    return np.concatenate(parts, axis=1)


def _windows(logs: Sequence[MotionLog], drive: Drive) -> IntArray:
    """Number of the window of every sample over all logs, (n,)."""
    parts, count = [], 0
    for one in logs:
        begun = starts(one, drive)
        parts.append(window_of(begun, len(one.log)) + count)
        count += len(begun.at)
    return np.concatenate(parts)


def misfit(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, bristle: float = COARSE, *,
    every: bool = False,
) -> float:  # fmt: skip
    """What the free run leaves of that signal of that log which it follows worst.

    Robust mean square in units of the sensors' noise: 1 where noise alone is left; bristle [s]:
    longest sub-step of one. Where nothing brings the position back, a breakaway that the force only
    just reaches is a matter of luck and takes its window with it: the worst windows do not count,
    unless every one is to.
    """
    worst = 0.0
    free = loose(plant, drive) and not every
    for one in logs:
        least = CANNOT_BE_FOLLOWED  # a short window may begin badly, a long one lose a stop
        whole = drive == "command" and not walks(one, drive)
        for seconds in (RUN_WINDOW, WHOLE) if whole else (RUN_WINDOW,):
            begun = starts(one, drive, seconds, bristle)
            r = window_residual(plant, one, drive, freed(plant, one, drive, begun))
            if r is not None:
                window = window_of(begun, len(one.log)) if free else None
                moves = one.signals["d"] != 0
                least = min(least, max(mean_loss(own, window, moves) for own in r))
        worst = max(worst, least)
    return worst


def mean_loss(r: Array, window: IntArray | None = None, moves: BoolArray | None = None) -> float:
    """Robust mean square of errors (n,), 1 for noise; window (n,): numbers of the stretches of
    which the worst do not count, of those in which the body moves (n,) at all, so many of them."""
    if window is None:
        return loss(r) / len(r) / NOISE_LOSS
    square = np.log1p((r / ROBUST_FROM) ** 2) * ROBUST_FROM**2 / NOISE_LOSS
    size = np.bincount(window)
    each = np.bincount(window, square) / np.maximum(size, 1)
    told = len(size) if moves is None else np.count_nonzero(np.bincount(window, moves))
    kept = np.argsort(each)[: max(1, len(size) - int(LUCKY_WINDOWS * told))]
    return float(np.average(each[kept], weights=size[kept]))


def plant_is_motor(plant: Plant) -> bool:
    """Whether a motor drives it, whose position nothing brings back."""
    return isinstance(plant.actuator, Motor)


def on_bristle(plant: Plant) -> bool:
    """Whether a bristle stands for sticking: its sub-steps make runs long, and err."""
    return any(acting.effect.place.elastic for acting in plant.effects)


def loose(plant: Plant, drive: Drive) -> bool:
    """Whether a force drives it and nothing brings its position back to the log's."""
    return drive == "force" or plant_is_motor(plant)
