"""The servo: its parts against written equations, the sampled object, saturation, rivals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from design.compensator import Compensator
from design.filters import CompensatorFilters, rig_filters, simulation_filters
from design.force_pi import ForcePI
from design.linear import commanded_plant
from design.loop import Cascade, LoopNoise, simulate_loop
from design.pid import pd_to_rst, pid_to_rst
from design.rivals import DisturbanceObserver, Dither, FrictionObserver, IntegralPID
from design.rst import RST
from design.servo import (
    Compensation,
    Countermeasure,
    FrictionCompensator,
    Servo,
    ServoRun,
    moved_reference,
    simulate_servo,
)
from identification.arrays import Array
from identification.errors import BadModel, BadSpecification
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.signals.filters import RIG_A, RIG_C, apply_filter, fir_lowpass, velocity
from tests.identification.plants import ACTUATOR, table

H, N = 1e-3, 6000
PLANT = Plant(table(1), ACTUATOR)
PI = ForcePI(0.02, 0.05)
PD = pd_to_rst(200.0, 0.1, 0.2, H)
PID = pid_to_rst(1754.0, 0.072, 0.018, 0.2, H)
OWN = Compensator(table(1), 2.0, 0.003)
FOUR = Compensation(OWN, simulation_filters(H))
OBSERVER = DisturbanceObserver(1.0, 250.0, 40.0)
KALMAN = FrictionObserver(1.0, 300.0, 200.0, 0.05, 200.0, 1e-5)


def step(height: float = 0.05, n: int = N) -> Array:
    """A step at 0.2 s [m]."""
    return np.where(np.arange(n) < 200, 0.0, height)


def run(servo: Servo, plant: Plant = PLANT, n: int = N) -> ServoRun:
    """The step with the paper's noise."""
    noise = LoopNoise.draw(n, 1e-5, 1e-2, np.random.default_rng(1))
    return simulate_servo(plant, servo, step(n=n), H, noise=noise)


def rest(one: ServoRun) -> float:
    """Largest error of the last second [m]."""
    return float(np.max(np.abs(one.r - one.y)[-1000:]))


@pytest.mark.parametrize("what", [FOUR, OBSERVER, KALMAN])
def test_the_sampled_object_gives_what_the_simulation_had(what: Countermeasure) -> None:
    found = run(Servo(PD, PI, what))
    alone = FrictionCompensator(what, H)
    made = [
        alone.step(*sample)
        for sample in zip(
            found.r.tolist(), found.y_measured.tolist(), found.F_measured.tolist(), strict=True
        )
    ]
    assert np.max(np.abs(np.array(made) - found.compensation_filtered)) < 1e-9
    assert np.ptp(made) > 10.0


def test_filters_velocity_and_law_are_the_written_ones() -> None:
    found = run(Servo(PD, PI, FOUR))
    low = fir_lowpass(5.0, H)
    y_f = apply_filter(low, np.concatenate([np.zeros(100), found.y_measured]))
    assert np.allclose(velocity(y_f, H)[100:], found.velocity, atol=1e-9)
    e = found.r - y_f[100:]
    parts = zip(found.velocity.tolist(), e.tolist(), found.F_measured.tolist(), strict=True)
    F_comp = np.array([OWN.force(*part) for part in parts])
    # At the edge of a band the last digit of the velocity decides.
    assert np.mean(np.abs(F_comp - found.compensation) > 1e-6) < 1e-3
    F_compf = apply_filter(low, np.concatenate([np.zeros(100), found.compensation]))[100:]
    assert np.allclose(F_compf, found.compensation_filtered, atol=1e-9)


def test_the_force_loop_is_asked_for_both_forces() -> None:
    found = run(Servo(PD, PI, FOUR))
    error = found.force_reference + found.compensation_filtered - found.F_measured
    u = 0.02 * (error + np.concatenate([[0.0], np.cumsum(error)[:-1]]) * H / 0.05)
    assert np.allclose(u, found.u, atol=1e-9)


def test_without_a_countermeasure_it_is_the_plain_loop() -> None:
    noise = LoopNoise.draw(N, 1e-5, 1e-2, np.random.default_rng(1))
    plain = simulate_loop(PLANT, Cascade(PID, PI), step(), H, noise=noise)
    assert np.max(np.abs(run(Servo(PID, PI)).y - plain.y)) < 1e-10


