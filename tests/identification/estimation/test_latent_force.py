"""The force that a model lacks, against the one that was hidden in the log."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.effects._library import built_in
from identification.estimation.latent_force import LatentForces, Rougher, latent_forces
from identification.estimation.regression.motion_log import motion_log
from identification.log import Log
from identification.model.plant import Plant
from tests.identification.motor_logs import NINE, made, plant, seen
from tests.identification.plants import made_log, table

SLOWEST = 0.012  # m/s, above the bands of these plants
SPRING = {"spring": {"k": 60.0}}
LEVEL = max(NINE.F_cp, NINE.F_cn)


def of_motor(log: Log, of: Plant) -> LatentForces:
    return latent_forces(of, [seen(log)], SLOWEST)


def test_nothing_is_missing_of_the_machine_itself() -> None:
    assert of_motor(made(1), plant()).rms < 1e-3 * LEVEL
    assert of_motor(made(2, SPRING), plant(SPRING)).rms < 1e-3 * LEVEL


@pytest.mark.parametrize("seed", [3, 4])
def test_a_spring_that_the_model_lacks_is_seen_with_its_band(seed: int) -> None:
    log = made(seed, SPRING)
    (one,) = of_motor(log, plant()).logs
    true = -60.0 * np.asarray(log["y"])
    at = one.slides
    assert np.std((one.force - true)[at]) < 0.1 * np.std(true[at])
    inside = np.abs(one.force - true) <= 1.96 * one.sd
    assert 0.85 < np.mean(inside[at]) <= 1.0


def test_the_right_effect_gains_likelihood_and_a_wrong_one_loses_it() -> None:
    log = made(5, SPRING)
    lacking, right = (of_motor(log, plant(effects)) for effects in (None, SPRING))
    wrong = of_motor(log, plant({"spring": {"k": -60.0}}))
    assert wrong.log_likelihood < lacking.log_likelihood < right.log_likelihood - 100.0
    assert right.rms < 0.01 * lacking.rms < 0.01 * wrong.rms


def test_a_body_at_rest_shows_no_force() -> None:
    found = of_motor(made(6, SPRING), plant())
    (one,) = found.logs
    resting = np.convolve(one.slides, np.ones(21), "same") == 0
    assert np.any(resting) and np.any(one.slides)
    assert np.median(one.sd[resting]) > 2.0 * np.median(one.sd[one.slides])
    assert np.max(one.sd) <= 1.001 * found.sigma
    assert not np.any(one.log_density[~one.slides])


def test_friction_that_is_twice_too_high_is_what_is_missing() -> None:
    p = table(1)
    log = motion_log(made_log(p, 3), zoh=False, by_command=True)
    double = replace(p, F_cp=2.0 * p.F_cp, F_cn=2.0 * p.F_cn)
    found = latent_forces(Plant(double), [log], 1.2 * max(p.dv_p, -p.dv_n))
    (one,) = found.logs
    up, down = (one.slides & (np.sign(log.signals["v"]) == way) for way in (1.0, -1.0))
    assert np.median(one.force[up]) == pytest.approx(p.F_cp, rel=0.03)
    assert np.median(one.force[down]) == pytest.approx(-p.F_cn, rel=0.03)
    assert latent_forces(Plant(p), [log], 1.2 * max(p.dv_p, -p.dv_n)).rms < 2e-3 * p.F_cp


def test_of_prescribed_motion_the_force_alone_is_reported() -> None:
    rng, h = np.random.default_rng(0), 2e-3
    t = h * np.arange(8000, dtype=np.float64)
    since = np.pi * np.maximum(t - 1.0, 0.0)  # it begins at rest
    y, v = 0.05 * (1.0 - np.cos(since)), 0.05 * np.pi * np.sin(since)
    a = np.where(t > 1.0, 0.05 * np.pi**2 * np.cos(since), 0.0)
    missing = 0.8 * np.sin(2.0 * np.pi * y / 0.02)
    force = NINE.m * a + np.where(v > 0, NINE.F_cp + NINE.F_vp * v, -NINE.F_cn + NINE.F_vn * v)
    noisy = y + 1e-6 * rng.standard_normal(len(t))
    log = Log("rig", {"t": t, "y": noisy, "F": force - missing + 0.02 * rng.standard_normal(8000)})
    one = motion_log(log, zoh=False, by_command=False, prescribed=True)
    found = latent_forces(Plant(NINE), [one], 0.02)
    of = found.logs[0]
    assert np.std((of.force - missing)[of.slides]) < 0.05
    assert found.rms == pytest.approx(float(np.std(missing[t > 1.0])), rel=0.1)
    assert abs(of.force[0]) < 2.0 * found.sigma and of.sd[0] > 0.9 * found.sigma


def test_of_prescribed_motion_friction_never_drives_the_body() -> None:
    """Friction that falls below none along the travel: what is missing was that of a friction that
    pushes the body, while the force predicted has none, and effects were judged by the former."""
    rng, h = np.random.default_rng(2), 2e-3
    t = h * np.arange(4000, dtype=np.float64)
    y, v = 0.05 * np.sin(3.0 * t), 0.15 * np.cos(3.0 * t)
    log = Log("rig", {"t": t, "y": y + 1e-6 * rng.standard_normal(len(t)), "F": 0.0 * t})
    one = motion_log(log, zoh=False, by_command=False, prescribed=True)
    falls = built_in()["position_dependent_friction"].acting(
        {"c1": -3.0 * LEVEL / 0.05, "period": 0.1}
    )
    light = replace(NINE, m=1e-6, F_vp=0.0, F_vn=0.0)
    (of,) = latent_forces(Plant(light, None, (falls,)), [one], 0.02).logs
    against = (of.force * np.sign(v))[of.slides]
    assert np.max(against) > LEVEL and np.min(against) > -0.05 * LEVEL


def test_a_body_that_rests_or_is_driven_by_nothing_has_a_latent_force_all_the_same() -> None:
    t = 2e-3 * np.arange(2000, dtype=np.float64)
    noise = 1e-6 * np.random.default_rng(0).standard_normal(2000)
    for y in (noise, 0.05 * np.sin(3.0 * t)):
        log = Log("free", {"t": t, "y": y, "F": np.zeros(2000)})
        one = motion_log(log, zoh=False, by_command=False)
        found = latent_forces(Plant(NINE), [one], SLOWEST)
        assert np.all(np.isfinite(found.logs[0].force)) and np.isfinite(found.rms)
        assert (found.rms > 0.0) == bool(np.any(found.logs[0].slides))


@pytest.mark.parametrize("change", [{"m": 1e-9, "F_vp": 0.0, "F_vn": 0.0}, {"F_vp": 1e6}])
def test_a_wrong_plant_is_no_fault(change: dict[str, float]) -> None:
    found = of_motor(made(1), replace(plant(), friction=replace(NINE, **change)))
    assert np.isfinite(found.rms) and np.isfinite(found.log_likelihood)


def test_a_position_noisier_in_motion_is_no_missing_force() -> None:
    """What a clock that jitters makes of it: errors from sample to sample, and none at rest."""
    log = made(1)
    v = np.gradient(np.asarray(log["y"]), log.h)
    jitter = 2e-4 * np.random.default_rng(5).standard_normal(len(log))
    one = seen(log.with_signals(y=log["y"] + v * jitter))
    plain = replace(one, noise=replace(one.noise, y=1e-5, jitter=0.0))
    found = latent_forces(plant(), [plain], SLOWEST)
    assert found.rougher.measured > 1.0
    assert found.rms < 0.02 * LEVEL
    assert latent_forces(plant(), [plain], SLOWEST, Rougher()).rms > 2.0 * found.rms


def test_a_force_between_the_samples_is_none_that_a_model_lacks() -> None:
    """What a loop faster than its log adds from period to period: white, and in no sample."""
    rng, h, p = np.random.default_rng(7), 2e-3, NINE
    t = h * np.arange(10000, dtype=np.float64)
    v = 0.05 * (1.2 + np.sin(6.0 * t))
    F = p.m * 0.3 * np.cos(6.0 * t) + p.F_cp + p.F_vp * v
    kept = np.exp(-p.F_vp / p.m * h)
    more = lfilter([h / p.m], [1.0, -kept], 1.5 * rng.standard_normal(len(t)))
    y = h * np.cumsum(v + more) + 1e-6 * rng.standard_normal(len(t))
    one = motion_log(Log("rig", {"t": t, "y": y, "F": F}), zoh=False, by_command=False)
    one = replace(one, noise=replace(one.noise, F=0.5))
    found = latent_forces(plant(), [one], SLOWEST)
    assert found.rougher.force > 1.0
    assert found.rms < 0.5 * latent_forces(plant(), [one], SLOWEST, Rougher()).rms


def test_the_bound_of_a_force_that_does_not_show_is_one_that_would() -> None:
    log, found = made(1), of_motor(made(1), plant())
    assert found.is_a_bound
    share = found.share(LEVEL)
    assert share is not None and share * LEVEL == pytest.approx(found.most)
    pushed = log.with_signals(F=log["F"] + 5.0 * found.most * np.sin(2.0 * log["t"]))
    assert not of_motor(pushed, plant()).is_a_bound
