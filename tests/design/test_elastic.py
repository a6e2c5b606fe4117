"""Plants with elastic parts, against the body alone, the continuous curve, a simulation."""

import numpy as np
import pytest
from scipy.signal import lfilter

from design.elastic import Swing, elastic_plant
from design.linear import commanded_plant, force_gains, linear_plant
from design.polynomial import evaluate
from design.present import cascade_to_rst
from design.rst import closed_loop
from design.servo import SecondMass, Servo, simulate_servo
from identification.errors import BadModel, BadSpecification
from identification.frequency.body import body_response
from identification.frequency.stretches import hold
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor, Plant

M, F_V, H = 3.0, 20.0, 5e-4
SWING = Swing.of_two_masses(70.0, 45.0, 0.02)
ACTUATOR = Actuator(19530.0, 10405.0)


def test_without_elastic_parts_it_is_the_body_alone() -> None:
    gains = force_gains(ACTUATOR, 1e-3)
    for found, known in (
        (elastic_plant(M, F_V, H, []), linear_plant(M, F_V, H)),
        (elastic_plant(M, F_V, H, [], ACTUATOR), commanded_plant(M, F_V, H, ACTUATOR)),
        (
            elastic_plant(M, F_V, 5e-3, [], ACTUATOR, gains, 5),
            linear_plant(M, F_V, 5e-3, ACTUATOR, gains, 5),
        ),
    ):
        np.testing.assert_allclose(found[0], known[0], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found[1], known[1], rtol=1e-6, atol=1e-15)


def test_two_masses_have_the_curve_of_the_identified_body() -> None:
    A, B = elastic_plant(M, F_V, H, [SWING])
    f = np.geomspace(1.0, 90.0, 60)  # far below the sampling rate, above which a hold folds
    z = np.exp(2j * np.pi * f * H)
    found = evaluate(B, z) / evaluate(A, z)
    known = body_response(f, M, F_V, second_mass=(70.0, 45.0, 0.02)) * hold(f, H)
    np.testing.assert_allclose(found, known, rtol=1e-4)


def test_the_simulated_loop_on_two_masses_is_the_linear_one_where_nothing_rubs() -> None:
    controller = cascade_to_rst(8.0, 40.0 * M, 0.3, H, eps=1e-3)
    none = Karnopp(M, 1e-9, 1e-9, F_V, F_V, 1e-9, -1e-9, 2e-9, -2e-9)
    load = SecondMass.of(70.0, 45.0, 0.02, M * (1.0 - (45.0 / 70.0) ** 2))
    r = np.zeros(3000)
    r[10:] = 0.01
    run = simulate_servo(Plant(none, Motor(1.0)), Servo(controller, None), r, H, load=load)
    A, B = elastic_plant(M, F_V, H, [SWING])
    y = lfilter(np.convolve(B, controller.T), closed_loop(A, B, controller), r)
    assert np.max(np.abs(run.y - y)) < 1e-4 * 0.01
    assert np.ptp(run.y[100:200]) > 1e-4  # and it moves


def test_a_load_swings_on_while_friction_holds_the_motor() -> None:
    stuck = Karnopp(M, 10.0, 10.0, F_V, F_V, 1e-3, -1e-3, 15.0, -15.0)
    load = SecondMass.of(70.0, 45.0, 0.02, M * (1.0 - (45.0 / 70.0) ** 2))
    controller = cascade_to_rst(20.0, 80.0 * M, 0.1, H, eps=1e-3)
    r = np.where(np.arange(2000) < 20, 0.0, 0.005)
    run = simulate_servo(Plant(stuck, Motor(1.0)), Servo(controller, None), r, H, load=load)
    assert np.all(np.isfinite(run.y)) and abs(run.y[-1] - 0.005) < 1e-3


@pytest.mark.parametrize("wrong", [{"resonance": 0.0}, {"damping": -0.1}, {"anti_resonance": -1.0}])
def test_what_is_no_swing_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(BadSpecification, match="need frequencies > 0"):
        Swing(**{"resonance": 70.0, "damping": 0.02, "anti_resonance": 45.0, **wrong})


def test_a_load_heavier_than_the_whole_is_refused() -> None:
    plant = Plant(Karnopp(M, 1.0, 1.0, F_V, F_V, 1e-3, -1e-3, 2.0, -2.0), Motor(1.0))
    controller = cascade_to_rst(8.0, 40.0 * M, 0.3, H)
    with pytest.raises(BadModel, match="not less than the whole mass"):
        simulate_servo(
            plant, Servo(controller, None), np.zeros(10), H, load=SecondMass(4.0, 1e4, 1.0)
        )
