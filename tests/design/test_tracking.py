"""T and the reference's speed: static gain kept, lag as computed, overshoot and force bounded."""

import numpy as np
import pytest
from scipy.signal import lfilter

from design.linear import force_gains, linear_plant
from design.pid import pid_gains, pid_to_rst
from design.polynomial import ComplexArray
from design.rst import RST, closed_loop, design_rst
from design.specification import RSTSpecification, pole_pair
from design.tracking import (
    Demand,
    followed,
    integrates,
    pid_candidates,
    rst_candidates,
    static_gain,
)
from design.tune import Asked, Goals, tune_pid, tune_rst
from identification.arrays import Array
from identification.model.plant import Actuator

ACTUATOR = Actuator(19530.0, 10405.0)
H = 0.01
A, B = linear_plant(3.5, 288.0, H, ACTUATOR, force_gains(ACTUATOR, H / 10), 10)
AUXILIARY = (0.6, 0.5, 0.4)
POLES: ComplexArray = np.append(pole_pair(20.0, 0.9, H), AUXILIARY)


def controller(integrator: bool = True) -> RST:
    H_S = [1.0, -1.0] if integrator else [1.0]
    asked = RSTSpecification((20.0, 0.9), AUXILIARY, H_S=H_S, T="unit-static")
    return design_rst(A, B, H, asked)


def response(T: Array, r: Array, top: Array = B) -> Array:
    """y (or with A on top the force) of the loop under the reference r."""
    P = closed_loop(A, B, controller())
    return np.asarray(lfilter(np.convolve(top, T), P, r), dtype=np.float64)


def test_every_candidate_keeps_the_static_gain_and_the_degree() -> None:
    for integrator in (True, False):
        c = controller(integrator)
        assert integrates(A, c) is True  # the body is an integrator itself
        for most in (0, 2, 5):
            found = list(rst_candidates(A, B, c, POLES, most))
            assert len(found) >= 1
            for T in found:
                assert T.size - 1 <= most
                assert T.sum() == pytest.approx(static_gain(A, B, c), rel=1e-9)


def test_a_cancelled_pole_is_gone_from_the_response() -> None:
    c = controller()
    P = closed_loop(A, B, c)
    degrees = set()
    for T in rst_candidates(A, B, c, POLES, 3):
        degrees.add(T.size - 1)
        if T.size == 3 and abs(np.polyval(T, POLES[0])) < 1e-6 * np.abs(T).sum():
            left = np.polydiv(np.trim_zeros(P, "b"), T / T[0])[1]
            assert np.abs(left).max() < 1e-8
    assert degrees == {0, 1, 2, 3}


def test_lag_and_overshoot_are_those_of_the_response() -> None:
    n = 800
    for T in list(rst_candidates(A, B, controller(), POLES, 4))[::5]:
        one = followed([(A, B)], controller(), [T], Demand())
        ramp = H * np.arange(n, dtype=np.float64)
        assert one.lag == pytest.approx(float((ramp - response(T, ramp))[-1]), abs=1e-6)
        step = response(T, np.ones(n))
        assert one.overshoot == pytest.approx(max(float(step.max()) - 1.0, 0.0), abs=1e-6)
        assert one.rate is None


def test_a_limited_step_asks_for_no_more_force() -> None:
    demand = Demand(step=0.1, force=150.0)
    one = followed([(A, B)], controller(), rst_candidates(A, B, controller(), POLES, 5), demand)
    assert one.rate is not None and one.overshoot <= demand.overshoot
    r = np.minimum(0.1, one.rate * H * np.arange(600))
    force = response(one.T, r, A)
    assert np.max(force) == pytest.approx(150.0, rel=0.02)
    free = response(one.T, np.where(np.arange(600) > 0, 0.1, 0.0), A)
    assert np.max(free) > 300.0


