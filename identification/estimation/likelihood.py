"""The likelihood by which a fit has converged, with its noise and bounds, for sampling around it.

The same ways as of the fit. The run in windows, the longest of them whole runs: a window begins in
a measured state of normal, known uncertainty, with which the run changes about linearly: so the
states are integrated out, r'(I + B B')^-1 r for residuals r and their changes B. Under prescribed
motion the rows of the force equation. Priors are flat.

A measured force drives a run with its noise, which turns on stops and drifts: no density of all
samples at once is to be had then. What is left is a likelihood of each by itself, with the weights
of the estimator. Such a one is far too narrow; here it counts for less and is stretched about
its maximum, so that there it is as wide as draws of the noise move the estimator (Ribatet, Cooley,
Davison, Statistica Sinica 22 (2012) 813, eqs. 2.8 and 2.10), and its maximum is laid on the fit,
whose sliding friction may be that of the prediction errors: the shape is that of the run's
likelihood, place and width are those of the fit and its errors.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.arrays import Array
from identification.errors import BadModel
from identification.estimation.converged_fit import between_samples_sd
from identification.estimation.gauss_newton import smooth_jacobian
from identification.estimation.prescribed_motion import force_fit
from identification.estimation.recorded_logs import RecordedLogs, recorded_logs
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.windowed_run.likely_square import LikelyLog
from identification.estimation.windowed_run.parameters import (
    even,
    kernel_rows,
    plant_with,
    units_in,
    values_of,
)
from identification.estimation.windowed_run.refinement import refit
from identification.estimation.windowed_run.run_errors import NOISE_LOSS
from identification.estimation.windowed_run.windows import (
    RUN_WINDOW,
    Freed,
    freed,
    longest_window,
    starts,
    window_errors,
    window_run,
)
from identification.log import Log, Rig
from identification.model.estimates import Drive, KarnoppFit
from identification.model.karnopp import NAMES
from identification.model.plant import Plant
from identification.simulation.karnopp_lanes import WIDTH
from identification.thresholds import ADEQUATE

WHOLE_RUNS = "the run over the whole of each log"
IN_WINDOWS = "the run in windows from measured states"
BY_FORCE = "the force equation"
# Of the robust square, for normal noise: the mean curvature of its half, and how much narrower than
# the errors of its minimum it is itself (curvature over mean square slope), which is made up for.
CURVATURE, AS_NOISE = 0.7761, 1.2523
REACH = 5.0  # times its value, and the largest force of friction, how far a parameter may lie
LEAST_OF = 0.2  # of its value, that a mass, a band or an actuator's gain has at least
SCALES = ("m", "dv_p", "dv_n", "k1", "k2")


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Minus twice a log likelihood, of the parameters `names` (d,).

    center (d,), covariance (d, d): where it is largest, and how wide about there. cost: members
    (k, d) to (k,), infinite outside the bounds. further (d,): deviations of what the likelihood
    cannot hold, the force between its samples. way: on what it is, in words.
    """

    names: tuple[str, ...]
    center: Array
    covariance: Array
    cost: Callable[[Array], Array]
    further: Array
    way: str


def likelihood_of(fit: KarnoppFit, logs: Sequence[Log], rig: Rig) -> Likelihood:
    """The likelihood of a fit's parameters on the logs that it was made from.

    Raises BadLog where the logs lack a signal, NotIdentifiable where nothing moves. Source:
    `LikelyWindows`, Ribatet, Cooley, Davison (2012).
    """
    recorded = recorded_logs(logs, rig, fit.drive)
    if fit.prescribed:
        return _by_force(recorded)
    if recorded.by_motor and not fit.noise_F:
        recorded = recorded.with_exact_force()
    plant = Plant(fit.friction, fit.actuator, fit.effects)
    return _over_windows(fit, plant, recorded)


def _over_windows(fit: KarnoppFit, plant: Plant, recorded: RecordedLogs) -> Likelihood:
    """Windows of any plant; the fit's own parameters, of which some may be fixed."""
    covariance = np.atleast_2d(fit.covariance)
    logs, drive = recorded.logs, recorded.drive
    seconds = longest_window(plant, logs, drive) if fit.whole else RUN_WINDOW
    own, center = plant, values_of(plant, fit.free)
    if any(one.has_random_walk(drive) for one in logs):
        own = refit(plant, logs, drive, prior=even(plant), effort="near").plant
    windows = LikelyWindows.of(own, logs, drive, fit.free, covariance, seconds, center)
    further = between_samples_sd(fit.free, center, recorded)
    if windows.stretch is not None:  # which has that in it already
        further = np.zeros(len(center))
    way = WHOLE_RUNS if fit.whole else IN_WINDOWS
    return Likelihood(fit.free, center, covariance, windows.cost, further, way)


