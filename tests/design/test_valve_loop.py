"""The loop of a valve and cylinder: its linear part, the inverse of the dead zone, its run."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from design.margins import margins
from design.valve_loop import (
    SLOW_END,
    ValveController,
    at_edges,
    run_valve_loop,
    step_overshoot,
    tuned,
    valve_plant,
    valve_rst,
)
from identification.errors import BadSpecification
from identification.velocity.model import Valve, lagged, moved

VALVE = Valve(g_p=0.06, g_n=0.045, d_p=0.8, d_n=1.1, delay=0.064, lag=0.08)
H = 0.01


def law(**other: float) -> ValveController:
    numbers = {"k_p": 3.0, "k_i": 0.0, "h": H, "g_p": 0.06, "g_n": 0.045, "d_p": 0.8, "d_n": 1.1,
               "smooth": 2e-3, "band": 5e-4, "limit": 6.0, **other}  # fmt: skip
    return ValveController(**numbers)


@pytest.mark.parametrize(("delay", "lag"), [(0.064, 0.08), (0.0, 0.0), (0.05, 0.3)])
def test_the_plant_is_the_model(delay: float, lag: float) -> None:
    w = np.random.default_rng(1).standard_normal(300)
    w[0] = 0.0
    A, B = valve_plant(delay, lag, H)
    assert lfilter(B, A, w) == pytest.approx(lagged(w, H, delay, lag).y, abs=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_command_gives_the_wanted_speed(sign: float) -> None:
    one = law(g_p=0.06 * sign, g_n=0.045 * sign)
    for v in (0.2, 0.01, 2e-3, -2e-3, -0.1):
        u = one.command(v)
        given = one.g_p * max(u - 0.8, 0.0) - one.g_n * max(-u - 1.1, 0.0)
        assert given == pytest.approx(v)
    assert one.command(0.0) == 0.0
    assert abs(one.command(1e-4)) < 0.1  # smoothed at 0
    assert abs(one.command(9.0)) == 6.0
    assert one.fastest == pytest.approx(0.045 * 4.9)


@pytest.mark.parametrize("integrator", [True, False])
def test_the_goals_are_kept(integrator: bool) -> None:
    k_p, k_i = tuned(
        VALVE, H, gain=1.1, modulus=0.5, delay_samples=2.0, overshoot=0.05, integrator=integrator
    )
    assert (k_i > 0.0) == integrator
    A, B = valve_plant(VALVE.delay, VALVE.lag, H)
    found = margins(A, 1.1 * B, valve_rst(k_p, k_i, H))
    assert found.modulus >= 0.5 and float(found.delay_s or 1.0) >= 2.0 * H
    assert step_overshoot(A, 1.1 * B, k_p) <= 0.05 + 1e-9
    assert step_overshoot(A, 1.1 * B, 1.02 * k_p) > 0.05


def test_goals_that_no_gain_keeps_are_refused() -> None:
    with pytest.raises(BadSpecification, match="no gain gives a modulus margin"):
        tuned(VALVE, H, modulus=1.5, delay_samples=2.0, overshoot=0.1, integrator=True)


def test_the_loop_runs_the_model() -> None:
    """The position of a run is the model's under the run's own command, richer valves too."""
    rich = replace(VALVE, curve_p=0.2, lag_other=0.5, second_lag=0.3, creep=1e-3)
    r = 0.1 * np.sin(np.arange(800) * H)
    found = run_valve_loop(law(), rich, r, np.zeros(800), 6.0)
    model = moved(found.u, H, rich, 6.0).y
    assert found.y == pytest.approx(model - model[0], abs=1e-6)


def test_it_comes_to_its_target_and_holds_against_creep() -> None:
    r = np.concatenate([[0.0], np.full(1500, 0.1)])
    still = run_valve_loop(law(), VALVE, r, np.zeros(len(r)), 6.0)
    assert still.y[-1] == pytest.approx(0.1, abs=1e-3)
    creeping = replace(VALVE, creep=6e-3)
    p = run_valve_loop(law(), creeping, r, np.zeros(len(r)), 6.0)
    pi = run_valve_loop(law(k_i=1.5), creeping, r, np.zeros(len(r)), 6.0)
    assert abs(p.y[-1] - 0.1) > 1e-3
    assert abs(pi.y[-1] - 0.1) < 1e-3


def test_ends_of_intervals() -> None:
    low, high = replace(VALVE, d_p=0.7, g_p=0.05), replace(VALVE, d_p=0.9, g_p=0.07, delay=0.1)
    ends = at_edges(VALVE, low, high)
    assert [one.d_p for one in ends.values()] == [0.7, 0.9, 0.8]
    assert (ends[SLOW_END].g_p, ends[SLOW_END].delay) == (0.07, 0.1)
