"""The force that a model lacks, over time, with its band: what moves the body beside model and log.

The body under its measured force F, its modelled friction f and a force d that no model has:

    m dv/dt = F(t) - f(y, v, t) - F_v v + d,   dd/dt = -d/tau + noise,   rms(d) = sigma          (1)

Along the measured motion f is known, so y, v, d are a linear Gaussian chain of which y is measured
(`signals/kalman`): d is smoothed, with its standard deviation, and what is left of y is white.
Where the body rests, or its direction is not significant, friction takes whatever is applied: no
force is seen there, and the band is as wide as d may be. Where a rig prescribes the motion the
force is measured instead, and d is what it leaves of the equation. sigma and tau are those of
largest likelihood, and so is the white noise of what is measured and of the force over a sample,
where it is more than the log shows of it by itself: a clock that jitters, or a drive that filters
what it reports, makes errors from sample to sample that are no force, and a loop that is faster
than the log a force between the samples that none of them has. Sources: latent force models,
Alvarez, Luengo, Lawrence, IEEE TPAMI 35 (2013) 2693; Sarkka, Solin, Applied Stochastic Differential
Equations (2019), ch. 10, 12; of bodies with friction, Marino, Cicirello, arXiv 2303.03858.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.optimize import brentq, minimize_scalar

from identification.arrays import Array, BoolArray
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.motion_log import again
from identification.log import Log
from identification.model.plant import Plant
from identification.signals.kalman import Chain, N, innovations, log_densities, smoothed
from identification.simulation.inverse_dynamics import (
    Along,
    force_along,
    of_body,
    opposing_force,
    with_motor_force,
)
from identification.thresholds import AS_GOOD_AS_NONE

MEMORIES = (0.02, 0.06, 0.2, 0.6, 2.0, 6.0)  # s, that tau may be
FEWEST_IN_MEMORY = 5  # samples of tau, below which d would pass for the sensor's noise
LEAST_SIGMA, MOST_SIGMA = 1e-6, 10.0  # of the largest force, that sigma may be
LEAST_NOISE_F = 1e-6  # of the largest force, to which any force is uncertain
SHARE_OF_WINDOW = 4  # of a weak window's length, over which the motion's smoothing reaches
CLOSE_ENOUGH = 0.02  # of log sigma
WHITE_NOISES = (1.5, 3.0, 6.0, 15.0, 40.0, 120.0)  # times the noise, that either may be
SIGMA_SHARES = (1.0, 0.1, 1e-3)  # of sigma, that may be left beside more white noise
WHITE_GAINS = 5.0  # nats, by which more noise has to be the likelier
NATS_95 = 1.353  # nats below the largest likelihood: one-sided 95 % of chi-square over two
FORCE, VELOCITY = 2, 1  # states beside the position


class Rougher(NamedTuple):
    """Times the noise that the logs show: the standard deviation of what is measured, and of the
    force over a sample."""

    measured: float = 1.0
    force: float = 1.0


@dataclass(frozen=True, eq=False)
class LatentForce:
    """The force on a log's body that a model lacks, towards +y.

    t [s], y [m], force, sd [N], slides (where the log is informative), each (n,); log_density (n,):
    of each measured sample given those before it, 0 where it is not tested.
    """

    t: Array
    y: Array
    force: Array
    sd: Array
    slides: BoolArray
    log_density: Array


@dataclass(frozen=True, eq=False)
class LatentForces:
    """The latent forces of several logs under one sigma [N] and one memory tau [s].

    most [N]: the largest sigma that these logs do not rule out (95 %); rougher: the white noise.
    """

    sigma: float
    tau: float
    most: float
    rougher: Rougher
    logs: tuple[LatentForce, ...]

    @property
    def rms(self) -> float:
        """Expected root mean square force while the bodies slide [N]; 0 where none does."""
        return float(np.sqrt(sum(self._squares)))

    @property
    def is_a_bound(self) -> bool:
        """Whether more of that is the band's width than a force that shows."""
        seen, width = self._squares
        return width > seen

    @property
    def _squares(self) -> tuple[float, float]:
        """Mean squares of the force and of its deviation while the bodies slide [N^2]."""
        force, sd = (
            np.concatenate([getattr(one, name)[one.slides] for one in self.logs])
            for name in ("force", "sd")
        )
        return (float(np.mean(force**2)), float(np.mean(sd**2))) if len(force) else (0.0, 0.0)

    def share(self, level: float) -> float | None:
        """`rms` as a share of a Coulomb level [N], where it is a bound the most that these logs do
        not rule out; None where no body slides, or nothing rubs."""
        slides = any(np.any(one.slides) for one in self.logs)
        size = max(self.rms, self.most) if self.is_a_bound else self.rms
        return size / level if slides and rubs(level, self.rms) else None

    @property
    def log_likelihood(self) -> float:
        """Of all samples measured while the bodies slide [nats]."""
        return float(sum(np.sum(one.log_density) for one in self.logs))


