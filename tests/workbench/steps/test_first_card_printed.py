"""A first card for logs that somebody's own program prints: words of its own for what it shows."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.init_real_tables import machine
from benchmarks.init_table_words import KINDS as TABLES
from design.first_card.proposal import Proposal
from identification.arrays import Array
from identification.errors import BadLog
from workbench.steps.first_card.proposal import proposed

T: Array = np.asarray(2e-3 * np.arange(5000), dtype=np.float64)
NO_BODY = "no column moves as a body that another one drives"


@pytest.fixture(scope="module")
def joint() -> dict[str, Array]:
    """The signals of a joint behind a limited loop, in SI."""
    return machine(np.random.default_rng(5), T, TABLES["choose"][0])


def propose(folder: Path, headers: str, *columns: Array) -> Proposal:
    rows = (",".join(f"{one:.9g}" for one in row) for row in np.column_stack(columns).tolist())
    path = folder / "run.csv"
    path.write_text("\n".join([headers, *rows]), "utf-8")
    return proposed(path)


def roles(found: Proposal) -> dict[str, str | int]:
    return {one.name: one.column for one in found.signals}


@pytest.mark.parametrize("word", ["current", "input"])
def test_beside_a_target_the_current_one_is_the_present_one(
    joint: dict[str, Array], tmp_path: Path, word: str
) -> None:
    table = (T, 600.0 * joint["r"], 600.0 * joint["y"], np.round(60.0 * joint["u"]))
    found = propose(tmp_path, f"timestamp,target,{word},pwm", *table)
    assert roles(found) == {"t": "timestamp", "r": "target", "y": word, "u": "pwm"}


def test_beside_a_position_a_current_is_one(joint: dict[str, Array], tmp_path: Path) -> None:
    found = propose(tmp_path, "t,target,position,current", T, joint["r"], joint["y"], joint["u"])
    assert roles(found) == {"t": "t", "r": "target", "y": "position", "u": "current"}


def test_one_of_several_motors_drives_none_of_the_others(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    """Angles of a robot's motors, of which no drive is logged."""
    many = [np.roll(joint["y"], 700 * k) + 0.1 * k * np.sin(T) for k in range(4)]
    with pytest.raises(BadLog, match=NO_BODY):
        propose(tmp_path, "timestamp,motor_0,motor_1,motor_2,motor_3", T, *many)


