"""Three months of one machine: what was noticed, when, and what was done.

    python benchmarks/scenario.py [--seed 0] [--picture docs/timeline.png]

A simulated rig has the friction of the paper's table 2 and wears to that of table 3. Two logs a
week are judged by the same pass as `workbench reidentify`, on a registry of its own. In between a
week of files that no one can read, a week in which the position transducer sticks, and from then
on a spring that nobody declared (a hose that pulls). Prints the timeline.
"""

import argparse
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from design.simulated.record import record
from identification.effects._library import built_in
from identification.log import Log
from identification.model.karnopp import NAMES, Karnopp
from workbench.cards.card import Card, load_card
from workbench.jobs.judge import Chain
from workbench.jobs.options import JobOptions
from workbench.jobs.passes import Pass
from workbench.logs.sources import card_path
from workbench.registry.queue import Queue
from workbench.registry.store import Registry
from workbench.registry.values import LogOutcome
from workbench.steps.simulate import as_columns

START = datetime(2026, 3, 2, 6, 0, tzinfo=UTC)
STEP = timedelta(days=3.5)
SPRING = 40.0  # N/m
CARD = """[card]
name = "rig"

[rig]
kind = "force"
control_limit_v = 5.0

[signals]
t = { column = "t", unit = "s" }
r = { column = "r", unit = "m" }
y = { column = "y", unit = "m" }
F = { column = "F", unit = "N" }
u = { column = "u", unit = "V" }
"""


@dataclass(frozen=True)
class Day:
    """One log: when, what is true then (wear 0: table 2, 1: table 3), and what is wrong with it."""

    number: int
    wear: float
    spring: bool = False
    fault: str = ""

    @property
    def at(self) -> datetime:
        """When the log ends."""
        return START + self.number * STEP

    @property
    def week(self) -> float:
        """Weeks since the start."""
        return self.number / 2.0


@dataclass(frozen=True)
class DayResult:
    """A day's log, what became of it, and the model's active F_cp [N] after it."""

    day: Day
    outcome: LogOutcome
    true: float
    active: float | None


def days() -> Iterator[Day]:
    """Twelve weeks, two logs each."""
    for number in range(24):
        week = number // 2
        wear = float(np.clip((number - 6) / 14.0, 0.0, 1.0))
        fault = {3: "unreadable", 6: "transducer sticks"}.get(week, "")
        yield Day(number, wear, spring=week >= 8, fault=fault)


def between(old: Karnopp, new: Karnopp, wear: float) -> Karnopp:
    """Parameters on the way from old to new."""
    return Karnopp(*((1.0 - wear) * getattr(old, n) + wear * getattr(new, n) for n in NAMES))


def story(
    root: Path, seed: int, numbers: Iterable[int] = range(24),
    on_day: Callable[["DayResult"], None] = lambda _result: None,
) -> list[DayResult]:  # fmt: skip
    """The logs of these numbers, one after the other, each judged by a pass of its own."""
    machine = root / "machines" / "rig"
    (machine / "logs").mkdir(parents=True)
    (machine / "card.toml").write_text(CARD, encoding="utf-8")
    results = []
    with Registry(str(root / "registry.db")) as registry:
        every = list(days())
        options = JobOptions(root / "machines", settle=0.0, first=True)
        for day in (every[number] for number in numbers):
            write(machine / "logs", day, seed)
            now = day.at + timedelta(minutes=5)
            Pass(registry, Chain(), options, "scenario", partial(at, now), silent).run()
            (outcome,) = (one for one in Queue(registry.database).outcomes("rig") if one.at == now)
            version = registry.active_version("rig")
            value = None
            if version is not None:
                value = registry.document(version, "model")["friction"]["F_cp"]["value"]
            results.append(DayResult(day, outcome, truth(day).F_cp, value))
            on_day(results[-1])
    return results


def at(now: datetime) -> datetime:
    """A clock that stands."""
    return now


def truth(day: Day) -> Karnopp:
    """The machine's parameters on a day."""
    tables = [shipped(f"paper_table{k}").recipe for k in (2, 3)]
    old, new = (one.plant.friction for one in tables if one is not None)
    return between(old, new, day.wear)


def shipped(name: str) -> Card:
    """A shipped card."""
    return load_card(card_path(name))


