"""EMPS: fit on the training log, free run of the position over the whole of both logs.

    python benchmarks/emps_free_run.py [SEEDS]    (WORKBENCH_DATA names the folder that holds emps/)

The run starts from the first measured state and is driven by the logged command alone; nothing is
fitted on PULSES. Published on PULSES: LTI state space 5.53 mm, polynomial NARX 5.17 mm, dynoNet
(a network of blocks) 2.64 mm; the published symmetric parameters give about 9.3 mm.
"""

import os
import sys
import time
from pathlib import Path

import numpy as np

from identification.estimation.fit import fit_plant
from identification.model.plant import Plant
from identification.signals.initial_state import measured_start
from identification.simulation.free_run import free_run
from workbench.cards.card import load_card
from workbench.logs.runs import read_runs
from workbench.logs.sources import card_path, find_data


def main(seeds: int) -> None:
    os.environ.setdefault("WORKBENCH_DATA", str(Path(__file__).parents[2] / "shared" / "data"))
    card = load_card(card_path("emps"))
    files = ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")
    train, pulses = (read_runs(find_data(name, card), card).runs[0] for name in files)
    errors = []
    print(f"{'seed':>4s}{'training mm':>13s}{'PULSES mm':>11s}{'s':>6s}")
    for seed in range(seeds):
        begin = time.perf_counter()
        fit = fit_plant([train], np.random.default_rng(seed), rig=card.rig())
        seconds = time.perf_counter() - begin
        row = []
        for log in (train, pulses):
            run = free_run(Plant(fit.friction, fit.actuator), log, measured_start(log), "command")
            row.append(1e3 * float(np.sqrt(np.mean((run.y - log["y"]) ** 2))))
        errors.append(row)
        print(f"{seed:4d}{row[0]:13.2f}{row[1]:11.2f}{seconds:6.1f}")
    low, middle, high = np.quantile([row[1] for row in errors], [0.0, 0.5, 1.0])
    print(f"PULSES: {low:.2f} to {high:.2f} mm, median {middle:.2f} mm")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
