"""From a regression's sizes to a plant."""

from dataclasses import replace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.regressed_plant import regressed_plant, slight, without_effects
from identification.estimation.regression.equation_rows import ACTUATOR, FIVE, MECHANICAL
from identification.estimation.structure_fit import FittedStructure, searched
from identification.estimation.windowed_run.run_errors import misfit
from identification.log import Rig
from identification.thresholds import ASTRAY, COMPLETE
from tests.identification.plants import ACTUATOR as ELECTRO_PNEUMATIC
from tests.identification.plants import made_log, table

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
    # Where every size is poorly told, none is taken for nothing.
    assert slight(effect, values, dict.fromkeys(sd, 1e3)) == set()


def test_only_columns_of_a_regression_are_judged() -> None:
    effect = built_in()["sensor_nonlinearity"]
    assert slight(effect, {"a": 1e-6, "b": 1.0}, {"a": 1.0, "b": 1e-3}) == set()


def test_the_one_size_of_an_effect_is_never_taken_for_nothing() -> None:
    effect = built_in()["spring"]
    assert slight(effect, {"k": 0.1, "k_3": 1e6}, {"k": 1.0, "k_3": 1.0}) == set()
    assert slight(effect, {"k": 50.0, "k_3": 1.0}, {"k": 1.0, "k_3": 10.0}) == {"k_3"}


@pytest.mark.parametrize("samples", [400, 600])
def test_of_a_log_with_few_windows_the_equations_are_those_of_windows_of_any_width(
    samples: int,
) -> None:
    recorded = recorded_logs([made_log(table(1), seed=1).part(0, samples)], Rig("force"), "command")
    stage, found = without_effects(recorded)
    assert MECHANICAL not in found
    p, truth = regressed_plant(stage, found, (), recorded).plant, table(1)
    for name in FIVE[:4]:
        assert getattr(p.friction, name) == pytest.approx(getattr(truth, name), rel=0.2)
    assert p.actuator is not None  # of the shorter one no window shows the command's equation
    assert (ACTUATOR in found) is (samples == 600)
    assert p.actuator.k1 == pytest.approx(ELECTRO_PNEUMATIC.k1, rel=0.01)


def test_stops_that_are_far_off_are_searched_about_what_the_equations_give() -> None:
    recorded = recorded_logs([made_log(table(1), seed=1, seconds=6.0)], Rig("force"), "command")
    stage, found = without_effects(recorded)
    plant = regressed_plant(stage, found, (), recorded).plant
    p = plant.friction
    wrong = replace(p, dv_p=2e-3, dv_n=-0.2, F_sp=3.0 * p.F_cp, F_sn=-1.01 * p.F_cn)
    plant = replace(plant, friction=wrong)
    left = misfit(plant, recorded.logs, recorded.drive)
    assert left > ASTRAY
    lost = FittedStructure(stage, found, plant, {}, False, left)
    better = searched(lost, recorded, np.random.default_rng(0))
    assert better.misfit <= COMPLETE
    assert better.plant.friction.F_sn == pytest.approx(table(1).F_sn, rel=0.02)
    # One that is followed is left alone.
    assert searched(better, recorded, np.random.default_rng(0)) is better
