"""What a log leads to: nothing, a new version, a refusal; on real logs of a simulated machine."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from design import retuned
from design.challenge import Terms
from design.identified.identify_logs import Identified, identify_logs
from design.judgement import Judgement
from design.machine.model import Model
from design.machine.source import MachineLogs
from design.retuned import Drift, divided
from design.simulated.record import record
from identification.effects._library import built_in
from identification.errors import BadCard, BadLog, BadModel
from identification.model.karnopp import Karnopp
from tests.chain import CARD, TABLES, designed
from workbench.cards.card import Card, load_card
from workbench.documents.result_files import read_model
from workbench.jobs.judge import Chain, drift_by_chart
from workbench.jobs.passes import Task
from workbench.logs.sources import read_sources
from workbench.output import dumps
from workbench.registry.values import SeenLog, Version
from workbench.steps.simulate import as_columns

OLD = TABLES["paper_table1"]
NEW = replace(OLD, F_cp=16.0, F_vp=380.0, F_sp=26.0)
VERSION = Version("a", 1, "m", "d", None, datetime(2026, 3, 1, tzinfo=UTC))


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A machine's folder with logs before and after its friction has changed."""
    folder = tmp_path_factory.mktemp("a")
    (folder / "card.toml").write_text(
        CARD.replace("duration_s = 6.0", "duration_s = 10.0"), "utf-8"
    )
    card = load_card(folder / "card.toml")
    for name, friction, seed in (("first", OLD, 5), ("same", OLD, 6), ("drifted", NEW, 7)):
        write(folder / f"{name}.csv", card, friction, seed)
    return folder


def write(path: Path, card: Card, friction: Karnopp, seed: int) -> None:
    assert card.recipe is not None
    recipe = replace(card.recipe, plant=replace(card.recipe.plant, friction=friction))
    log = record(card.name, recipe, seed, card.rig())
    pd.DataFrame(as_columns(log, card)).to_csv(path, index=False, float_format="%.12g")


