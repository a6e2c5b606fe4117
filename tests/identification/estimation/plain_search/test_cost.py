"""The vectorised distance: the same numbers as a scalar run, lane for lane."""

from dataclasses import replace

import numpy as np
import pytest

from identification.estimation.plain_search.fitted_runs import (
    FittedRun,
    prepare_run,
    rest_windows,
    total_cost,
)
from identification.log import Log
from identification.model.plant import Actuator, Plant
from identification.simulation.free_run import free_run
from identification.simulation.karnopp_lanes import WIDTH
from identification.simulation.karnopp_step import kernel_parameters
from tests.identification.plants import ACTUATOR, NOISE_F, NOISE_Y, made_log, table


def run_of(log: Log, *, by_command: bool = True, window: float = 100.0) -> FittedRun:
    run = prepare_run(
        log,
        "command" if by_command else "force",
        constant=0.0,
        window=window,
        noise=(NOISE_Y, NOISE_F),
    )
    run.windows.y[0] = run.windows.v[0] = 0.0
    return run


def sets(number: int) -> np.ndarray:
    """WIDTH parameter sets around a table's plant."""
    truth = kernel_parameters(table(number).array, ACTUATOR.k1, ACTUATOR.k2)
    rng = np.random.default_rng(number)
    return truth * (1 + 0.02 * rng.standard_normal((WIDTH, len(truth))))


@pytest.mark.parametrize("number", [1, 2, 3])
def test_cost_is_that_of_scalar_runs(number: int) -> None:
    log = made_log(table(number), seconds=3.0)
    run, rows = run_of(log), sets(number)
    costs = total_cost([run], rows, 0.0)
    for lane in (0, 3, WIDTH - 1):
        plant = Plant(
            type(table(number)).from_array(rows[lane, :9]), Actuator(rows[lane, 9], rows[lane, 10])
        )
        alone = free_run(plant, log, (0.0, 0.0, 0.0), "command")
        expected = np.sum(((alone.y - log["y"]) / NOISE_Y) ** 2)
        expected += np.sum(((alone.F - log["F"]) / NOISE_F) ** 2)
        assert costs[lane] == pytest.approx(expected, rel=1e-6)


def test_cost_driven_by_force_is_that_of_a_scalar_run() -> None:
    log = made_log(table(2), seconds=3.0)
    run, rows = run_of(log, by_command=False), sets(2)
    rows[:, 9] = 0.0
    costs = total_cost([run], rows, 0.0)
    plant = Plant(type(table(2)).from_array(rows[0, :9]))
    alone = free_run(
        plant, log, (0.0, 0.0, float(log["F"][0])), "force", stiffness=float(rows[0, 10])
    )
    expected = np.sum(((alone.y - log["y"]) / NOISE_Y) ** 2)
    assert costs[0] == pytest.approx(expected, rel=1e-3)


def test_the_cost_of_the_truth_is_the_noise() -> None:
    run = run_of(made_log(table(1), seed=2))
    truth = kernel_parameters(table(1).array, ACTUATOR.k1, ACTUATOR.k2)
    assert total_cost([run], truth[None], 0.0)[0] / run.measured.count == pytest.approx(1, abs=0.03)


def test_a_bound_keeps_outliers_from_ruling() -> None:
    log = made_log(table(1), seconds=3.0)
    y = log["y"].copy()
    y[1000:1010] += 1.0
    run = run_of(log)
    run = replace(run, measured=replace(run.measured, y=y))
    truth = kernel_parameters(table(1).array, ACTUATOR.k1, ACTUATOR.k2)[None]
    assert total_cost([run], truth, 0.0)[0] > 1e9
    assert total_cost([run], truth, 25.0)[0] < 2 * run.measured.count + 10 * 25.0


def test_windows_restart_at_sure_rests_only() -> None:
    t = np.arange(6000) * 1e-3
    clean = 0.01 * np.clip(np.sin(2 * np.pi * 0.5 * t), -0.5, 0.5)
    y = clean + NOISE_Y * np.random.default_rng(1).standard_normal(len(t))
    windows = rest_windows(y, NOISE_Y, 1e-3, 0.4)
    assert windows.at[0] == 0
    assert len(windows.at) > 4
    assert np.all(np.diff(windows.at) >= 400)
    assert np.all(windows.v == 0.0)
    for at, level in zip(windows.at[1:], windows.y[1:], strict=True):
        assert abs(clean[at]) == 0.005
        assert abs(level - clean[at]) < 4e-6
