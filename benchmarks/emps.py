"""The EMPS inverse model beside the figures its authors published.

    python benchmarks/emps.py            (WORKBENCH_DATA names the folder that holds emps/)

Fits the training log and tries the fit on both logs: as published, with the cut-off from the log,
and with the command taken as held over each sample.
"""

import os
import sys
import time
import tomllib
from pathlib import Path
from typing import Any

from scipy.io import loadmat

from identification.log import Log
from identification.model.inverse_model import Smoothing, Viscous, fit_inverse, force_error

ROOT = Path(__file__).parents[1]
EMPS = Path(os.environ.get("WORKBENCH_DATA") or ROOT.parent / "shared" / "data") / "emps"


def read(name: str) -> Log:
    """One EMPS log: position [m] and motor force [N]."""
    data = loadmat(EMPS / f"{name}.mat", squeeze_me=True)
    F = float(data["gtau"]) * data["vir"]
    return Log(name, {"t": data["t"], "y": data["qm"], "F": F})


def main() -> int:
    """Print the table; 2 where the logs are not there."""
    if not (EMPS / "DATA_EMPS.mat").is_file():
        print("EMPS logs not found; set WORKBENCH_DATA to the folder that holds emps/")
        return 2
    reference = tomllib.loads((ROOT / "tests/reference/emps.toml").read_text())
    training, pulses = read("DATA_EMPS"), read("DATA_EMPS_PULSES")
    cutoff = reference["procedure"]["cutoff_hz"]
    ways = {
        f"{cutoff:g} Hz, as published": Smoothing(cutoff=cutoff),
        "cut-off from the log": Smoothing(),
        f"{cutoff:g} Hz, held command": Smoothing(cutoff=cutoff, zoh=True),
    }
    print(f"{'':34}{'m':>9}{'F_v+':>9}{'F_v-':>9}{'F_c':>8}{'offset':>8}  training  PULSES    ms")
    for viscous in ("symmetric", "directional"):
        for way, how in ways.items():
            print(row(f"{viscous}, {way}", training, pulses, viscous, how))
        print(f"  published: {published(reference, viscous)}")
    return 0


def published(reference: dict[str, Any], viscous: Viscous) -> str:
    """The authors' figures for one kind of viscous friction."""
    errors = {k: v for k, v in reference["force_relative"].items() if k.endswith(viscous)}
    figures = [f"{k} {100 * v['value']:.3f} %" for k, v in errors.items()]
    if viscous == "symmetric":
        figures = [
            f"{k} {v['value']:g} {v['unit']}" for k, v in reference[viscous].items()
        ] + figures
    return ", ".join(figures)


def row(label: str, training: Log, pulses: Log, viscous: Viscous, how: Smoothing) -> str:
    """One line of the table: the fit on `training`, its error there and on `pulses`."""
    start = time.perf_counter()
    model = fit_inverse(training, viscous, how)
    spent = 1e3 * (time.perf_counter() - start)
    test = force_error(pulses, model, how)
    return (
        f"{label:34}{model.m:9.3f}{model.F_vp:9.2f}{model.F_vn:9.2f}{model.F_c:8.3f}"
        f"{model.offset:8.3f}{100 * model.error.relative:8.3f} %{100 * test.relative:6.3f} %"
        f"{spent:6.0f}"
    )


if __name__ == "__main__":
    sys.exit(main())
