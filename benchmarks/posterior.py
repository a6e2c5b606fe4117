"""The posterior of the nine: how long until it has converged, and how many likelihoods a second.

    python benchmarks/posterior.py [--seconds 40] [--drive command force] [--seed 3]

Table 1 of the paper at 1 kHz with its noise. A run with a warm kernel cache; times are of the wall,
then of the processor, likelihoods per second of the latter.
"""

import argparse
import time

import numpy as np

from identification.estimation.fit import fit_plant
from identification.estimation.posterior import sample_posterior
from identification.log import Rig
from tests.identification.plants import made_log, table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=40.0)
    parser.add_argument("--drive", nargs="+", choices=("command", "force"), default=["command"])
    parser.add_argument("--seed", type=int, default=3)
    asked = parser.parse_args()
    rig, rng = Rig("force"), np.random.default_rng
    for seconds, timed in ((3.0, False), (asked.seconds, True)):  # the first fills the cache
        log = made_log(table(1), seed=asked.seed, seconds=seconds)
        for drive in asked.drive:
            fit = fit_plant([log], rng(1), rig=rig, drive=drive)
            begun, spent = time.perf_counter(), time.process_time()
            found = sample_posterior(fit, [log], rng(2), rig=rig)
            took, spent = time.perf_counter() - begun, time.process_time() - spent
            if timed:
                rate = found.evaluations / spent
                print(f"by {drive}: {took:.1f} s, {spent:.1f} s, {rate:.0f} likelihoods/s")
                print(f"  {found.verdict}")


if __name__ == "__main__":
    main()
