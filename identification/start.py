"""The state in which a log begins, from its first samples."""

import numpy as np

from identification.differentiate import spectrum
from identification.log import Log

SAMPLES = 30  # looked at, or 30 ms where that is more
SECONDS = 0.03
DEGREE = 3
FITS = 1.5  # times the noise that a cubic may leave
SURE = 3.0  # sigma of the velocity below which the body is taken to be at rest


def measured_start(log: Log) -> tuple[float, float, float]:
    """Position [m], velocity [m/s] and applied force [N] at the first sample.

    A cubic through the first samples; a velocity within its noise is rest. The force is 0 where
    the log has none.
    """
    noise = spectrum(log["y"], log.h).noise
    longest = min(len(log), max(SAMPLES, round(SECONDS / log.h)))
    for n in (longest, longest // 2, max(longest // 4, 2 * DEGREE)):
        t = np.arange(n) * log.h
        basis = np.vander(t / t[-1], DEGREE + 1, increasing=True)
        theta, _, _, _ = np.linalg.lstsq(basis, log["y"][:n], rcond=None)
        # A body that sets off at once is no cubic for long: look at less of it.
        if np.std(log["y"][:n] - basis @ theta) <= FITS * noise:
            break
    v_noise = noise * float(np.sqrt(np.linalg.inv(basis.T @ basis)[1, 1])) / t[-1]
    v = float(theta[1] / t[-1])
    force = float(log["F"][0]) if "F" in log else 0.0
    return float(theta[0]), v if abs(v) > SURE * v_noise else 0.0, force
