"""Joint refinement of a plant with effects on its free run, from estimates already close.

The regression gives mass, sliding friction and effects; band and stick limits show only in how
the body starts and stops. All are refined together on the position (and force, where the command
drives) in windows, with the regression's estimates as a prior. No global search is needed.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from identification.arrays import Array, IntArray
from identification.estimation.gauss_newton import (
    FINE_STEP,
    ROUGH_STEP,
    Minimum,
    gauss_newton,
)
from identification.estimation.regression.equation_rows import FIVE, MotionLog
from identification.estimation.regression.motion_log import shortened
from identification.estimation.windowed_run.parameters import (
    AT_ZERO,
    even,
    names_of,
    on_bristle,
    plant_with,
    that_sticks,
    units_in,
    values_of,
)
from identification.estimation.windowed_run.run_errors import (
    ROBUST_FROM,
    judge,
    misfit,
    soft,
)
from identification.estimation.windowed_run.stick_search import PIECE, SHORT_WINDOW, start_band
from identification.estimation.windowed_run.windows import (
    RUN_WINDOW,
    freed,
    longest_window,
    noise_errors,
    starts,
    window_of,
)
from identification.model.estimates import Drive
from identification.model.plant import Plant
from identification.progress import Halted
from identification.thresholds import ADEQUATE, COMPLETE, HOPELESS

# Of `descended`: windows [s] in which hardly a stop is lost first, samples that each has at least,
# how often each is gone through, since what a plant loses by chance is judged by the plant; errors
# count in full within so many deviations
GROWING_WINDOWS, FEWEST_IN_WINDOW = (0.1, 0.3, 1.0, RUN_WINDOW), 20
GONE_THROUGH, IN_FULL_WITHIN = 2, 10.0
PASSING = 0.03  # share of the cost, below which a step of an approach is the last
# At most, of a refinement, of one on a bristle and of a quick one
REFIT_STEPS, BRISTLE_STEPS, QUICK_STEPS = 12, 10, 4
NOISE_DRAWS = 60  # of every signal's noise, from which the parameters' deviations follow
FARTHEST = 300.0  # the same, at most, while much is far off
FIRST_SHARE, HALF_SHARE = 0.9, 0.5  # share of the residuals that then count in full
OFF_BOUND = 1e-3  # of the most that a term of sliding could be, where its effect on a run is taken
TRUST = 3.0  # times its standard deviation that the regression is trusted as a prior


@dataclass(frozen=True, eq=False)
class Refit:
    """The plant refined and its misfit.

    names (d,): parameters that were free; prior: their deviations from the regression, where they
    have one; spread: gives `covariance` (d, d), which takes many runs; whole: whether it is
    followed as long as a run by the command may be, and not from one window to the next.
    """

    plant: Plant
    misfit: float
    names: tuple[str, ...]
    prior: Mapping[str, float]
    spread: Callable[[], Array]
    whole: bool = False

    @cached_property
    def covariance(self) -> Array:
        """Of the errors of `names`, (d, d): `README.md`, (8) to (10) (Liang, Zeger 1986)."""
        return self.spread()

    @cached_property
    def sd(self) -> dict[str, float]:
        """Standard deviations by name (effects as key.name)."""
        deviations = np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).tolist()
        least = self.prior if self.misfit > ADEQUATE else {}
        return {n: max(s, least.get(n, 0.0)) for n, s in zip(self.names, deviations, strict=True)}


class HaltedRefit(Halted):
    """A refinement that was halted, at the plant that it had come to."""

    def __init__(self, plant: Plant) -> None:
        super().__init__()
        self.plant = plant


Effort = Literal["quick", "near", "rough", "whole", "long"]


@dataclass(frozen=True, eq=False)
class _Unknowns:
    """A plant's parameters as the unknowns of a refinement, in units of their sizes.

    names, x0, unit (k,): all of them; at (d,): those that are free; trust (k,): the regression's
    deviations; steps: at most, of one minimum; little: share of the cost below which a step is the
    last; sticks: stick limits are no less than a body can have; reached: the last minimum (d,).
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
    sticks: bool = True
    reached: list[Array] = field(default_factory=list)

    @classmethod
    def of(
        cls, plant: Plant, logs: Sequence[MotionLog], drive: Drive, prior: Mapping[str, float],
        steps: int, little: float,
    ) -> "_Unknowns":  # fmt: skip
        """The parameters that `prior` leaves open: a shape at its bound is fixed."""
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
        found = plant_with(self.plant, self.names, self.full(x))
        return that_sticks(found) if self.sticks else found

    def off_bounds(self, found: Minimum) -> tuple[Minimum, Array]:
        """A minimum with each term of sliding friction that lies at its bound 0 moved off it, by
        less than a run shows, and the units (d,) of its unknowns.

        At a bound a run changes to one side alone, or not at all, and least squares would take for
        exact what is only bounded, and what goes with it for better known than it is. Ours.
        """
        least = values_of(self.plant_at(found.x), self.names)[self.at]
        size, x = self.unit[self.at].copy(), found.x.copy()
        for i, k in enumerate(self.at):
            if self.names[k] in FIVE[1:] and least[i] <= AT_ZERO:
                size[i] = self.largest(self.names[k])
                x[i] = OFF_BOUND
        ratio = size / self.unit[self.at]
        x = np.where(x == found.x, found.x / ratio, x)
        return Minimum(lambda at: found.fun(at * ratio), x, found.mean), size

    def largest(self, name: str) -> float:
        """Size that a term of sliding friction would have, as all of the friction that there is."""
        p = self.plant.friction
        force = max(p.F_cp, p.F_cn, p.F_sp, -p.F_sn)
        speed = max(float(np.max(np.abs(one.signals["v"]))) for one in self.logs)
        return force / speed if name.startswith("F_v") else force

    def misfit(self, x: Array) -> float:
        """What the free run of the unknowns (d,) leaves."""
        return misfit(self.plant_at(x), self.logs, self.drive)

    def refined(self, x: Array, seconds: float, tie: bool, part: float = 0.0) -> Minimum:
        """The nearest minimum over windows of so many seconds; tie: the regression is the prior."""
        now = self.plant_at(x)
        errors_of = judge(now, self.logs, self.drive, seconds)
        # While most is far off, what is far off must still pull.
        far = float(np.clip(np.quantile(np.abs(errors_of(now)), part), ROBUST_FROM, FARTHEST))
        tied = np.flatnonzero(np.isfinite(self.trust) & (self.trust > 0))

        def bent(at: Array) -> Array:
            r = soft(errors_of(self.plant_at(at)), far)
            pull = (self.full(at)[tied] - self.x0[tied]) / (TRUST * self.trust[tied])
            return np.concatenate([r, pull]) if tie else np.asarray(r)

        found = gauss_newton(bent, x, self.steps, little=self.little)
        self.reached[:] = [found.x]
        return found

    def descended(self, x: Array, seconds: float) -> Array:
        """Where no damping leads further down over windows of so many seconds."""
        errors_of = judge(self.plant_at(x), self.logs, self.drive, seconds)
        found = gauss_newton(
            lambda at: soft(errors_of(self.plant_at(at)), IN_FULL_WITHIN), x,
            step_by=ROUGH_STEP, little=self.little, rough=True,
        )  # fmt: skip
        return found.x


