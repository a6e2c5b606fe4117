"""A first card by what headers say together, and by what the columns do where these say nothing."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.init_real_tables import machine
from benchmarks.init_table_words import KINDS as TABLES
from identification.arrays import Array
from identification.errors import BadLog
from tests.workbench.steps.first_card_columns import T, propose, roles


@pytest.fixture(scope="module")
def joint() -> dict[str, Array]:
    """The signals of a joint behind a limited loop, in SI."""
    return machine(np.random.default_rng(5), T, TABLES["choose"][0])


@pytest.fixture(scope="module")
def other() -> dict[str, Array]:
    """Those of another joint."""
    return machine(np.random.default_rng(6), T, TABLES["choose"][0])


def test_what_all_headers_begin_with_is_the_machines_name(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    """The R of a right arm asks for nothing."""
    headers = "t,R_wrist_pos,R_wrist_load,R_wrist_temp"
    found = propose(tmp_path, headers, T, joint["y"], joint["F"], 30.0 + 0.1 * np.sin(T))
    assert roles(found) == {"t": "t", "y": "R_wrist_pos", "F": "R_wrist_load",
                            "temperature": "R_wrist_temp"}  # fmt: skip


def test_axes_have_names_of_several_words(
    joint: dict[str, Array], other: dict[str, Array], tmp_path: Path
) -> None:
    headers = "time,arm_lift_cmd,arm_lift_act,arm_lift_force,elbow_flex_cmd,elbow_flex_act"
    found = propose(tmp_path, f"{headers},elbow_flex_force", T, joint["r"], joint["y"], joint["F"],
                    other["r"], other["y"], other["F"])  # fmt: skip
    assert found.axes == ("arm_lift", "elbow_flex")
    own = str(found.axis)
    assert roles(found) == {"t": "time", "r": f"{own}_cmd", "y": f"{own}_act", "F": f"{own}_force"}


def test_another_axis_drives_nothing(
    joint: dict[str, Array], other: dict[str, Array], tmp_path: Path
) -> None:
    table = (T, joint["r"], other["r"], joint["y"], other["y"])
    with pytest.raises(BadLog, match=r"no column moves|no force and no command"):
        propose(tmp_path, "time_s,cmd_0,cmd_1,actual_0,actual_1", *table)


def test_of_a_measured_torque_and_a_current_the_torque_drives(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    noise = 1e-3 * np.random.default_rng(3).standard_normal(len(T))
    headers = "t_ms,measured_position_deg,measured_torque_Nm,measured_current_A"
    deg = np.rad2deg(joint["y"])
    found = propose(tmp_path, headers, 1e3 * T, deg, joint["F"], joint["F"] / 0.3 + noise)
    assert (found.kind, roles(found)["F"]) == ("force", "measured_torque_Nm")


def test_what_a_model_says_of_friction_is_no_force(joint: dict[str, Array], tmp_path: Path) -> None:
    model = 0.4 * np.tanh(joint["v"] / 0.02) + 0.1 * joint["v"]
    found = propose(tmp_path, "t,q,qd,tau_fric,tau_motor", T, joint["y"], joint["v"], model,
                    joint["F"])  # fmt: skip
    assert roles(found)["F"] == "tau_motor"


def test_a_speed_under_any_name_is_summed(joint: dict[str, Array], tmp_path: Path) -> None:
    found = propose(tmp_path, "t,value_1,current", T, joint["v"], joint["F"])
    y = found.signal("y")
    assert y is not None and (y.column, y.summed) == ("value_1", True)
    assert roles(found)["u"] == "current"


def test_a_set_point_is_no_drive_of_what_follows_it(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    with pytest.raises(BadLog, match=r"no column moves|no force and no command"):
        propose(tmp_path, "time_s,cmd,actual", T, joint["r"], joint["y"])


def test_a_power_of_both_signs_is_a_command(joint: dict[str, Array], tmp_path: Path) -> None:
    share: Array = np.round(100.0 * joint["F"] / np.max(np.abs(joint["F"])))
    whole: Array = np.round(57.3 * joint["y"])
    found = propose(tmp_path, "Timestamp,Angle,MotorPower", 1e3 * T, whole, share)
    assert roles(found)["u"] == "MotorPower"


def test_a_steady_voltage_supplies_a_motor(joint: dict[str, Array], tmp_path: Path) -> None:
    volts = 24.0 + 2e-3 * np.random.default_rng(4).standard_normal(len(T)) - 0.02 * joint["F"]
    found = propose(tmp_path, "t_s,position_rad,torque_Nm,voltage_V", T, joint["y"], joint["F"],
                    volts)  # fmt: skip
    assert set(roles(found)) == {"t", "y", "F"}


def test_a_height_of_the_arm_is_no_reference(joint: dict[str, Array], tmp_path: Path) -> None:
    ahead = np.concatenate([joint["y"][1:], joint["y"][-1:]])  # read a row before the joint
    height = 0.3 + 0.1 * np.sin(ahead / np.max(np.abs(joint["y"])))
    found = propose(tmp_path, "time,q,tau,hand", T, joint["y"], joint["F"], height)
    assert set(roles(found)) == {"t", "y", "F"}


def test_what_is_half_alike_is_no_reference(joint: dict[str, Array], tmp_path: Path) -> None:
    """A heading of two wheels, ahead of the one."""
    mixed = np.roll(joint["y"], -40) + 1.2 * np.std(joint["y"]) * np.sin(5.0 * T)
    found = propose(tmp_path, "time,position,voltage,angle", T, joint["y"], joint["u"], mixed)
    assert "r" not in roles(found)


def test_a_size_and_a_direction_are_no_command(joint: dict[str, Array], tmp_path: Path) -> None:
    size, way = np.abs(joint["u"]), (joint["u"] > 0.0).astype(float)
    with pytest.raises(BadLog, match="'pwm' has no sign, 'dir' gives its direction"):
        propose(tmp_path, "t,enc,pwm,dir", T, joint["y"], size, way)


def test_two_columns_without_a_drive_are_refused(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)

    def joint_angle() -> Array:
        drawn = ((rng.uniform(0.3, 1.0), rng.uniform(0.15, 1.2), rng.uniform(0.0, 6.0))
                 for _ in range(4))  # fmt: skip
        return np.round(57.0 * sum(a * np.sin(2 * np.pi * f * T + p) for a, f, p in drawn), 4)

    with pytest.raises(BadLog, match="no column moves as a body"):
        propose(tmp_path, "t,th1,th2", T, joint_angle(), joint_angle())


def test_a_joint_in_whole_degrees_is_in_no_counts(joint: dict[str, Array], tmp_path: Path) -> None:
    whole = np.round(200.0 * joint["y"] / np.ptp(joint["y"]))
    found = propose(tmp_path, "t,joint_angle,current", T, whole, joint["F"])
    y = found.signal("y")
    assert y is not None and y.unit == "deg"


def test_a_time_may_stand_before_the_names(joint: dict[str, Array], tmp_path: Path) -> None:
    """As loggers write it that take the time of each line."""
    headers = "1718212344.91,POSITION_FB,TORQUE_FB"
    found = propose(tmp_path, headers, [f"{1718212345.0 + one:.4f}" for one in T], joint["y"],
                    joint["F"])  # fmt: skip
    assert roles(found) == {"t": "1718212344.91", "y": "POSITION_FB", "F": "TORQUE_FB"}


def test_a_name_more_than_the_rows_have_fields(joint: dict[str, Array], tmp_path: Path) -> None:
    found = propose(tmp_path, "time,position,torque,note", T, joint["y"], joint["F"])
    assert roles(found) == {"t": "time", "y": "position", "F": "torque"}


def test_rows_of_two_motors_have_a_column_each(
    joint: dict[str, Array], other: dict[str, Array], tmp_path: Path
) -> None:
    """Each row at a time of its own."""
    both = [np.column_stack([joint[k], other[k]]).ravel() for k in ("y", "F")]
    t = np.column_stack([T, T + 1e-3]).ravel()
    found = propose(tmp_path, "time,motor_id,position,current", t, np.tile([1.0, 2.0], len(T)),
                    *both)  # fmt: skip
    assert any("rows are of 2 in turn, which column 'motor_id' names" in one
               for one in found.remarks)  # fmt: skip
    assert roles(found)["y"] in ("1 position", "2 position")
