"""An effect at its best: sizes at its own levels, shapes held at defaults, the shortest period."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.regression.row_fit import first_stage
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.tracing.regression.candidates import EffectCandidate
from tests.identification.motor_logs import NINE, made, seen
from tests.identification.tracing.settings import best_of


def best(
    key: str, effects: Mapping[str, Mapping[str, float]], friction: Karnopp = NINE
) -> EffectCandidate:
    """The effect `key` at its best on the log of a motor with these effects."""
    stage, base = first_stage([seen(made(3, effects, friction=friction))], by_command=False)
    found = best_of(stage, built_in()[key], base)
    assert found is not None
    return found


def test_a_change_in_time_is_even_where_the_directions_are_not() -> None:
    uneven = replace(NINE, F_cn=0.6 * NINE.F_cn, F_sn=0.7 * NINE.F_sn)
    found = best("warmup", {"warmup": {"a": -0.3, "b": 0.0, "tau": 6.0}}, uneven)
    assert found.values["asymmetry"] == 0.0
    assert found.values["a"] == pytest.approx(-0.3, rel=0.02)
    assert found.values["tau"] == pytest.approx(6.0, rel=0.1)
    assert found.outcomes["mechanical"].fit.theta[2] == pytest.approx(uneven.F_cn, rel=0.02)


@pytest.mark.parametrize(("delta", "stays"), [(2.0, True), (1.0, False)])
def test_an_exponent_stays_unless_the_log_calls_for_another(delta: float, stays: bool) -> None:
    found = best("stribeck", {"stribeck": {"F_s": 6.0, "v_s": 0.06, "delta": delta}})
    assert (found.values["delta"] == 2.0) == stays
    assert found.values["delta"] == pytest.approx(delta, rel=0.3)


@pytest.mark.slow
@pytest.mark.parametrize("harmonic", [0.0, 2.0])
def test_a_period_is_the_shortest_that_will_do(harmonic: float) -> None:
    found = best("cogging", {"cogging": {"a": 3.0, "period": 0.01, "a_2": harmonic}})
    assert found.values["period"] == pytest.approx(0.01, rel=0.01)
    assert found.values["a"] == pytest.approx(3.0, rel=0.05)
    assert found.values["a_2"] == pytest.approx(harmonic, abs=0.15)


def test_a_tight_spot_is_found_where_it_is() -> None:
    values = {"size": 6.0, "y_0": 0.02, "width": 0.008}
    found = best("tight_spot", {"tight_spot": values})
    for name, value in values.items():
        assert found.values[name] == pytest.approx(value, rel=0.05), name


def test_what_a_sensor_adds_is_refined_though_a_recipe_may_leave_it_out() -> None:
    optional = {p.name for e in built_in().values() for p in e.params if p.optional}
    assert optional == {"asymmetry", "delta", "turn"}
    found = best("sensor_nonlinearity", {"sensor_nonlinearity": {"a": 0.0, "b": 9.0}})
    assert found.values["b"] == pytest.approx(9.0, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("tau", [0.02, 0.12])
def test_a_lag_is_fitted_with_the_friction_that_lags(tau: float) -> None:
    found = best("frictional_lag", {"frictional_lag": {"tau": tau}})
    assert found.values["tau"] == pytest.approx(tau, rel=0.05)
    truth = NINE.array[:5]
    assert found.outcomes["mechanical"].fit.theta[:5] == pytest.approx(truth, rel=0.05)


@pytest.mark.parametrize("seed", range(6))
def test_a_chamber_whose_seal_has_no_friction_comes_out_as_nothing(seed: int) -> None:
    # The pressures are all but mirror images, so noise brings the other size to either side of 0.
    rng = np.random.default_rng(seed)
    way = np.repeat(np.tile([1.0, -1.0], 10), 200)
    n = len(way)
    p_n = 3e5 + 2e5 * np.sin(2.0 * np.pi * np.arange(n) / 900.0)
    log = Log(
        "two chambers",
        {
            "t": 0.01 * np.arange(n, dtype=np.float64),
            "y": 0.01 * np.cumsum(0.02 * way) + 1e-5 * rng.standard_normal(n),
            "F": way * (4.0 + 2e-5 * p_n) + 0.2 * rng.standard_normal(n),
            "p_p": 8e5 - p_n + 2e3 * rng.standard_normal(n),
            "p_n": p_n,
        },
    )
    stage, base = first_stage([motion_log(log, zoh=False, by_command=False)], by_command=False)
    found = best_of(stage, built_in()["pressure_dependent_friction"], base)
    assert found is not None
    assert found.values["mu_p"] >= 0.0
    assert found.values["mu_n"] - found.values["mu_p"] == pytest.approx(2e-5, rel=0.02)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_an_effect_of_one_direction_alone_is_found(way: float) -> None:
    values = {"F_s": 4.0, "v_s": 0.06, "asymmetry": way}
    found = best("stribeck", {"stribeck": values})
    assert found.values["asymmetry"] == pytest.approx(way, abs=0.06)
