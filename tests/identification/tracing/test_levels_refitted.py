"""Drift of the two Coulomb levels, judged by how the rest of a test log is followed."""

from dataclasses import replace

import numpy as np
import pytest

from identification.arrays import Array
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.motion_log import motion_log
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant
from identification.simulation.free_run import free_run
from identification.tracing.levels_refitted import levels_refitted

H, N = 2e-3, 6_000
RIG = Rig("motor", force_per_command=1.0)
LAW = Karnopp(2.0, 5.0, 6.0, 20.0, 25.0, 1e-3, -1e-3, 5.5, -6.5)


def run_of(law: Karnopp, seed: int, noise: float = 1e-6) -> MotionLog:
    """A run of that law under a slow wave of the command."""
    rng = np.random.default_rng(seed)
    t: Array = np.asarray(H * np.arange(N), dtype=np.float64)
    u = 9.0 * np.sin(2.0 * np.pi * 0.4 * t + seed) + 4.0 * np.sin(2.0 * np.pi * 1.1 * t)
    blank = Log("run", {"t": t, "y": np.zeros(N), "F": u, "u": u})
    run = free_run(Plant(law, Motor(1.0)), blank, (0.0, 0.0, float(u[0])), "command")
    log = blank.with_signals(y=run.shown + noise * rng.standard_normal(N))
    return motion_log(log, zoh=True, by_command=False)


def found(test: Karnopp, wrong: float = 1.0) -> dict[str, float]:
    """Relative changes that are reported of a machine that became `test`; the plant of the training
    logs has so many times the mass."""
    plant = Plant(replace(LAW, m=wrong * LAW.m), Motor(1.0))
    changes, said = levels_refitted(plant, LAW, [run_of(LAW, 1)], [run_of(test, 2)], "command", RIG)
    assert bool(changes) == ("first 25% of the test logs" in said)
    return {one.name: one.after / one.before - 1.0 for one in changes}


def test_levels_of_another_day_are_found_beside_a_law_that_is_not_exact() -> None:
    drifted = replace(LAW, F_cp=5.5, F_cn=6.6, F_sp=6.0, F_sn=-7.1)
    assert found(drifted, wrong=1.01) == pytest.approx({"F_cp": 0.1, "F_cn": 0.1}, abs=0.02)


def test_the_same_machine_has_not_changed() -> None:
    assert found(LAW, wrong=1.01) == {}


def test_another_law_is_no_change_of_level() -> None:
    assert found(replace(LAW, F_vp=80.0, F_vn=5.0), wrong=1.01) == {}
