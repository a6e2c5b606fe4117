"""Logs of another simulator: does `workbench trace` say what was put in, are its numbers right?

    python -m benchmarks.mujoco_logs [--seeds 10 11] [--machines motor slide] [--jobs 2]

Needs MuJoCo (`pip install mujoco`), which is no part of the project's environment. Each machine of
`mujoco_rigs` is written as CSV with a card and traced as the command does, one log to learn from
and another to judge. "Right" is the verdict that an engineer would want, with the effects that were
put in and no other. Of mass, friction and effects that are reported with an interval it is counted
how many of the true values lie within it; beside them the share of the force that is left of the
test log while sliding, and that which ten lines of least squares leave (`yardstick`). Seeds 1 to 9
served to find faults; others judge. Exit status 0 in any case.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.mujoco_rigs import MACHINES, Machine, write
from benchmarks.yardstick import Record, Terms, fitted, own_share, record


@dataclass(frozen=True)
class Judged:
    """One line; whether the verdict is right; how many true values lie in how many intervals."""

    line: str
    right: bool
    inside: int = 0
    intervals: int = 0


def judged(name: str, seed: int) -> Judged:
    """What a trace says of one machine."""
    machine = MACHINES[name]
    with tempfile.TemporaryDirectory() as at:
        folder = Path(at)
        write(folder, machine, seed)
        begun = time.perf_counter()
        command = [sys.executable, "-m", "workbench", "trace", str(folder / "train.csv"), "--test",
                   str(folder / "test.csv"), "--card", str(folder / "card.toml"), "--out",
                   str(folder / "out")]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        took = time.perf_counter() - begun
        if done.returncode != 0:
            return Judged(f"{name:24}{done.stderr.strip()[-90:]}", False)
        found, model = (
            json.loads((folder / "out" / f"{one}.json").read_text("utf-8"))
            for one in ("trace", "model")
        )
        squares = _least_squares(folder, machine)
    named = _named(model)
    right = found["verdict"] in machine.right and set(named) == set(machine.names)
    bands = _intervals(model)
    known = {key: one for key, one in bands.items() if key in machine.numbers}
    inside = sum(low <= machine.numbers[key] <= high for key, (low, high) in known.items())
    left = found["after"]["test"]["force_relative"]
    return Judged(
        f"{name:24}{found['verdict']:12}{', '.join(named) or '-':24}{inside} of {len(known)} within"
        f"   left {_percent(left)} (least squares {_percent(squares)}){took:6.0f} s"
        f"{'' if right else '  X'}",
        right, inside, len(known),
    )  # fmt: skip


def _named(model: dict[str, Any]) -> list[str]:
    """Effects of a model, and a second mass."""
    second = ["two_masses"] if model.get("resonance") else []
    return [*model["effects"], *second]


def _intervals(model: dict[str, Any]) -> dict[str, tuple[float, float]]:
    """95 % intervals of what a model reports, by name."""
    every = dict(model["friction"])
    for key, own in model["effects"].items():
        every |= {f"{key}.{name}": one for name, one in own.items()}
    return {
        name: (one["low"], one["high"])
        for name, one in every.items()
        if one["value"] is not None and one["low"] is not None and one["high"] is not None
    }


def _least_squares(folder: Path, machine: Machine) -> float | None:
    """Share of the force that least squares leave of the test log."""
    train, test = (_record(folder / f"{name}.csv") for name in ("train", "test"))
    fit = fitted([train], Terms(gravity=bool(machine.weight)))
    return None if fit is None else own_share([test], fit)


def _record(path: Path) -> Record:
    t, y, _, signal = np.loadtxt(path, delimiter=",", skiprows=1, unpack=True)
    return record(t, y, signal)


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.2g} %"


def main() -> None:
    parser = argparse.ArgumentParser(description="Logs of another simulator.")
    parser.add_argument("--seeds", type=int, nargs="+", default=[10])
    parser.add_argument("--machines", nargs="+", choices=MACHINES, default=list(MACHINES))
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    asked = [(name, seed) for seed in given.seeds for name in given.machines]
    with ThreadPoolExecutor(given.jobs) as pool:
        every = []
        for one in pool.map(lambda at: judged(*at), asked):
            print(one.line, flush=True)
            every.append(one)
    inside, intervals = sum(one.inside for one in every), sum(one.intervals for one in every)
    print(f"{sum(one.right for one in every)} of {len(every)} right; {inside} of {intervals}"
          " true values within their 95 % intervals")  # fmt: skip


if __name__ == "__main__":
    main()
