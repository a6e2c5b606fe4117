"""Filters around the compensator: the rig's at any period, and the quick ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from design.filters import (
    LONGEST_SLOPE,
    PASS,
    QUICK_SHARE,
    QUICK_SLOPE,
    filters_at,
    quick_filters,
    rig_filters,
    scaled_filters,
)
from identification.errors import BadSpecification


def test_at_the_rigs_period_they_are_the_rigs() -> None:
    found, rig = filters_at(10e-3), rig_filters(10e-3)
    for one, other in ((found.error, rig.error), (found.force, rig.force)):
        assert one.b == pytest.approx(other.b)
        assert one.a == pytest.approx(other.a)


def test_shorter_ones_have_shorter_time_constants() -> None:
    usual, short = scaled_filters(2e-3, 1.0), scaled_filters(2e-3, 0.5)
    for one, other in zip((usual.error, usual.force), (short.error, short.force), strict=True):
        assert np.log(-other.a[1]) == pytest.approx(2.0 * np.log(-one.a[1]))
    assert short.N_d < usual.N_d


@given(st.floats(1e-4, 2e-2), st.floats(1e-8, 1e-3), st.floats(1e-4, 0.1))
def test_quick_ones_are_as_short_as_the_noise_lets(h: float, noise: float, band: float) -> None:
    found = quick_filters(h, noise, band)
    assert found.force == PASS

    def left(n: int) -> float:
        """Noise of the slope (5) over n positions [m/s]: least squares of white noise."""
        k = np.arange(n) - (n - 1) / 2.0
        return float(noise / (h * np.sqrt(np.sum(k**2))))

    most = QUICK_SHARE * band
    assert left(found.N_d) <= most * (1.0 + 1e-9) or found.N_d == LONGEST_SLOPE
    assert found.N_d == QUICK_SLOPE or left(found.N_d - 1) > most * (1.0 - 1e-9)


def test_without_noise_they_are_the_shortest() -> None:
    assert quick_filters(1e-3, 0.0, 0.01).N_d == QUICK_SLOPE


@pytest.mark.parametrize(("h", "band"), [(0.0, 0.01), (1e-3, 0.0)])
def test_a_period_or_band_of_nothing_is_refused(h: float, band: float) -> None:
    with pytest.raises(BadSpecification, match="need both > 0"):
        quick_filters(h, 1e-5, band)
