"""The gate before a fit: what is said to be identifiable, and what the fit then gives.

    python benchmarks/gate.py [--first 1500] [--machines 500]

Every seed draws a machine (of `blind_machines`) and two logs of it: 6 s of a few moves under ten
times the usual noise, and 15 s of moves and multisines. `doctor`'s rules say of each parameter
whether the log can tell it, and within what; `fit_plant` then identifies the log. Wrong is a
parameter that is said to be identifiable and is null, or has an interval more than twice as wide as
promised. Missed: one that is said not to be identifiable, and is. Seeds below 1500 served to
choose.
"""

import argparse
from collections import Counter

import numpy as np

from benchmarks.blind_machines import random_machine, simulated
from benchmarks.experiment import poor_log
from design.identified.identifiable_by_log import identifiability_of_runs
from identification.errors import UserError
from identification.estimation.fit import fit_plant
from identification.log import Log, Rig
from identification.model.karnopp import NAMES

RICH = 15.0  # s
TWICE = 2.0


def judged(log: Log, rig: Rig, seed: int, count: Counter[str]) -> str:
    """Counts of one log's parameters; the wrong ones in words."""
    said = identifiability_of_runs([log], rig).identifiability
    fit = fit_plant([log], np.random.default_rng(seed), rig=rig)
    wrong = []
    for one in said:
        found = fit.estimates.get(one.name)
        if one.name not in NAMES or found is None:
            continue
        reported = found.value is not None and found.low is not None and found.high is not None
        if not one.can:
            count["missed"] += reported
            count["not said"] += 1
            continue
        count["said"] += 1
        if not reported:
            wrong.append(f"{one.name} null")
        elif one.within is not None:
            half = 0.5 * ((found.high or 0.0) - (found.low or 0.0)) / abs(found.value or 1.0)
            if half > TWICE * one.within:
                wrong.append(f"{one.name} {half:.2g} for {one.within:.2g}")
    count["wrong"] += len(wrong)
    count["logs"] += 1
    count["logs with a wrong one"] += bool(wrong)
    return ", ".join(wrong)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1500)
    parser.add_argument("--machines", type=int, default=500)
    asked = parser.parse_args()
    count: Counter[str] = Counter()
    for seed in range(asked.first, asked.first + asked.machines):
        one = random_machine(seed)
        for kind in ("poor", "rich"):
            log = (
                poor_log(one, seed)
                if kind == "poor"
                else simulated(one, (), seed, "train", RICH).log
            )
            try:
                wrong = judged(log, one.rig, seed, count)
            except UserError as error:
                wrong = f"{type(error).__name__}: {error}"[:100]
            print(f"{seed:5d} {one.kind:17s} {kind} {wrong or 'kept'}", flush=True)
    said = max(count["said"], 1)
    print(f"{dict(count)}: wrong {count['wrong'] / said:.1%} of what is said to be identifiable")


if __name__ == "__main__":
    main()
