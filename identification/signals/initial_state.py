"""The state of a body at a sample of its log, from the samples about it."""

import numpy as np

from identification.arrays import Array, IntArray
from identification.log import Log
from identification.signals.clock_jitter import position_noise
from identification.signals.differentiate import differentiate

START_SAMPLES = 30  # looked at, or 30 ms where that is more
START_SECONDS = 0.03
START_DEGREE = 3
START_FITS = 1.5  # times the noise that a cubic may leave
AT_REST_BELOW = 3.0  # sigma of the velocity below which the body is taken to be at rest


def measured_start(log: Log) -> tuple[float, float, float]:
    """Position [m], velocity [m/s] and applied force [N] at the first sample.

    A cubic through the first samples; a velocity within its noise is rest. The force is 0 where
    the log has none.
    """
    y, v = measured_states(log, np.zeros(1, dtype=np.int64))
    return float(y[0]), float(v[0]), float(log["F"][0]) if "F" in log else 0.0


def measured_states(log: Log, at: IntArray) -> tuple[Array, Array]:
    """Position [m] and velocity [m/s] at these samples (k,), each by a cubic through those about
    it; a velocity within its noise is rest."""
    y, h = np.asarray(log["y"]), log.h
    motion = differentiate(y, h)
    unsteady = position_noise(y, motion.v)
    noise = np.full(len(y), motion.noise)
    if unsteady is not None:  # of a clock that jitters, the more the faster the body is
        noise = np.hypot(unsteady.at_rest, unsteady.jitter * motion.v)
    found = [_state(y, h, int(i), noise) for i in at]
    return np.array([y for y, _ in found]), np.array([v for _, v in found])


def _state(y: Array, h: float, at: int, noise: Array) -> tuple[float, float]:
    """Position and velocity at a sample; noise (n,): one sigma of the position at each."""
    longest = min(len(y), max(START_SAMPLES, round(START_SECONDS / h)))
    for n in (longest, longest // 2, max(longest // 4, 2 * START_DEGREE)):
        first = min(max(at - n // 2, 0), len(y) - n)
        part, end = y[first : first + n], (n - 1) * h
        basis = np.vander(
            (np.arange(n) - (at - first)) * h / end, START_DEGREE + 1, increasing=True
        )
        theta, _, _, _ = np.linalg.lstsq(basis, part, rcond=None)
        # A body that sets off at once is no cubic for long: look at less of it.
        sigma = float(np.sqrt(np.mean(noise[first : first + n] ** 2)))
        if np.std(part - basis @ theta) <= START_FITS * sigma:
            break
    v = float(theta[1] / end)
    v_noise = sigma * float(np.sqrt(np.linalg.inv(basis.T @ basis)[1, 1])) / end
    return float(theta[0]), v if abs(v) > AT_REST_BELOW * v_noise else 0.0
