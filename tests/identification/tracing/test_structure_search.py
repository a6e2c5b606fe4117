"""Whose numbers a structure has: the run's, unless others are significantly likelier."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification.estimation.regression.row_fit import first_stage
from identification.estimation.structure_fit import FittedStructure
from identification.model.karnopp import NAMES
from identification.tracing import structure_search
from identification.tracing.plain_model import PlainModel
from identification.tracing.structure_search import finished_plain, likelier_plain
from tests.identification.motor_logs import NINE, made, plant, seen
from tests.identification.tracing.settings import setting_of


@cache
def plain() -> PlainModel:
    """A motor, and what its equations say of it."""
    one = seen(made(4))
    start, first = first_stage([one], False)
    known = dict.fromkeys(NAMES, 0.1)
    model = FittedStructure(start, first, plant(), known, False, 1.0)
    return setting_of([one], model, {}, np.random.default_rng(0)).plain


def run_with(**friction: float) -> PlainModel:
    """The same, its run bent."""
    bent = plant(friction=replace(NINE, **friction))
    return replace(plain(), model=replace(plain().model, plant=bent))


def test_a_plain_run_whose_numbers_are_as_likely_as_any_has_its_own() -> None:
    assert likelier_plain(plain(), 0.02) is plain().model
    prescribed = replace(plain(), model=replace(plain().model, prescribed=True))
    assert likelier_plain(prescribed, 0.02) is prescribed.model


def test_effects_are_tested_against_the_equations_where_these_are_likelier() -> None:
    bent = run_with(F_cp=1.2 * NINE.F_cp, F_sp=3.0 * NINE.F_sp)
    found = likelier_plain(bent, 0.02).plant.friction
    assert found.F_cp == pytest.approx(NINE.F_cp, rel=5e-3)
    assert found.F_sp == 3.0 * NINE.F_sp  # of which sliding says nothing


@pytest.mark.parametrize(("adequate", "left"), [(True, 1.0), (False, 4.0)])
def test_what_follows_with_the_runs_numbers_lacks_nothing_with_likelier_ones(
    monkeypatch: pytest.MonkeyPatch, adequate: bool, left: float
) -> None:
    """Those of largest likelihood lost a stop that the run had followed, and a machine that lacks
    nothing had an effect that nobody knows."""
    p = plant()
    fit = SimpleNamespace(
        friction=p.friction, actuator=p.actuator, adequate=adequate, chi_square=1.0,
        drive="command", prescribed=False,
    )  # fmt: skip
    monkeypatch.setattr(structure_search, "finished", lambda *_: fit)
    monkeypatch.setattr(structure_search, "misfit", lambda *_: 4.0)
    found = finished_plain(plain(), np.random.default_rng(0), lambda *_: None)
    assert found.model.misfit == left


def test_a_run_that_is_not_followed_leaves_its_numbers_to_the_equation_that_answers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A band that took all sliding one way, with a level of 447 kN, made "69 % of friction" of the
    force that was missing beside the 1.1 kN reported."""
    far = run_with(F_cp=400.0 * NINE.F_cp)
    for misfit, numbers in ((40.0, NINE), (1.0, far.model.plant.friction)):
        fit: Any = SimpleNamespace(friction=NINE, drive="command", prescribed=True)
        monkeypatch.setattr(structure_search, "finished", lambda *_, fit=fit: fit)
        of = replace(far, model=replace(far.model, misfit=misfit))
        found = finished_plain(of, np.random.default_rng(0), lambda *_: None).model
        assert found.plant.friction == numbers and found.fit is fit
        assert found.plant.actuator == plant().actuator and found.misfit == misfit
