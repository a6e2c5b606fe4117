"""Summary of the fleet: states by the last log, what moved most, pages cut by the database."""

from datetime import timedelta
from typing import Any

import pytest

from design.judgement import Candidate, Judgement, LogVerdict
from tests.workbench.page.conftest import NOW, Page
from workbench.page.machine import asked_for, parameter_charts
from workbench.registry import results
from workbench.registry.overview import (
    TREND_LOGS,
    FleetAsked,
    fleet_page,
    most_moved,
    state_of,
    with_log,
)
from workbench.registry.queue import Queue
from workbench.registry.results import condition, last_logs
from workbench.registry.store import Registry
from workbench.registry.values import SeenLog

HOUR = timedelta(hours=1)


def parameter_moved(name: str, change: float, sd: float = 0.01) -> dict[str, Any]:
    after = 10.0 * (1.0 + change)
    return {"name": name, "unit": "N", "before": 10.0, "after": after, "low": after - 0.2,
            "high": after + 0.2, "change": change, "sd": sd}  # fmt: skip


def evidence(*parameters: dict[str, Any], verdict: str = "none") -> dict[str, Any]:
    return {"drift": {"verdict": verdict, "parameters": list(parameters), "moved": []}}


def judge(
    registry: Registry, machine: str, number: int, verdict: LogVerdict, found: dict[str, Any],
    made: Candidate | None = None,
) -> None:  # fmt: skip
    """A further log of the machine and its result, an hour after the one before."""
    queue, now = Queue(registry.database), NOW + number * HOUR
    log = SeenLog(f"{number:064d}", f"run{number}.csv", 10, int(now.timestamp() * 1e9))
    queue.announce(machine, [log], now=now)
    claim = queue.claim(machine, owner="w", lease=HOUR, now=now)
    assert claim is not None
    queue.finish(claim, log, Judgement(verdict, "why", made, found), by="w", now=now)
    queue.release(claim)


def asked(**given: Any) -> FleetAsked:
    return FleetAsked(**{"silent_since": NOW, **given})


def names(registry: Registry, **given: Any) -> list[str]:
    return [one.machine for one in fleet_page(registry.database, asked(**given)).lines]


@pytest.mark.slow
def test_a_state_is_that_of_the_last_log(where: str) -> None:
    with Registry(where) as registry:
        for name in ("tuned", "drifts", "changed", "bad", "unsure", "new"):
            registry.add(name, Candidate({"m": 1.0}), reason="r", by="t", now=NOW)
        judge(registry, "tuned", 1, "refused", evidence(verdict="drift"))
        judge(registry, "tuned", 2, "none", evidence(parameter_moved("F_cp", 0.01)))
        judge(
            registry,
            "drifts",
            1,
            "refused",
            evidence(parameter_moved("F_cp", 0.3), verdict="drift"),
        )
        judge(registry, "changed", 1, "structure", evidence(verdict="structure"))
        judge(registry, "bad", 1, "set_aside", {})
        judge(registry, "unsure", 1, "not_judged", {})
        lines = {one.machine: one for one in fleet_page(registry.database, asked()).lines}
        assert {name: one.state for name, one in lines.items()} == {
            "tuned": "in_tune", "drifts": "drifting", "changed": "structure", "bad": "log_bad",
            "unsure": "not_judged", "new": "no_log",
        }  # fmt: skip
        assert (lines["tuned"].logs, lines["new"].logs) == (2, 0)
        assert lines["drifts"].moved == "F_cp" and lines["drifts"].moved_by == pytest.approx(0.3)
        later = fleet_page(registry.database, asked(silent_since=NOW + 90 * timedelta(minutes=1)))
        silent = {one.machine for one in later.lines if one.state == "silent"}
        assert silent == {"unsure"} and later.counts["silent"] == 1  # an alarm stays one
        for name in ("drifts", "new"):
            registry.promote(name, 1, reason="r", by="t", now=NOW)
        assert condition(registry.database, "new") == "no_log"
        assert condition(registry.database, "drifts") == "not_judged"


@pytest.mark.slow
def test_pages_are_filtered_sorted_and_cut(where: str) -> None:
    with Registry(where) as registry:
        for k in range(7):
            registry.add(f"m{k}", Candidate({"m": 1.0}), reason="r", by="t", now=NOW)
        for k, moved in ((1, -0.2), (3, 0.1), (5, 0.4)):
            judge(
                registry,
                f"m{k}",
                k,
                "refused",
                evidence(parameter_moved("m", moved), verdict="drift"),
            )
        judge(registry, "m2", 2, "structure", evidence())
        assert names(registry, order="machine", per_page=3) == ["m0", "m1", "m2"]
        assert names(registry, order="machine", per_page=3, page=3) == ["m6"]
        assert names(registry, order="machine", down=True)[0] == "m6"
        assert names(registry, order="moved", down=True)[:3] == ["m5", "m1", "m3"]
        assert names(registry, order="heard")[:2] == ["m1", "m2"]
        assert names(registry, order="state")[:2] == ["m2", "m1"]
        assert names(registry, state="drifting", order="machine") == ["m1", "m3", "m5"]
        assert names(registry, text="M3") == ["m3"]
        assert names(registry, text="%") == [] and names(registry, text="_") == []
        found = fleet_page(registry.database, asked(state="drifting", text="m", per_page=2))
        assert (found.found, len(found.lines)) == (3, 2)
        assert found.counts == {"drifting": 3, "structure": 1, "no_log": 3}
        assert last_logs(registry.database, "m5", 5)[0].parameters[0]["name"] == "m"