def rubs(level: float, left: float) -> bool:
    """Whether a Coulomb level [N] is enough for what is left of the force to be a share of it."""
    return level > AS_GOOD_AS_NONE * left


class _Least(NamedTuple):
    """The least cost [nats], and where it is."""

    cost: float
    sigma: float
    tau: float
    rougher: Rougher


@dataclass(frozen=True, eq=False)
class _Known:
    """What a plant says of one log's chain, but for size and memory of d, its state `at`.

    z: what is measured, R: its variance, seen: where; slides, free: where d is estimated, and where
    the body may go anywhere, (n,) each.
    """

    one: MotionLog
    at: int
    z: Array
    R: Array
    seen: BoolArray
    slides: BoolArray
    free: BoolArray
    known: Chain

    def chain(self, sigma: float, tau: float, noise_F: float) -> Chain:
        """The chain under a latent force of rms sigma [N] and memory tau [s], and so many times the
        force's noise."""
        kept, at, of = float(np.exp(-self.one.log.h / tau)), self.at, self.known
        A, Q, A_free, Q_free, P0 = (x.copy() for x in (of.A, of.Q, of.A_free, of.Q_free, of.P0))
        A[at, at] = A_free[at, at] = kept
        Q *= noise_F**2
        Q[at, at] = Q_free[at, at] = sigma**2 * (1.0 - kept**2)
        P0[at] = sigma**2
        return Chain(A, Q, A_free, Q_free, of.c, of.x0, P0)

    def log_density(self, sigma: float, tau: float, rougher: Rougher) -> Array:
        """Of each sample measured while the body slides, given those before it, (n,)."""
        chain, R = self.chain(sigma, tau, rougher.force), self.R * rougher.measured**2
        found = log_densities(self.z, R, self.seen, self.free, chain)
        return np.where(self.slides, found, 0.0)

    def whitened(self, sigma: float, tau: float, rougher: Rougher) -> Array:
        """Error of each sample measured while the body slides, predicted from those before it, in
        its deviations, (n,)."""
        chain, R = self.chain(sigma, tau, rougher.force), self.R * rougher.measured**2
        e, S = innovations(self.z, R, self.seen, self.free, chain)
        return np.where(self.slides, e / np.sqrt(S), 0.0)

    def latent(self, sigma: float, tau: float, rougher: Rougher) -> LatentForce:
        """d of this log."""
        chain, R = self.chain(sigma, tau, rougher.force), self.R * rougher.measured**2
        force, sd = smoothed(self.z, R, self.seen, self.free, chain, self.at)
        t, y = (np.asarray(self.one.log[name]) for name in ("t", "y"))
        return LatentForce(t, y, force, sd, self.slides, self.log_density(sigma, tau, rougher))


def latent_forces(
    plant: Plant, logs: Sequence[MotionLog], slowest: float, rougher: Rougher | None = None
) -> LatentForces:
    """What a plant lacks on each of the logs, sigma and tau those of largest likelihood on them.

    slowest [m/s]: speed up to which friction is not that of sliding; rougher: that of the same
    logs, where a better plant has shown it. Equation (1); the bound by the likelihood ratio, Wilks,
    Ann. Math. Stat. 9 (1938) 60.
    """
    known = [_known(plant, one, slowest) for one in logs]
    scale = max(_largest(plant, one.log) for one in logs)
    shortest = FEWEST_IN_MEMORY * max(one.log.h for one in logs)
    memories = [tau for tau in MEMORIES if tau > shortest] or [shortest]
    bounds = float(np.log(LEAST_SIGMA * scale)), float(np.log(MOST_SIGMA * scale))

    def cost(sigma: float, tau: float, rougher: Rougher) -> float:
        return -float(sum(np.sum(one.log_density(sigma, tau, rougher)) for one in known))

    def least(tau: float, rougher: Rougher) -> _Least:
        """The sigma of largest likelihood at these."""
        found: Any = minimize_scalar(
            lambda x: cost(float(np.exp(x)), tau, rougher), bounds=bounds, method="bounded",
            options={"xatol": CLOSE_ENOUGH},
        )  # fmt: skip
        return _Least(float(found.fun), float(np.exp(found.x)), tau, rougher)

    with ThreadPoolExecutor(2) as pool:
        best = min(pool.map(lambda tau: least(tau, rougher or Rougher()), memories))
        if rougher is None:
            noises = [Rougher(x) for x in WHITE_NOISES]
            if not all(one.prescribed for one in logs):  # then the force is what is measured
                noises += [Rougher(force=x) for x in WHITE_NOISES]
            tried = [
                (share * best.sigma, best.tau, more) for more in noises for share in SIGMA_SHARES
            ]
            costs = list(pool.map(lambda at: cost(*at), tried))
            other = least(best.tau, tried[int(np.argmin(costs))][2])
            if other.cost < best.cost - WHITE_GAINS:
                best = min(pool.map(lambda tau: least(tau, other.rougher), memories))

    def beyond(x: float) -> float:
        return cost(float(np.exp(x)), best.tau, best.rougher) - best.cost - NATS_95

    low = float(np.log(best.sigma))
    out = beyond(low) < 0.0 < beyond(bounds[1])
    most = float(np.exp(brentq(beyond, low, bounds[1], xtol=CLOSE_ENOUGH) if out else bounds[1]))
    found = (one.latent(best.sigma, best.tau, best.rougher) for one in known)
    return LatentForces(best.sigma, best.tau, most, best.rougher, tuple(found))


