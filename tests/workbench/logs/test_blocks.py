"""Traces that stand block by block in one text, and what only looks like them."""

from pathlib import Path

import numpy as np
import pytest

from workbench.cards.card_tables import FileSpec
from workbench.logs.blocks import blocks_of
from workbench.logs.tables import read_table
from workbench.logs.unknown import read_unknown

ROWS = 150


def rows(mark: str, slope: float, count: int = ROWS, decimal: str = ".") -> list[str]:
    text = (f"{2 * k}{mark}{slope * k:.4f}" for k in range(count))
    return [line.replace(".", decimal) for line in text]


@pytest.mark.parametrize(
    ("heads", "mark", "decimal"),
    [
        (["Variable;{0}", "Type;LREAL", "Time;Value"], ";", "."),
        (["[Channel]", "Name={0}", "Samples=150"], "\t", "."),
        (["{0}"], ";", ","),
        (["Time [ms];{0}"], ";", ","),
    ],
)
def test_each_block_is_a_variable(
    heads: list[str], mark: str, decimal: str, tmp_path: Path
) -> None:
    lines = ["Trace of 3 May"]
    for name, slope, count in (("Axis.Pos", 0.5, ROWS), ("Axis.Cur", -1.25, ROWS - 1)):
        lines += [*(head.format(name) for head in heads), *rows(mark, slope, count, decimal), ""]
    path = tmp_path / "trace.csv"
    path.write_text("\n".join(lines), "utf-8")
    table = read_table(path, FileSpec())
    assert [name for name in table.names if name.startswith("Axis")] == ["Axis.Pos", "Axis.Cur"]
    cur = table.column("Axis.Cur", "trace")
    assert len(cur) == ROWS - 1
    assert cur[100] == -125.0
    found = {one.header: one for one in read_unknown(path).columns}
    assert found["Axis.Pos"].values[10] == 5.0
    assert found["Axis.Cur"].values[10] == -12.5


def test_runs_one_below_the_other_are_one_table(tmp_path: Path) -> None:
    """Where each has the header; its clock then begins again (`times`)."""
    run = ["t;y;F", *(f"{k};{0.1 * k};{k % 7}" for k in range(ROWS))]
    path = tmp_path / "runs.csv"
    path.write_text("\n".join([*run, "", *run]), "utf-8")
    table = read_table(path, FileSpec())
    np.testing.assert_array_equal(table.column("t", "runs"), 2 * list(range(ROWS)))


def test_one_table_is_no_block() -> None:
    table = ["Recorder 3", "t,y", *(f"{k},{k % 5}" for k in range(ROWS))]
    assert blocks_of("\n".join(table)) == []
    assert blocks_of("\n".join([*table, "EOF"])) == []
    assert blocks_of("\n".join([*table, "nan,3", "7,8"])) == []
    short = ["stop", "1,2", "2,3"]  # a few numbers below are no log
    assert blocks_of("\n".join([*table, *short])) == []


def test_blocks_are_as_long_as_they_are(tmp_path: Path) -> None:
    lines = ["Name;a", *rows(";", 1.0, 400), "Name;b", *rows(";", 2.0, 200)]
    found = blocks_of("\n".join(lines))
    assert [len(one.rows) for one in found] == [400, 200]
    assert np.all([one.width == 2 for one in found])


def test_a_codesys_trace_numbers_its_keys_and_begins_its_rows_with_the_mark(
    tmp_path: Path,
) -> None:
    """Layout of the trace editor of CODESYS and ctrlX: public file of AragakiCH/ctrlx_sysid."""
    lines = ["[key]; [value]", "Version; 0x03050000", "Name; Application.Trace", "Comment; "]
    for k, (name, slope) in enumerate((("Axis.Pos", 0.5), ("Axis.Cur", -1.25))):
        keys = (f"Variable; {name}", "Class; 14", f"GraphColor; 428281106{k}", "YAxis; 0", "Data; ")
        lines += [f"{k}.{key}" for key in keys]
        lines += [f"; {2 + 20 * i}; {slope * i:g}" for i in range(ROWS)]
    path = tmp_path / "sinto.trace.csv"
    path.write_text("\n".join(lines), "utf-8")
    found = {one.header: one.values for one in read_unknown(path).columns}
    assert (found["Axis.Pos"][10], found["Axis.Cur"][10], found["time"][1]) == (5.0, -12.5, 22.0)


def test_a_missing_first_cell_is_no_mark_that_rows_begin_with() -> None:
    table = ["t;y;u", *(f"{'' if k % 3 else k};{k % 5};{k % 7}" for k in range(ROWS))]
    (first, _) = blocks_of("\n".join([*table, "Axis 2", *table]))
    assert (first.width, first.fields(";1;2")) == (3, ["", "1", "2"])