def refit(
    plant: Plant, logs: Sequence[MotionLog], drive: Drive, *, prior: dict[str, float],
    band: float = 0.0, effort: Effort = "whole",
) -> Refit:  # fmt: skip
    """All parameters refined together.

    band [m/s]: about the speed below which sliding friction does not hold; prior: standard
    deviations from the regression by name (others are free); effort: "quick" takes a few
    steps from the plant as it is, "near" goes on from there, "long" to the end over whole runs, if
    these are followed, "rough" searches the band first and goes on while much is gained, "whole" as
    long as anything is. Sources: multiple shooting, Bock (1983); Levenberg (1944), Marquardt
    (1963); Cauchy's weights, Holland, Welsch (1977); covariance, Liang, Zeger (1986): `README.md`,
    (5), (8) to (10).
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
        at, found, whole = _minimum(unknowns, effort)
    except Halted:
        if not unknowns.reached:
            raise
        raise HaltedRefit(unknowns.plant_at(unknowns.reached[0])) from None

    def spread() -> Array:
        inside, size = unknowns.off_bounds(at)
        # Where what is left is no noise, a window counts as one sample.
        factor = RUN_WINDOW / logs[0].log.h if found > ADEQUATE else 1.0
        drifts, noise = any(one.has_random_walk(drive) for one in logs), None
        if drifts and found <= COMPLETE:
            noise = _noise(unknowns.plant_at(at.x), logs, drive)
        cluster = _windows(logs, drive) if drifts else None
        alike = None if drifts else counts(logs, drive)
        return factor * inside.covariance(cluster, noise, alike) * np.outer(size, size)

    names = tuple(unknowns.names[i] for i in unknowns.at)
    return Refit(unknowns.plant_at(at.x), found, names, dict(prior), spread, whole)


def _minimum(unknowns: _Unknowns, effort: Effort) -> tuple[Minimum, float, bool]:
    """The minimum that a refinement of this effort ends in, its misfit, and whether it is one of
    runs as long as the command's can be followed."""
    plant, logs, drive = unknowns.plant, unknowns.logs, unknowns.drive
    quick = effort == "quick"
    at = _approached(unknowns, effort)
    # Free of the regression where the model follows: elsewhere what it lacks would bias what the
    # equations give.
    if not (quick or (effort == "rough" and at.mean > HOPELESS)):
        again = unknowns.refined(at.x, RUN_WINDOW, False)
        at = again if again.followed else at
    at, found = _ended(unknowns, at, quick)
    longest = longest_window(plant, logs, drive)
    if effort == "long" and longest > RUN_WINDOW and found <= ADEQUATE:
        return _over_long_runs(unknowns, at, found, longest)
    return at, found, False


