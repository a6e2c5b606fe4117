"""The state in which a log begins, from its first samples."""

import numpy as np

from identification.log import Log
from identification.signals.differentiate import spectrum

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
    noise = spectrum(log["y"], log.h).noise
    longest = min(len(log), max(START_SAMPLES, round(START_SECONDS / log.h)))
    for n in (longest, longest // 2, max(longest // 4, 2 * START_DEGREE)):
        t = np.arange(n) * log.h
        basis = np.vander(t / t[-1], START_DEGREE + 1, increasing=True)
        theta, _, _, _ = np.linalg.lstsq(basis, log["y"][:n], rcond=None)
        # A body that sets off at once is no cubic for long: look at less of it.
        if np.std(log["y"][:n] - basis @ theta) <= START_FITS * noise:
            break
    v_noise = noise * float(np.sqrt(np.linalg.inv(basis.T @ basis)[1, 1])) / t[-1]
    v = float(theta[1] / t[-1])
    force = float(log["F"][0]) if "F" in log else 0.0
    return float(theta[0]), v if abs(v) > AT_REST_BELOW * v_noise else 0.0, force