def write(folder: Path, day: Day, seed: int) -> None:
    """The day's log, as the machine's logger leaves it."""
    path = folder / f"{day.at:%Y-%m-%d}.csv"
    card = shipped("paper_table2")
    recipe = card.recipe
    assert recipe is not None
    spring = built_in()["spring"].acting({"k": SPRING})
    plant = replace(recipe.plant, friction=truth(day), effects=(spring,) if day.spring else ())
    recipe = replace(
        recipe,
        plant=plant,
        duration=40.0,
        h=2e-3,
        reference=shipped("paper_table1_rich").recipe.reference,  # type: ignore[union-attr]
    )
    log = record("rig", recipe, 1000 * seed + day.number, card.rig())
    if day.fault == "transducer sticks":
        log = stuck(log)
    pd.DataFrame(as_columns(log, card)).to_csv(path, index=False, float_format="%.10g")
    if day.fault == "unreadable":
        text = path.read_text("utf-8")
        # A logger that was switched off before its first row, and one that lost a column's name.
        cut = text.splitlines(keepends=True)[0]
        path.write_text(cut if day.number % 2 else text.replace("F,", "", 1))
    os.utime(path, (day.at.timestamp(), day.at.timestamp()))


def stuck(log: Log) -> Log:
    """The log with its position held for two seconds now and then."""
    y = np.array(log["y"])
    for start in range(len(y) // 8, len(y) - 1000, len(y) // 4):
        y[start : start + 1000] = y[start]
    return log.with_signals(y=y)


def silent(_event: str, **_more: object) -> None:
    """A pass's report that goes nowhere."""


def line(one: DayResult) -> str:
    """One log's line of the timeline."""
    day, known = one.day, "-" if one.active is None else f"{one.active:.2f}"
    about = ", ".join(
        part for part in (f"wear {100 * day.wear:.0f} %", "spring" if day.spring else "", day.fault)
        if part
    )  # fmt: skip
    return (
        f"week {day.week:4.1f}  {about:34s} F_cp {one.true:5.2f} true, {known:>5s} active    "
        f"{one.outcome.verdict:10s} {one.outcome.reason}"
    )


def picture(results: list[DayResult], path: Path) -> None:
    """The timeline as a PNG: F_cp true and active, and what was made of each log."""
    from workbench.report.chart_figure import MODEL, OTHER, REFERENCE, figure, label, style

    marks = {
        "none": ("o", OTHER, "nothing has changed"),
        "promoted": ("^", MODEL, "new model active"),
        "effect": ("*", "#cc79a7", "missing effect named and added"),
        "refused": ("v", "#56b4e9", "challenger refused"),
        "structure": ("s", "#e69f00", "structure changed: no model follows"),
        "set_aside": ("x", "#000000", "log excluded"),
        "not_judged": ("d", "#999999", "inconclusive"),
    }
    week = [one.day.week for one in results]
    with style():
        drawn = figure(9.0, 3.6)
        axes = drawn.subplots(1, 1)
        axes.plot(week, [one.true for one in results], color=REFERENCE, label="F_cp, true")
        known = [np.nan if one.active is None else one.active for one in results]
        axes.step(week, known, where="post", color=MODEL, ls="--", label="F_cp, active")
        for verdict, (marker, colour, words) in marks.items():
            at = [one for one in results if mark_of(one) == verdict]
            if at:
                axes.plot(
                    [one.day.week for one in at], [one.true for one in at], marker,
                    color=colour, label=words, ms=11 if marker == "*" else 7,
                )  # fmt: skip
        low, high = axes.get_ylim()
        for row, (first, last, words) in enumerate(spans(results)):
            axes.axvspan(first - 0.2, last + 0.2, color="#eeeeee", zorder=0)
            height = low + (0.03 + 0.07 * (row % 2)) * (high - low)
            axes.text(first - 0.15, height, words, fontsize=8)
        label(axes, "time [weeks]", "Coulomb friction F_cp [N]")
        drawn.legend(loc="outside right upper")
        drawn.savefig(path, dpi=130)


def mark_of(one: DayResult) -> str:
    """What the picture shows of a log: its verdict, "effect" where the trace named one."""
    named = one.outcome.verdict == "promoted" and "Missing: " in one.outcome.reason
    return "effect" if named else one.outcome.verdict


def spans(results: list[DayResult]) -> list[tuple[float, float, str]]:
    """Weeks in which something is wrong with the logs, or undeclared is in the machine."""
    found: dict[str, list[float]] = {}
    for one in results:
        words = one.day.fault or ("spring" if one.day.spring else "")
        if words:
            found.setdefault(words, []).append(one.day.week)
    return [(min(weeks), max(weeks), words) for words, weeks in found.items()]


def main() -> None:
    """The story on a terminal, and its picture where one is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--picture", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        results = story(
            Path(name), given.seed, range(given.count), lambda one: print(line(one), flush=True)
        )
    if given.picture:
        picture(results, given.picture)


if __name__ == "__main__":
    main()
