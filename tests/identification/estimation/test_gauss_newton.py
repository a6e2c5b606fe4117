"""Deviations of a minimum: those of the smooth run, whatever jumps near it."""

from collections.abc import Callable

import numpy as np
import pytest

from identification.arrays import Array
from identification.estimation.gauss_newton import (
    FINE_STEP,
    Minimum,
    gauss_newton,
    jacobian,
    smooth_jacobian,
)
from identification.progress import Halted

RNG = np.random.default_rng(0)
X = RNG.standard_normal((400, 3))
AT = np.array([1.0, 2.0, 3.0])


def smooth(x: Array) -> Array:
    """Residuals that bend a little with each parameter."""
    return np.asarray(X @ (x - AT) + 0.1 * X**2 @ (x - AT) ** 2)


def jumping(x: Array) -> Array:
    """The same of a run that loses a stop as soon as the first parameter grows at all."""
    lost = np.zeros(400)
    lost[100:160] = 5.0 * (x[0] > AT[0] + 1e-9)
    return smooth(x) + lost


def test_a_stop_lost_within_the_step_is_no_derivative() -> None:
    assert np.max(np.abs(jacobian(jumping, AT, jumping(AT), FINE_STEP))) > 1e6
    for fun in (smooth, jumping):
        np.testing.assert_allclose(smooth_jacobian(fun, AT), X, atol=1e-6)


@pytest.mark.parametrize("fun", [smooth, jumping])
def test_the_covariance_is_that_of_noise(fun: Callable[[Array], Array]) -> None:
    noise = RNG.standard_normal((4000, 400))
    expected = np.linalg.inv(X.T @ X)
    found = Minimum(fun, AT, 1.0)
    np.testing.assert_allclose(found.covariance(), expected, rtol=1e-4, atol=1e-8)
    spread = np.sqrt(np.diag(found.covariance(noise=noise)))
    np.testing.assert_allclose(spread, np.sqrt(np.diag(expected)), rtol=0.1)


def test_residuals_that_are_one_value_count_once() -> None:
    """As the errors of a position are that stands on one count of its encoder; the covariance is
    that of drawn noise of which each value stays for four residuals."""
    alike = np.repeat(np.arange(100), 4)
    of_stretches = RNG.standard_normal((4000, 100))[:, alike]
    half = np.hstack([of_stretches[:, :200], RNG.standard_normal((4000, 200))])
    found = Minimum(smooth, AT, 1.0)
    for noise, numbers in ((of_stretches, alike), (half, alike[:200])):
        wide = np.sqrt(np.diag(found.covariance(noise=noise)))
        spread = np.sqrt(np.diag(found.covariance(alike=numbers)))
        np.testing.assert_allclose(spread, wide, rtol=0.1)


def test_a_descent_comes_down_from_far_and_halted_keeps_what_it_has() -> None:
    t = np.linspace(0.0, 1.0, 400)
    left = [1000]

    def errors(x: Array) -> Array:
        left[0] -= 1
        if left[0] < 0:
            raise Halted
        return errors_at(t, x)

    begun = np.array([3.0, 5.0])
    assert np.allclose(gauss_newton(errors, begun, rough=True).x, [1.0, 2.0], atol=1e-6)
    left[0] = 40
    halted = gauss_newton(errors, begun, rough=True)
    assert 0.0 < halted.mean < float(np.mean(errors_at(t, begun) ** 2))


def errors_at(t: Array, x: Array) -> Array:
    return np.asarray((x[0] * np.exp(-x[1] * t) - np.exp(-2.0 * t)) / 1e-3)
