"""Residual tests: false alarms at their level, power, oversampled logs."""

import numpy as np
import pytest
from scipy.signal import lfilter

from identification.arrays import Array
from identification.arx.model import fit_arx
from identification.arx.residual_tests import (
    ResidualTests,
    effective_samples,
    error_tests,
    plant_step,
    residual_tests,
)
from identification.errors import BadLog, BadModel

RST_A = [1.0, -2.142, 1.688, -0.5459]
RST_B = [0.0, 0.0, 0.0, 0.0001782, 0.0001322]
RUNS = 600


def coloured_input(rng: np.random.Generator, n: int) -> Array:
    return np.asarray(lfilter([1.0], [1.0, -0.9], rng.standard_normal(n)))


def rst_log(seed: int, n: int = 2000, noise: float = 1e-4) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], n)
    e = noise * rng.standard_normal(n)
    return u, np.asarray(lfilter(RST_B, RST_A, u) + lfilter([1.0], RST_A, e))


def assert_one_per_cent(tests: list[ResidualTests]) -> None:
    """A fraction of 1 % outside the bands, and of 1 % refused, within what chance allows."""
    white = np.mean([len(t.whiteness.outside) / len(t.whiteness.lags) for t in tests])
    cross = np.mean([len(t.cross.outside) / len(t.cross.lags) for t in tests if t.cross])
    assert 0.007 <= white <= 0.014
    assert 0.005 <= cross <= 0.015
    assert np.mean([not t.white for t in tests]) <= 0.025
    assert np.mean([not t.uncorrelated for t in tests]) <= 0.025


@pytest.mark.slow
def test_white_errors_leave_the_bands_at_one_lag_in_a_hundred() -> None:
    tests = []
    for seed in range(RUNS):
        rng = np.random.default_rng(seed)
        tests.append(error_tests([rng.standard_normal(1000)], [coloured_input(rng, 1000)]))
    assert_one_per_cent(tests)
    p_values = [t.whiteness.p_value for t in tests]
    assert np.histogram(p_values, 4, (0.0, 1.0))[0] == pytest.approx(RUNS / 4, rel=0.25)


