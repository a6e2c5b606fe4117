"""A first card by what columns are of each other: counters, sums, set points."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.init_real_tables import machine
from benchmarks.init_table_words import KINDS as TABLES
from identification.arrays import Array
from identification.errors import BadLog
from tests.workbench.steps.first_card_columns import T, propose, roles


@pytest.fixture(scope="module")
def joint() -> dict[str, Array]:
    """The signals of a joint behind a limited loop, in SI."""
    return machine(np.random.default_rng(5), T, TABLES["choose"][0])


def test_a_number_of_strokes_is_no_position(joint: dict[str, Array], tmp_path: Path) -> None:
    """What goes up by one from time to time counts something."""
    found = propose(tmp_path, "t_s,cycle,position_mm,force_N,StrokeCount", T, np.floor(T / 3.0),
                    joint["y"], joint["F"], np.floor(T / 1.5))  # fmt: skip
    assert roles(found) == {"t": "t_s", "y": "position_mm", "F": "force_N"}
    assert "counts something" in found.unused["'StrokeCount'"]


def test_an_acceleration_drives_nothing(joint: dict[str, Array], tmp_path: Path) -> None:
    y = joint["y"]
    v = np.gradient(y, T)
    with pytest.raises(BadLog, match="no force and no command of the motor is logged"):
        propose(tmp_path, "t,q_sp,q_meas,dq_meas,ddq_meas", T, joint["r"], y, v, np.gradient(v, T))


def test_the_rate_of_a_set_point_drives_nothing(joint: dict[str, Array], tmp_path: Path) -> None:
    """Nor does noise that no header calls a drive."""
    noise = np.random.default_rng(3).standard_normal(len(T))
    rate = np.gradient(joint["r"], T)
    with pytest.raises(BadLog, match="no force and no command of the motor is logged"):
        propose(tmp_path, "t,pos,target,rate,slip", T, joint["y"], joint["r"], rate, noise)


def test_of_a_sum_and_its_parts_the_sum_drives(joint: dict[str, Array], tmp_path: Path) -> None:
    """Though inertia and friction explain a torque without the weight better."""
    weight = 0.4 * np.sin(joint["y"])
    found = propose(tmp_path, "t,q,tau_grav,tau_imp,tau_sum", T, joint["y"], weight, joint["F"],
                    joint["F"] + weight)  # fmt: skip
    assert roles(found)["F"] == "tau_sum"


def test_what_a_controller_adds_for_friction_is_not_measured(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    added = 0.3 * np.sign(np.gradient(joint["y"], T))
    found = propose(tmp_path, "t,q,tau_f,tau_meas", T, joint["y"], added, joint["F"])
    assert roles(found)["F"] == "tau_meas"


def test_a_set_point_of_the_speed_is_no_reference(joint: dict[str, Array], tmp_path: Path) -> None:
    v = np.gradient(joint["y"], T)
    found = propose(tmp_path, "t,position,speed,sp,current", T, joint["y"], v, v + 0.01 * np.sin(T),
                    joint["F"])  # fmt: skip
    assert roles(found) == {"t": "t", "y": "position", "u": "current"}


def test_a_target_that_the_position_does_not_follow_is_of_something_else(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    """As of the force that a press keeps."""
    steps = np.sign(np.sin(0.9 * T + 0.3))
    found = propose(tmp_path, "t,target,force_N,position_mm", T, steps, joint["F"], joint["y"])
    assert "r" not in roles(found)


def test_speeds_with_the_torque_that_is_asked_for(joint: dict[str, Array], tmp_path: Path) -> None:
    """Like the speed itself the torque is a command, and no set point of the speed."""
    v = np.gradient(joint["y"], T)
    found = propose(tmp_path, "t_ms,omega_set,omega_meas,torque_cmd", 1e3 * T, v, v, joint["F"])
    assert roles(found)["y"] == "omega_meas"
    assert "torque_cmd" in roles(found).values()


def test_a_p_below_zero_is_no_pressure(joint: dict[str, Array], tmp_path: Path) -> None:
    """But the position of a motor, beside its v and its torque."""
    found = propose(tmp_path, "t,p,p_des,v,tau", T, joint["y"], joint["r"],
                    np.gradient(joint["y"], T), joint["F"])  # fmt: skip
    assert roles(found) == {"t": "t", "r": "p_des", "y": "p", "F": "tau"}


def test_a_stress_is_the_force_again(joint: dict[str, Array], tmp_path: Path) -> None:
    stress = [f"{one:.4g}" for one in joint["F"] / 40.0]
    found = propose(tmp_path, "t_s,Force_N,Position_mm,Stress_MPa", T, joint["F"], joint["y"],
                    stress)  # fmt: skip
    assert roles(found) == {"t": "t_s", "y": "Position_mm", "F": "Force_N"}


def test_counts_of_several_joints_are_axes(joint: dict[str, Array], tmp_path: Path) -> None:
    other = machine(np.random.default_rng(6), T, TABLES["choose"][0])
    counts = [np.round(2e4 * one["y"]) for one in (joint, other)]
    found = propose(tmp_path, "clock,hip_counts,knee_counts,hip_torque,knee_torque", T, *counts,
                    joint["F"], other["F"])  # fmt: skip
    assert found.axes == ("hip", "knee")
    assert roles(found) == {"t": "clock", "y": "hip_counts", "F": "hip_torque"}


def test_a_raw_value_that_recurs_tells_no_motors_apart(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    """The number of a motor says little of a signal, that of a converter's step all of it."""
    current = np.round(joint["F"] / np.ptp(joint["F"]), 2)
    found = propose(tmp_path, "t_s,position,current,raw", T, joint["y"], current,
                    np.round(2048.0 + 100.0 * current))  # fmt: skip
    assert roles(found) == {"t": "t_s", "y": "position", "u": "current"}


