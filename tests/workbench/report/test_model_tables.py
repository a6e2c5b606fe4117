"""The first sentences of a model, and what comes next."""

from dataclasses import replace
from pathlib import Path

import pytest

from identification.model.karnopp import Karnopp
from tests.chain import EMPS, model_of
from tests.workbench.trace_values import missing_force
from workbench.documents.model import Model
from workbench.report.model_tables import summary
from workbench.report.next_steps import after_identify


def by_equation(left: float, friction: Karnopp = EMPS) -> Model:
    """A model of the equation of motion alone, which leaves this mean square."""
    model = model_of(friction, k_a=35.15)
    entries = tuple(replace(one, position_rms=None) for one in model.log)
    fit = replace(model.fit, adequate=False, chi_square=left)
    return replace(model, log=entries, fit=fit)


@pytest.mark.parametrize(
    ("left", "said", "then"),
    [
        (1.0, "The equation of motion leaves nothing but noise", "whether an effect is missing"),
        (
            9.0,
            "The model leaves more than noise, 3 times the sensors' noise",
            "an effect is missing",
        ),
    ],
)
def test_what_an_equation_leaves_is_said_once(left: float, said: str, then: str) -> None:
    model = by_equation(left)
    assert said in summary(model, None)
    assert after_identify(model, ["a.csv"], "card.toml", Path("out")).why == then


def test_a_force_that_shows_is_not_called_noise() -> None:
    found = missing_force(["stribeck"])
    said = summary(by_equation(1.0, replace(EMPS, F_cp=2.0, F_cn=2.0)), found.before)
    assert "little more than noise, but a force is missing" in said
    assert "Force missing: " in said