def _by_force(recorded: RecordedLogs) -> Likelihood:
    """The rows of the force equation: linear in its parameters, so it is normal but for signs."""
    found, _ = force_fit(recorded)
    information = np.linalg.pinv(found.covariance, hermitian=True)

    def cost(members: Array) -> Array:
        off = members - found.theta
        square = np.einsum("ki,ij,kj->k", off, information, off)
        return np.where(np.all(members >= 0.0, axis=1), square, np.inf)

    names = tuple(NAMES[i] for i in found.used)
    center = np.maximum(found.theta, 0.0)
    return Likelihood(names, center, found.covariance, cost, np.zeros(len(names)), BY_FORCE)


@dataclass(frozen=True, eq=False)
class LikelyWindows:
    """Logs in windows, as a likelihood of parameters `names` (d,) of a plant like this one.

    found: by log, how its run changes with the windows' states; low, high (d,): bounds; center
    (d,): the plant's own values; stretch (d, d): of what is off the fit (d,), in cost; factor: of
    the robust square sum; granted: independent samples for which a residual that is no noise
    counts, 0 where it is noise.
    """

    plant: Plant
    drive: Drive
    names: tuple[str, ...]
    logs: tuple[MotionLog, ...]
    found: tuple[Freed, ...]
    low: Array
    high: Array
    stretch: Array | None = None
    fit: Array | None = None
    factor: float = 1.0
    granted: float = 0.0

    @classmethod
    def of(
        cls, plant: Plant, logs: Sequence[MotionLog], drive: Drive, names: Sequence[str],
        covariance: Array, seconds: float, fit: Array | None = None,
    ) -> "LikelyWindows":  # fmt: skip
        """The logs in the windows of so many seconds in which the plant's run has converged.

        covariance (d, d): of the fit's errors; fit (d,): its values, by default the plant's own.
        Raises BadModel where the plant cannot be followed. Source: composite likelihood, Ribatet,
        Cooley, Davison, Statistica Sinica 22 (2012) 813.
        """
        found = [freed(plant, one, drive, starts(one, drive, seconds)) for one in logs]
        own = tuple(one for one in found if one is not None)
        if len(own) < len(logs):
            raise BadModel(f"{logs[0].log.name}: the fitted plant's run cannot be followed")
        posed = cls(plant, drive, tuple(names), tuple(logs), own, *_bounds(plant, names))
        if any(one.has_random_walk(drive) for one in logs):
            factor, stretch = posed.stretched(covariance)
            return replace(posed, factor=factor, stretch=stretch, fit=fit)
        left = float(posed.squares(posed.center[np.newaxis])[0]) / posed.count / NOISE_LOSS
        if left <= ADEQUATE:
            return replace(posed, factor=AS_NOISE / left)
        # What the model lacks is correlated over a window.
        return replace(posed, granted=float(sum(len(one.begun.at) for one in own)))

    @property
    def count(self) -> int:
        """Number of compared values."""
        return sum(one.weight.size for one in self.found)

    @property
    def center(self) -> Array:
        """The plant's own values (d,)."""
        return values_of(self.plant, self.names)

    @cached_property
    def likely(self) -> tuple[LikelyLog, ...]:
        """The logs as the kernel of the likelihood takes them."""
        pairs = zip(self.logs, self.found, strict=True)
        return tuple(LikelyLog.of(self.plant, one, self.drive, own) for one, own in pairs)

    def cost(self, members: Array) -> Array:
        """Minus twice the log likelihood of members (k, d), (k,); infinite outside the bounds.

        Normal states integrated out, Ribatet et al. (2012) for the stretch; `README.md`, (5).
        """
        inside = np.all((members >= self.low) & (members <= self.high), axis=1)
        at = members
        if self.stretch is not None:
            fit = self.center if self.fit is None else self.fit
            at = self.center + (members - fit) @ self.stretch.T
            inside &= np.all((at >= self.low) & (at <= self.high), axis=1)
        out = np.full(len(members), np.inf)
        out[inside] = self.squares(at[inside])
        return self.granted * np.log(out / self.count) if self.granted else self.factor * out

    def squares(self, members: Array) -> Array:
        """Robust square sums (k,) of what plants with the values (k, d), inside the bounds, leave;
        infinite of one that cannot be followed.

        All at once: walkers take the same windows, and differ in their plants alone.
        """
        total = np.zeros(len(members))
        for one, own, likely in zip(self.logs, self.found, self.likely, strict=True):
            one.halt.ask()
            if not self.plant.effects:
                rows = kernel_rows(self.plant, self.names, self.drive, members)
                total += likely.simulated(rows)
                continue
            for low in range(0, len(members), WIDTH):
                some = members[low : low + WIDTH]
                total[low : low + WIDTH] += likely.shown(self._runs(some, one, own))[: len(some)]
        return total

    def _runs(self, members: Array, one: MotionLog, own: Freed) -> Array:
        """Runs (n, 2, WIDTH) of plants with effects, positions shown and forces; NaN: lost."""
        out = np.zeros((len(one.log), 2, WIDTH))
        for i, x in enumerate(members):
            tried = plant_with(self.plant, self.names, x)
            run = window_run(tried, one, self.drive, own.begun)
            out[:, :, i] = np.nan if run is None else np.transpose([run.shown, run.F])
        return out

    def stretched(self, covariance: Array) -> tuple[float, Array]:
        """Factor of the cost, and matrix (d, d) by which what is off the center is stretched, so
        that the cost there curves as the inverse of the covariance (d, d).

        The factor makes it as wide on the whole, the matrix in each direction: a cost that is only
        stretched keeps its steps where stops come and go, in which walkers are caught. Source:
        Ribatet, Cooley, Davison (2012), eqs. 2.8 and 2.10.
        """
        unit = np.maximum(np.sqrt(np.diag(covariance)), 1e-300)
        size = units_in(self.plant, self.names, self.center)

        def errors(x: Array) -> Array:
            tried = plant_with(self.plant, self.names, x * size)
            return np.concatenate([
                self._left(tried, one, own) for one, own in zip(self.logs, self.found, strict=True)
            ])  # fmt: skip

        J = smooth_jacobian(errors, self.center / size) * (unit / size)
        curvature = CURVATURE * J.T @ J
        wanted = np.linalg.inv(covariance / np.outer(unit, unit))
        larger = np.linalg.slogdet(wanted)[1] - np.linalg.slogdet(curvature)[1]
        factor = float(min(np.exp(larger / len(unit)), 1.0))
        stretch = np.linalg.inv(_root(factor * curvature)) @ _root(wanted)
        return factor, np.asarray(stretch * unit[:, np.newaxis] / unit)

    def _left(self, plant: Plant, one: MotionLog, own: Freed) -> Array:
        run = window_run(plant, one, self.drive, own.begun)
        if run is None:
            return np.zeros(own.weight.size)
        return own(window_errors(run, one, self.drive)).ravel()


