"""The gate before a fit: `identify` writes it, names runs to add, and tells broken promises."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from design.identified.broken_promises import BROKEN, broken_promises
from design.identified.identify_logs import Identified, identify_logs
from design.machine.documents import model_document
from design.machine.model import Model
from identification.model.karnopp import NAMES
from tests.identification.motor_logs import K_A, made
from workbench.documents.result_files import read_model
from workbench.logs.sources import read_sources
from workbench.output import dumps
from workbench.report.model_tables import fit_lines, runs_to_add
from workbench.steps.doctor import examine

CARD = f"""
[card]
name = "motor"
[rig]
kind = "motor"
force_per_command = {K_A}
[signals]
t = {{ column = "t", unit = "s" }}
y = {{ column = "y", unit = "m" }}
u = {{ column = "u", unit = "V" }}
"""


def identified(folder: Path, columns: dict[str, np.ndarray]) -> Identified:
    """What identify makes of the columns, read by the card; both lie in the folder."""
    (folder / "card.toml").write_text(CARD, "utf-8")
    pd.DataFrame(columns).to_csv(folder / "run.csv", index=False)
    return identify_logs(read_sources([str(folder / "run.csv")], str(folder / "card.toml")).logs)


@pytest.fixture(scope="module")
def both_ways(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Identified]:
    folder = tmp_path_factory.mktemp("both")
    log = made(3)
    return folder, identified(folder, {name: np.array(log[name]) for name in "tyu"})


@pytest.mark.slow
def test_identify_and_doctor_promise_the_same(both_ways: tuple[Path, Identified]) -> None:
    folder, found = both_ways
    card = read_sources([str(folder / "run.csv")], str(folder / "card.toml")).card
    said = {
        one.name: (one.can, one.within) for one in examine(folder / "run.csv", card).identifiability
    }
    assert {one.name: (one.can, one.within) for one in found.model.identifiability} == said
    assert {one.name for one in found.model.identifiability} >= set(NAMES)


@pytest.mark.slow
def test_is_written_and_read(both_ways: tuple[Path, Identified], tmp_path: Path) -> None:
    model = both_ways[1].model
    document = model_document(model)
    (tmp_path / "model.json").write_text(dumps(document), "utf-8")
    assert read_model(tmp_path / "model.json").identifiability == model.identifiability
    del document["identifiability"]  # as older files are
    (tmp_path / "old.json").write_text(dumps(document), "utf-8")
    assert read_model(tmp_path / "old.json").identifiability == ()


def promised(model: Model, share: float) -> Model:
    """The model with such a share of its mass's interval promised before the fit."""
    m = model.friction["m"]
    assert m.value is not None and m.sd is not None
    own = next(one for one in model.identifiability if one.name == "m")
    within = share * 1.96 * m.sd / m.value
    return replace(model, identifiability=(replace(own, within=within),))


@pytest.mark.slow
def test_a_broken_promise_is_reported(both_ways: tuple[Path, Identified]) -> None:
    model = both_ways[1].model
    assert broken_promises(model) == ()
    (line,) = broken_promises(promised(model, 0.9 / BROKEN))
    assert line.startswith("intervals are wider than predicted from the logs (in brackets): m ")
    assert broken_promises(promised(model, 1.1 / BROKEN)) == ()


@pytest.mark.method
def test_runs_to_add_are_those_of_what_is_not_reported(tmp_path: Path) -> None:
    log = made(3)
    step = np.diff(log["y"], prepend=log["y"][0])
    u = np.where(log["u"] > 0, log["u"], 0.0)
    found = identified(tmp_path, {"t": log["t"], "y": np.cumsum(np.maximum(step, 0.0)), "u": u})
    runs = runs_to_add(found.model)
    assert any("that way" in one for one in runs), runs
    assert any(line.startswith("to identify the rest: ") for line in fit_lines(found.model))
    reported = {
        name: replace(one, value=one.assumed, reason=None) if one.value is None else one
        for name, one in found.model.friction.items()
    }
    assert not any(
        "that way" in one for one in runs_to_add(replace(found.model, friction=reported))
    )
