"""What the registry gives an axis test: the last logs of a machine, and its active model."""

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from design.judgement import Candidate, Judgement
from design.machine.documents import model_document
from design.machine.effect_values import written_effect
from design.machine.source import Source
from design.simulated.record import record
from identification.drift.drift_result import Shift
from identification.effects._library import built_in
from identification.model.estimates import Estimate
from identification.model.plant import Actuator
from tests.chain import TABLES, model_of, short_recipe
from workbench.cards.units import in_unit_of
from workbench.jobs.axis_history import by_quantity, earlier_of
from workbench.logs.sources import Sources
from workbench.output import strict
from workbench.registry.queue import Queue
from workbench.registry.store import Registry
from workbench.registry.values import BadRegistry, SeenLog

NOW = datetime(2026, 3, 1, tzinfo=UTC)
LOGS = 7


def log_of(registry: Registry, k: int, value: float, done: Judgement | None = None) -> None:
    """A further log of the machine that shows this friction, quiet unless `done` says otherwise."""
    queue, log = Queue(registry.database), SeenLog(f"{k:x}" * 64, f"{k}.csv", 10, (k + 1) * 10**9)
    queue.announce("m", [log], now=NOW)
    claim = queue.claim("m", owner="w", lease=timedelta(minutes=1), now=NOW)
    assert claim is not None
    parameters = [
        {"name": name, "unit": "N", "before": 1.0, "after": sign * value + more}
        for name, sign, more in (("F_cp", 1, 0.0), ("F_cn", 1, 3.0), ("F_sn", -1, -8.0))
    ]
    judged = done or Judgement("none", "no drift")
    evidence = {"drift": {"verdict": "drift" if done else "none", "parameters": parameters}}
    queue.finish(claim, log, replace(judged, evidence=evidence), by="w", now=NOW)
    queue.release(claim)


def model(F_cp: float = 12.0) -> Candidate:
    made = model_of(replace(TABLES["paper_table1"], F_cp=F_cp), Actuator(19530.0, 10405.0))
    return Candidate(strict(model_document(made)))  # type: ignore[arg-type]


@pytest.fixture
def registry(tmp_path: Path) -> Iterator[Registry]:
    """A machine with seven judged logs, the last of which tells another friction."""
    with Registry(str(tmp_path / "r.db")) as found:
        found.add("m", model(), reason="first", by="t", now=NOW)
        found.promote("m", 1, reason="first", by="t", now=NOW)
        for k in range(LOGS):
            log_of(found, k, 12.0 + k)
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


def test_logs_after_a_drift_are_no_part_of_the_limits_until_somebody_accepts_it(
    registry: Registry,
) -> None:
    log_of(registry, 8, 25.0, Judgement("refused", "moved"))
    log_of(registry, 9, 25.0, Judgement("promoted", "moved", model(25.0)))
    for k in range(10, 15):
        log_of(registry, k, 25.0 + 0.01 * k)
    found = earlier_of(registry, "m", sources())
    assert [value for _, value in found.values["F_cp"]] == [12.0 + k for k in range(LOGS)]
    assert found.version == 2 and not found.said
    out, accept = found.remarks
    assert out.startswith("the limits leave out 9.csv, 8.csv (alarm), 14.csv, 13.csv, 12.csv and 2")
    assert "not tested against the accepted version 1" in out
    assert "nobody has accepted the active version 2" in accept
    assert "registry promote m 2" in accept
    registry.promote("m", 2, reason="new guide", by="anna", now=NOW)
    found = earlier_of(registry, "m", sources())
    assert [value for _, value in found.values["F_cp"]] == [25.0 + 0.01 * k for k in range(10, 15)]
    assert not found.said and len(found.remarks) == 1
    registry.rollback("m", reason="old guide again", by="anna", now=NOW)
    found = earlier_of(registry, "m", sources())
    assert len(found.values["F_cp"]) == LOGS


def test_a_new_design_of_the_same_model_goes_on_with_its_history(registry: Registry) -> None:
    made = replace(model(), design={"k": 1.0})
    registry.add("m", made, reason="faster", by="t", now=NOW)
    registry.promote("m", 2, reason="faster", by="t", now=NOW)
    log_of(registry, 8, 12.5)
    assert len(earlier_of(registry, "m", sources()).values["F_cp"]) == LOGS + 1


def test_a_machine_that_is_not_there_is_refused(registry: Registry) -> None:
    with pytest.raises(BadRegistry, match="other"):
        earlier_of(registry, "other", sources())
    registry.add("new", Candidate({"m": 1.0}), reason="first", by="t", now=NOW)
    found = earlier_of(registry, "new", sources())
    assert found.version is None and "0 sound logs" in found.said


def test_readings_of_the_drift_test_by_quantity() -> None:
    found = by_quantity(
        [
            Shift("F_sn", "N", -21.0, 0.1, -20.0, 0.8, -21.5, -18.5, 0.0, 0.1, 1.0),
            Shift("backlash.width", "m", 1e-4, 1e-5, 2e-4, 5e-5, 1e-4, 3e-4, 0.0, 0.1, 1.0),
            Shift("stribeck.F_s", "N", 1.0, 0.1, 1.0, 0.05, 0.9, 1.1, 0.0, 0.1, 1.0),
        ]
    )
    assert set(found) == {"F_sn", "backlash"}
    one = found["F_sn"]
    assert (one.value, one.low, one.high) == (20.0, 18.5, 21.5)


@pytest.mark.slow
def test_a_model_with_further_effects_tells_this_log_by_its_fit(tmp_path: Path) -> None:
    values = {"F_s": 5.0, "v_s": 0.03}
    model = model_of(TABLES["paper_table1"], Actuator(19530.0, 10405.0))
    whole = written_effect("stribeck", values, built_in(), in_unit_of)
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