def test_an_integral_pid_without_rule_is_its_linear_form() -> None:
    pid = IntegralPID(1754.0, 0.072, 0.018, 0.2, H)
    assert np.max(np.abs(run(Servo(pid, PI)).y - run(Servo(PID, PI)).y)) < 1e-9


def test_a_reset_integral_starts_anew_where_the_error_changes_sign() -> None:
    pid = IntegralPID(1754.0, 0.072, 0.0, 0.2, H, "reset")
    found = run(Servo(pid, PI))
    e = found.r - found.y_measured
    total = found.force_reference / 1754.0 - e
    crossed = e[1:] * e[:-1] < 0.0
    assert np.all(np.abs(total[1:][crossed]) < 1e-12)
    assert np.count_nonzero(crossed) > 3
    assert np.max(np.abs(total)) > 0.05


def test_inside_its_dead_zone_the_integral_rests() -> None:
    pid = IntegralPID(1754.0, 0.072, 0.0, 0.2, H, "dead-zone", 0.002)
    found = run(Servo(pid, PI))
    e = found.r - found.y_measured
    total = found.force_reference / 1754.0 - e
    moved = np.abs(np.diff(total)) > 1e-12
    assert np.array_equal(moved, (np.abs(e) > 0.002)[:-1])
    assert 100 < np.count_nonzero(moved) < N - 1000


def test_figure_6_the_zero_velocity_term_takes_the_error_away() -> None:
    none = rest(run(Servo(PD, PI), n=12000))
    without = rest(
        run(Servo(PD, PI, replace(FOUR, compensator=replace(OWN, inner="none"))), n=12000)
    )
    whole = rest(run(Servo(PD, PI, FOUR), n=12000))
    assert none > 0.04
    assert without > 5.0 * whole
    assert whole < 0.003  # e_T


@pytest.mark.parametrize("what", [OBSERVER, KALMAN])
def test_the_observers_find_the_friction(what: Countermeasure) -> None:
    found = run(Servo(PD, PI, what))
    # Sliding: Coulomb friction of table 1 (the observer's viscous part is not the plant's).
    fast = (found.v > 0.03) & (np.arange(N) > 300)
    slack = 0.0 if isinstance(what, FrictionObserver) else 50.0 * float(np.max(found.v[fast]))
    estimate = float(np.median(found.compensation[fast]))
    assert 8.0 < estimate < 16.0 + slack
    assert rest(found) < 0.1 * rest(run(Servo(PD, PI)))


@pytest.mark.parametrize("ratio", [1, 5])
def test_a_limited_reference_is_the_moved_one_given(ratio: int) -> None:
    position = pd_to_rst(200.0, 0.1, 0.2, ratio * H)
    moved = np.minimum(0.05, 0.1 * H * np.maximum(np.arange(N) - 199, 0))
    limited = simulate_servo(PLANT, Servo(position, PI, FOUR, rate=0.1), step(), H)
    given = simulate_servo(PLANT, Servo(position, PI, FOUR), moved, H)
    assert np.array_equal(limited.r, step())
    assert np.max(np.abs(limited.y - given.y)) < 1e-9
    assert np.max(np.abs(limited.y - run(Servo(PD, PI, FOUR)).y)) > 1e-3


def test_dither_shakes_the_command() -> None:
    shaken = run(Servo(PD, PI, dither=Dither(0.2, 50.0)))
    plain = run(Servo(PD, PI))
    assert np.std(shaken.u[-1000:]) > 10.0 * np.std(plain.u[-1000:])


@pytest.mark.parametrize("time", [0.2, 0.05])
def test_a_clipped_command_winds_less_up(time: float) -> None:
    """A valve of 0.1 V limits the speed to 0.19 m/s."""
    over = {}
    for tracking_time in (None, time):
        servo = Servo(PID, PI, control_limit=0.1, anti_windup=tracking_time)
        found = simulate_servo(PLANT, servo, step(0.3, 8000), H)
        assert np.max(np.abs(found.u)) <= 0.1
        over[tracking_time] = float(np.max(found.y)) / 0.3 - 1.0
        assert abs(found.y[-1] - 0.3) < 0.02
    assert over[None] > over[time] + 0.05


