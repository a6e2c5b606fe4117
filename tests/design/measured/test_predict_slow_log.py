"""Predictions on logs that are slower than the drive's loop."""

from dataclasses import replace

import numpy as np
import pytest

from design.measured.predict import predict
from identification.arrays import Array
from identification.effect_contract.runs import START_AT_REST, TABLE_1
from identification.log import Log
from identification.model.plant import Motor, Plant
from identification.simulation.free_run import free_run
from tests.chain import model_of

LOOP, K_A = 2.5e-4, 900.0  # s, N/V


def slow_log(every: int) -> Log:
    """A motor's run under commands of its loop, of which the log has one of so many."""
    t: Array = LOOP * np.arange(40_000, dtype=np.float64)
    u = 0.08 * np.sin(6.0 * t) + 0.05 * np.sin(17.0 * t)
    fast = Log("fast", {"t": t, "y": 0.0 * t, "u": u})
    run = free_run(Plant(TABLE_1, Motor(K_A)), fast, START_AT_REST, "command")
    return Log("slow", {"t": t[::every], "y": run.y[::every], "u": u[::every]})


@pytest.mark.parametrize("every", [4, 16])
def test_the_run_has_what_drove_the_machine_between_the_samples(every: int) -> None:
    model, log = model_of(TABLE_1, k_a=K_A), slow_log(every)
    knows = replace(model, fit=replace(model.fit, command_period=LOOP))
    off, less = predict(model, log).position_rms, predict(knows, log).position_rms
    assert off is not None and less is not None
    assert less < 0.5 * off


def test_a_log_of_every_command_is_taken_as_it_is() -> None:
    model, log = model_of(TABLE_1, k_a=K_A), slow_log(1)
    slower = replace(model, fit=replace(model.fit, command_period=4.0 * LOOP))
    assert predict(slower, log).position_rms == predict(model, log).position_rms
    assert predict(model, log).position_rms == pytest.approx(0.0, abs=1e-9)
