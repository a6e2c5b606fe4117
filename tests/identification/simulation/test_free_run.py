"""Free runs: by command, by force, by motor, restarted; refusals."""

from dataclasses import replace

import numpy as np
import pytest

from identification.arrays import Array
from identification.effects._library import built_in
from identification.errors import BadModel
from identification.log import Log
from identification.model.plant import Actuator, Motor, Plant
from identification.simulation.free_run import FreeRun, force_slope, free_run, run_kernel
from identification.simulation.karnopp_step import STUCK
from tests.identification.oracle import euler
from tests.identification.plants import ACTUATOR, command, table

REST = (0.0, 0.0, 0.0)


def log_of(h: float = 1e-3, seconds: float = 3.0, **signals: Array) -> Log:
    """A log with a command, everything else 0 unless given."""
    t = h * np.arange(round(seconds / h), dtype=np.float64)
    blank = {"t": t, "y": np.zeros(len(t)), "u": command(t, 1)}
    return Log("made", {**blank, **signals})


def with_response(log: Log, run: FreeRun) -> Log:
    """The log as the run would have been measured without noise."""
    return log.with_signals(y=run.y, F=run.F)


def test_by_command_it_is_the_written_equation() -> None:
    log = log_of()
    run = free_run(Plant(table(2), ACTUATOR), log, REST, "command")
    fine = euler(table(2), ACTUATOR.k1, ACTUATOR.k2, log["u"], 1e-3, 1000)
    assert np.max(np.abs(run.y - fine[0])) < 2e-6
    assert np.max(np.abs(run.F - fine[2])) < 2e-6 * ACTUATOR.k2
    assert run.y.shape == run.v.shape == run.F.shape == run.mode.shape == (len(log),)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_by_force_and_coupling_it_is_the_run_by_command(number: int) -> None:
    # F(t) of the log's own motion is a line only to second order: h small, the coupling exact.
    log = log_of(1e-4)
    plant = Plant(table(number), ACTUATOR)
    run = free_run(plant, log, REST, "command")
    seen = with_response(log, run)
    again = free_run(plant, seen, REST, "force", stiffness=ACTUATOR.k2)
    assert np.max(np.abs(again.y - run.y)) < 2e-6
    assert np.max(np.abs(again.F - run.F)) < 2e-6 * ACTUATOR.k2


def test_force_is_linear_between_samples_unless_held() -> None:
    force = np.array([0.0, 2.0, 1.0])
    assert force_slope(force, 0.5, hold=False).tolist() == [4.0, -2.0, 0.0]
    assert force_slope(force, 0.5, hold=True).tolist() == [0.0, 0.0, 0.0]


def test_stiffness_pulls_to_the_measured_position() -> None:
    log = log_of()
    run = free_run(Plant(table(1), ACTUATOR), log, REST, "command")
    seen = with_response(log, run)
    wrong = Plant(replace(table(1), F_vp=400.0, F_vn=300.0))
    errors = [
        np.sqrt(np.mean((free_run(wrong, seen, REST, "force", stiffness=k).y - run.y) ** 2))
        for k in (0.0, 1e3, 1e5)
    ]
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2] > 0.0


def test_motor_holds_its_force_over_the_sample() -> None:
    log, motor = log_of(1e-2), Motor(250.0)
    run = free_run(Plant(table(3), motor), log, REST, "command")
    assert np.array_equal(run.F, motor.k_a * log["u"])
    parts = 20
    fine = log_of(
        1e-2 / parts,
        y=np.zeros(len(log) * parts),
        u=np.repeat(log["u"], parts),
    )
    split = free_run(Plant(table(3), motor), fine, REST, "command")
    assert np.max(np.abs(split.y[::parts] - run.y)) < 1e-12
    assert np.ptp(run.y) > 1e-3


def test_restarts_take_the_given_state() -> None:
    log = log_of()
    plant = Plant(table(1), ACTUATOR)
    run = free_run(plant, log, REST, "command")
    seen = with_response(log, run)
    at = np.array([0, 700, 1900])
    same = free_run(plant, seen, REST, "command", restarts=(at, run.y[at], run.v[at]))
    assert np.max(np.abs(same.y - run.y)) < 1e-9
    moved = free_run(plant, seen, REST, "command", restarts=(at, run.y[at] + 0.01, run.v[at]))
    assert np.array_equal(moved.y[:700], run.y[:700])
    assert moved.y[700] == run.y[700] + 0.01
    assert moved.y[1900] == run.y[1900] + 0.01


def test_start_in_the_band_with_too_little_force_is_at_rest() -> None:
    log = log_of(seconds=0.2, u=np.zeros(200))
    run = free_run(Plant(table(1), ACTUATOR), log, (0.05, 0.03, 10.0), "command")
    assert set(run.mode.tolist()) == {STUCK}
    assert np.all(run.y == 0.05)
    assert np.all(run.v == 0.0)


def test_no_command_drive_without_an_actuator() -> None:
    with pytest.raises(BadModel, match="no actuator"):
        free_run(Plant(table(1)), log_of(), REST, "command")


def test_arrays_of_the_log_are_not_changed() -> None:
    log = log_of(F=np.zeros(3000))
    before = {name: values.copy() for name, values in log.signals.items()}
    free_run(Plant(table(1), Actuator(2e4, 0.0)), log, REST, "command")
    free_run(Plant(table(1)), log, REST, "force")
    assert all(np.array_equal(log[name], values) for name, values in before.items())


def test_a_kernel_is_compiled_once_however_a_run_is_driven() -> None:
    log = with_response(log_of(), free_run(Plant(table(2), ACTUATOR), log_of(), REST, "command"))
    free_run(Plant(table(2)), log, REST, "force")
    count = len(run_kernel.signatures)  # type: ignore[attr-defined]
    delay = built_in()["input_delay"].acting({"tau": 0.01})
    for motor in (Plant(table(2), Motor(3.0)), Plant(table(2), Motor(3.0), (delay,))):
        free_run(motor, log, REST, "command")
    free_run(Plant(table(2), ACTUATOR), log, REST, "command")
    free_run(Plant(table(2)), Log("made", {k: log[k] for k in ("t", "y", "F")}), REST, "force")
    assert len(run_kernel.signatures) == count  # type: ignore[attr-defined]