def test_an_unclipped_command_is_not_touched_by_anti_windup() -> None:
    plain = run(Servo(PID, PI))
    for time in (0.0, 0.1):
        assert np.max(np.abs(run(Servo(PID, PI, anti_windup=time)).y - plain.y)) < 1e-10


def test_the_force_reference_keeps_its_limit() -> None:
    found = run(Servo(PID, PI, FOUR, force_limit=30.0))
    assert np.max(np.abs(found.force_reference + found.compensation_filtered)) <= 30.0 + 1e-9


def test_figure_1_a_motor_takes_the_compensation_as_a_command() -> None:
    plant = Plant(table(1), Motor(35.15))
    pd = pd_to_rst(200.0 / 35.15, 0.1, 0.2, H)
    filters = CompensatorFilters(RIG_A, RIG_A, RIG_C)
    with_, without = (
        run(Servo(pd, None, what), plant) for what in (Compensation(OWN, filters), None)
    )
    assert rest(without) > 0.04
    assert rest(with_) < 0.003
    u = with_.force_reference + with_.compensation_filtered / 35.15
    assert np.allclose(u, with_.u, atol=1e-12)


def test_both_readings_of_the_rigs_filters() -> None:
    by_delay, by_letter = rig_filters(0.01), rig_filters(0.01, as_lettered=True)
    assert (by_delay.velocity, by_delay.error) == (by_letter.error, by_letter.velocity)
    assert by_delay.error == RIG_A
    assert len(by_delay.velocity.b) == 41
    assert by_delay.force == RIG_C


def test_parts_that_do_not_fit_are_refused() -> None:
    with pytest.raises(BadModel, match="force controller"):
        run(Servo(PD, None, FOUR))
    with pytest.raises(BadSpecification, match="zone"):
        IntegralPID(1.0, 1.0, 0.0, 0.1, H, "dead-zone", -1.0)
    with pytest.raises(BadSpecification, match="plain, dead-zone, reset"):
        IntegralPID(1.0, 1.0, 0.0, 0.1, H, "other")  # type: ignore[arg-type]
    with pytest.raises(BadSpecification, match="dither"):
        Dither(0.0, 50.0)
    with pytest.raises(BadSpecification, match="rad/s"):
        DisturbanceObserver(1.0, 1.0, 0.0)
    with pytest.raises(BadSpecification, match="must be > 0"):
        FrictionObserver(1.0, 1.0, 1.0, 0.0, 1.0, 1.0)


def test_a_command_without_a_force_loop_closes_the_linear_loop() -> None:
    h, k = 1e-3, 2.0  # V/m
    drive = Actuator(19530.0, 10405.0)
    slippery = Plant(Karnopp(1.0, 1e-9, 1e-9, 300.0, 300.0, 1e-9, -1e-9, 1e-9, -1e-9), drive)
    gain = RST(np.array([k]), np.ones(1), np.array([k]), h)
    r = np.full(400, 0.05)
    r[0] = 0.0
    found = simulate_servo(slippery, Servo(gain, None, direct=True), r, h)
    A, B = commanded_plant(1.0, 300.0, h, drive)
    size = max(len(A), len(B))
    P = np.pad(A, (0, size - len(A))) + k * np.pad(B, (0, size - len(B)))
    assert np.max(np.abs(found.y - lfilter(k * B, P, r))) < 1e-6
    with pytest.raises(BadModel, match="without a force loop"):
        Servo(gain, PI, direct=True)


@pytest.mark.parametrize("acceleration", [None, 4.0])
def test_a_reference_as_it_is_moved_makes_the_same_run(acceleration: float | None) -> None:
    """Within the servo's speed and acceleration, and taken by the servo as it is."""
    servo = Servo(PD, PI, rate=0.2, acceleration=acceleration)
    slow = moved_reference(servo, step(), H)
    speed = np.diff(slow) / H
    assert np.max(np.abs(speed)) < 0.2 + 1e-9 and slow[-1] == pytest.approx(0.05, abs=1e-9)
    if acceleration is not None:
        assert np.max(np.abs(np.diff(speed))) / H < acceleration * (1.0 + 1e-6)
    by_step, by_path = (simulate_servo(PLANT, servo, r, H) for r in (step(), slow))
    assert np.max(np.abs(by_step.y - by_path.y)) < 1e-4
    assert np.array_equal(moved_reference(Servo(PD, PI), step(), H), step())
