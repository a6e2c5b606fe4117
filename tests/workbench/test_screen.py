"""One screen holds whatever there is to say, and --verbose all of it."""

import re

import click
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.screens import one_screen
from workbench import cli
from workbench.output import emit, step
from workbench.screen import Part, Screen, instead, listed, more, screen, shared_options, tabled

WORDS = st.text("abc de", min_size=1, max_size=300)
CELLS = st.text("abc de", max_size=60)
PARTS = st.one_of(
    WORDS,
    st.builds(listed, st.lists(WORDS, max_size=50), st.integers(1, 50)),
    st.builds(
        lambda rows, latest: tabled(("name", "value", "why"), rows, latest=latest),
        st.lists(st.tuples(CELLS, CELLS, CELLS), max_size=50), st.booleans(),
    ),
    st.builds(more, WORDS),
)  # fmt: skip


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.lists(PARTS, min_size=1, max_size=12), st.integers(5, 40), st.integers(60, 100))
def test_whatever_there_is_fits(parts: list[Part | str], room: int, width: int) -> None:
    lines = Screen(tuple(parts)).text(width, room=room).splitlines()
    assert len(lines) <= room
    assert all(len(line) <= width for line in lines)


def test_a_long_list_is_cut_with_its_count_and_whole_with_verbose() -> None:
    rows = [(f"run{n}.csv", str(n), "excluded") for n in range(70)]
    shown = screen("70 logs", tabled(("log", "n", "verdict"), rows), "written: out/report.html")
    text = one_screen(shown)
    found = re.search(r"\.\.\. and (\d+) more: --verbose", text)
    assert found is not None
    assert text.count("excluded") + int(found[1]) == len(rows)
    assert "run0.csv" in text and "run69.csv" not in text and "written: out/report.html" in text
    assert shown.text(verbose=True).count("excluded") == len(rows)
    assert "more: report()" in shown.text(rest="report()")


def test_of_a_history_the_latest_is_shown() -> None:
    rows = [(f"decision {n}", "1") for n in range(70)]
    text = one_screen(screen(tabled(("what", "n"), rows, latest=True)))
    assert "decision 69" in text and "decision 0 " not in text and "earlier: --verbose" in text


def test_a_list_that_yields_is_cut_before_one_that_is_longer() -> None:
    notes = instead([f"note {n}" for n in range(6)], [], yields=True)
    text = one_screen(screen(listed([f"row {n}" for n in range(36)]), notes))
    assert text.count("row ") == 36 and text.count("note ") == 3


def test_what_is_behind_verbose_stands_in_its_place() -> None:
    shown = screen("first", more("hidden"), instead(["short"], ["long", "longer"]), "last")
    assert shown.text() == "first\nshort\nlast\n"
    assert shown.text(verbose=True) == "first\nhidden\nlong\nlonger\nlast\n"


@click.command()
@shared_options
def shows() -> None:
    """A command with more to say than a screen holds."""
    lines = [f"line {n}" for n in range(80)]
    logs = [f"measured/{n:02}.csv" for n in range(60)]
    emit({"lines": lines}, lambda: screen(listed(lines)), step("why", "trace", *logs))


def test_the_option_reaches_the_screen_and_leaves_json_alone() -> None:
    first, whole, json, both = (
        CliRunner().invoke(shows, given).output
        for given in ([], ["--verbose"], ["--json"], ["--json", "--verbose"])
    )
    one_screen(first)
    assert first.count("\nline ") < 40 and "... and" in first
    assert whole.count("line ") == 80 and "measured/59.csv" in whole
    assert json == both and "line 79" in json


def test_a_long_command_is_folded_so_that_a_shell_takes_it() -> None:
    logs = [f"measured/run {n:02}.csv" for n in range(20)]
    then = step("an effect is missing", "trace", *logs, "--card", "card.toml")
    first, *lines = then.lines(100)
    assert first == "next (an effect is missing):" and all(len(line) <= 100 for line in lines)
    assert " ".join("\n".join(lines).replace("\\\n", "").split()) == then.command
    short = then.lines(100, 4)
    assert len(short) == 4 and "--verbose" in short[2] and short[-1].endswith("--card card.toml")
    alone = step("why", "demo")
    assert alone.lines(100) == [str(alone)]


def every_command() -> list[tuple[str, click.Command]]:
    """The commands, those of groups by both names."""
    found = []
    with cli.cli.make_context("workbench", [], resilient_parsing=True) as context:
        waiting = [(name, cli.cli.get_command(context, name)) for name in cli.COMMANDS]
    while waiting:
        name, command = waiting.pop()
        if isinstance(command, click.Group):
            waiting += [(f"{name} {one}", of) for one, of in command.commands.items()]
        else:
            assert command is not None
            found.append((name, command))
    return found


@pytest.mark.parametrize(("name", "command"), every_command())
def test_every_command_takes_verbose(name: str, command: click.Command) -> None:
    assert any("--verbose" in one.opts for one in command.params), name


def test_a_long_reason_in_a_table_leaves_room_for_other_rows() -> None:
    rows = [(str(n), "because " * 100) for n in range(9)]
    shown = screen(tabled(("log", "reason"), rows, latest=True))
    lines = shown.text().splitlines()
    assert len(lines) <= 40 and sum(line[:1].isdigit() for line in lines) >= 3
    assert lines[-1].endswith(" ...")
    assert shown.text(verbose=True).count("because") == 900
