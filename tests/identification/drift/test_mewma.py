"""The chart over the logs: its limit, its mean, and what it learns of a machine's variation."""

from dataclasses import replace

import numpy as np
import pytest

from identification.drift.mewma import (
    chart_limit,
    fresh_state,
    mean_change,
    mean_run,
    taken_in,
    variation,
)
from identification.errors import BadModel

NAMES = ("a", "b", "c")
ALL = np.ones(3, dtype=np.bool_)
OWN = 1e-6 * np.eye(3)
VARIED = np.full(3, 1e-4)


@pytest.mark.parametrize(("parameters", "square"), [(2, 8.66), (4, 12.73)])
def test_run_length_is_that_of_the_printed_tables(parameters: int, square: float) -> None:
    # Prabhu and Runger, J. Quality Technology 29 (1997), table 1: smoothing 0.1, run length 200.
    assert mean_run(parameters, 0.1, square) == pytest.approx(200.0, rel=0.02)


def test_limit_gives_the_asked_run_length_in_simulation() -> None:
    d, smoothing, asked = 3, 0.2, 100.0
    square = chart_limit(d, smoothing, asked)
    rng = np.random.default_rng(3)
    z, spread, alarms = np.zeros((500, d)), np.zeros(500), 0
    for _ in range(600):
        z = (1 - smoothing) * z + smoothing * rng.standard_normal(z.shape)
        spread = (1 - smoothing) ** 2 * spread + smoothing**2
        out = np.sum(z**2, axis=1) > square * spread
        alarms += int(np.count_nonzero(out))
        z[out], spread[out] = 0.0, 0.0
    assert 500 * 600 / alarms == pytest.approx(asked, rel=0.1)


def test_the_mean_of_steady_logs_is_their_change_and_surer_than_one() -> None:
    state = fresh_state("model", NAMES)
    change = np.array([0.03, 0.0, -0.01])
    for _ in range(8):
        state = taken_in(state, change, OWN, ALL, 0.2, VARIED)
    mean = mean_change(state, np.zeros((3, 3)), 0.02)
    assert mean.change == pytest.approx(change)
    assert np.all(np.diag(mean.covariance) < 0.2 * VARIED)
    assert state.logs == 8


def test_the_models_own_error_does_not_average_out() -> None:
    state = fresh_state("model", NAMES)
    for _ in range(50):
        state = taken_in(state, np.zeros(3), OWN, ALL, 0.2, VARIED)
    error = 4e-4 * np.eye(3)
    assert np.all(np.diag(mean_change(state, error, 0.02).covariance) > 4e-4)


def test_a_parameter_that_no_log_judges_is_not_in_the_mean() -> None:
    judged = np.array([True, False, True])
    state = taken_in(fresh_state("model", NAMES), np.full(3, 0.5), OWN, judged, 0.2, VARIED)
    mean = mean_change(state, np.zeros((3, 3)), 0.02)
    assert mean.names == ("a", "c")
    assert state.mean[1] == 0.0


def test_variation_is_learnt_from_neighbours_and_not_from_a_slow_drift() -> None:
    rng = np.random.default_rng(1)
    wild = steady = fresh_state("model", NAMES)
    for k in range(60):
        wild = taken_in(wild, 0.05 * rng.standard_normal(3), OWN, ALL, 0.2, VARIED)
        steady = taken_in(steady, np.full(3, 0.002 * k), OWN, ALL, 0.2, VARIED)
    assert np.sqrt(variation(wild, 0.01)) == pytest.approx(np.full(3, 0.05), rel=0.3)
    assert np.all(np.sqrt(variation(steady, 0.01)) < 0.006)


def test_a_state_with_entries_of_other_lengths_is_refused() -> None:
    with pytest.raises(BadModel, match="other lengths"):
        replace(fresh_state("model", NAMES), mean=(0.0,))
