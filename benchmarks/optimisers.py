"""Our local minimiser beside scipy's, on the costs that it minimises in a fit.

    python benchmarks/optimisers.py [--first 300] [--seeds 8]

The residual of runs in windows (`estimation/windowed_run/run_errors.judge`) from a plant that is 1
to 5 % off, by our Gauss-Newton with differences for slopes and by scipy's least_squares ("trf" with
the same differences, "lm"); all take the same function of the same unknowns. Reached: cost a value,
1 where noise alone is left; time: of ours in the same run.
"""

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from benchmarks.blind_machines import machine, simulated
from identification.arrays import Array
from identification.estimation.gauss_newton import WIDE_STEP, gauss_newton
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.windowed_run.parameters import (
    names_of,
    plant_with,
    units_in,
    values_of,
)
from identification.estimation.windowed_run.run_errors import judge, soft
from identification.model.plant import Plant

MACHINES = ("table2", "motor", "force")
SECONDS, WINDOW = 30.0, 2.0
OFF = (0.01, 0.05)  # relative, of every parameter
STEPS = 12
SCIPY: Any = least_squares  # its stubs know no single step for all
Local = Callable[[Callable[[Array], Array], Array], Array]


def ours(fun: Callable[[Array], Array], x: Array) -> Array:
    """Gauss-Newton of the fit."""
    return gauss_newton(fun, x, STEPS).x


def scipy_trf(fun: Callable[[Array], Array], x: Array) -> Array:
    """scipy's trust region with the same differences."""
    return np.asarray(SCIPY(fun, x, diff_step=WIDE_STEP, max_nfev=STEPS).x)


def scipy_lm(fun: Callable[[Array], Array], x: Array) -> Array:
    """scipy's (MINPACK's) Levenberg-Marquardt with the same differences, as many evaluations."""
    most = STEPS * (len(x) + 1)
    return np.asarray(SCIPY(fun, x, method="lm", diff_step=WIDE_STEP, max_nfev=most).x)


LOCAL: dict[str, Local] = {"ours": ours, "scipy trf": scipy_trf, "scipy lm": scipy_lm}


def local(seed: int, name: str) -> dict[str, tuple[float, float]]:
    """Mean square reached and seconds of each minimiser, from a plant that is off."""
    one = machine(name, seed)
    log = simulated(one, (), seed, "train", SECONDS).log
    recorded = recorded_logs([log], one.rig)
    drives = one.drive if recorded.drive == "command" else None
    truth = Plant(one.friction, drives)
    names = names_of(truth, recorded.drive)
    values = values_of(truth, names)
    unit = units_in(truth, names, values)
    rng = np.random.default_rng([seed, len(name)])
    off = rng.uniform(*OFF) * rng.choice([-1.0, 1.0], len(names))
    errors_of = judge(truth, recorded.logs, recorded.drive, WINDOW)

    def fun(x: Array) -> Array:
        return soft(errors_of(plant_with(truth, names, x * unit)))

    out = {}
    for how, minimise in LOCAL.items():
        begin = time.perf_counter()
        x = minimise(fun, values / unit * (1.0 + off))
        out[how] = float(np.mean(fun(x) ** 2)), time.perf_counter() - begin
    return out


def report(what: str, rows: list[dict[str, tuple[float, float]]]) -> None:
    """Median and worst cost reached, and time over ours."""
    print(f"{what:16s}{'reached, median':>18s}{'worst':>12s}{'time':>8s}")
    for how in rows[0]:
        reached = [row[how][0] for row in rows]
        ratio = np.median([row[how][1] / row["ours"][1] for row in rows])
        print(f"  {how:26s}{np.median(reached):8.3f}{max(reached):12.4g}{ratio:8.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=300)
    parser.add_argument("--seeds", type=int, default=8)
    asked = parser.parse_args()
    seeds = range(asked.first, asked.first + asked.seeds)
    for name in MACHINES:
        report(f"local, {name}", [local(seed, name) for seed in seeds])


if __name__ == "__main__":
    main()
