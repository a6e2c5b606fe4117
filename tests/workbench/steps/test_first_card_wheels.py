"""A first card for logs of students' rigs: signs without a return, speeds of many names, PWMs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from design.first_card.proposal import Proposal
from identification.columns.clock import counts_thousandths
from identification.errors import BadLog
from workbench.steps.first_card.proposal import proposed

Floats = np.ndarray[Any, np.dtype[np.floating[Any]]]
H = 0.005


def propose(folder: Path, headers: str, *columns: Floats, axis: str | None = None) -> Proposal:
    path = folder / "run.csv"
    rows = (",".join(f"{one:.9g}" for one in row) for row in np.column_stack(columns).tolist())
    path.write_text("\n".join([headers, *rows]), "utf-8")
    return proposed(path, axis=axis)


def driven(u: Floats, m: float, F_c: float, F_v: float) -> tuple[Floats, Floats]:
    """Position and speed of a body from rest, by the force u (n,)."""
    y, v = np.zeros(len(u)), np.zeros(len(u))
    for k in range(1, len(u)):
        pushed = u[k] - F_v * v[k - 1]
        rests = v[k - 1] == 0.0 and abs(u[k]) <= F_c
        friction = pushed if rests else F_c * np.sign(v[k - 1] or u[k])
        v[k] = v[k - 1] + H / m * (pushed - friction)
        v[k] = 0.0 if v[k] * v[k - 1] < 0.0 else v[k]
        y[k] = y[k - 1] + H * v[k]
    return y, v


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_inertia_gives_the_sign_where_the_motion_does_not_come_back(
    tmp_path: Path, sign: float
) -> None:
    """A cart that is pushed hard there and back, and stops before the middle of its stroke."""
    t = H * np.arange(240)
    pushed = np.select([t < 0.3, t < 0.6], [-4.0 + 3.0 * t, 4.7 - t], 0.5)
    u = np.where(t < 0.1, 0.6, pushed) + 0.3 * np.sin(40.0 * t)
    y, _ = driven(u, m=0.19, F_c=0.1, F_v=1.0)
    found = propose(tmp_path, "ms,X,U", 1e3 * t, 0.2 + y, sign * u)
    one = found.signal("u")
    assert one is not None and (one.gain == -1.0) == (sign < 0.0)
    assert ("with this sign the mass is positive" in one.why) == (sign < 0.0)


def test_a_pendulum_that_turns_far_does_not_turn_its_torque(tmp_path: Path) -> None:
    """Its weight is no force linear in place: what the acceleration explains has the wrong sign."""
    t = H * np.arange(2400)
    y, v, torque = np.zeros(len(t)), 0.0, np.zeros(len(t))
    for k in range(1, len(t)):
        torque[k] = np.clip(3.0 * (2.2 * np.sin(1.9 * t[k]) - y[k - 1]), -1.0, 1.0)
        v += H / 0.06 * (torque[k] - 2.6 * np.sin(y[k - 1]) - 0.02 * v)
        y[k] = y[k - 1] + H * v
    one = propose(tmp_path, "time,position,torque", t, y, torque).signal("F")
    assert one is not None and one.gain is None


def wheels() -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Clock, and command and angle of two wheels that turn together."""
    t = H * np.arange(500)
    left = 60.0 * np.sign(np.sin(2.1 * t)) + 20.0 * np.sin(9.0 * t)
    right = 1.05 * left + 2.0
    return t, left, driven(left, 0.2, 8.0, 3.0)[0], right, driven(right, 0.2, 8.5, 3.1)[0]


def test_the_angle_of_another_axis_is_no_reference(tmp_path: Path) -> None:
    t, left, angle, right, other = wheels()
    speeds = np.gradient(angle, H), np.gradient(other, H)
    headers = "time,leftSpeed,leftCommand,leftAngle,rightSpeed,rightCommand,rightAngle"
    found = propose(tmp_path, headers, t, speeds[0], left, angle, speeds[1], right, other)
    assert found.signal("r") is None
    assert [found.signal(name) is not None for name in "yu"] == [True, True]


def test_what_was_made_of_the_position_drives_nothing_whatever_its_name(tmp_path: Path) -> None:
    """CURRENT as the present one: a speed, beside the PWM that drives."""
    t, pwm, angle, *_ = wheels()
    speed = np.gradient(angle, H)
    found = propose(tmp_path, "TIMESTAMP,PWM_M1,CURRENT_M1,POS_M1", 1e3 * t, pwm, speed, angle)
    one = found.signal("u")
    assert found.kind == "motor" and one is not None and one.column == "PWM_M1"
    assert "derivative" in found.unused["'CURRENT_M1'"]
    with pytest.raises(BadLog, match="no column moves as a body that another one drives"):
        propose(tmp_path, "TIMESTAMP,w,theta", 1e3 * t, speed, angle)


def test_a_command_in_volts_stands_before_the_counts_of_its_pwm(tmp_path: Path) -> None:
    t, pwm, angle, *_ = wheels()
    counts = np.round(2.5 * pwm)
    found = propose(tmp_path, "Tiempo (s),PWM,Voltaje (V),Angulo (rad)", t, counts, 9.0 / 255.0
                    * counts, angle)  # fmt: skip
    one = found.signal("u")
    assert one is not None and (one.column, one.unit) == ("Voltaje (V)", "V")


def test_a_pwm_above_100_is_no_share_in_percent(tmp_path: Path) -> None:
    t, pwm, angle, *_ = wheels()
    one = propose(tmp_path, "time,pwm,theta", t, np.round(2.5 * pwm), angle).signal("u")
    assert one is not None and (one.unit, one.sure) == ("1", False)


