"""From a regression's sizes to a plant."""

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.regressed_plant import slight
from identification.estimation.structure_fit import by_exact_force, plain_structure
from identification.log import Rig
from identification.thresholds import COMPLETE
from tests.identification.jumping_command import MASS, cart_log
from tests.identification.motor_logs import K_A, NINE, made, strokes

KEY = "position_dependent_friction"


def test_sizes_that_chance_makes_begin_as_none() -> None:
    effect = built_in()[KEY]
    values = {p.name: p.default or 0.0 for p in effect.params} | {
        "c1": 40.0, "c2": 60.0, "a": -0.2, "b": 0.5, "period": 0.01,
    }  # fmt: skip
    sd = {"c1": 0.5, "c2": 30.0, "a": 0.1, "b": 0.1}
    kept = dict(values)
    assert slight(effect, values, sd) == {"c2", "a"}
    assert values == kept
    # Where every size is poorly identified, none is taken for nothing.
    assert slight(effect, values, dict.fromkeys(sd, 1e3)) == set()


def test_only_columns_of_a_regression_are_judged() -> None:
    effect = built_in()["sensor_nonlinearity"]
    assert slight(effect, {"a": 1e-6, "b": 1.0}, {"a": 1.0, "b": 1e-3}) == set()


def test_the_one_size_of_an_effect_is_never_taken_for_nothing() -> None:
    effect = built_in()["spring"]
    assert slight(effect, {"k": 0.1, "k_3": 1e6}, {"k": 1.0, "k_3": 1.0}) == set()
    assert slight(effect, {"k": 50.0, "k_3": 1.0}, {"k": 1.0, "k_3": 10.0}) == {"k_3"}


def test_a_log_with_few_rows_of_sliding_is_followed_from_what_these_give() -> None:
    """From its first estimate alone the run ends where one direction has no Coulomb friction."""
    recorded = recorded_logs([cart_log(1, 0)], Rig("motor", force_per_command=1.0), None)
    model = plain_structure(recorded, np.random.default_rng(0))
    assert model.misfit <= COMPLETE
    assert abs(model.plant.friction.m / MASS - 1.0) < 0.01


@pytest.mark.parametrize("reached", [True, False])
def test_a_noise_of_the_command_that_moved_the_motor_is_none_of_its_force(reached: bool) -> None:
    """As of a loop whose own measurement is not the logged one. By the log's signals alone either
    is as noisy."""
    u = strokes(6000, 3)
    noisy = u + 0.02 * np.random.default_rng(3).standard_normal(len(u))
    log = made(3, n=len(u), command=noisy if reached else u)
    log = log.with_signals(u=noisy, F=K_A * noisy)
    recorded = recorded_logs([log], Rig("motor", force_per_command=K_A))
    assert recorded.logs[0].noise.F > 0.3
    rng = np.random.default_rng(0)
    exact, found = by_exact_force(recorded, plain_structure(recorded, rng), rng)
    assert exact.exact == reached
    assert pytest.approx(0.0 if reached else 0.4, abs=0.03) == exact.given(log).noise.F
    if reached:
        friction = found.plant.friction
        assert friction.F_sp == pytest.approx(NINE.F_sp, rel=1e-3)
        assert friction.F_sn == pytest.approx(NINE.F_sn, rel=1e-3)
