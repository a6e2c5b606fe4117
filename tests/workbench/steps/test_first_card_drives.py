"""A first card for exports of drives and recorders: forces that are asked for, paths, shares."""

from pathlib import Path

import numpy as np
import pytest

from design.first_card.proposal import Proposal
from identification.arrays import Array
from tests.identification.uneven_rows import servo_log
from workbench.steps.first_card.proposal import proposed

H, ROWS = 5e-3, 1600


@pytest.fixture(scope="module")
def servo() -> dict[str, Array]:
    """Clock, angle and torque of a servo in its loop."""
    log = servo_log(np.full(ROWS, H), zoh=True, seed=2)
    return {"t": log["t"], "y": log["y"], "F": log["F"]}


def propose(folder: Path, headers: str, *columns: Array) -> Proposal:
    path = folder / "run.csv"
    rows = (",".join(f"{one:.9g}" for one in row) for row in np.column_stack(columns).tolist())
    path.write_text("\n".join([headers, *rows]), "utf-8")
    return proposed(path)


@pytest.mark.parametrize("header", ["Target Torque", "tau_cmd", "torque_setpoint"])
def test_a_torque_that_is_asked_for_is_a_command_in_its_own_unit(
    servo: dict[str, Array], tmp_path: Path, header: str
) -> None:
    """It has no noise, and stands at its limit without a sensor's range being at its end."""
    found = propose(tmp_path, f"t,position,{header}", *servo.values())
    assert found.kind == "motor"
    u = found.signal("u")
    assert u is not None and (u.column, u.unit) == (header, "N m")
    constant = next(one for one in found.rig if one.key == "force_per_command")
    assert constant.value == 1.0 and not constant.sure


def test_a_measured_torque_goes_before_what_is_asked_for(
    servo: dict[str, Array], tmp_path: Path
) -> None:
    rng = np.random.default_rng(1)
    asked = servo["F"] + 0.02 * rng.standard_normal(ROWS)
    found = propose(tmp_path, "t,position,torque,torque_setpoint", *servo.values(), asked)
    F = found.signal("F")
    assert F is not None and F.column == "torque"


def test_blocks_in_which_all_signals_lie_say_nothing_of_one(
    servo: dict[str, Array], tmp_path: Path
) -> None:
    """'Model' is here no model's prediction, nor 'Mode' a state."""
    block = "Model Root/Plant/"
    found = propose(
        tmp_path, f"X-Axis,{block}Angle [rad],{block}Torque [Nm]", *servo.values()
    )  # fmt: skip
    y, F = found.signal("y"), found.signal("F")
    assert y is not None and F is not None
    assert y.sure and F.sure


def test_a_command_that_stops_at_a_hundred_is_in_percent_beside_counts_too(
    servo: dict[str, Array], tmp_path: Path
) -> None:
    counts = np.round(servo["y"] * 180.0 / np.pi)
    duty = np.round(np.clip(servo["F"] * 60.0, -100.0, 100.0))
    path = tmp_path / "log.txt"
    np.savetxt(path, np.column_stack([1e3 * servo["t"], duty, counts]), "%d", delimiter=";")
    u = proposed(path).signal("u")
    assert u is not None and u.unit == "%"


def test_a_guessed_unit_makes_no_clock_wrong(servo: dict[str, Array], tmp_path: Path) -> None:
    speed = 0.37 * np.gradient(servo["y"], H)
    found = propose(tmp_path, "t,position,velocity,torque", servo["t"], servo["y"], speed,
                    servo["F"])  # fmt: skip
    assert not any("the clock runs" in one for one in found.remarks)


def test_a_speed_of_turning_beside_the_position_tells_that_it_turns(
    servo: dict[str, Array], tmp_path: Path
) -> None:
    erpm = 7.0 * 30.0 / np.pi * np.gradient(servo["y"], H)
    noise = np.random.default_rng(4).standard_normal(ROWS)
    found = propose(tmp_path, "ms,tacho,erpm,current", 1e3 * servo["t"], servo["y"] / 6.0,
                    erpm + 30.0 * noise, servo["F"])  # fmt: skip
    assert found.motion == "rotary"


def test_the_current_of_which_a_torque_was_made_is_no_command(
    servo: dict[str, Array], tmp_path: Path
) -> None:
    """Of six digits each, so that the two are not the same to the last one."""
    noise = 3e-2 * np.random.default_rng(5).standard_normal(ROWS)
    made = np.array([float(f"{one:.6g}") for one in 1e3 * (servo["F"] + noise)])
    found = propose(tmp_path, "t,position,current,torque", servo["t"], servo["y"],
                    np.round(made / -9.13, 5), made)  # fmt: skip
    assert found.kind == "force"
    assert found.signal("u") is None
