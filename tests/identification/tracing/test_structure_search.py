"""Whose numbers a structure has: the run's, unless others are significantly likelier."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.regression.row_fit import first_stage
from identification.estimation.structure_fit import FittedStructure
from identification.tracing import structure_search
from identification.tracing.free_run.backward_elimination import Setting
from identification.tracing.regression.stepwise import Choice, choose
from identification.tracing.structure_search import finished_plain, likelier
from tests.identification.motor_logs import made, plant, seen
from tests.identification.tracing.settings import setting_of

BENT = {"m": 0.5, "spring.k": 30.0, "F_sp": 2.0}  # deviations of a run that is not followed


@cache
def spring() -> tuple[Setting, Choice]:
    """A motor with a spring of 40 N/m, and what its equations call for."""
    return called_for("spring", {"k": 40.0})


def called_for(key: str, values: dict[str, float]) -> tuple[Setting, Choice]:
    """A motor with this effect, and what its equations call for."""
    one = seen(made(4, {key: values}))
    rng = np.random.default_rng(0)
    start, first = first_stage([one], False)
    plain = FittedStructure(start, first, plant(), {}, False, 90.0)
    library = {key: built_in()[key]}
    setting = setting_of([one], plain, library, rng)
    return setting, choose(start, first, library, rng, lambda _stage, _share: None)


def model(k: float) -> FittedStructure:
    """A plant with this spring, refined on the run."""
    setting, choice = spring()
    own = plant({"spring": {"k": k}})
    return replace(setting.plain.model, plant=own, sd=BENT, misfit=1.0, stage=choice.end)


def test_a_run_whose_numbers_are_as_likely_as_any_has_its_own() -> None:
    setting, choice = spring()
    assert likelier(choice, model(40.0), setting).plant == model(40.0).plant
    prescribed = replace(model(55.0), prescribed=True)
    assert likelier(choice, prescribed, setting) is prescribed


def test_numbers_that_make_the_position_likelier_take_the_place_of_bent_ones() -> None:
    setting, choice = spring()
    found = likelier(choice, model(55.0), setting)
    (acting,) = found.plant.effects
    assert acting.values["k"] == pytest.approx(40.0, rel=0.01)
    assert found.sd["spring.k"] < 1.0 and found.sd["m"] < 0.1
    assert found.sd["F_sp"] == BENT["F_sp"]  # of which sliding says nothing
    assert found.plant.friction.F_sp == model(55.0).plant.friction.F_sp


def test_a_searched_parameter_has_the_deviation_of_its_likelihood() -> None:
    """That of its search, a trust of 3 %, made 12.0 mm "11.3 to 12.7"."""
    values = {"a": 3.0, "b": 0.0, "period": 0.012, "a_2": 0.0, "b_2": 0.0}
    setting, choice = called_for("cogging", values)
    bent = plant({"cogging": {**values, "a": 2.0}})
    own = replace(
        setting.plain.model, plant=bent, misfit=1.0, stage=choice.end,
        sd={**BENT, "cogging.period": 3.6e-4, "cogging.a": 0.1},
    )  # fmt: skip
    found = likelier(choice, own, setting)
    (acting,) = found.plant.effects
    sd = found.sd["cogging.period"]
    assert 0.0 < sd < 1e-5 and abs(acting.values["period"] - 0.012) < 4.0 * sd


@pytest.mark.parametrize(("adequate", "left"), [(True, 1.0), (False, 4.0)])
def test_what_follows_with_the_runs_numbers_lacks_nothing_with_likelier_ones(
    monkeypatch: pytest.MonkeyPatch, adequate: bool, left: float
) -> None:
    """Those of largest likelihood lost a stop that the run had followed, and a machine that lacks
    nothing had an effect that nobody knows."""
    setting, _ = spring()
    p = plant()
    fit = SimpleNamespace(
        friction=p.friction, actuator=p.actuator, adequate=adequate, chi_square=1.0,
        drive=setting.drive, prescribed=False,
    )  # fmt: skip
    monkeypatch.setattr(structure_search, "finished", lambda *_: fit)
    monkeypatch.setattr(structure_search, "misfit", lambda *_: 4.0)
    found = finished_plain(setting.plain, np.random.default_rng(0), lambda *_: None)
    assert found.model.misfit == left
