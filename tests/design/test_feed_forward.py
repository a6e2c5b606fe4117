"""Feed-forward and the reference that is moved within limits, in the loop and as a program."""

import math

import numpy as np
import pytest

from design.controller_program import ProgramUnits, controller_program
from design.feed_forward import FeedForward, feed_forward_force
from design.present import cascade_to_rst
from design.program_run import ProgramRun
from design.servo import Servo, simulate_servo
from design.servo_kernels import PATH_TURN, profiled
from identification.arrays import Array
from identification.errors import BadModel
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant

H = 1e-3
AHEAD = FeedForward(10.0, 12.0, 20.0, 25.0, 2e-3, 3.0, 60.0)
PLANT = Plant(Karnopp(3.0, 10.0, 12.0, 20.0, 25.0, 5e-3, -5e-3, 14.0, -15.0), Motor(1.0))
RATE, ACCELERATION = 0.3, 5.0


def servo(ahead: FeedForward | None) -> Servo:
    cascade = cascade_to_rst(20.0, 300.0, 0.1, H, eps=1e-3, v_ff=1.0)
    return Servo(
        cascade, None, friction=ahead, rate=RATE, acceleration=ACCELERATION, control_limit=100.0
    )


@pytest.mark.parametrize(
    ("v", "a", "force"),
    [
        (0.1, 1.0, 10.0 + 2.0 + 3.0), (-0.1, 0.0, -12.0 - 2.5), (1e-3, 0.0, 5.0 + 0.02),
        (0.0, -2.0, -6.0), (0.1, 100.0, 60.0), (-0.1, -100.0, -60.0),
    ],
)  # fmt: skip
def test_force_is_that_of_the_reference_s_motion(v: float, a: float, force: float) -> None:
    assert feed_forward_force(AHEAD.law, AHEAD.law, v, a) == pytest.approx(force)


def moved(r: Array) -> Array:
    past = np.array([r[0], 0.0, 0.0, 0.0, r[0], 0.0, 0.0, 0.0])
    return np.array([profiled(RATE * H, ACCELERATION * H * H, past, float(one)) for one in r])


def kept(x: Array) -> bool:
    """Whether the acceleration is kept."""
    return bool(np.max(np.abs(np.diff(x, 2))) <= (1.0 + 1e-6) * ACCELERATION * H * H)


def test_a_step_becomes_a_trapezoid_that_stops_at_its_end() -> None:
    r = np.where(np.arange(1500) < 10, 0.0, 0.1)
    x = moved(r)
    assert x[-1] == 0.1
    assert np.max(x) < 0.1 + 2.0 * ACCELERATION * H * H
    assert np.max(np.abs(np.diff(x))) <= RATE * H * (1.0 + 1e-9)
    assert kept(x)
    shortest = 0.1 / RATE + RATE / ACCELERATION
    assert H * int(np.argmax(x >= 0.1)) == pytest.approx(0.01 + shortest, abs=0.02)


@pytest.mark.parametrize("faster", [0.3, 1.0, 8.0])
def test_a_path_is_taken_as_it_is_however_fast(faster: float) -> None:
    t = H * np.arange(3000)
    rise = np.minimum(t, 1.0)
    r = faster * RATE * np.sin(5.0 * t) / 5.0 * rise**2 * (3.0 - 2.0 * rise)
    r[2500:] = r[2499] + (r[2499] - r[2498]) * np.arange(1, 501)
    hardest = float(np.max(np.abs(np.diff(r, 3)))) / (ACCELERATION * H * H)
    assert hardest < PATH_TURN
    np.testing.assert_array_equal(moved(r), r)


@pytest.mark.parametrize("speed", [0.2, 2.0])
def test_after_a_kink_a_path_is_caught_up_with_within_the_acceleration(speed: float) -> None:
    t = H * np.arange(4000)
    r = speed * np.maximum(t - 0.5, 0.0)
    x = moved(r)
    assert kept(x)
    behind = speed**2 / (2.0 * ACCELERATION)
    assert np.max(r - x) == pytest.approx(behind, rel=0.05)
    np.testing.assert_array_equal(x[-1500:], r[-1500:])


def test_one_that_turns_back_on_the_way_is_followed_within_the_limits() -> None:
    r = np.concatenate([np.zeros(5), np.full(250, 0.2), np.full(1500, -0.05)])
    x = moved(r)
    assert x[-1] == -0.05
    assert kept(x)


def test_with_it_the_machine_follows_several_times_more_closely() -> None:
    r = np.where(np.arange(3000) < 100, 0.0, 0.1)
    x = moved(r)
    errors = [
        float(np.max(np.abs(x - simulate_servo(PLANT, servo(one), r, H).y)))
        for one in (AHEAD, None)
    ]
    assert errors[0] < 0.3 * errors[1]


def test_the_program_gives_what_the_simulation_gave_in_every_bit() -> None:
    rng = np.random.default_rng(0)
    r = np.repeat(0.05 * rng.integers(-2, 3, size=8), 400).astype(np.float64)
    r[:400] = 0.0
    run = simulate_servo(PLANT, servo(AHEAD), r, H)
    program = controller_program("axis", servo(AHEAD), H, ProgramUnits(), 1.0)
    assert {"r_step", "v_ref", "F_ff"} <= {one.name for one in program.states}
    step = ProgramRun(program, 0.0).step
    found = np.array([step(a, b) for a, b in zip(r, run.y_measured, strict=True)])
    np.testing.assert_array_equal(found, run.u)


def test_what_is_no_feed_forward_or_limit_is_refused() -> None:
    with pytest.raises(BadModel, match="band"):
        FeedForward(10.0, 12.0, 20.0, 25.0, 0.0, 3.0, 60.0)
    with pytest.raises(BadModel, match="limited acceleration"):
        Servo(servo(None).position, None, acceleration=math.inf)