def test_what_moved_most_is_what_surely_moved() -> None:
    assert most_moved({}) == (None, None)
    assert most_moved(
        evidence(parameter_moved("a", 0.5, 0.5), parameter_moved("b", -0.1, 0.01))
    ) == ("b", -0.1)
    assert (
        most_moved(evidence(parameter_moved("a", 0.01, 0.01), parameter_moved("b", 0.015, 0.1)))[0]
        == "a"
    )
    old = {"drift": {"moved": [{"name": "F_cp", "before": 10.0, "after": 12.0}]}}
    name, by = most_moved(old)
    assert name == "F_cp" and by == pytest.approx(0.2)
    trend: dict[str, list[float]] = {}
    for k in range(TREND_LOGS + 5):
        trend = with_log(trend, evidence(parameter_moved("a", k / 10)))
    assert len(trend["a"]) == TREND_LOGS and trend["a"][-1] == pytest.approx(10 * (1 + 3.6))
    assert state_of("refused", {}) == "not_judged"
    assert state_of("refused", evidence(verdict="structure")) == "structure"


def test_an_older_log_does_not_move_the_state(where: str) -> None:
    with Registry(where) as registry:
        registry.add("a", Candidate({"m": 1.0}), reason="r", by="t", now=NOW)
        log = SeenLog("f" * 64, "new.csv", 1, int((NOW + 9 * HOUR).timestamp() * 1e9))
        queue = Queue(registry.database)
        queue.announce("a", [log], now=NOW)
        claim = queue.claim("a", owner="w", lease=HOUR, now=NOW)
        assert claim is not None
        made = Judgement(
            "promoted", "r", Candidate({"m": 2.0}), evidence(parameter_moved("m", 0.2))
        )
        queue.finish(claim, log, made, by="w", now=NOW)
        queue.release(claim)
        assert condition(registry.database, "a") == "in_tune"
        judge(registry, "a", 1, "refused", evidence(verdict="drift"))
        assert condition(registry.database, "a") == "in_tune"


def test_the_table_and_the_machine_show_it(page: Page) -> None:
    registry = page.registry
    for name in ("a/b", "c d", "x&y"):
        if "/" in name:
            continue
        registry.add(name, Candidate({"m": 1.0}), reason="first", by="t", now=NOW)
        for k in range(1, 4):
            judge(
                registry,
                name,
                k,
                "none",
                evidence(parameter_moved("F_cp", k / 100), parameter_moved("m", 0.001)),
            )
    text = page.client.get("/?order=machine").text
    assert 'href="/machine/c%20d"' in text and "x&amp;y" in text and "<polyline" in text
    part = page.client.get("/?state=no_log", headers={"HX-Target": "fleet"}).text
    assert "<html" not in part and "No machine of 2 is so" in part
    shown = page.client.get("/machine/x%26y").text
    assert "run3.csv" in shown and '"y": "F_cp [N]"' in shown
    assert page.client.get("/machine/x%26y/compare?a=1&b=1").status_code == 200
    assert page.client.get("/machine/x%26y/compare?a=x&b=1").status_code == 400
    assert page.client.get("/machine/x%26y/version/1/model.json").json() == {"m": 1.0}


def test_a_machine_shows_the_lights_of_its_newest_log(page: Page) -> None:
    registry = page.registry
    for name in ("fresh", "same", "worn"):  # a page is kept for a moment, so one for each state
        registry.add(name, Candidate({"m": 1.0}), reason="first", by="t", now=NOW)
        for k in range(1, 8) if name != "fresh" else ():
            found = evidence(parameter_moved("F_cp", 0.01 * (k % 3)), parameter_moved("m", 0.001))
            judge(registry, name, k, "none", found)
    judge(
        registry,
        "worn",
        8,
        "none",
        evidence(parameter_moved("F_cp", 0.4), parameter_moved("m", 0.001)),
    )
    fresh, same, worn = (
        page.client.get(f"/machine/{name}").text for name in ("fresh", "same", "worn")
    )
    assert "No log has given its parameters yet" in fresh
    assert (
        "run7.csv; limits: mean ± 3 sd of 6 sound logs" in same
        and 'class="state done">green' in same
    )
    assert 'class="state failed">red' not in same
    assert (
        "run8.csv; limits: mean ± 3 sd of 7 sound logs" in worn
        and 'class="state failed">red' in worn
    )