def test_rows_in_turn_go_by_what_is_called_their_time(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    """And not by the number of the loop before it."""

    def twice(x: Array) -> Array:
        return np.asarray(np.repeat(x, 2), dtype=np.float64)

    sides = ["L", "R"] * len(T)
    y = twice(joint["y"]) * np.tile([1.0, -0.5], len(T))
    loop = twice(np.asarray(np.arange(len(T)), dtype=np.float64))
    found = propose(tmp_path, "loop,time_sec,leg,pos,tau", loop, twice(T), sides, y,
                    twice(joint["F"]))  # fmt: skip
    t = found.signal("t")
    assert t is not None and (t.shown, t.unit) == ("'time_sec'", "s")


def test_a_logger_may_begin_each_row_with_its_name(joint: dict[str, Array], tmp_path: Path) -> None:
    times = [f"TRACE {1e6 * t:.0f}" for t in T]
    headers = "TRACE t_us,ref_deg,pos_deg,duty"
    found = propose(tmp_path, headers, times, joint["r"], joint["y"], joint["F"])
    assert roles(found) == {"t": "t_us", "r": "ref_deg", "y": "pos_deg", "u": "duty"}
    t = found.signal("t")
    assert t is not None and t.unit == "us"


@pytest.mark.parametrize("drive", ["b", "u"])
def test_a_late_speed_that_is_called_a_force_is_none(tmp_path: Path, drive: str) -> None:
    """Filtered over 50 ms it is a damping beside a mass below 0, and had been "99 % inertia and
    friction" by its letter."""
    rng, n, h = np.random.default_rng(0), 6000, 2e-3
    t = h * np.arange(n, dtype=np.float64)
    force = 30.0 * np.sin(3.8 * t) + 15.0 * np.sin(10.7 * t + 1.0)
    force += 8.0 * np.sign(np.sin(1.4 * t))
    v = np.zeros(n)
    for k in range(n - 1):
        held = 5.0 * np.sign(v[k]) if abs(v[k]) > 1e-3 else np.clip(force[k], -5.0, 5.0)
        v[k + 1] = v[k] + h / 2.0 * (force[k] - held - 20.0 * v[k])
    late = lfilter([1.0 / 26.0], [1.0, -25.0 / 26.0], v + 1e-3 * rng.standard_normal(n))
    y = h * np.cumsum(v) + 1e-5 * rng.standard_normal(n)
    found = propose(tmp_path, f"t,y,F,{drive}", t, y, late, force + 5.0 * rng.standard_normal(n))
    assert drive in roles(found).values() and "F" not in roles(found).values()
