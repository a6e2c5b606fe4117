"""Stamps of even rows that are rounded, or late."""

import numpy as np
import pytest

from identification.signals.stamps import even_stamps


@pytest.mark.parametrize("begun", [0.0, 1_715_000_000.123])
def test_stamps_in_whole_milliseconds_are_those_of_even_rows(begun: float) -> None:
    t = 2.3e-3 * np.arange(3000)
    t[1500:] += 18.0  # a logger that paused
    found, said = even_stamps(begun + np.floor(1e3 * t) / 1e3)
    np.testing.assert_allclose(np.diff(found)[:1499], 2.3e-3, rtol=1e-3)
    assert "whole ticks of 0.001: taken as even rows" in said


def test_stamps_that_are_off_by_more_are_as_they_are() -> None:
    t = np.cumsum(np.random.default_rng(2).integers(1, 4, 2000)) * 1e-3
    fine = np.round(2e-3 / 3.0 * np.arange(900), 6)  # of no account
    for times in (t, 2e-3 * np.arange(500), np.where(t > 1.0, np.nan, t), fine):
        found, said = even_stamps(np.asarray(times, dtype=np.float64))
        np.testing.assert_array_equal(found, times)
        assert not said


def test_rows_that_waited_before_the_log_was_read_are_put_before_it() -> None:
    """Six seconds of rows in a buffer, found at once; then five at a time."""
    rng, period = np.random.default_rng(3), 0.01
    t = period * np.arange(2500)
    found_at = np.maximum(np.ceil((t + 3e-3) / 0.05) * 0.05, 6.0)
    stamps = np.sort(found_at + 2e-4 * rng.random(len(t)))
    even, said = even_stamps(stamps)
    np.testing.assert_allclose(np.diff(even), period, rtol=1e-3)
    assert "rows that waited before the first are put before it; rows stamped about 5" in said
