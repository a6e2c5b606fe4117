"""The linear plant: against the simulated body, in every argument."""

import numpy as np
import pytest
from scipy.signal import lfilter

from design.force_pi import ForcePI
from design.linear import force_gains, linear_plant
from design.loop import Cascade
from design.rst import RST
from design.two_rate import simulate_two_rate
from identification.errors import BadSpecification
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Plant

ACTUATOR = Actuator(19530.0, 10405.0)


def test_a_free_body_is_the_textbook_s() -> None:
    m, f, h = 2.0, 3.0, 0.01
    A, B = linear_plant(m, f, h)
    pole = np.exp(-f / m * h)
    assert pytest.approx([1.0, -1.0 - pole, pole]) == A
    b1 = (h - m / f * (1 - pole)) / f
    assert B[1] == pytest.approx(b1)
    assert B.sum() / f == pytest.approx(h * (1 - pole) / f**2)


@pytest.mark.parametrize("ratio", [1, 5])
@pytest.mark.parametrize(("m", "f", "k2"), [(1.0, 300.0, 10405.0), (4.0, 100.0, 5000.0)])
def test_it_moves_as_the_simulated_loop_without_coulomb_friction(
    ratio: int, m: float, f: float, k2: float
) -> None:
    h, actuator = 0.005, Actuator(15000.0, k2)
    gains = force_gains(actuator, h / ratio)
    A, B = linear_plant(m, f, h, actuator, gains, ratio)
    n = 40
    # A controller without feedback: the reference is the force reference.
    feed_through = RST(np.zeros(1), np.ones(1), np.ones(1), h)
    body = Karnopp(m, 0.0, 0.0, f, f, 1e-9, -1e-9, 0.0, 0.0)
    r = np.repeat(np.linspace(5.0, 20.0, n), ratio)
    cascade = Cascade(feed_through, gains)
    run = simulate_two_rate(Plant(body, actuator), cascade, r, h / ratio)
    linear = lfilter(B, A, r[::ratio])
    assert run.y[::ratio] == pytest.approx(linear, rel=1e-6, abs=1e-9)


def test_the_force_loop_has_unit_static_gain_and_time_constant() -> None:
    gains = force_gains(ACTUATOR, 1e-3)
    assert gains.k_i * ACTUATOR.k1 * 1e-3 == pytest.approx(0.3)
    assert gains.T_i == pytest.approx(10 * 1e-3 / 0.3)
    A, B = linear_plant(2.0, 50.0, 0.01, ACTUATOR, gains, 10)
    A_f, B_f = linear_plant(2.0, 50.0, 0.01)
    # Both integrate: the same steady velocity per newton.
    slope = B.sum() / (A @ np.arange(len(A)))
    assert slope == pytest.approx(B_f.sum() / (A_f @ np.arange(len(A_f))), rel=1e-6)


def test_an_unstable_force_loop_is_refused() -> None:
    with pytest.raises(BadSpecification, match="force loop"):
        linear_plant(1.0, 300.0, 0.01, ACTUATOR, ForcePI(0.02, 0.05))


@pytest.mark.parametrize(("m", "f"), [(0.0, 1.0), (-1.0, 1.0), (1.0, -1.0)])
def test_mass_and_friction_have_signs(m: float, f: float) -> None:
    with pytest.raises(BadSpecification, match="m > 0 and f >= 0"):
        linear_plant(m, f, 0.01)
