from typing import Any

import control
import numpy as np
import pytest
from hypothesis import given, settings

from design.convert import controller_to_control, from_control, to_control
from design.polynomial import evaluate
from design.rst import RST
from identification.arrays import Array
from identification.errors import BadSpecification
from tests.design.strategies import plant

H = 0.01
Z = np.exp(1j * np.linspace(0.05, 3.0, 20))


@given(plant(4))
@settings(max_examples=20)
def test_there_and_back(AB: tuple[Array, Array]) -> None:
    A, B = AB
    a, b, h = from_control(to_control(A, B, H))
    np.testing.assert_allclose(a, A, rtol=1e-12)
    np.testing.assert_allclose(b, B, rtol=1e-12)
    assert h == H


def test_response_is_the_plants() -> None:
    A, B = np.array([1.0, -0.5]), np.array([0.0, 0.0, 0.3, 0.1])
    np.testing.assert_allclose(to_control(A, B, H)(Z), evaluate(B, Z) / evaluate(A, Z))


def test_state_space_and_continuous_systems_are_taken() -> None:
    system = control.tf([2.0], [1.0, 3.0, 2.0])
    A, B, h = from_control(control.ss(system), h=H)
    sampled = control.sample_system(system, H)
    np.testing.assert_allclose(evaluate(B, Z) / evaluate(A, Z), sampled(Z), rtol=1e-8)
    assert h == H


def test_open_period_is_given_by_the_caller() -> None:
    system = control.tf([1.0], [1.0, -0.5], True)
    assert from_control(system, h=0.02)[2] == 0.02


def test_controller_keeps_its_responses() -> None:
    c = RST(np.array([2.0, -1.0]), np.array([1.0, -0.6]), np.array([0.7, 0.3]), H)
    feedback, forward = controller_to_control(c)
    np.testing.assert_allclose(feedback(Z), evaluate(c.R, Z) / evaluate(c.S, Z))
    np.testing.assert_allclose(forward(Z), evaluate(c.T, Z) / evaluate(c.S, Z))


@pytest.mark.parametrize(
    ("system", "h", "text"),
    [
        (3.0, None, "float found"),
        (control.tf([1.0], [1.0, 1.0]), None, "no sampling period"),
        (control.tf([1.0], [1.0, -0.5], True), None, "no sampling period"),
        (control.tf([1.0], [1.0, -0.5], 0.02), 0.01, "resample"),
        (control.tf([1.0, 0, 0], [1.0, -0.5], 0.01), None, "improper"),
        (control.tf([0.0], [1.0, -0.5], 0.01), None, "all zero"),
        (control.ss(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)), 0.01), None, "2 inputs"),
    ],
)
def test_unfit_systems_are_refused(system: Any, h: float | None, text: str) -> None:
    with pytest.raises(BadSpecification, match=text):
        from_control(system, h)


def test_noncausal_plant_is_refused() -> None:
    with pytest.raises(BadSpecification, match="not causal"):
        to_control([0.0, 1.0], [1.0], H)