def _over_long_runs(
    unknowns: _Unknowns, at: Minimum, found: float, longest: float
) -> tuple[Minimum, float, bool]:
    """The minimum over runs so long [s], where these are followed down to the noise.

    While a stop comes late, what is far off must pull: so by plain least squares first.
    """
    errors_of = judge(unknowns.plant_at(at.x), unknowns.logs, unknowns.drive, longest)
    plain = gauss_newton(
        lambda x: errors_of(unknowns.plant_at(x)), at.x, step_by=ROUGH_STEP, rough=True
    )
    whole = gauss_newton(
        lambda x: soft(errors_of(unknowns.plant_at(x))), plain.x, step_by=ROUGH_STEP, rough=True
    )
    left_by = unknowns.misfit(whole.x)
    if whole.followed and left_by <= max(found, COMPLETE):
        return whole, left_by, True
    return at, found, False


def _approached(unknowns: _Unknowns, effort: Effort) -> Minimum:
    """The minimum with the regression as prior, approached as the effort says."""
    x = unknowns.start
    if effort in ("rough", "whole"):
        x = unknowns.refined(x, SHORT_WINDOW, True, FIRST_SHARE).x
    return unknowns.refined(x, RUN_WINDOW, True, HALF_SHARE)


def _ended(unknowns: _Unknowns, at: Minimum, quick: bool) -> tuple[Minimum, float]:
    """The minimum itself and its misfit."""
    found = unknowns.misfit(at.x)
    if quick or not at.followed:
        return at, found
    finer = gauss_newton(at.fun, at.x, unknowns.steps, FINE_STEP)
    left_by = unknowns.misfit(finer.x)
    return (finer, left_by) if left_by < max(found, COMPLETE) else (at, found)


def descended(plant: Plant, logs: Sequence[MotionLog], drive: Drive) -> Refit:
    """The plant refined from far off, through windows that grow, with directions that may be
    unequal. Ours: `README.md`, (7)."""
    fixed = {name: 0.0 for name in even(plant) if not name.endswith("asymmetry")}
    part = [shortened(one, PIECE) for one in logs]
    unknowns = replace(
        _Unknowns.of(plant, part, drive, fixed, REFIT_STEPS, PASSING), sticks=on_bristle(plant)
    )
    x, shortest = unknowns.start, FEWEST_IN_WINDOW * max(one.log.h for one in logs)
    try:
        for seconds in GROWING_WINDOWS:
            for _ in range(GONE_THROUGH):
                x = unknowns.descended(x, max(seconds, shortest))
        return refit(unknowns.plant_at(x), logs, drive, prior=fixed, effort="near")
    except Halted:
        raise HaltedRefit(unknowns.plant_at(x)) from None


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


def counts(logs: Sequence[MotionLog], drive: Drive) -> IntArray:
    """Numbers of the errors over all logs, (n,), the same of those that are one: of a position
    while it stands on one count of its encoder."""
    parts, count = [], 0
    for one in logs:
        n = len(one.log)
        y = np.cumsum(np.diff(np.asarray(one.log["y"]), prepend=np.nan) != 0.0)
        others = np.arange(0 if one.is_forced(drive) else n) + y[-1] + 1
        parts.append(np.concatenate([y, others]) + count)
        count = int(parts[-1][-1]) + 1
    return np.concatenate(parts)


def _windows(logs: Sequence[MotionLog], drive: Drive) -> IntArray:
    """Number of the window of every sample over all logs, (n,)."""
    parts, count = [], 0
    for one in logs:
        begun = starts(one, drive)
        parts.append(window_of(begun, len(one.log)) + count)
        count += len(begun.at)
    return np.concatenate(parts)
