"""After a run of the verdicts: what changed against the committed table, and the table rewritten.

The answers come with the tests' reports, as with workers the tests run in other processes.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

PROPERTY = "verdict"  # of a test's report: what the outcome holds
WRITE, ALL = "--verdicts-write", "--verdicts-all"


@dataclass(frozen=True)
class Outcome:
    """One entry's outcome, as it goes from a worker to the terminal."""

    name: str
    answer: dict[str, Any]  # as comparison.to_plain
    worse: list[str]
    better: list[str]
    cost: str
    seconds: float
    evaluations: str
    refusal: str = ""

    @property
    def state(self) -> str:
        """Where it stands against the committed table, in the words of the summary."""
        short = bool(self.answer["short"])
        if self.worse:
            return "newly wrong"
        if self.better and not short:
            return "newly right"
        if self.better:
            return "less wrong"
        return "wrong as committed" if short else "right as committed"


STATES = ("right as committed", "newly right", "less wrong", "newly wrong", "wrong as committed")


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options of the table; `tools/verdicts.py` gives them."""
    group = parser.getgroup("verdicts")
    group.addoption(WRITE, action="store_true", help="rewrite the committed answers")
    group.addoption(ALL, action="store_true", help="print every entry, with its seconds")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """The verdicts run where they are asked for, by `-m verdicts` or by their file's name."""
    named = [config.getoption("markexpr"), *config.args]
    if any("verdicts" in Path(str(name)).name for name in named):
        return
    left = [item for item in items if item.get_closest_marker("verdicts")]
    if left:
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if not item.get_closest_marker("verdicts")]


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """The table of what changed; called in the process that has the terminal."""
    found = {one.name: one for one in _outcomes(terminalreporter.stats)}
    if not found:
        return
    terminalreporter.section("verdicts against tests/reference/verdicts_today.toml")
    for line in lines(found, everything=config.getoption(ALL)):
        terminalreporter.write_line(line)
    if config.getoption(WRITE):
        terminalreporter.write_line(f"written: {_write(found)}")


def _outcomes(stats: Mapping[str, list[Any]]) -> Iterator[Outcome]:
    for reports in stats.values():
        for report in reports:
            for name, value in getattr(report, "user_properties", ()):
                if name == PROPERTY:
                    yield Outcome(**value)


def lines(found: Mapping[str, Outcome], *, everything: bool = False) -> Iterator[str]:
    """What changed, an entry a paragraph, and the count of all."""
    for name in sorted(found):
        one = found[name]
        if everything:
            answer = one.answer
            effects = ", ".join(answer["effects"]) or "-"
            whole = "complete" if answer["complete"] else "incomplete"
            yield (
                f"{name:34} {one.seconds:5.1f} s {one.evaluations:>12} {one.state:18}"
                f" {answer['verdict']}: {effects}; {whole}"
            )
            yield from (f"    {key} = {value}" for key, value in answer["short"].items())
            if one.refusal:
                yield f"    {one.refusal}"
        elif one.worse or one.better or one.cost:
            yield f"{name}: {one.state}"
        yield from (f"    worse   {line}" for line in one.worse)
        yield from (f"    better  {line}" for line in one.better)
        if one.cost:
            yield f"    cost    {one.cost}"
    count = {state: sum(one.state == state for one in found.values()) for state in STATES}
    seconds = sum(one.seconds for one in found.values())
    yield (
        f"{len(found)} logs: " + ", ".join(f"{n} {state}" for state, n in count.items())
        + f"; {seconds:.0f} processor seconds"
    )  # fmt: skip


def _write(found: Mapping[str, Outcome]) -> str:
    """The committed answers with those of this run in their places; returns the file's name."""
    from tests.verdicts.comparison import TODAY, committed, from_plain, written
    from tests.verdicts.entries import entries

    now = committed() | {name: from_plain(one.answer) for name, one in found.items()}
    TODAY.write_text(written(now, list(entries())), encoding="utf-8")
    return TODAY.name