@pytest.fixture(scope="module", autouse=True)
def once() -> Iterator[None]:
    """The same runs are fitted once and the same model is designed for once, whoever asks."""
    fits: dict[str, Identified] = {}

    def identified_once(logs: MachineLogs, seed: int) -> Identified:
        key = repr([(one.sha256, one.rows, seed) for one in logs.runs])
        if key not in fits:
            fits[key] = identify_logs(logs, seed=seed)
        return fits[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(retuned, "identify_logs", identified_once)
        patch.setattr(retuned, "design", designed)
        yield


@pytest.fixture(scope="module")
def first(shop: Path) -> Judgement:
    """The machine's first model."""
    return Chain()(task(shop, "first", None))


def task(
    shop: Path, name: str, first: Judgement | None, previous: Mapping[str, Any] | None = None
) -> Task:
    log = SeenLog(name, f"{name}.csv", 1, 1)
    made = None if first is None else first.candidate
    return Task(
        machine="a",
        card=shop / "card.toml",
        path=shop / f"{name}.csv",
        log=log,
        version=None if made is None else VERSION,
        model=None if made is None else made.model,
        design=None if made is None else made.design,
        previous=previous,
    )


def model_of(first: Judgement, folder: Path) -> Model:
    assert first.candidate is not None
    (folder / "model.json").write_text(dumps(first.candidate.model), encoding="utf-8")
    return read_model(folder / "model.json")


def says(verdict: Any, **more: Any) -> Any:
    """A drift test that always says the same, and keeps what it was given."""

    def test(
        model: Model, logs: MachineLogs, rng: np.random.Generator, state: Mapping[str, Any]
    ) -> Drift:
        return Drift(verdict, "said", state={"given": dict(state)}, **more)

    return test


def test_the_first_model_is_one_that_passes(first: Judgement) -> None:
    assert first.verdict == "promoted"
    assert first.candidate is not None
    assert first.candidate.model["friction"]["F_cp"]["value"] == pytest.approx(12.0, rel=1e-2)
    assert first.candidate.design is not None and first.candidate.validation is not None
    assert first.candidate.validation["passed"] is True


@pytest.mark.slow
def test_the_chart_goes_on_from_log_to_log(shop: Path, first: Judgement, tmp_path: Path) -> None:
    model, rng = model_of(first, tmp_path), np.random.default_rng(1)
    state: Mapping[str, Any] = {}
    for name, verdict in (("same", "none"), ("drifted", "drift")):
        sources = read_sources([str(shop / f"{name}.csv")], str(shop / "card.toml"))
        found = drift_by_chart(model, sources.logs, rng, state)
        state = found.state
        assert found.verdict == verdict, found.reason
        assert state["logs"] >= 1
    assert {"F_cp", "F_sp"} <= {one.name for one in found.moved}
    assert found.reason.startswith("moved: ")
    with pytest.raises(BadModel, match="stored drift state"):
        drift_by_chart(model, sources.logs, rng, {"logs": "many"})


@pytest.mark.slow
def test_a_drifted_machine_gets_a_new_version(shop: Path, first: Judgement) -> None:
    chain = Chain(says("drift"), Terms(loop=-10.0))
    found = chain(task(shop, "drifted", first))
    assert found.verdict == "promoted", found.reason
    assert found.candidate is not None
    assert found.candidate.model["friction"]["F_cp"]["value"] == pytest.approx(16.0, rel=1e-2)
    contest = found.evidence["contest"]["held_out"]
    assert contest["challenger"]["position_rms"] < 0.5 * contest["champion"]["position_rms"]
    (entry,) = found.candidate.model["log"]
    assert entry["duration"] == pytest.approx(0.65 * 10.0, rel=0.01)  # the rest was held out


@pytest.mark.slow
def test_a_model_alone_is_replaced_where_the_active_design_is_not_beaten(
    shop: Path, first: Judgement
) -> None:
    found = Chain(says("drift"), Terms(loop=0.9))(task(shop, "drifted", first))
    assert found.verdict == "promoted", found.reason
    assert "the model is replaced and the controllers stay" in found.reason
    assert first.candidate is not None and first.candidate.design is not None
    assert found.candidate is not None and found.candidate.design is not None
    for name in ("rst", "pid", "force"):
        assert found.candidate.design[name] == first.candidate.design[name]
    friction = found.candidate.design["compensator"]["friction"]
    assert friction["F_cp"]["value"] == pytest.approx(16.0, rel=1e-2)
    assert found.rival is not None
    rival, why = found.rival
    assert rival.design != found.candidate.design and "at least 90 % less needed" in why


@pytest.mark.slow
def test_a_slip_of_unit_replaces_nothing_by_itself(shop: Path, first: Judgement) -> None:
    slipped = pd.read_csv(shop / "same.csv")
    slipped["y"] *= 10.0
    slipped.to_csv(shop / "slipped.csv", index=False)
    found = Chain(says("drift"), Terms(loop=-10.0))(task(shop, "slipped", first))
    assert found.verdict == "refused"
    assert found.reason.startswith("no wear but a slip of unit or scale")
    assert "every length by the factor 10 " in found.reason
    assert found.candidate is not None  # which a person may promote


@pytest.mark.slow
def test_a_false_alarm_is_refused_with_its_reason(shop: Path, first: Judgement) -> None:
    found = Chain(says("drift"))(task(shop, "same", first))
    assert found.verdict == "refused"
    assert "Held out" in found.reason
    assert found.candidate is not None


@pytest.mark.parametrize("verdict", ["none", "not_judged"])
def test_other_verdicts_are_passed_on_with_their_state(
    shop: Path, first: Judgement, verdict: str
) -> None:
    found = Chain(says(verdict))(task(shop, "same", first, {"state": {"mean": 1.5}}))
    assert (found.verdict, found.reason, found.candidate) == (verdict, "said", None)
    assert found.evidence["state"] == {"given": {"mean": 1.5}}


@pytest.mark.slow
def test_another_structure_is_traced_and_the_effect_made_active(
    shop: Path, first: Judgement
) -> None:
    card = load_card(shop / "card.toml")
    assert card.recipe is not None
    spring = built_in()["spring"].acting({"k": 60.0})
    plant = replace(card.recipe.plant, effects=(spring,))
    sprung = record(card.name, replace(card.recipe, plant=plant, duration=20.0), 8, card.rig())
    pd.DataFrame(as_columns(sprung, card)).to_csv(shop / "sprung.csv", index=False)
    found = Chain(says("structure"))(task(shop, "sprung", first))
    assert found.verdict == "promoted", found.reason
    assert "Missing: spring" in found.reason
    assert found.candidate is not None
    (effect,) = found.candidate.model["effects"].values()
    assert effect["k"]["value"] == pytest.approx(60.0, rel=0.02)
    assert found.evidence["trace"]["verdict"] == "effect"


@pytest.mark.slow
def test_a_structure_that_no_trace_confirms_has_to_win(shop: Path, first: Judgement) -> None:
    found = Chain(says("structure"))(task(shop, "same", first))
    assert found.verdict == "refused"
    assert "Held out" in found.reason


def test_the_log_that_made_the_model_does_not_judge_it(shop: Path, first: Judgement) -> None:
    assert first.candidate is not None
    one = task(shop, "first", first)
    digest = first.candidate.model["log"][0]["sha256"]
    found = Chain(says("drift"))(replace(one, log=replace(one.log, sha256=digest)))
    assert (found.verdict, found.reason) == (
        "none",
        "the active model was fitted on this log",
    )


def test_what_cannot_be_judged_says_why(shop: Path, first: Judgement, tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text("t,y\n0,0\n", encoding="utf-8")
    one = task(shop, "same", first)
    with pytest.raises(BadLog, match="no column"):
        Chain()(replace(one, path=tmp_path / "bad.csv"))
    with pytest.raises(BadCard, match="no such card"):
        Chain()(replace(one, card=tmp_path / "card.toml"))
    with pytest.raises(BadModel, match=r"a: active version: model\.json: "):
        Chain()(replace(one, model={"schema": "model/1"}))


def test_a_run_is_divided_in_time(shop: Path) -> None:
    sources = read_sources([str(shop / "same.csv")], str(shop / "card.toml"))
    train, (rest,) = divided(sources.logs)
    whole, (part,) = sources.runs[0].log, train.runs
    assert len(part.log) + len(rest) == len(whole)
    assert part.rows == len(part.log) == round(0.65 * len(whole))
    assert part.log["t"][-1] < rest["t"][0]
