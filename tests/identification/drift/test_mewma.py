"""The chart over the logs: run length, mean, and what it learns of a machine's variation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from identification.drift.mewma import (
    fresh_state,
    mean_change,
    taken_in,
    variation,
)
from identification.errors import BadModel

NAMES = ("a", "b", "c")
ALL = np.ones(3, dtype=np.bool_)
OWN = 1e-6 * np.eye(3)
VARIED = np.full(3, 1e-4)


def test_an_alarm_as_likely_as_one_log_in_so_many_is_at_least_as_far_away() -> None:
    asked, alarms, rng = 100.0, 0, np.random.default_rng(3)
    first = state = fresh_state("model", NAMES)
    spread = np.sqrt(np.diag(OWN) + VARIED)
    for _ in range(10_000):
        state = taken_in(state, spread * rng.standard_normal(3), OWN, ALL, 0.2, VARIED)
        if mean_change(state, np.zeros((3, 3)), 0.0).square > chi2.isf(1.0 / asked, 3):
            alarms, state = alarms + 1, first
    assert asked < 10_000 / alarms < 2.5 * asked


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