def test_a_header_names_no_clock_that_nothing_logs_as_fast(tmp_path: Path) -> None:
    t, pwm, angle, *_ = wheels()
    one = propose(tmp_path, "time_us,pwm,theta", 0.1 * t, pwm, angle).signal("t")
    assert one is not None and (one.unit, one.sure) == ("s", False)
    assert "the header's us makes rows 5e-10 s apart" in one.why


@pytest.mark.parametrize("header", ["Step", "n"])
def test_a_counter_is_no_signal_where_the_rows_come_unevenly(tmp_path: Path, header: str) -> None:
    """Whole milliseconds that a loop counts, beside the stamps that the reader gave the rows."""
    rng = np.random.default_rng(2)
    counted = 9454.0 + np.cumsum(rng.integers(4, 7, 900))
    stamp = 1e-3 * (np.round(counted + rng.uniform(-1.0, 1.0, 900)))
    angle = np.round(200.0 * np.cos(4.0 * stamp))
    with pytest.raises(
        BadLog, match=r"no column moves as a body .*'Theta'; left out: .* as another one"
    ):
        propose(tmp_path, f"Timestamp,{header},Theta", stamp, counted, angle)


def test_the_speed_of_the_motors_angle_drives_nothing(tmp_path: Path) -> None:
    """A pendulum on a motor of which only angle and speed were logged, as the robot sends them."""
    t, _, angle, *_ = wheels()
    swung = 20.0 * np.sin(5.0 * t) + 0.2 * angle
    table = (t, np.gradient(swung, H), swung, np.gradient(angle, H), angle)
    with pytest.raises(BadLog, match="no column moves as a body that another one drives"):
        propose(tmp_path, "time,angle_velocity,angle,motor_velocity,motor_angle", *table)


def test_a_time_that_goes_back_is_named_and_is_no_signal(tmp_path: Path) -> None:
    """A second that a serial port wrote twice, beside the milliseconds of the controller."""
    t, pwm, angle, *_ = wheels()
    stamp = 24.0 + t - np.isin(np.arange(len(t)), (13, 14))
    found = propose(tmp_path, "timestamp,ms,pwm,theta", stamp, 1e3 * t, pwm, angle)
    assert {one.name: one.column for one in found.signals} == {"t": "ms", "y": "theta", "u": "pwm"}
    assert found.unused["'timestamp'"] == "is called a time, but goes back in data row 14"


def steady_speeds(seed: int) -> tuple[Floats, Floats, Floats]:
    """Times [s] of rows about a second apart, in whole ms, and a wheel's command and steady speed
    [rpm] from row to row."""
    rng = np.random.default_rng(seed)
    step = 1.0 + 0.001 * rng.integers(0, 4, 120)
    t = np.round(17.251 + np.cumsum(step), 3)
    u = np.linspace(-240.0, 240.0, 120)
    rpm = np.sign(u) * np.clip(2.4 * np.abs(u) - 35.0, 0.0, None)
    return t, u, rpm + 4.0 * rng.standard_normal(120)


@pytest.mark.parametrize("seed", range(3))
def test_a_clock_to_the_thousandth_that_jitters_is_one_of_seconds(
    tmp_path: Path, seed: int
) -> None:
    found = propose(tmp_path, "time,motorCommand,wheelSpeedRpm", *steady_speeds(seed))
    (clock,) = (one for one in found.signals if one.name == "t")
    assert (clock.unit, clock.sure, clock.rival) == ("s", False, "ms")
    assert "its decimals" in clock.why


@pytest.mark.parametrize("step", [0.125, 1.0 / 3.0, 0.5])
def test_an_even_clock_to_the_thousandth_may_be_one_of_milliseconds(step: float) -> None:
    assert not counts_thousandths(np.round(step * np.arange(400), 3))


def test_a_jittering_clock_finer_than_thousandths_may_be_one_of_milliseconds() -> None:
    steps = np.random.default_rng(1).integers(990, 1010, 400).astype(np.float64)
    assert counts_thousandths(1e-3 * np.cumsum(steps))
    assert not counts_thousandths(0.5e-3 * np.cumsum(steps))


def test_a_speed_that_stays_above_zero_does_not_go_both_ways(tmp_path: Path) -> None:
    """Of four wheels, two of which turn backwards: no command lacks its sign."""
    rng, t = np.random.default_rng(6), 0.02 * np.arange(300)
    up = 30.0 * (1.0 - np.exp(-2.0 * t)) * (1.0 + 0.3 * np.sin(3.0 * t))
    ways = (1.0, 1.0, -1.0, -1.0)
    names = ",".join(f"CURRENT_M{k}" for k in (1, 2, 3, 4))
    drives = ",".join(f"PWM_M{k}" for k in (1, 2, 3, 4))
    seen = [way * up + 0.7 * rng.standard_normal(300).round() for way in ways]
    pwm = [way * (20.0 + rng.uniform(0.0, 30.0, 300)) for way in ways]
    with pytest.raises(BadLog, match="no column moves as a body") as refused:
        propose(tmp_path, f"{names},{drives},time", *seen, *pwm, t)
    assert "never negative" not in str(refused.value)


def test_all_axes_are_said_of_the_card_of_one(tmp_path: Path) -> None:
    t = H * np.arange(2000)
    columns, names = [t], ["time"]
    for k in (1, 2, 3):
        u = 3.0 * np.sin((1.0 + 0.4 * k) * t) + np.sin(7.0 * t + k)
        _, v = driven(u, 0.05, 0.3, 0.2)
        columns, names = [*columns, v, u], [*names, f"SPEED_M{k}", f"PWM_M{k}"]
    found = propose(tmp_path, ",".join(names), *columns, axis="1")
    assert any("3 axes in this log: 1, 2, 3; this card is of 1" in one for one in found.remarks)