def _root(square: Array) -> Array:
    """Symmetric root (d, d) of a matrix, of which nothing counts as less than a 1e-12 of most."""
    values, vectors = np.linalg.eigh(0.5 * (square + square.T))
    values = np.maximum(values, 1e-12 * float(values[-1]))
    return np.asarray((vectors * np.sqrt(values)) @ vectors.T)


def _bounds(plant: Plant, names: Sequence[str]) -> tuple[Array, Array]:
    """Where the parameters may lie, low and high (d,): a refinement's reach of the nine and the
    actuator's, and an effect's own bounds, as the search for its shape has them."""
    values = values_of(plant, names)
    p = plant.friction
    force = max(p.F_cp, p.F_cn, p.F_sp, -p.F_sn)
    low, high = np.empty(len(names)), np.empty(len(names))
    ends = [values_of(plant_with(plant, names, side * np.full(len(names), 1e300)), names)
            for side in (-1.0, 1.0)]  # fmt: skip
    for i, name in enumerate(names):
        low[i], high[i] = ends[0][i], ends[1][i]
        if "." in name:
            continue
        size, sign = abs(values[i]), -1.0 if values[i] < 0 else 1.0
        most = REACH * size + (0.0 if name in SCALES else REACH * force)
        least = LEAST_OF * size if name in SCALES else 0.0
        near, far = sorted((sign * least, sign * most))
        low[i], high[i] = max(near, low[i]), min(far, high[i])
    return low, high
