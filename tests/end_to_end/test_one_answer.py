"""One log, one answer: where no effect is found, `trace` gives what `identify` gives."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from design.simulated.record import record
from identification.effects._library import Library, built_in
from identification.estimation.fit import fit_plant
from identification.estimation.surroundings import surrounding_estimates
from identification.log import Log, Rig
from identification.model.estimates import Estimate
from identification.tracing.trace import trace
from tests.reported import broken
from workbench.cards.card import load_card
from workbench.logs.sources import card_path, read_sources

LONG = pytest.mark.method
RECIPES = (
    "paper_table1", "paper_table3",
    *(pytest.param(name, marks=LONG) for name in ("paper_table1_rich", "paper_table2", "demo")),
)  # fmt: skip
SETS = (
    "friction_backlash", "pneumatic_seals",
    *(pytest.param(name, marks=LONG) for name in ("emps", "xl330_servo")),
)  # fmt: skip
SEED, SECONDS = 3, 10.0
MOST_LOGS = 3  # of a set


def both(
    logs: list[Log], rig: Rig, library: Library
) -> tuple[Mapping[str, Estimate], Mapping[str, Estimate]]:
    """What the estimator and the tracer say of the parameters, with what acts beside friction."""
    fit = fit_plant(logs, np.random.default_rng(SEED), rig=rig)
    found = trace(logs, [], rig, library, np.random.default_rng(SEED))
    assert not found.effects
    return fit.estimates, {**found.parameters_after, **surrounding_estimates(found.surroundings)}


@pytest.mark.method
@pytest.mark.slow
@pytest.mark.parametrize("signals", [("t", "y", "F", "u"), ("t", "y", "F")])
@pytest.mark.parametrize("name", RECIPES)
def test_of_a_recipe_without_effects(name: str, signals: tuple[str, ...]) -> None:
    card = load_card(card_path(name))
    assert card.recipe is not None
    plain = replace(card.recipe, plant=replace(card.recipe.plant, effects=()))
    log = record(name, plain, SEED)
    log = log.part(0, round(SECONDS / log.h))
    seen = Log(name, {key: log[key] for key in signals})
    identified, traced = both([seen], Rig("force"), built_in())
    assert identified == traced
    assert [said for one in identified.values() if (said := broken(one))] == []
    assert any(one.value is not None for one in identified.values())


@pytest.mark.slow
@pytest.mark.parametrize("name", SETS)
def test_of_a_measured_set(
    name: str, workbench_data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WORKBENCH_DATA", str(workbench_data))
    train = load_card(card_path(name), with_recipe=False).split["train"][:MOST_LOGS]
    if not all((workbench_data / name / one).is_file() for one in train):
        pytest.skip(f"no measured data of {name}")
    found = read_sources(train, name)
    logs, rig = [run.log for run in found.runs], found.rig
    if rig.kind == "motor" and not rig.force_per_command:
        rig = replace(rig, force_per_command=1.0)  # a force in units of the command
        logs = [log.with_signals(F=log["u"]) for log in logs]
    logs = [log.part(0, min(len(log), round(SECONDS / log.h))) for log in logs]
    identified, traced = both(logs, rig, {})
    assert identified == traced
    assert [said for one in identified.values() if (said := broken(one))] == []
