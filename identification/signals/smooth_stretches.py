"""A noisy signal averaged where it is smooth: over stretches as long as it stays a parabola."""

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import savgol_filter

from identification.arrays import Array

HALF_STRETCHES = (4, 8, 16, 32)  # samples to either side, over which a parabola is laid
BY_NOISE = 2.0  # deviations, by which the square that one leaves may be more than the noise's


def smooth_stretches(x: Array, noise: float) -> Array:
    """The signal (n,), each sample by the parabola over the longest stretch about it that leaves no
    more than white noise of this deviation; where none does, as it was measured.

    What is below the stretches' own frequencies stays as it is. Sources: parabolas, Savitzky,
    Golay, Anal. Chem. 36 (1964) 1627; the longest that noise allows, Goldenshluger, Nemirovski,
    Math. Methods Stat. 6 (1997) 135.
    """
    out = np.array(x, dtype=np.float64)
    for half in HALF_STRETCHES if noise > 0.0 else ():
        length = 2 * half + 1
        if len(out) < length:
            break
        fitted = savgol_filter(x, length, 2)
        free = length - 3
        left = uniform_filter1d((x - fitted) ** 2, length) * length / free
        smooth = left <= noise**2 * (1.0 + BY_NOISE * np.sqrt(2.0 / free))
        out[smooth] = fitted[smooth]
    return out
