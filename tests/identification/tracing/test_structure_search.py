"""Whose numbers a structure has: the run's where it is followed, else those of the equations."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.regression.row_fit import first_stage
from identification.estimation.structure_fit import FittedStructure
from identification.thresholds import ADEQUATE, ASTRAY
from identification.tracing.free_run.backward_elimination import Setting
from identification.tracing.regression.stepwise import Choice, choose
from identification.tracing.structure_search import by_equations
from tests.identification.motor_logs import made, plant, seen
from tests.identification.tracing.settings import setting_of

BENT = {"m": 0.5, "spring.k": 30.0, "F_sp": 2.0}  # deviations of a run that is not followed


@cache
def spring() -> tuple[Setting, Choice]:
    """A motor with a spring of 40 N/m, and what its equations call for."""
    one = seen(made(4, {"spring": {"k": 40.0}}))
    rng = np.random.default_rng(0)
    start, first = first_stage([one], False)
    plain = FittedStructure(start, first, plant(), {}, False, 90.0)
    library = {"spring": built_in()["spring"]}
    setting = setting_of([one], plain, library, rng)
    return setting, choose(start, first, library, rng, lambda _stage, _share: None)


def model(misfit: float) -> FittedStructure:
    """A plant with another spring, of which the run leaves this."""
    setting, choice = spring()
    bent = plant({"spring": {"k": 55.0}})
    return replace(setting.plain.model, plant=bent, sd=BENT, misfit=misfit, stage=choice.end)


def test_a_run_that_is_followed_has_its_own_numbers() -> None:
    setting, choice = spring()
    followed = model(0.9 * ADEQUATE)
    assert by_equations(choice, followed, setting) is followed
    prescribed = replace(model(90.0), imposed=True)
    assert by_equations(choice, prescribed, setting) is prescribed


def test_between_a_run_and_equations_that_are_explained_the_surer_numbers_stand() -> None:
    setting, choice = spring()
    between = replace(model(0.9 * ASTRAY), sd={**BENT, "m": 1e-6})
    found = by_equations(choice, between, setting)
    assert found.plant.effects[0].values["k"] == pytest.approx(40.0, rel=0.01)
    assert found.plant.friction.m == between.plant.friction.m and found.sd["m"] == 1e-6


def test_equations_that_are_explained_answer_for_a_run_that_is_not_followed() -> None:
    setting, choice = spring()
    found = by_equations(choice, model(90.0), setting)
    (acting,) = found.plant.effects
    assert acting.values["k"] == pytest.approx(40.0, rel=0.01)
    assert found.sd["spring.k"] < 1.0 and found.sd["m"] < 0.1
    assert found.sd["F_sp"] == BENT["F_sp"]  # of which the equations of sliding say nothing
    unexplained = replace(choice, base=setting.plain.first)
    assert by_equations(unexplained, model(90.0), setting).plant.effects[0].values["k"] == 55.0