def prediction_errors(
    plant: Plant, logs: Sequence[MotionLog], slowest: float, noise: LatentForces
) -> Array:
    """Errors with which each sample of the position that is measured while the bodies slide is
    predicted from those before it, under this latent force, in their deviations, (n,) over all
    logs: white where nothing else is missing. Source: Kalman (1960)."""
    for one in logs:
        one.halt.ask()
    known = [_known(plant, one, slowest) for one in logs]
    return np.concatenate([one.whitened(noise.sigma, noise.tau, noise.rougher) for one in known])


def _known(plant: Plant, one: MotionLog, slowest: float) -> _Known:
    """What the plant says of a log's chain."""
    log = of_body(with_motor_force(one.log, plant), plant)
    if log is not one.log:
        one = replace(again(one, log), noise=one.noise)
    y, v, a, d = (one.signals[name] for name in ("smooth", "v", "a", "d"))
    F, n, slides = np.asarray(log["F"]), len(log), _slides(one, slowest)
    p, viscous = plant.friction, 0.5 * (plant.friction.F_vp + plant.friction.F_vn)
    noise_F = max(one.noise.F, LEAST_NOISE_F * _largest(plant, log))
    if one.prescribed:
        left, none = force_along(log, F, plant, Along(y, v, a, d)) - F, np.zeros((N, N))
        known = Chain(none, none, none, none, np.zeros((n, N)), np.zeros(N), np.zeros(N))
        return _Known(one, 0, left, np.full(n, noise_F**2), slides, slides, ~slides, known)
    free = ~(slides & np.append(slides[1:], False))
    opposed = opposing_force(log, plant, y, v, d)
    force = (F if one.zoh else _over_sample(F)) - _over_sample(opposed)
    push, A = _pushed(p.m, viscous, log.h)
    c = np.where(free, 0.0, force)[:, np.newaxis] * push
    # Where its direction is open the body may go as any force of the log could send it.
    sent = np.array([0.5 * log.h, 1.0, 0.0]) * _largest(plant, log) * log.h / p.m
    A_free = np.array([[1.0, log.h, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    by_noise, by_any = (np.outer(x, x) for x in (noise_F * push, sent))
    R = one.position_sd**2
    at_first = np.array([R[0], n * by_any[VELOCITY, VELOCITY], 0.0])
    x0 = np.array([float(log["y"][0]), 0.0, 0.0])
    known = Chain(A, by_noise, A_free, by_any, c, x0, at_first)
    y_seen = np.ones_like(slides)
    return _Known(one, FORCE, np.asarray(log["y"]), R, y_seen, slides, free, known)


def _largest(plant: Plant, log: Log) -> float:
    """Largest force that may act on the body [N]: the log's beside friction's."""
    p = plant.friction
    return float(np.max(np.abs(log["F"]))) + max(p.F_cp, p.F_cn, p.F_sp, -p.F_sn, 1e-12)


def _slides(one: MotionLog, slowest: float) -> BoolArray:
    """Samples around which the body slides one way, as far as the velocity is smoothed, (n,)."""
    v = np.where(one.signals["d"] != 0, one.signals["v"], 0.0)
    around = 2 * (one.sliding.length // (2 * SHARE_OF_WINDOW)) + 1
    up, down = minimum_filter1d(v, around), maximum_filter1d(v, around)
    return np.asarray((up > slowest) | (down < -slowest))


def _over_sample(values: Array) -> Array:
    """Mean of each value and the next, (n,)."""
    return np.asarray(0.5 * (values + np.append(values[1:], values[-1:])))


def _pushed(m: float, viscous: float, h: float) -> tuple[Array, Array]:
    """What a force of 1 N over a step does to position, velocity and itself (3,), and the
    transition (3, 3) of the three: m dv/dt = F - viscous v, solved exactly."""
    rate = viscous / m
    coasted = h if rate == 0.0 else -float(np.expm1(-rate * h)) / rate
    # The difference h - coasted by its series where rounding would take it.
    slow = abs(rate * h) < 1e-4
    shift = 0.5 * h**2 / m * (1.0 - rate * h / 3.0) if slow else (h - coasted) / viscous
    push = np.array([shift, coasted / m, 0.0])
    A = np.array([[1.0, coasted, push[0]], [0.0, 1.0 - rate * coasted, push[1]], [0.0, 0.0, 1.0]])
    return push, A
