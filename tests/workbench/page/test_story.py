"""The story in Chromium: drop, correct, trace, keep; drift arrives; promote, roll back.

Also by the keyboard alone, at two widths, in the dark, and looked over by axe.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import pytest

from design.judgement import Candidate, Judgement
from tests.chain import CARD
from tests.workbench.jobs.worker import short_pass
from tests.workbench.page.browser import CHROMIUM, DRIVER, NARROW, NO_BROWSER, Person
from tests.workbench.page.served import serving
from tests.workbench.page.test_fleet import evidence, parameter_moved
from workbench.jobs.passes import Task
from workbench.registry.access import Access
from workbench.registry.store import Registry

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None or DRIVER is None, reason=NO_BROWSER),
]
ENTER, SPACE = "\ue007", " "


@dataclass
class Plant:
    """What the story plays in: the page, a person in front of it, a token, a log."""

    person: Person
    registry: Registry
    root: Path
    token: str
    log: str


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Plant]:
    folder = tmp_path_factory.mktemp("plant")
    root, where = folder / "machines", str(folder / "r.db")
    with Registry(where) as registry:
        token = Access(registry.database).add("anna", "change", by="t", now=datetime.now(UTC))
        with serving(where, root, "--servers", "1") as served:
            person = Person(served.address)
            try:
                yield Plant(person, registry, root, token, simulated(folder))
            finally:
                person.quit()


def simulated(folder: Path) -> str:
    """A short log of a machine with a spring, as text, its position in mm and called so."""
    import workbench as wb

    card = CARD.replace("duration_s = 6.0", "duration_s = 5.0").replace("2e-3", "2.5e-3")
    path = folder / "recipe.toml"
    path.write_text(f"{card}[recipe.effects.spring]\nk = 150.0\n", encoding="utf-8")
    frame = wb.simulate(path).frame.drop(columns=["r"])
    frame["y"] = 1e3 * frame["y"]
    names = {"t": "time [s]", "y": "position [mm]", "F": "force [N]", "u": "valve [V]"}
    return str(frame.rename(columns=names).to_csv(index=False))


def drifted(task: Task) -> Judgement:
    """A judge that finds another Coulomb friction, with a model that loses the contest."""
    assert task.model is not None
    friction = dict(task.model["friction"])
    friction["F_cp"] = {**friction["F_cp"], "value": 1.3 * friction["F_cp"]["value"]}
    candidate = Candidate({**task.model, "friction": friction}, task.design)
    found = evidence(parameter_moved("F_cp", 0.3), parameter_moved("m", 0.001), verdict="drift")
    return Judgement("refused", "moved: F_cp; but no better on the held-out part", candidate, found)


def quiet(task: Task) -> Judgement:
    """A judge that finds nothing."""
    return Judgement(
        "none", "no parameter has moved", evidence=evidence(parameter_moved("F_cp", 0.01))
    )


def test_the_story(plant: Plant) -> None:
    person = plant.person
    _signs_in_by_keyboard(plant)
    _drops_and_corrects(plant)
    person.find("#do-identify").click()
    person.reads("Cancel")
    person.find(".task button.plain").click()
    person.reads("cancelled by anna")
    person.find("#do-trace").click()
    person.find("progress")
    person.looks_right("drop")
    person.reads("Keep as machine")
    person.until(lambda: person.inked(".task"), "the residual is not drawn")
    assert "spring" in person.text()
    person.looks_right("traced")
    person.type("[name=machine]", "bench-a")
    person.type(".keep [name=reason]", "first model <b>of bench-a</b>")
    person.find(".keep button").click()
    person.reads("first model <b>of bench-a</b>")
    assert (plant.root / "bench-a" / "card.toml").exists()
    assert plant.registry.machine("bench-a").in_force is not None
    _drift_arrives(plant)
    _promotes_by_keyboard_and_goes_back(plant)
    _in_the_dark_and_narrow(plant)


def _signs_in_by_keyboard(plant: Plant) -> None:
    person = plant.person
    person.go("/drop")
    person.reads("To drop a log, sign in")
    person.tab_to("Sign in")
    person.keys(ENTER)
    person.until(lambda: person.focused() == "token", "the field has no focus")
    person.keys(plant.token, ENTER)
    person.reads("anna (change)")
    person.go("/drop")
    person.keys("\ue004")
    assert person.focused() == "Skip to content"
    person.tab_to("log")


def _drops_and_corrects(plant: Plant) -> None:
    person = plant.person
    person.drop("#zone", "bench <i>a</i>.csv", plant.log)
    person.reads("bench <i>a</i>.csv")
    person.until(lambda: person.inked("#columns"), "the columns are not drawn")
    person.until(lambda: person.inked("#picture"), "the doctor's picture is not drawn")
    assert person.find("[name=unit_y]").get_attribute("value") == "mm"
    person.type("[name=unit_y]", "parsec per fortnight")
    person.find("#card button[type=submit]").click()
    person.until(lambda: person.find("#card .bad"), "a wrong unit is not reported")
    person.type("[name=unit_y]", "mm")
    person.type("#name", "bench-a")
    person.find("#card button[type=submit]").click()
    person.reads("Saved; the log is read by it.")
    person.until(lambda: person.inked("#picture"), "the doctor's picture is not drawn again")
    person.reads("of the nine parameters")


def _drift_arrives(plant: Plant) -> None:
    """Two quiet logs and one of a drift, judged as a worker of `watch` does."""
    logs = plant.root / "bench-a" / "logs"
    for number, judge in enumerate((quiet, quiet, drifted)):
        for path in logs.iterdir():
            path.with_name(f"run{number}.csv").write_text(f"{number}", encoding="utf-8")
            break
        assert short_pass(plant.registry, judge, plant.root, "w").run().failed == {}
    person = plant.person
    person.go("/")
    person.reads("drift")
    person.find("[aria-label^='F_cp over the last']")
    person.looks_right("fleet")
    person.type("#text", "nothing")
    person.reads("No machine of 1 is so")
    person.type("#text", "bench")
    person.find("a[href='/machine/bench-a']").click()
    person.reads("but no better on the held-out part")
    person.until(lambda: person.inked("[aria-labelledby=h-time]"), "no parameters over time")
    person.until(lambda: person.inked("#side"), "no step responses")
    person.looks_right("machine")


def _promotes_by_keyboard_and_goes_back(plant: Plant) -> None:
    person = plant.person
    person.go("/machine/bench-a")
    person.tab_to("number")
    person.tab_to("why-promote", 1)
    person.keys("seen on the bench")
    person.tab_to("promote", 1)
    person.keys(SPACE)
    person.reads("by anna: seen on the bench")
    person.type("#why-rollback", "slower than before")
    person.find("#rollback").click()
    person.reads("by anna: slower than before")
    state = plant.registry.machine("bench-a")
    assert state.since is not None and state.since.made_by == "anna"
    assert (state.since.kind, state.since.number) == ("rolled_back", 1)
    person.find("#rollback")
    person.type("#why-rollback", "and once more")
    person.find("#rollback").click()
    person.reads("so there is none to go back to")


def _in_the_dark_and_narrow(plant: Plant) -> None:
    person = plant.person
    upload = next((plant.root / ".drops").iterdir()).name
    pages = {"fleet": "/", "zone": "/drop", "machine": "/machine/bench-a",
             "changes": "/audit", "drop": f"/drop/{upload}"}  # fmt: skip
    for width, dark in ((NARROW, False), (NARROW, True)):
        person.wide(width, dark=dark)
        for name, path in pages.items():
            person.go(path)
            if name == "machine":
                person.until(lambda: person.inked("#side"), "no step responses")
            if name == "drop":
                person.until(lambda: person.inked(".task"), "the residual is not drawn")
            person.looks_right(f"{name}-{width}{'-dark' if dark else ''}")
    person.wide(dark=True)
    person.go("/machine/bench-a")
    person.until(lambda: person.inked("#side"), "no step responses")
    person.looks_right("machine-dark")
    person.wide()