def promoted_by_a_worker(registry: Registry, machine: str) -> None:
    """A machine whose seven quiet logs are followed by a drift, its new model, and a quiet log."""
    registry.add(machine, Candidate({"m": 1.0}), reason="first", by="t", now=NOW)
    registry.promote(machine, 1, reason="first", by="t", now=NOW)
    for k in range(1, 8):
        judge(
            registry,
            machine,
            k,
            "none",
            evidence(parameter_moved("F_cp", 0.001 * (k % 3)), parameter_moved("m", 0.0)),
        )
    found = evidence(parameter_moved("F_cp", 0.4), parameter_moved("m", 0.001), verdict="drift")
    judge(registry, machine, 8, "promoted", found, Candidate({"m": 2.0}))
    after = {**parameter_moved("F_cp", 0.4), "before": 14.0, "change": 0.0}
    judge(registry, machine, 9, "none", evidence(after, parameter_moved("m", 0.011)))
    judge(registry, machine, 10, "set_aside", {})
    judge(registry, machine, 11, "not_judged", {})


def test_a_drift_stays_until_somebody_accepts_it(page: Page) -> None:
    registry = page.registry
    promoted_by_a_worker(registry, "a")
    (line,) = fleet_page(registry.database, asked()).lines
    assert (line.state, line.moved, line.version) == ("drifting", "F_cp", 2)
    assert line.moved_by == pytest.approx(0.4) and line.trend[-1] == pytest.approx(14.0)
    text = page.client.get("/machine/a").text
    assert (
        "run9.csv; limits: mean ± 3 sd of 7 sound logs (wider of few); the limits leave out" in text
    )
    assert "run8.csv (alarm)" in text
    assert text.count("Newer logs gave no parameters: run11.csv, run10.csv") == 2
    assert 'class="state failed">red' in text
    assert "Nobody has accepted it yet" in text and "<td>excluded</td>" in text.replace(
        '<td class="nowrap">', "<td>"
    )
    promoted_by_a_worker(registry, "b")
    judge(registry, "b", 12, "refused", evidence(parameter_moved("m", 0.5), verdict="drift"))
    for name in ("a", "b"):
        registry.promote(name, 2, reason="new guide", by="anna", now=NOW)
    assert condition(registry.database, "a") == "in_tune"
    assert condition(registry.database, "b") == "drifting"  # since that version, too
    judge(registry, "b", 13, "none", evidence(parameter_moved("F_cp", 0.0)))
    assert condition(registry.database, "b") == "in_tune"


def test_a_bad_or_inconclusive_log_hides_no_change() -> None:
    for verdict in ("set_aside", "not_judged"):
        assert state_of(verdict, {}, "structure") == "structure"
        assert state_of(verdict, {}, "in_tune") != "in_tune"
    assert state_of("none", {}, "drifting") == "in_tune"
    assert state_of("none", {}, "drifting", accepted=False) == "drifting"
    drift = evidence(verdict="drift")
    assert state_of("refused", drift, "structure", accepted=False) == "structure"
    assert state_of("refused", evidence(verdict="structure"), "drifting") == "structure"
    assert state_of("promoted", {}) == "in_tune"  # the first model


def test_the_active_model_is_drawn_in_steps_and_what_moved_comes_first() -> None:
    def log(k: int, active: float, found: float) -> results.TestedLog:
        dv = {
            **parameter_moved("dv_p", 0.0005, 0.0001),
            "before": 0.04,
            "after": 0.04002,
            "unit": "m/s",
        }
        F_cp = {**parameter_moved("F_cp", 0.0), "before": active, "after": found}
        return results.TestedLog(
            f"{k}", f"{k}", 60.0 * k, "none", "", 1, None, (dv, F_cp), "", True
        )

    logs = [log(0, 17.0, 17.0), log(1, 17.0, 21.0), log(2, 21.0, 21.0)]
    (drawn,) = parameter_charts(logs)
    first, second = drawn.panels
    assert (first.y, second.y) == ("F_cp [N]", "dv_p [mm/s]")
    active = first.lines[0]
    assert list(active.y) == [17.0, 17.0, 17.0, 21.0, 21.0]
    assert active.x[2] < active.x[3] < active.x[2] + 1e-3
    assert second.lines[1].y[0] == pytest.approx(40.02)


@pytest.mark.parametrize(
    "query",
    [
        {"page": "-1"},
        {"page": "9" * 30},
        {"page": "²"},
        {"order": "x; drop"},
        {"state": "x"},
        {"text": "a" * 10_000},
    ],
)
def test_an_odd_question_is_answered(page: Page, query: dict[str, str]) -> None:
    assert page.client.get("/", params=query).status_code == 200
    assert len(asked_for(query, 7.0).text) <= 100
