"""Columns on clocks of their own in one table: pairs, two instruments, and what is none."""

from pathlib import Path

import numpy as np
import pytest

from identification.arrays import Array
from workbench.cards.card import load_card
from workbench.logs.clocks import clock_groups
from workbench.logs.runs import read_log
from workbench.logs.table import Table
from workbench.logs.unknown import read_unknown

T: Array = np.asarray(2e-3 * np.arange(600), dtype=np.float64)
Y: Array = 0.1 * np.sin(6.0 * T)
F: Array = np.cos(6.0 * T)


def table_of(names: list[str], *columns: Array) -> Table | None:
    table = Table(tuple(names), lambda k: columns[k])
    return clock_groups(table, [one[:40] for one in columns])


def write(path: Path, names: str, *columns: Array, shorter: int = 0) -> Path:
    """A table; the last `shorter` columns lack their last row."""
    rows = [[f"{one:.10g}" for one in row] for row in np.column_stack(columns).tolist()]
    if shorter:
        rows[-1][-shorter:] = [""] * shorter
    path.write_text("\n".join([names, *(",".join(row) for row in rows)]), "utf-8")
    return path


def test_each_column_may_have_its_clock() -> None:
    found = table_of(["a", "pos", "b", "cur"], T, Y, T + 4e-4, F)
    assert found is not None
    assert found.groups == ("pos", "pos", "cur", "cur")
    assert dict(found.clocks) == {"pos": 0, "cur": 2}


def test_two_instruments_each_have_a_clock() -> None:
    found = table_of(["time_a", "pos", "vel", "time_b", "load"], T, Y, F, T + 4e-4, F)
    assert found is not None
    assert found.groups == ("time_a", "time_a", "time_a", "load", "load")


@pytest.mark.parametrize(
    ("names", "columns"),
    [
        (["t", "pos", "time", "cur"], (T, Y, T, F)),  # the same clock twice
        (["time_s", "pos", "time_ms", "cur"], (T, Y, 1e3 * T, F)),  # in another unit
        (["t", "pos", "n", "cur", "on"], (T, Y, 3.0 + np.arange(600.0), F, F)),  # counts rows
        (["t", "pos", "turns", "cur", "on"], (T, Y, 0.5 + 2.0 * T, F, F)),  # an even position
        (["pos", "t", "cur", "time"], (Y, T, F, T + 4e-4)),  # behind their columns
    ],
)
def test_what_is_no_clock_of_its_own(names: list[str], columns: tuple[Array, ...]) -> None:
    assert table_of(names, *columns) is None


def test_pairs_are_read_on_one_clock(tmp_path: Path) -> None:
    late = T + 7e-4
    path = write(tmp_path / "run.csv", "t1,pos,t2,force", T, Y, late, np.cos(6.0 * late), shorter=2)
    (tmp_path / "card.toml").write_text(
        '[card]\nname = "a"\n[rig]\nkind = "force"\n[signals]\n'
        't = { column = "t1", unit = "s" }\ny = { column = "pos", unit = "m" }\n'
        'F = { column = "force", unit = "N" }\n',
        "utf-8",
    )
    log = read_log(path, load_card(tmp_path / "card.toml"))
    assert np.max(np.abs(log["F"] - np.cos(6.0 * log["t"]))[:-1]) < 1e-3
    raw = {one.header: one for one in read_unknown(path).columns}
    whole = np.isfinite(raw["force"].values)
    assert np.mean(whole) > 0.99
    assert np.max(np.abs(raw["force"].values[whole] - F[: len(whole)][whole])) < 1e-3
    assert raw["t2"].unusable == "the clock of 'force'"


def test_clocks_without_a_time_in_common_are_said_to_be(tmp_path: Path) -> None:
    from identification.columns.column import RawColumn
    from workbench.logs.unknown import on_clock_of_most

    columns = [
        RawColumn(0, "a/t", "t", "", T, group="a"), RawColumn(1, "a/y", "y", "", Y, group="a"),
        RawColumn(2, "a/v", "v", "", F, group="a"), RawColumn(4, "b/F", "F", "", F, group="b"),
        RawColumn(3, "b/t", "t", "", T + 900.0, group="b"),
    ]  # fmt: skip
    found = {one.key: one.unusable for one in on_clock_of_most(columns, {})}
    assert "hardly a time in common" in found["b/F"]
    assert found["a/y"] == ""
