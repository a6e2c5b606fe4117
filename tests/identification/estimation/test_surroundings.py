"""Gravity, a constant force and columns of two instants are found, with what friction is beside."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from benchmarks.random_plants import KINDS, drawn, logged
from identification.arrays import Array
from identification.effects._library import built_in
from identification.estimation.fit import fit_plant
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.surroundings import lag_estimate, surroundings, widened_friction
from identification.log import Log, Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.model.size import Size
from identification.model.surroundings import NO_SURROUNDINGS, Surroundings
from identification.simulation.free_run import free_run
from tests.identification.motor_logs import K_A, NINE, made
from tests.identification.plants import made_log, table

ROD = Karnopp(0.15, 0.3, 0.3, 0.05, 0.05, 0.01, -0.01, 0.36, -0.36)
TURNING = Rig("force", motion="rotary")
MOTOR = Rig("motor", force_per_command=K_A)
TURNED = replace(TURNING, kind="motor", force_per_command=1.0)


PULLS = ((0.25, 1.6), (0.6, 1.2), (1.3, 0.8))  # Hz, N m
QUICK = ((0.3, 0.8), (3.0, 1.0), (8.0, 1.0))


def pendulum(
    seed: int, a: float, b: float = 0.0, seconds: float = 20.0,
    pulls: tuple[tuple[float, float], ...] = PULLS, noise_F: float = 5e-3, spring: float = 0.0,
) -> Log:  # fmt: skip
    """A rod pushed to and fro by a torque that is measured; a sin y + b cos y pulls at it, or a
    spring [N m/rad]."""
    h = 2e-3
    t = h * np.arange(round(seconds / h), dtype=np.float64)
    rng = np.random.default_rng(seed)
    waves = [size * np.sin(2 * np.pi * f * t + rng.uniform(0, 2 * np.pi)) for f, size in pulls]
    F = np.sum(waves, axis=0)
    blank = Log("rod", {"t": t, "y": np.zeros(len(t)), "F": F})
    weight = built_in()["gravity"].acting({"a": a, "b": b})
    if spring:
        weight = built_in()["spring"].acting({"k": spring})
    run = free_run(Plant(ROD, None, (weight,)), blank, (0.0, 0.0, float(F[0])), "force")
    noise = rng.standard_normal((2, len(t)))
    return blank.with_signals(y=run.y + 1e-4 * noise[0], F=F + noise_F * noise[1])


def sprung(seed: int, stiffness: float, noise_F: float) -> Log:
    """The rod pushed less far, against a spring [N m/rad]."""
    pulls = ((0.25, 0.8), (0.6, 0.6), (1.3, 0.4))
    return pendulum(seed, 0.0, pulls=pulls, noise_F=noise_F, spring=stiffness)


@pytest.mark.parametrize(("a", "b"), [(3.0, 0.0), (2.0, 1.5)])
def test_gravity_is_found_with_its_interval(a: float, b: float) -> None:
    found = surroundings([pendulum(1, a, b)], TURNING)
    assert found.sine.value == pytest.approx(a, abs=4.0 * found.sine.sd + 0.01)
    assert found.cosine.value == pytest.approx(b, abs=4.0 * found.cosine.sd + 0.01)
    assert found.sine.sd < 0.05


def swung(seed: int) -> list[Log]:
    """Coarse logs of a rod that is driven to and fro quickly."""
    h, rng, logs = 1.0 / 190.0, np.random.default_rng(seed), []
    t = h * np.arange(1140, dtype=np.float64)
    for k, both in enumerate(
        (((1.2, 0.35), (0.3, 1.1)), ((0.9, 0.5), (0.25, 1.5)), ((0.6, 0.9), (0.4, 0.6)))
    ):
        y, v, a = np.zeros((3, len(t)))
        for size, f in both:
            w, phase = 2.0 * np.pi * f, rng.uniform(0, 2 * np.pi)
            y += size * np.sin(w * t + phase)
            v += size * w * np.cos(w * t + phase)
            a -= size * w**2 * np.sin(w * t + phase)
        F = 0.01 * a + 0.05 * np.sign(v) + 0.1 * v + 0.8 * np.sin(y)
        noise = rng.standard_normal((2, len(t)))
        logs.append(Log(f"{k}", {"t": t, "y": y + 1e-3 * noise[0], "F": F + 0.05 * noise[1]}))
    return logs


def test_quick_motion_does_not_bias_gravity() -> None:
    sizes = [surroundings(swung(seed), TURNING).sine.value for seed in range(6)]
    assert np.mean(sizes) == pytest.approx(0.8, abs=2.5e-3)


def test_a_rod_without_weight_has_none() -> None:
    assert surroundings([pendulum(2, 0.0)], TURNING).none


@pytest.mark.parametrize("seed", [3, 4])
def test_a_spring_is_no_weight_though_noise_hides_most_of_the_difference(seed: int) -> None:
    """In 2.5 rad of motion, of which a weight leaves a square that is 14 and 18 % larger."""
    assert surroundings([sprung(seed, 1.5, 0.5)], TURNING).none


def test_a_weight_behind_a_crude_torque_is_no_spring() -> None:
    """As a servo's duty cycle is, one torque of three is off, by y^3: by squares alone, as of white
    noise, a spring was clearly the likelier for all of them, and neither was taken out."""
    *others, last = swung(0)
    crude = last.with_signals(F=np.asarray(last["F"]) - np.asarray(last["y"]) ** 3)
    assert surroundings([*others, crude], TURNING).sine.value == pytest.approx(0.8, rel=0.1)


@pytest.mark.parametrize("seed", [3, 5])
def test_a_spring_over_half_a_turn_is_no_order_of_it(seed: int) -> None:
    assert surroundings([sprung(seed, 1.0, 0.3)], TURNING).none


def test_a_linear_machine_has_no_gravity_by_angle() -> None:
    found = surroundings([pendulum(1, 3.0)], Rig("force"))
    assert found.sine == found.cosine == Size()


@pytest.mark.parametrize("samples", [-4.0, 4.0, 6.0, 20.0, 50.0])
def test_columns_of_two_instants_are_found(samples: float) -> None:
    log = made(4)
    at = np.arange(len(log))
    early = np.interp(at + samples, at, log["u"])  # whose effect comes so much later
    late = log.with_signals(u=early, F=K_A * early)
    found = surroundings([late], MOTOR)
    assert found.lag.value == pytest.approx(samples * log.h, abs=3.0 * found.lag.sd)
    assert found.lag.sd < 0.5 * log.h
    reported = lag_estimate(found)
    assert reported is not None and reported.low is not None and reported.high is not None
    assert reported.low < reported.high


@pytest.mark.parametrize("samples", [-0.25, 0.25])
def test_a_measured_force_may_act_anywhere_within_its_sample(samples: float) -> None:
    """As that of a filtered current does: left in, it was damping, another one in every motion, and
    a machine that stays as it is had drifted."""
    found = surroundings([moved_by(samples)], TURNING)
    assert found.lag.value == pytest.approx(samples * 2e-3, abs=4.0 * found.lag.sd)
    assert 0.0 < found.lag.sd < 0.2e-3 and not found.zoh


@pytest.mark.parametrize(("samples", "whole"), [(0.5, 0.0), (-0.5, -1.0)])
def test_half_a_sample_is_the_lag_of_a_force_that_is_held(samples: float, whole: float) -> None:
    """From its row to the next, or until its row."""
    found = surroundings([moved_by(samples)], TURNING)
    assert found.zoh and found.lag.value == pytest.approx(whole * 2e-3)


@pytest.mark.parametrize("key", ["spring", "backlash"])
def test_a_hold_is_seen_beside_what_is_not_known_yet(key: str) -> None:
    """Of a pull five times as large as what half a sample makes."""
    log = moved_by(0.5)
    y = np.asarray(log["y"])
    if key == "spring":
        log = log.with_signals(F=log["F"] + 0.5 * y)
    else:
        log = log.with_signals(y=y + 2e-4 * np.sign(np.gradient(y)))
    assert surroundings([log], TURNING).zoh


@pytest.mark.parametrize("zoh", [True, False])
def test_a_hold_of_a_jittering_force_is_seen_behind_its_sensors_noise(zoh: bool) -> None:
    """As of a slide behind a loop of 1 kHz, which answers its encoder's noise: rows of the equation
    show no lag there, and half a sample left in takes 0.3 to 0.6 N s/m off a viscous friction of
    50 (five deviations and more)."""
    h, nine = 1e-3, Karnopp(8.0, 20.0, 20.0, 50.0, 50.0, 1e-3, -1e-3, 22.0, -22.0)
    rng, t = np.random.default_rng(1), np.asarray(1e-3 * np.arange(15_000.0), dtype=np.float64)
    F = sum(size * np.sin(2 * np.pi * f * t + f) for f, size in ((0.3, 30), (0.9, 25), (2.1, 20)))
    F = F + rng.standard_normal(len(t))
    fine = np.asarray(np.arange(5 * len(t)) * 0.2 * h, dtype=np.float64)
    acts: Array = np.repeat(F, 5) if zoh else np.interp(fine, t, F)
    blank = Log("slide", {"t": fine, "y": np.zeros(len(fine)), "F": acts})
    run = free_run(Plant(nine), blank, (0.0, 0.0, float(F[0])), "force")
    noise = rng.standard_normal((2, len(t)))
    log = Log("slide", {"t": t, "y": run.y[::5] + 2e-6 * noise[0], "F": F + 0.3 * noise[1]})
    found = surroundings([log], Rig("force"))
    assert found.zoh is zoh and not found.lag.value


def test_a_zero_order_hold_force_is_held_in_the_log_that_is_fitted() -> None:
    log = moved_by(0.5)
    out = surroundings([log], TURNING).taken_out(log)
    assert out.zoh and not log.zoh
    assert motion_log(out, zoh=False, by_command=False).zoh


def moved_by(samples: float) -> Log:
    """A log whose force acts so much later than its row."""
    log = pendulum(3, 0.0, pulls=QUICK)
    at = np.arange(len(log))
    return log.with_signals(F=np.interp(at + samples, at, log["F"]))


def test_no_lag_is_sought_that_is_much_of_a_stroke() -> None:
    """In a quick sine inertia and friction make good for any lag."""
    t = 0.02 * np.arange(3000, dtype=np.float64)
    w = 2.0 * np.pi / (78 * 0.02)
    early = w * (t + 0.36)
    F = 0.7 * np.clip(20.0 * np.cos(early), -1.0, 1.0) - 0.0015 * w**2 * np.sin(early)
    y = 0.5 * np.sin(w * t) + 1e-4 * np.random.default_rng(1).standard_normal(len(t))
    found = surroundings(
        [Log("sine", {"t": t, "y": y, "F": F, "u": F})], replace(MOTOR, force_per_command=1.0)
    )
    assert abs(found.lag.value) <= 12.0 * 0.02


def test_a_weight_is_found_where_one_stroke_alone_goes_up() -> None:
    """Without the eighth of the log that has this stroke nothing would go up."""
    n, each = 10_000, 500
    push = np.concatenate([1.4 * np.sin(np.pi * np.arange(250) / 250), np.zeros(250)])
    command = np.tile(-push, n // each)
    command[1000:1500] = push
    log = made(3, command=command)
    pulled = log.with_signals(F=log["F"] + 60.0, u=log["u"] + 60.0 / K_A)
    found = surroundings([pulled], MOTOR)
    assert found.force.value == pytest.approx(-60.0, abs=0.5 * abs(NINE.F_cp - NINE.F_cn) + 0.5)


@pytest.mark.parametrize("force", [-60.0, 60.0])
def test_a_weight_larger_than_friction_is_taken_out(force: float) -> None:
    log = made(3)
    pulled = log.with_signals(F=log["F"] - force, u=log["u"] - force / K_A)
    found = surroundings([pulled], MOTOR)
    assert found.force.value == pytest.approx(force, abs=0.5 * abs(NINE.F_cp - NINE.F_cn) + 0.5)
    assert found.force.sd >= 0.1 * 0.5 * (NINE.F_cp + NINE.F_cn) / 2.0  # friction may be unequal
    freed = found.taken_out(pulled)
    assert freed["F"] == pytest.approx(pulled["F"] + found.force.value)
    assert freed["u"] == pytest.approx(freed["F"] / K_A)


def test_a_constant_force_is_found_in_strokes_of_one_speed_each_way() -> None:
    """A rod driven up at 5 mm/s and, mostly, down at 11, under friction of 6 and 8 N: pressure on
    another area than the card's leaves -11 N, as a seal's test stand had it. The Coulomb levels at
    rest are not known, and all that goes up was left out as the slow part of the motion."""
    h, rng = 0.01, np.random.default_rng(0)
    speeds = np.tile(np.repeat([5e-3, -11e-3], [200, 700]), 5)
    v = speeds * (1.0 + 0.05 * np.sin(np.arange(len(speeds)) / 30.0))
    F = np.where(v > 0.0, 6.0, -8.0) - 11.0 + 0.2 * rng.standard_normal(len(v))
    y = h * np.cumsum(v) + 1e-5 * rng.standard_normal(len(v))
    log = Log("seal", {"t": h * np.arange(len(v), dtype=np.float64), "y": y, "F": F})
    found = surroundings([log], Rig("force"))
    assert found.force.value == pytest.approx(12.0, abs=0.1)  # of equal friction, 7 N
    assert found.force.sd > 0.05 * 7.0


@pytest.mark.parametrize("period", [0.586, 0.6])
def test_a_switched_command_is_no_friction_a_quarter_period_later(period: float) -> None:
    """A cart under +-13 N, switched every 0.3 s and logged every 13 ms, its friction uneven: at a
    lag of 0.12 s the force is friction of 13 N alone, without a mass and with nothing left."""
    h, sub, rng = 0.0133, 20, np.random.default_rng(4)
    n = 1500
    t = h * np.arange(n, dtype=np.float64)
    force = np.where(t % period < 0.5 * period, 13.3, -13.3)
    v, x, y = 0.0, 0.0, np.zeros(n)
    for k in range(n):
        y[k] = x + 2e-5 * rng.standard_normal()
        for _ in range(sub):
            friction = 3.0 + np.sin(2.0 * np.pi * x / 0.13)
            v += h / sub * (force[k] - friction * np.sign(v)) / 6.3
            x += h / sub * v
    log = Log("cart", {"t": t, "y": y, "F": force, "u": force})
    found = surroundings([log], Rig("motor", force_per_command=1.0))
    assert abs(found.lag.value) < 2.0 * h


def short_swing(size: float, about: float) -> Log:
    """6 s of a pendulum driven about an angle [rad] by sines of this size each, under gravity of 1
    N m and noise of its torque that lasts 0.2 s."""
    h, rng = 1.0 / 190.0, np.random.default_rng(3)
    t = h * np.arange(1140, dtype=np.float64)
    y = about + size * (np.sin(1.9 * t) + np.sin(3.1 * t + 1.0))
    v, a = np.gradient(y, h), np.gradient(np.gradient(y, h), h)
    F = 0.015 * a + 0.05 * np.sign(v) + 0.01 * v + 1.0 * np.sin(y)
    y = y + 5e-4 * rng.standard_normal(len(t))
    F = F + 0.03 * gaussian_filter1d(rng.standard_normal(len(t)), 40.0) * 40.0**0.5
    return Log("swing", {"t": t, "y": y, "F": F, "u": F})


def test_a_cosine_about_a_constant_force_is_left_out_of_gravity() -> None:
    """Beside Coulomb friction the cosine was 0.4 +- 0.4 N m, and friction was below 0 one way."""
    found = surroundings([short_swing(0.2, 0.0)], TURNED)
    assert found.cosine.value == 0.0 < found.cosine.sd
    assert found.sine.value == pytest.approx(1.0, abs=0.15)


def test_gravity_of_a_small_swing_shows_by_its_sine() -> None:
    """Beside the cosine neither was significant, and nothing was taken out."""
    found = surroundings([short_swing(0.1, 0.3)], TURNED)
    assert found.sine.value == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5, 6])
def test_nothing_is_found_where_there_is_nothing(seed: int) -> None:
    assert surroundings([made(seed)], MOTOR).none
    assert surroundings([made_log(table(1), seed, seconds=8.0)], Rig("force")).none


def test_inertia_that_is_small_beside_damping_is_no_lag() -> None:
    """m/F_v of 9 ms and a lag of 9 ms differ by less than the equation errs itself."""
    machine, run = drawn(211, KINDS)
    log = logged(machine, run, 211)[0]
    rig = Rig("motor", force_per_command=machine.k1)
    assert surroundings([log], rig).lag == Size()


def test_motion_one_way_tells_no_constant_force() -> None:
    log = made(3)
    t = np.asarray(log["t"])
    one_way = log.with_signals(y=0.05 * t + 0.01 * np.sin(5.0 * t), F=3.0 + np.sin(5.0 * t))
    assert surroundings([one_way], MOTOR).force == Size()


def test_what_is_not_there_changes_no_log() -> None:
    log = made(1)
    assert NO_SURROUNDINGS.taken_out(log) is log
    assert NO_SURROUNDINGS.effects == ()


def test_a_shifted_log_loses_the_samples_whose_force_is_not_known() -> None:
    log = made(1, n=500)
    later = Surroundings(lag=Size(2.5 * log.h), gives=K_A).taken_out(log)
    earlier = Surroundings(lag=Size(-2.5 * log.h), gives=K_A).taken_out(log)
    assert len(later) == len(earlier) == 497
    assert later["t"][0] == log["t"][3] and earlier["t"][-1] == log["t"][496]
    assert later["F"][0] == pytest.approx(0.5 * (log["F"][0] + log["F"][1]))
    assert [one.key for one in Surroundings(lag=Size(0.01), gives=K_A).effects] == ["input_delay"]
    assert Surroundings(lag=Size(-0.01), gives=K_A).effects == ()


def test_friction_is_reported_beside_gravity() -> None:
    fit = fit_plant([pendulum(3, 3.0)], np.random.default_rng(1), rig=TURNING)
    assert fit.estimates["gravity.a"].value == pytest.approx(3.0, rel=0.01)
    for name, true in (("m", 0.15), ("F_cp", 0.3), ("F_cn", 0.3)):
        assert fit.estimates[name].value == pytest.approx(true, rel=0.05), name
    assert [one.key for one in fit.effects] == ["gravity"]


def test_what_is_unsure_of_a_force_taken_out_is_unsure_of_friction() -> None:
    """A constant force moves both levels by all of its error, gravity by its mean that way."""
    t = np.asarray(np.arange(4000) * 2e-3, dtype=np.float64)
    log = Log("swing", {"t": t, "y": 0.3 * np.sin(t), "F": np.sin(t)})
    one = Estimate(0.3, "N m", 0.001, 0.298, 0.302)
    around = Surroundings(force=Size(1.0, 0.003), cosine=Size(0.1, 0.004), sine=Size(3.0, 0.001))
    known = {"F_cp": one, "F_cn": replace(one, value=None)}
    known["m"] = Estimate(10.0, "kg m^2", 1e-6, 10.0, 10.0)
    wider = widened_friction(known, around, [log])
    assert set(wider) == {"F_cp", "m"} and wider["m"].sd == pytest.approx(0.01, rel=1e-3)
    sd = wider["F_cp"].sd
    assert sd is not None and abs(sd - np.hypot(0.001, np.hypot(0.003, 0.004 * 0.98))) < 2e-4
    low, high = wider["F_cp"].low, wider["F_cp"].high
    assert low is not None and high is not None
    assert abs(0.5 * (low + high) - 0.3) < 1e-12 and high - low > 0.004 * 4.5
