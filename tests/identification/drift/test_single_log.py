"""One log's change: what is no drift, and the smallest change that its tests see."""

import numpy as np
import pytest

from identification.drift.practical_margin import Change
from identification.drift.single_log import LogChange, detectable_together

NAMES = ("m", "F_cp", "F_cn")
MEASURED = 1e-6 * np.array([[4.0, 1.5, 0.0], [1.5, 4.0, 0.0], [0.0, 0.0, 25.0]])
VARIED = np.full(3, 1e-4)
SQUARE = 16.0


def of(change: list[float], varied: float = 1e-4) -> LogChange:
    return LogChange(NAMES, np.array(change), MEASURED, np.full(3, varied), 0.02)


def test_a_change_within_the_margin_is_none_however_little_the_machine_varies() -> None:
    found = of([0.019, -0.015, 0.0], varied=1e-8)
    assert found.nearer.square == 0.0
    assert np.all(found.alone == 0.0)


def test_what_the_machine_varies_by_is_none_however_well_it_is_measured() -> None:
    found = of([0.03, 0.0, 0.0])
    assert found.beyond_margin.square > SQUARE
    assert found.nearer.square < SQUARE
    assert found.alone[0] == pytest.approx(0.03 / np.sqrt(1.04e-4))


def test_margin_and_variation_do_not_add_up() -> None:
    found = of([0.05, 0.0, 0.0])
    assert found.alone[0] ** 2 > SQUARE


def test_the_smallest_change_is_seen_as_often_as_is_said() -> None:
    rng = np.random.default_rng(1)
    errors = rng.multivariate_normal(np.zeros(3), MEASURED, 400)
    sizes = of([0.0, 0.0, 0.0]).detectable_alone(SQUARE)
    for i, size in enumerate(sizes):
        changed = size * np.eye(3)[i]
        alarms = [of(list(changed + error)).alone[i] ** 2 > SQUARE for error in errors]
        assert np.mean(alarms) == pytest.approx(0.9, abs=0.04)


def test_all_together_see_the_smallest_change_at_least_as_often() -> None:
    rng = np.random.default_rng(2)
    errors = rng.multivariate_normal(np.zeros(3), MEASURED, 200)
    sizes = detectable_together(Change(NAMES, np.zeros(3), MEASURED, 0.02), SQUARE)
    for i, size in enumerate(sizes):
        changed = size * np.eye(3)[i]
        squares = [Change(NAMES, changed + error, MEASURED, 0.02).square for error in errors]
        assert np.mean(np.array(squares) > SQUARE) > 0.86


def test_a_change_that_nothing_shows_is_never_seen() -> None:
    blind = Change(("m",), np.zeros(1), np.array([[1e4]]), 0.02)
    assert detectable_together(blind, SQUARE)[0] == np.inf