@pytest.mark.slow
def test_bands_hold_on_the_runs_of_the_fit_itself() -> None:
    tests = []
    for seed in range(RUNS // 2):
        log = rst_log(seed)
        tests.append(residual_tests(fit_arx(log, 3, 2, 3, 0.01), log))
    assert_one_per_cent(tests)


@pytest.mark.slow
def test_bands_hold_for_errors_coloured_at_lags_below_the_step() -> None:
    tests = []
    for seed in range(RUNS):
        rng = np.random.default_rng(seed)
        e = lfilter([1.0, 0.7, 0.3], [1.0], rng.standard_normal(2000))
        tests.append(error_tests([e], [coloured_input(rng, 2000)], lag_step=3))
    assert_one_per_cent(tests)
    assert tests[0].whiteness.lags[0] == 3
    assert tests[0].whiteness.independent < 2000 / 1.5


@pytest.mark.slow
def test_other_levels_and_several_runs() -> None:
    tests = []
    for seed in range(RUNS):
        rng = np.random.default_rng(seed)
        e = [rng.standard_normal(n) for n in (300, 500)]
        u = [coloured_input(rng, n) for n in (300, 500)]
        tests.append(error_tests(e, u, level=0.9, max_lag=10))
    outside = np.mean([len(t.whiteness.outside) / 10 for t in tests])
    assert outside == pytest.approx(0.1, abs=0.02)
    assert np.mean([not t.white for t in tests]) == pytest.approx(0.1, abs=0.04)
    assert tests[0].samples == 800


@pytest.mark.parametrize("seed", range(5))
def test_too_low_an_order_and_too_short_a_delay_are_refused(seed: int) -> None:
    log, other = rst_log(seed), rst_log(100 + seed)
    right = fit_arx(log, 3, 2, 3, 0.01)
    low = residual_tests(fit_arx(log, 2, 2, 3, 0.01), log)
    late = residual_tests(fit_arx(log, 3, 1, 4, 0.01), log)
    assert not low.white and not low.uncorrelated
    assert late.cross is not None and not late.uncorrelated
    assert 3 in late.cross.outside
    assert residual_tests(right, other, fitted=False).whiteness.p_value > 1e-4


def test_feedback_shows_at_negative_lags_only() -> None:
    rng = np.random.default_rng(1)
    e = rng.standard_normal(4000)
    u = rng.standard_normal(4000)
    u[2:] += 0.5 * e[:-2]
    tests = error_tests([e], [u])
    assert tests.cross is not None
    assert -2 in tests.cross.outside
    assert tests.uncorrelated
    position = int(np.flatnonzero(tests.cross.lags == -2)[0])
    expected = np.corrcoef(e[:-2], u[2:])[0, 1]
    assert tests.cross.rho[position] == pytest.approx(expected, abs=0.01)


def test_an_oversampled_log_is_judged_at_the_plants_own_pace() -> None:
    """White noise of a fast position sensor colours e by A: refused at every lag, not beyond."""
    A, B = np.poly([0.99, 0.97]), [0.0, 1e-4]
    passed = {1: 0, 5: 0}
    for seed in range(20):
        rng = np.random.default_rng(seed)
        u = np.repeat(rng.choice([-1.0, 1.0], 400), 50)
        sensor = 1e-3 * rng.standard_normal(20_000)
        errors = np.asarray(lfilter(A, [1.0], sensor))
        for step in passed:
            passed[step] += error_tests([errors], [u], lag_step=step).white
        y = lfilter(B, A, u) + sensor
        assert plant_step([np.asarray(y)]) > 2
    assert passed[1] == 0
    assert passed[5] >= 18


def test_effective_samples_of_white_and_of_correlated_signals() -> None:
    rng = np.random.default_rng(3)
    e = rng.standard_normal(50_000)
    assert effective_samples([e]) == pytest.approx(50_000, rel=0.05)
    slow = np.asarray(lfilter([1.0], [1.0, -0.9], e))
    assert effective_samples([slow]) == pytest.approx(50_000 * 0.1 / 1.9, rel=0.1)
    both = effective_samples([slow[:25_000], slow[25_000:]])
    assert both == pytest.approx(effective_samples([slow]), rel=0.1)


def test_correlations_are_the_written_ones() -> None:
    rng = np.random.default_rng(4)
    e, u = rng.standard_normal(200) + 1.0, rng.standard_normal(200) - 2.0
    tests = error_tests([e], [u], max_lag=5)
    e0, u0 = e - e.mean(), u - u.mean()
    white = [np.sum(e0[k:] * e0[:-k]) / np.sum(e0**2) for k in range(1, 6)]
    np.testing.assert_allclose(tests.whiteness.rho, white, atol=1e-12)
    assert tests.cross is not None
    size = np.sqrt(np.sum(e0**2) * np.sum(u0**2))
    ahead = [np.sum(e0[k:] * u0[: 200 - k]) / size for k in range(6)]
    np.testing.assert_allclose(tests.cross.rho[5:], ahead, atol=1e-12)
    assert not tests.whiteness.rho.flags.writeable


def test_a_still_input_has_no_cross_correlation() -> None:
    e = np.random.default_rng(5).standard_normal(500)
    tests = error_tests([e], [np.ones(500)])
    assert tests.cross is None and tests.uncorrelated


def test_default_step_comes_from_the_output() -> None:
    log = rst_log(6)
    model = fit_arx(log, 3, 2, 3, 0.01)
    step = plant_step([log[1]])
    assert residual_tests(model, log, lag_step=None, max_lag=10).lag_step == step
    assert residual_tests(model, log, lag_step=None, max_lag=100).lag_step == 1996 // 400 < step


def test_refusals() -> None:
    e = np.random.default_rng(7).standard_normal(60)
    with pytest.raises(BadLog, match="25 lags of 1 samples need 100"):
        error_tests([e], [e])
    with pytest.raises(BadModel, match="level"):
        error_tests([e], [e], level=1.0)
    with pytest.raises(BadModel, match="lag_step"):
        error_tests([e], [e], lag_step=0)
    with pytest.raises(BadLog, match="no errors"):
        error_tests([], [])