def test_a_command_that_the_position_follows_in_its_size_drives_nothing(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    with pytest.raises(BadLog, match=NO_BODY):
        propose(tmp_path, "timestamp,loc_cmd,loc_state", T, joint["r"], joint["y"])


def test_a_second_encoder_is_no_reference(joint: dict[str, Array], tmp_path: Path) -> None:
    """Motor and load of a stiff drive: neither is ahead of the other."""
    table = (T, joint["y"] + 2e-3 * joint["F"], joint["y"], joint["F"])
    found = propose(tmp_path, "time_s,motor_pos_rad,load_pos_rad,torque_Nm", *table)
    assert set(roles(found)) == {"t", "y", "F"}


def test_what_counts_of_a_converter_mean_goes_before_them(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    steps = {"pos": 25.0 / 65535.0, "trq": 36.0 / 4095.0}
    pos, trq = (np.round(joint[of] / step) for of, step in zip("yF", steps.values(), strict=True))
    table = (T, steps["pos"] * pos, steps["trq"] * trq, 32768.0 + pos, 2048.0 + trq)
    found = propose(tmp_path, "timestamp,position,torque,raw_pos,raw_torque", *table)
    assert roles(found) == {"t": "timestamp", "y": "position", "F": "torque"}


def test_of_two_equal_columns_the_filtered_one_is_left_out(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    found = propose(tmp_path, "t,pos_meas,pos_filt,torque", T, joint["y"], joint["y"], joint["F"])
    assert roles(found)["y"] == "pos_meas"


def test_the_way_that_a_wheel_has_rolled_is_no_position(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    gone = np.cumsum(np.abs(np.diff(joint["y"], prepend=joint["y"][:1])))
    table = (T, gone, joint["y"], joint["u"])
    found = propose(tmp_path, "t,tacho_abs_meters,tacho_meters,motor_current", *table)
    assert roles(found) == {"t": "t", "y": "tacho_meters", "u": "motor_current"}
    assert "the way that 'tacho_meters' goes" in found.unused["'tacho_abs_meters'"]


def test_what_a_speed_follows_is_no_reference_of_its_sum(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    asked = np.convolve(joint["v"], np.ones(40) / 40.0)[20 : len(T) + 20]
    found = propose(tmp_path, "t,speed,target,pwm", T, joint["v"], asked, joint["u"])
    assert roles(found) == {"t": "t", "y": "speed", "u": "pwm"}


def test_a_pwm_of_motor_m1_is_no_force(joint: dict[str, Array], tmp_path: Path) -> None:
    u = propose(tmp_path, "t,angle,PWM_M1", T, joint["y"], joint["u"]).signal("u")
    assert u is not None and u.unit not in ("N", "N m")


def test_a_measured_current_goes_before_the_one_asked_for(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    measured = joint["F"] + 0.01 * np.random.default_rng(2).standard_normal(len(T))
    found = propose(tmp_path, "t,pos,iq_ref,iq_meas", T, joint["y"], joint["u"], measured)
    assert roles(found)["u"] == "iq_meas"


def test_three_phases_are_known_without_their_unit(joint: dict[str, Array], tmp_path: Path) -> None:
    turn = 7.0 * joint["y"]
    phases = [joint["F"] * np.sin(turn + k * 2.0 * np.pi / 3.0) for k in range(3)]
    headers = "t,angle,phase_a_current,phase_b_current,phase_c_current"
    with pytest.raises(BadLog, match="three phase currents"):
        propose(tmp_path, headers, T, joint["y"], *phases)


@pytest.mark.parametrize("at_a_time", [2, 5, 20])
def test_rows_that_a_reader_stamped_several_at_a_time_are_even(
    joint: dict[str, Array], tmp_path: Path, at_a_time: int
) -> None:
    """Lines of a serial port, each with the time at which the computer came to it."""
    rng = np.random.default_rng(4)
    read = np.repeat(np.arange(0, len(T), at_a_time), at_a_time)[: len(T)]
    found_at = 2e-3 * (read + at_a_time) + 1e-4 * rng.random(len(T))[read]
    stamps = found_at + 1e-4 * (np.arange(len(T)) - read) + 4e-5 * rng.random(len(T))
    y, r = (np.round(600.0 * joint[of]) for of in "yr")
    found = propose(tmp_path, "timestamp,target,position,pwm", stamps, r, y, joint["u"])
    assert roles(found) == {"t": "timestamp", "r": "target", "y": "position", "u": "pwm"}
    assert f"rows stamped about {at_a_time} at a time, late: taken as even rows" in found.remarks
    assert any("every 0.002 s, an even clock" in one for one in found.remarks)


def test_counts_are_no_millimetres_of_a_target_in_counts(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    y, r = (np.round(6000.0 * joint[of]) for of in ("y", "target"))
    one = propose(tmp_path, "t,target,position,pwm", T, r, y, joint["u"]).signal("y")
    assert one is not None and (one.unit, one.sure) == ("count", False)
    assert "data sheet" in one.why


def test_a_motors_torque_is_one_though_it_twists_the_shaft(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    """What is proportional to the difference of two angles is no error where its unit says so."""
    load = -0.2 * joint["F"] - 0.5 * np.tanh(joint["v"])
    twisted = joint["y"] + 0.02 * joint["F"]
    headers = "t_s,theta_motor_rad,theta_load_rad,T_motor_Nm,T_load_Nm"
    found = propose(tmp_path, headers, T, twisted, joint["y"], joint["F"], load)
    one = found.signal("F")
    assert one is not None and one.column == "T_motor_Nm"


def test_a_torque_in_percent_of_the_rated_one_is_a_command(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    found = propose(tmp_path, "t,angle_deg,Torque[%]", T, 57.3 * joint["y"], 10.0 * joint["F"])
    one = found.signal("u")
    assert (
        found.kind == "motor" and one is not None and (one.column, one.unit) == ("Torque[%]", "%")
    )


def test_beside_a_left_wheel_r_is_the_right_one(joint: dict[str, Array], tmp_path: Path) -> None:
    table = (T, joint["y"], np.roll(joint["y"], 3), joint["F"])
    found = propose(tmp_path, "t,l_wheel_pos_rad,r_wheel_pos_rad,l_wheel_torque_Nm", *table)
    assert roles(found) == {"t": "t", "y": "l_wheel_pos_rad", "F": "l_wheel_torque_Nm"}


def test_a_supply_is_no_chamber(joint: dict[str, Array], tmp_path: Path) -> None:
    noise = np.random.default_rng(3).standard_normal((3, len(T)))
    supply, cap, rod = 160.0 + 0.2 * noise[0], 60.0 + 5.0 * joint["F"], 60.0 - 8.0 * joint["F"]
    headers = "time_s,Position [mm],Supply [bar],Cap End [bar],Rod End [bar]"
    table = (T, 250.0 + joint["y"], supply, cap + 0.05 * noise[1], rod + 0.05 * noise[2])
    found = propose(tmp_path, headers, *table)
    assert {roles(found)["p_p"], roles(found)["p_n"]} == {"Cap End [bar]", "Rod End [bar]"}


def test_a_target_in_steps_to_whose_ends_the_position_goes_drives_nothing(tmp_path: Path) -> None:
    """Behind a slow loop, beside a current of the other sign."""
    h, x, v = 2e-3, 0.0, 0.0
    target = np.sign(np.sin(0.5 * np.pi * T + 0.3))
    y, u = np.zeros(len(T)), np.zeros(len(T))
    for k in range(len(T)):
        y[k], u[k] = x, np.clip(12.0 * (target[k] - x) - 4.0 * v, -4.0, 4.0)
        for _ in range(4):
            v += 0.25 * h * (u[k] - 0.8 * np.tanh(100.0 * v) - 0.2 * v) / 0.3
            x += 0.25 * h * v
    noise = np.random.default_rng(0).standard_normal((2, len(T)))
    table = (30.0 * target, 30.0 * y + 1e-3 * noise[0], -u + 0.05 * noise[1])
    found = propose(tmp_path, "a,b,c,d", T, *table)
    assert roles(found) == {"t": "a", "r": "b", "y": "c", "u": "d"}
    kind = next(one for one in found.rig if one.key == "kind")
    assert "a rig of kind force would be driven by 'd'" in kind.why


def test_a_position_that_goes_up_as_a_clock_does_is_named_as_one(tmp_path: Path) -> None:
    up = np.cumsum(1.0 + 0.1 * np.sin(T) ** 2)
    with pytest.raises(BadLog, match="'y' is taken for the clock as it goes up: is it one"):
        propose(tmp_path, "y,w,s", up, np.gradient(up), np.random.default_rng(0).normal(size=5000))
