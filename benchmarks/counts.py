"""Is a position in counts seen as such, however it was printed? Is one with noise taken for one?

    python -m benchmarks.counts [--seeds 0 1] [--files 400]

Every file is a motion of random size, offset and length in counts of a random step: exact, in
float32, and in as few decimals as leave a fifth of a step; and the same motion with white noise in
place of counts. Seed 0 served to choose the tenth of a step and the 20 levels of `resolution`;
others judge. Exit status 0 in any case.
"""

import argparse
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array
from identification.signals.differentiate import resolution

RIGHT = 0.02  # of a step, by which a found one may be off a whole number of them
OF_A_STEP = 0.19  # that a decimal is at most


def motion(rng: np.random.Generator) -> Array:
    """Positions at 100 Hz, of 30 to 3000 samples."""
    t = 0.01 * np.arange(rng.integers(30, 3000))
    wave = rng.uniform(0.1, 10.0) * np.sin(rng.uniform(0.2, 5.0) * t + rng.uniform(0.0, 6.0))
    return np.asarray(wave + rng.uniform(0.0, 1.0) * t)


def is_seen(shown: NDArray[np.floating[Any]], step: float) -> bool:
    """Whether counts are seen, and their step, or a whole number of them, is found."""
    found = resolution(np.asarray(shown, dtype=np.float64)) / step
    return found > 0.0 and round(found) >= 1 and abs(found - round(found)) < RIGHT


def main() -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description="Counts of printed positions.")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--files", type=int, default=400)
    given = parser.parse_args()
    for seed in given.seeds:
        rng, false = np.random.default_rng(seed), 0
        missed = dict.fromkeys(("exact", "float32", "few"), 0)
        for _ in range(given.files):
            y = motion(rng)
            false += resolution(y + 1e-3 * rng.standard_normal(len(y))) > 0.0
            step = rng.uniform(1e-3, 0.05)
            counted = step * np.round(y / step)
            missed["exact"] += not is_seen(counted, step)
            missed["float32"] += not is_seen(counted.astype(np.float32), step)
            digits = int(np.ceil(-np.log10(OF_A_STEP * step)))
            missed["few"] += not is_seen(np.round(counted, digits), step)
        print(
            f"seed {seed}: of {given.files} files missed {missed['exact']} exact,"
            f" {missed['float32']} in float32, {missed['few']} in few decimals;"
            f" {false} with noise taken for counts"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
