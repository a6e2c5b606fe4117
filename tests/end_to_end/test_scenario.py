"""Twelve weeks of one machine, from table 2 to table 3: what is noticed, when, and what is done.

`benchmarks/scenario.py` tells the same story with two logs a week.
"""

from pathlib import Path

import pytest

from benchmarks.scenario import SPRING, DayResult, days, picture, story
from workbench.registry.store import Registry

pytestmark = pytest.mark.method

LOGGED = (0, 1, 2, 4, 6, 7, 8, 10, 12, 14, 16, 18, 20, 22)  # one a week, and both unreadable ones
DAYS = [day for day in days() if day.number in LOGGED]


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the machine and its registry lie."""
    return tmp_path_factory.mktemp("scenario")


@pytest.fixture(scope="module")
def results(home: Path) -> list[DayResult]:
    """The story of the README's picture with a log a week, and other noise."""
    return story(home, 5, LOGGED)


def test_every_log_has_one_verdict(results: list[DayResult]) -> None:
    assert [one.day for one in results] == DAYS
    verdicts = {one.day.number: one.outcome.verdict for one in results}
    assert verdicts[0] == "promoted"
    assert [verdicts[number] for number in (1, 2, 4)] == ["none"] * 3


def test_bad_logs_and_a_sensor_fault_are_excluded_and_stop_nothing(
    results: list[DayResult],
) -> None:
    for one in results:
        assert (one.outcome.verdict == "set_aside") == bool(one.day.fault), one
    stuck = [one for one in results if one.day.fault == "transducer sticks"]
    assert all("sensor sticks" in one.outcome.reason for one in stuck)


def test_wear_is_followed(results: list[DayResult]) -> None:
    """With less behind than wears off between two logs: 0.6 N of F_cp."""
    for one in results:
        if not one.day.fault:
            assert one.active == pytest.approx(one.true, abs=0.35), one
    moved = [one for one in results if one.outcome.reason.startswith("moved:")]
    assert len(moved) >= 4
    assert results[-1].active == pytest.approx(12.54, abs=0.1)


def test_the_undeclared_spring_is_named_when_it_comes_and_stays(
    results: list[DayResult], home: Path
) -> None:
    first = next(one for one in results if one.day.spring)
    assert first.outcome.verdict == "promoted"
    assert "Missing: spring" in first.outcome.reason
    assert not any("spring" in one.outcome.reason for one in results if not one.day.spring)
    with Registry(str(home / "registry.db")) as registry:
        version = registry.active_version("rig")
        assert version is not None
        effects = registry.document(version, "model")["effects"]
    assert list(effects) == ["spring"]
    assert effects["spring"]["k"]["value"] == pytest.approx(SPRING, rel=0.05)


def test_nothing_is_lost(results: list[DayResult], home: Path) -> None:
    with Registry(str(home / "registry.db")) as registry:
        state = registry.machine("rig")
        excluded = sum(bool(day.fault) for day in DAYS)
        assert (state.logs, state.waiting, state.set_aside) == (len(DAYS), 0, excluded)
        promoted = [one for one in registry.decisions("rig") if one.kind == "promoted"]
    assert len(promoted) == sum(one.outcome.verdict == "promoted" for one in results)


def test_the_timeline_is_drawn(results: list[DayResult], tmp_path: Path) -> None:
    picture(results, tmp_path / "timeline.png")
    assert (tmp_path / "timeline.png").stat().st_size > 10_000
