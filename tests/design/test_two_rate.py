"""Two rates: at a ratio of one the loop of `design.loop`, above it a held force reference."""

import numpy as np
import pytest

from design.force_pi import ForcePI
from design.loop import Cascade, LoopNoise, simulate_loop
from design.pid import pid_to_rst
from design.rst import RST
from design.two_rate import simulate_two_rate
from identification.errors import BadModel
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor, Plant

PLANT = Plant(
    Karnopp(1.0, 12.0, 15.0, 300.0, 200.0, 0.04, -0.04, 20.6, -23.0), Actuator(19530.0, 10405.0)
)
PI = ForcePI(0.02, 0.05)
R = np.repeat([0.02, 0.1, -0.05, 0.0], 500)


@pytest.mark.parametrize("limit", [None, 1.0])
def test_at_one_rate_it_is_the_other_loop(limit: float | None) -> None:
    controller = pid_to_rst(1754.0, 0.072, 0.018, 0.2, 1e-3)
    noise = LoopNoise.draw(len(R), 1e-5, 1e-2, np.random.default_rng(0))
    cascade = Cascade(controller, PI, limit)
    one = simulate_loop(PLANT, cascade, R, 1e-3, noise=noise, start=(0.02, 0.0, 0.0))
    two = simulate_two_rate(PLANT, cascade, R, 1e-3, noise=noise, y_0=0.02)
    for name in ("t", "r", "y", "v", "F", "u", "y_measured", "F_measured", "mode"):
        assert getattr(two, name) == pytest.approx(getattr(one, name), rel=1e-9, abs=1e-9)


def test_the_position_controller_looks_only_at_its_samples() -> None:
    controller = pid_to_rst(800.0, 0.2, 0.018, 0.2, 5e-3)
    between = R.copy()
    between[np.arange(len(R)) % 5 != 0] += 0.01
    plain = simulate_two_rate(PLANT, Cascade(controller, PI), R, 1e-3)
    disturbed = simulate_two_rate(PLANT, Cascade(controller, PI), between, 1e-3)
    assert np.array_equal(plain.y, disturbed.y)


def test_periods_that_do_not_fit_are_refused() -> None:
    controller = pid_to_rst(800.0, 0.2, 0.018, 0.2, 5e-3)
    with pytest.raises(BadModel, match="multiple"):
        simulate_two_rate(PLANT, Cascade(controller, PI), R, 2e-3)
    with pytest.raises(BadModel, match="multiple"):
        simulate_two_rate(PLANT, Cascade(controller, PI), R, 2e-2)


def test_a_motor_has_no_force_loop() -> None:
    controller = pid_to_rst(800.0, 0.2, 0.018, 0.2, 1e-3)
    with pytest.raises(BadModel, match="motor"):
        simulate_two_rate(Plant(PLANT.friction, Motor(35.0)), Cascade(controller, PI), R, 1e-3)


def test_noise_of_another_length_is_refused() -> None:
    controller = pid_to_rst(800.0, 0.2, 0.018, 0.2, 1e-3)
    noise = LoopNoise(np.zeros(len(R) - 1), np.zeros(len(R) - 1))
    with pytest.raises(BadModel, match="noise of y"):
        simulate_two_rate(PLANT, Cascade(controller, PI), R, 1e-3, noise=noise)


@pytest.mark.parametrize("ratio", [3, 7])
def test_between_its_samples_the_force_reference_is_held(ratio: int) -> None:
    # A pure gain: the command must follow from the last position that it has looked at.
    h, gain = 1e-3, 900.0
    controller = RST(np.array([gain]), np.ones(1), np.array([gain]), ratio * h)
    noise = LoopNoise.draw(len(R), 1e-5, 1e-2, np.random.default_rng(4))
    run = simulate_two_rate(PLANT, Cascade(controller, PI), R, h, noise=noise, y_0=0.02)
    integral = 0.0
    for k in range(300):
        last = k - k % ratio
        error = gain * (R[last] - run.y_measured[last]) - run.F_measured[k]
        assert run.u[k] == pytest.approx(PI.k_i * error + integral, abs=1e-9)
        integral += PI.k_i * h / PI.T_i * error
