"""The exact lag and delay against the equation in fine steps."""

from dataclasses import replace

import numpy as np
import pytest

from identification.velocity.model import Valve, lagged, moved
from tests.identification.velocity.made import TRUE, command, moved_finely

H = 0.01
U = command(np.random.default_rng(11), H, 10.0)


@pytest.mark.parametrize(
    "valve",
    [
        TRUE,
        replace(TRUE, delay=0.0, lag=0.3),
        replace(TRUE, delay=0.0435),
        replace(TRUE, second_lag=0.5),
        replace(TRUE, lag_other=1.5),
        replace(TRUE, curve_p=0.3, curve_n=-0.2, creep=3e-3),
    ],
)
def test_it_is_the_equation(valve: Valve) -> None:
    found = moved(U, H, valve, float(np.max(np.abs(U)))).y
    fine = moved_finely(U, H, valve)
    assert np.max(np.abs(found - fine)) < 5e-4 * np.ptp(fine)


def test_a_lag_of_nothing_passes_the_command_through() -> None:
    w = np.array([0.0, 1.0, 1.0, 1.0])
    found = lagged(w, 0.5, 0.25, 0.0)
    assert found.y == pytest.approx([0.0, 0.0, 0.25, 0.75], abs=1e-5)
    assert found.v == pytest.approx([0.0, 0.0, 1.0, 1.0], abs=1e-9)


def test_the_place_changes_the_gain() -> None:
    z = np.full(len(U), 0.5)
    plain, placed = moved(U, H, TRUE, 5.0).y, moved(U, H, replace(TRUE, place=0.2), 5.0, z).y
    assert placed == pytest.approx(1.1 * plain)
