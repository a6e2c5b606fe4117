"""Notches and low-passes: their gain at rest, at their frequency, and how wide they are."""

import numpy as np
import pytest

from design.series_filters import SeriesFilter, filters_against
from identification.errors import BadSpecification

H = 5e-4


def gain(one: SeriesFilter, f: float) -> float:
    return float(np.abs(one.response(np.array([f])))[0])


def test_a_notch_is_as_deep_and_as_wide_as_it_says() -> None:
    one = SeriesFilter("notch", 80.0, 0.02, 0.5, H)
    assert sum(one.filter.b) / sum(one.filter.a) == pytest.approx(1.0, rel=1e-9)
    assert 20.0 * np.log10(gain(one, 80.0)) == pytest.approx(one.depth_db, abs=1e-6)
    f = np.linspace(1.0, 400.0, 20_000)
    below = f[np.abs(one.response(f)) < np.sqrt(0.5)]
    assert below[-1] - below[0] == pytest.approx(one.width, rel=0.03)


def test_a_low_pass_falls_by_forty_decibels_a_decade() -> None:
    one = SeriesFilter("low-pass", 20.0, 0.0, 0.7, 1e-4)
    assert gain(one, 0.1) == pytest.approx(1.0, rel=1e-3)
    assert 20.0 * np.log10(gain(one, 100.0) / gain(one, 1000.0)) == pytest.approx(40.0, abs=1.5)


def test_those_against_a_resonance_are_about_it_and_below_half_the_rate() -> None:
    every = list(filters_against(700.0, 0.02, H))
    assert {one.kind for one in every} == {"notch", "low-pass"}
    assert all(one.frequency <= 0.4 / H for one in every)
    assert list(filters_against(3000.0, 0.02, H)) == []


@pytest.mark.parametrize(("frequency", "denominator"), [(0.0, 0.5), (1500.0, 0.5), (80.0, 0.0)])
def test_what_is_no_filter_is_refused(frequency: float, denominator: float) -> None:
    with pytest.raises(BadSpecification, match="notch"):
        SeriesFilter("notch", frequency, 0.02, denominator, H)
