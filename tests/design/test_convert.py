import numpy as np
import pytest

from design.convert import controller_to_control, to_control
from design.polynomial import evaluate
from design.rst import RST
from identification.errors import BadSpecification

H = 0.01
Z = np.exp(1j * np.linspace(0.05, 3.0, 20))


def test_response_is_the_plants() -> None:
    A, B = np.array([1.0, -0.5]), np.array([0.0, 0.0, 0.3, 0.1])
    np.testing.assert_allclose(to_control(A, B, H)(Z), evaluate(B, Z) / evaluate(A, Z))


def test_controller_keeps_its_responses() -> None:
    c = RST(np.array([2.0, -1.0]), np.array([1.0, -0.6]), np.array([0.7, 0.3]), H)
    feedback, forward = controller_to_control(c)
    np.testing.assert_allclose(feedback(Z), evaluate(c.R, Z) / evaluate(c.S, Z))
    np.testing.assert_allclose(forward(Z), evaluate(c.T, Z) / evaluate(c.S, Z))


def test_noncausal_plant_is_refused() -> None:
    with pytest.raises(BadSpecification, match="not causal"):
        to_control([0.0, 1.0], [1.0], H)
