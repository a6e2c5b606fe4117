"""What the registry gives an axis test: the last logs of a machine, and its model in force."""

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from identification.effects._library import built_in
from identification.model.estimates import Estimate
from identification.model.plant import Actuator
from tests.chain import TABLES, model_of, short_recipe
from workbench.cards.effect_values import written_effect
from workbench.documents.model_file import model_document
from workbench.jobs.axis_history import by_quantity, earlier_of
from workbench.jobs.drift_by_chart import Reading
from workbench.logs.sources import Source, Sources
from workbench.output import strict
from workbench.registry.errors import BadRegistry
from workbench.registry.queue import Queue
from workbench.registry.store import Registry
from workbench.registry.values import Candidate, Judgement, SeenLog
from workbench.steps.simulate import record

NOW = datetime(2026, 3, 1, tzinfo=UTC)
LOGS = 7


@pytest.fixture
def registry(tmp_path: Path) -> Iterator[Registry]:
    """A machine with seven judged logs, the last of which tells another friction."""
    model = strict(model_document(model_of(TABLES["paper_table1"], Actuator(19530.0, 10405.0))))
    with Registry(str(tmp_path / "r.db")) as found:
        found.add("m", Candidate(model), reason="first", by="t", now=NOW)  # type: ignore[arg-type]
        found.promote("m", 1, reason="first", by="t", now=NOW)
        queue = Queue(found.database)
        for k in range(LOGS):
            log = SeenLog(f"{k}" * 64, f"{k}.csv", 10, (k + 1) * 10**9)
            queue.announce("m", [log], now=NOW)
            claim = queue.claim("m", owner="w", lease=timedelta(minutes=1), now=NOW)
            assert claim is not None
            parameters = [
                {"name": name, "unit": "N", "before": 1.0, "after": value}
                for name, value in (("F_cp", 12.0 + k), ("F_cn", 15.0 + k), ("F_sn", -20.0 - k))
            ]
            evidence = {"drift": {"parameters": parameters}}
            queue.finish(claim, log, Judgement("none", "no drift", None, evidence), by="w", now=NOW)
            queue.release(claim)
        yield found


def sources(sha256: str = "f" * 64) -> Sources:
    card, recipe = short_recipe()
    log = record("short", recipe, 7)
    return Sources(card, card.rig(), (Source(log, "short.csv", sha256, len(log)),), ())


def test_the_last_logs_oldest_first_and_sizes_of_negative_limits(registry: Registry) -> None:
    found = earlier_of(registry, "m", sources())
    assert [value for _, value in found.values["F_cp"]] == [12.0 + k for k in range(LOGS)]
    assert [value for _, value in found.values["F_sn"]] == [20.0 + k for k in range(LOGS)]
    assert [value for _, value in found.values["constant_force"]] == [1.5] * LOGS
    assert (found.machine, found.version, found.said, found.estimates) == ("m", 1, "", None)


def test_the_log_itself_is_not_among_them(registry: Registry) -> None:
    found = earlier_of(registry, "m", sources("6" * 64))
    assert [value for _, value in found.values["F_cp"]] == [12.0 + k for k in range(LOGS - 1)]


def test_a_machine_that_is_not_there_is_refused(registry: Registry) -> None:
    with pytest.raises(BadRegistry, match="other"):
        earlier_of(registry, "other", sources())
    registry.add("new", Candidate({"m": 1.0}), reason="first", by="t", now=NOW)
    found = earlier_of(registry, "new", sources())
    assert found.version is None and "0 tested logs" in found.said


def test_readings_of_the_drift_test_by_quantity() -> None:
    found = by_quantity(
        [
            Reading("F_sn", "N", -21.0, -20.0, -21.5, -18.5, 0.0, 0.1),
            Reading("backlash.width", "m", 1e-4, 2e-4, 1e-4, 3e-4, 0.0, 0.1),
            Reading("stribeck.F_s", "N", 1.0, 1.0, 0.9, 1.1, 0.0, 0.1),
        ]
    )
    assert set(found) == {"F_sn", "backlash"}
    one = found["F_sn"]
    assert (one.value, one.low, one.high) == (20.0, 18.5, 21.5)


@pytest.mark.slow
def test_a_model_with_further_effects_tells_this_log_by_its_fit(tmp_path: Path) -> None:
    values = {"F_s": 5.0, "v_s": 0.03}
    model = model_of(TABLES["paper_table1"], Actuator(19530.0, 10405.0))
    whole = written_effect("stribeck", values, built_in())
    units = {"F_s": "N", "v_s": "m/s"}
    known = {
        name: Estimate(value, units.get(name, "1"), 0.01 * value if name in units else None)
        for name, value in whole.values.items()
    }
    document = strict(model_document(replace(model, effects={"stribeck": known})))
    card, recipe = short_recipe(12.0)
    log = record("s", replace(recipe, plant=replace(recipe.plant, effects=(whole,))), 77)
    of = Sources(card, card.rig(), (Source(log, "s.csv", "a" * 64, len(log)),), ())
    with Registry(str(tmp_path / "r.db")) as found:
        found.add("m", Candidate(document), reason="f", by="t", now=NOW)  # type: ignore[arg-type]
        found.promote("m", 1, reason="f", by="t", now=NOW)
        earlier = earlier_of(found, "m", of)
    assert earlier.remarks == ("by the fit of the active version 1, which has stribeck",)
    assert earlier.estimates is not None
    assert earlier.estimates["F_cp"].value == pytest.approx(12.0, rel=0.01)
    assert earlier.estimates["F_sn"].value == pytest.approx(23.0, rel=0.01)
