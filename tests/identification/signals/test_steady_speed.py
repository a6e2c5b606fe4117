"""The steady speed of a log of one constant force, and what makes it unsure."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.signals.steady_speed import steady_speed

T = np.arange(170, dtype=np.float64) * 6e-3
COUNT = np.deg2rad(1.0)
NOISE = COUNT / 12**0.5


def settling(v: float, tau: float, late: float = 0.0) -> Array:
    """From rest to the speed v [rad/s], the force so late [s]."""
    t = np.maximum(T - late, 0.0)
    return v * (t + tau * (np.exp(-t / tau) - 1.0))


@pytest.mark.parametrize("late", [0.0, 0.05])
@pytest.mark.parametrize("v", [4.0, -11.0])
def test_speed_and_time_constant_of_counts_lie_within_their_intervals(
    v: float, late: float
) -> None:
    """Whenever the force comes, since the amplitude of what dies away is free."""
    found = steady_speed(T, np.floor(settling(v, 0.09, late) / COUNT) * COUNT, NOISE)
    assert found is not None and abs(found.v - v) < 3.0 * found.v_sd < 0.02 * abs(v)
    assert abs(found.tau - 0.09) < 3.0 * found.tau_sd < 0.03


@pytest.mark.parametrize(
    "y", [settling(4.0, 0.7), 5.0 * T**2, np.zeros(len(T))], ids=["slow", "accelerates", "rests"]
)
def test_what_has_not_settled_has_no_steady_speed(y: Array) -> None:
    noise = np.random.default_rng(0).normal(0.0, 1e-4, len(T))
    assert steady_speed(T, y + noise, 1e-4) is None


def test_a_log_that_ends_within_a_tenth_of_its_speed_has_settled() -> None:
    """Half of that, or twice, are other logs."""
    noise = np.random.default_rng(0).normal(0.0, 1e-4, len(T))
    for share, settled in ((0.2, False), (0.05, True)):
        tau = float(T[-1]) / np.log(1.0 / share)
        assert (steady_speed(T, settling(4.0, tau) + noise, 1e-4) is not None) == settled


@pytest.mark.parametrize("rate", [9.0, 25.0])
def test_a_speed_that_varies_over_the_log_is_as_unsure(rate: float) -> None:
    """Of a ripple of a period and a half, or four, in the log a mean speed errs by far more than
    by noise: of two parts in place of four half of them err by over twice their deviation; eight do
    as well. A slower one is in what dies away, where nothing shows it."""
    rng = np.random.default_rng(1)
    beyond = []
    for phase in np.linspace(0.0, 2.0 * np.pi, 12):
        ripple = 0.02 * np.sin(rate * T + phase)
        y = settling(4.0, 0.05) + ripple - ripple[0] + rng.normal(0.0, 1e-4, len(T))
        found = steady_speed(T[30:], y[30:], 1e-4)
        assert found is not None
        beyond.append(abs(found.v - 4.0) > 2.0 * found.v_sd)
    assert np.mean(beyond) <= 0.25
