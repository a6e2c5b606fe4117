"""Kernels of a fit compiled by a process of their own, while a first run has not come to them.

Numba compiles one kernel at a time in a process. A chain that simulates its loop first and
identifies then would compile for a minute on one core what another core could have ready by then.

    python -m workbench.steps.kernels_ahead
"""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

LONG, SAMPLE = 4.0, 2e-3  # of the log that is fitted, and between its samples


def compile_fits() -> None:
    """A short log through a fit, an ARX fit, a run with an effect, whose kernels this leaves in the
    cache. The effect's is last: most of what it calls has come from the simulated loop by then."""
    from identification.arx.model import fit_arx
    from identification.effect_contract.runs import HYDRAULIC, run_with, trial_log, typical
    from identification.effects._library import built_in
    from identification.estimation.fit import fit_plant
    from identification.estimation.latent_force import latent_forces
    from identification.estimation.regression.motion_log import motion_log
    from identification.log import Log, Rig
    from identification.model.plant import Plant

    driven = trial_log(LONG, h=SAMPLE)
    run = run_with(HYDRAULIC, driven)
    noise = np.random.default_rng(0).normal(size=(2, len(run.y)))
    seen = {"y": run.y + 1e-6 * noise[0], "F": run.F + 0.1 * noise[1]}
    log = Log("made", {"t": driven["t"], "u": driven["u"], **seen})
    fit = fit_plant([log], np.random.default_rng(0), rig=Rig("force"))
    moved = motion_log(log, zoh=False, by_command=False)
    latent_forces(Plant(fit.friction), [moved], 0.0)
    fit_arx([(driven["u"], run.y)], 2, 1, 1, SAMPLE)
    run_with(HYDRAULIC, driven, typical(built_in()["stribeck"]))


def are_compiled() -> bool:
    """Whether the cache holds the kernel of a fit's search."""
    from identification.estimation.windowed_run.likely_square import square_kernel

    cache = Path(square_kernel.stats.cache_path)  # type: ignore[attr-defined]
    return any(cache.glob("likely_square.square_kernel-*.nbi"))


@contextmanager
def fits_compiled_ahead() -> Iterator[None]:
    """Within the block another process compiles the kernels of fits, if they are not yet."""
    if are_compiled():
        yield
        return
    command = [sys.executable, "-m", __spec__.name]
    ahead = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        ahead.terminate()
        ahead.wait()


if __name__ == "__main__":
    compile_fits()