def test_a_command_limit_counts_jumps_and_speed() -> None:
    T = [np.array([static_gain(A, B, controller())])]
    force = response(T[0], np.ones(800), A)
    for per_jump, per_speed in ((0.02, 0.0), (0.0, 0.5), (0.02, 0.5)):
        demand = Demand(command=2.0, per_jump=per_jump, per_speed=per_speed)
        one = followed([(A, B)], controller(), T, demand)
        jump = H * float(np.max(np.abs(force)))
        assert one.rate == pytest.approx(2.0 / (per_jump * jump + per_speed))


def test_less_overshoot_allowed_costs_lag() -> None:
    lags = []
    for overshoot in (0.2, 0.05, 0.01):
        candidates = rst_candidates(A, B, controller(), POLES, 5)
        one = followed([(A, B)], controller(), candidates, Demand(overshoot=overshoot))
        assert one.overshoot <= overshoot
        lags.append(one.lag)
    assert lags[0] < lags[1] < lags[2]


def test_other_plants_count_and_unstable_ones_do_not() -> None:
    heavier = linear_plant(7.0, 240.0, H, ACTUATOR, force_gains(ACTUATOR, H / 10), 10)
    wild = (A, 40.0 * B)
    alone, of_both, same = (
        followed(plants, controller(), rst_candidates(A, B, controller(), POLES, 5), Demand())
        for plants in ([(A, B)], [(A, B), heavier], [(A, B), wild])
    )
    of_alone = followed([(A, B), heavier], controller(), [alone.T], Demand())
    assert of_alone.overshoot > alone.overshoot
    assert of_alone.lag == alone.lag
    assert of_both.overshoot <= of_alone.overshoot
    assert same.lag == alone.lag


def test_where_none_keeps_the_overshoot_the_least_is_taken_and_reported() -> None:
    c = controller()
    hasty, hastier = c.R, np.convolve(c.R, [1.5, -0.5])
    one = followed([(A, B)], c, [hastier, hasty], Demand())
    assert np.array_equal(one.T, hasty) and one.overshoot > 0.05
    found = tune_pid(A, B, H, Asked((20.0, 0.2)), Goals())
    assert any("a step overshoots by" in said for said in found.missed)


@pytest.mark.slow
@pytest.mark.parametrize(("m", "f"), [(1.0, 250.0), (3.5, 288.0), (6.5, 130.0)])
def test_tuned_loops_overshoot_little_and_follow(m: float, f: float) -> None:
    plant = linear_plant(m, f, H, ACTUATOR, force_gains(ACTUATOR, H / 10), 10)
    for tune in (tune_rst, tune_pid):
        found = tune(*plant, H, Asked(), Goals(), demand=Demand(step=0.1, force=180.0))
        assert found.missed == ()
        assert found.followed.overshoot <= 0.05
        assert found.rst.T.sum() == pytest.approx(found.rst.R.sum(), rel=1e-9)
        assert np.array_equal(found.rst.T, found.followed.T)
        slowest = -np.log(abs(found.margins.poles[0])) / H
        assert slowest >= 0.5 * found.dominant[0] * min(1.0, found.dominant[1])


@pytest.mark.parametrize(("b", "c"), [(1.0, 1.0), (0.4, 0.0), (0.0, 0.0), (0.7, 1.0)])
def test_set_point_weights_are_read_back(b: float, c: float) -> None:
    weighted = pid_to_rst(800.0, 0.2, 0.05, 0.03, H, b=b, c=c)
    plain = pid_to_rst(800.0, 0.2, 0.05, 0.03, H)
    assert np.array_equal(weighted.R, plain.R) and np.array_equal(weighted.S, plain.S)
    assert weighted.T.sum() == pytest.approx(weighted.R.sum())
    gains = pid_gains(weighted)
    assert (gains.b, gains.c) == pytest.approx((b, c), abs=1e-9)
    for T in pid_candidates(gains, H):
        assert T.sum() == pytest.approx(plain.R.sum(), rel=1e-9)
