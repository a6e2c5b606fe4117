"""One result, one view: terminal, page, notebook and picture say the same."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np

from workbench.output import OutputFolder, step
from workbench.report.chart import Chart, Line, Panel
from workbench.report.view import BUILDERS, Section, View, notes
from workbench.report.view import view as view_of
from workbench.screen import instead, more, tabled

TABLE = tabled(("what", "size"), [("a", "1")], whole=[("a", "1"), ("b", "2")])
X = np.arange(3.0)


def view() -> View:
    return View(
        "A title",
        "It is so.",
        [TABLE, instead(["in short"], ["at length"]), more("beside"), notes(["one", "two"])],
        {"x.json": lambda: {"schema": "x/1", "size": 1.0}, "x.csv": lambda: "t\n0\n"},
        lambda: [Section("Sizes", TABLE, ["a line"]), Section("More", "<p>more</p>")],
        lambda: Chart("x", "a line", [Panel("t [s]", "y [m]", [Line("y", X, X)])]),
        ["log more"],
        step("goes on", "design", "x.json"),
    )


def test_a_terminal_has_the_short_table_and_the_rest_with_verbose() -> None:
    shown = view().screen(Path("there"))
    short, whole = shown.text(), shown.text(verbose=True)
    assert short.startswith("It is so.\nnext: log more\n\nwhat  size\n")
    assert short.endswith("written: there/x.json, there/x.csv, there/report.html\n")
    assert "in short" in short and "at length" not in short and "beside" not in short
    assert "b" not in short.split("written")[0].split("size")[1]
    assert "at length" in whole and "beside" in whole and "b        2" in whole


def test_without_files_nothing_was_written_and_the_next_command_is_in_words() -> None:
    text = view().screen().text()
    assert "written" not in text
    assert "next: log more\nnext: workbench design x.json (goes on)\n" in text


def test_a_notebook_shows_all_of_it() -> None:
    html = view().html()
    said = "Next: log more. Next: <code>workbench design x.json</code> (goes on)."
    assert html.startswith(f"<p><b>It is so. {said}")
    for words in ('<td class="short">b</td>', "at length", "beside", "note: two"):
        assert words in html
    assert "in short" not in html and "&lt;" not in html


def test_a_page_has_the_sections_and_no_mark_is_shown_as_text() -> None:
    page = view().page()
    assert "<h1>A title</h1>" in page and "It is so." in page and "a line" in page
    assert page.count("<h2>") == 2 and "&lt;t" not in page


def test_a_picture_is_drawn_of_the_chart() -> None:
    assert [axes.get_xlabel() for axes in view().figure().axes] == ["t [s]"]


def test_the_files_are_written_a_document_as_json(tmp_path: Path) -> None:
    from datetime import datetime

    with OutputFolder("x", tmp_path / "out", now=datetime(2026, 1, 1)) as folder:
        view().write(folder)
    found = {path.name: path.read_text("utf-8") for path in (tmp_path / "out").iterdir()}
    assert set(found) == {"x.json", "x.csv", "report.html"}
    assert found["x.csv"] == "t\n0\n" and '"schema": "x/1"' in found["x.json"]
    with OutputFolder("x", tmp_path / "two", now=datetime(2026, 1, 1)) as folder:
        replace(view(), has_page=False).write(folder)
    assert not (tmp_path / "two" / "report.html").exists()


def test_the_view_of_every_result_is_built_where_it_is_said_to_be() -> None:
    for home in BUILDERS.values():
        import_module(f"workbench.report.{home}")
    built = {kind.__name__: one.__module__ for kind, one in view_of.registry.items()}
    assert built.pop("object") == "workbench.report.view"
    assert built == {name: f"workbench.report.{home}" for name, home in BUILDERS.items()}
