"""Cells with a label, a unit or a monitor's time around the number are read as a plain table."""

from pathlib import Path

import numpy as np
import pytest

from workbench.cards.card_tables import FileSpec
from workbench.logs.rewritten import as_table
from workbench.logs.table import Table
from workbench.logs.text import read_text_table

ROWS = [(5 * k + 500, np.sin(0.1 * k), -2.5e-3 * k) for k in range(120)]
LABELLED = "".join(f"t:{t},angle:{y:.4f},current:{u:.4f}\n" for t, y, u in ROWS)
IN_WORDS = "".join(f"Time: {t} ms, Angle: {y:.4f} deg, Current: {u:.4f} A\n" for t, y, u in ROWS)
UNITS = "n,phase: None,torque: None\n" + "".join(
    f"{t},{y:.4f}deg,{u:.4f}NewtonMeter\n" for t, y, u in ROWS
)
MONITOR = "".join(f"12:34:{k // 20:02d}.{k % 20:03d} -> {t}\t{y:.4f}\t{u:.4f}\n"
                  for k, (t, y, u) in enumerate(ROWS))  # fmt: skip


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (LABELLED, ("t", "angle", "current")),
        (IN_WORDS, ("Time [ms]", "Angle [deg]", "Current [A]")),
        (UNITS, ("n", "phase [deg]", "torque [NewtonMeter]")),
        (MONITOR, ("0", "1", "2")),
    ],
)
def test_numbers_and_names_are_taken_apart(
    tmp_path: Path, text: str, names: tuple[str, ...]
) -> None:
    path = tmp_path / "serial.txt"
    path.write_text(text)
    table = read_text_table(path, FileSpec())
    assert table.names == names
    for k in range(3):
        expected = [round(row[k], 4) for row in ROWS]
        assert np.asarray(table.fetch(k), dtype=float) == pytest.approx(expected, abs=1e-9)


def test_a_monitors_time_stays_where_the_machine_has_none() -> None:
    text = "".join(f"12:34:{k // 20:02d}.{k % 20 * 50:03d} -> {np.sin(k):.3f}\n" for k in range(99))
    assert as_table(text).splitlines()[0] == "12:34:00.000,0.000"


@pytest.mark.parametrize(
    "text",
    [
        "t,y\n" + "0.1,2\n" * 50,
        "t;y\n" + "12:34:56.7;2,5\n" * 50,
        "time,state\n" + "0.1,IDLE\n" * 50,
        "id,code\n" + "1,A3\n" * 50,
        "2025-07-29 11:38:05.949,6553.00,6537.00\n" * 50,
        "1.0 s;2 mm\n",
        '12:34:56.7,"a, b: 1",2\n' * 50,
        "",
    ],
)
def test_other_texts_stay_as_they_are(text: str) -> None:
    assert as_table(text) == text


def table_of(tmp_path: Path, text: str, name: str = "a.txt") -> Table:
    path = tmp_path / name
    path.write_text(text, "utf-8")
    return read_text_table(path, FileSpec())


def read_as(table: Table, names: tuple[str, ...]) -> None:
    """The table has these columns, t, angle and current as above."""
    assert table.names == names
    for k in range(3):
        expected = [round(row[k], 4) for row in ROWS]
        assert np.asarray(table.fetch(k), dtype=float) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("row", [
    "Time: {t} Angle: {y:.4f} Current: {u:.4f}",
    "{{'Time': {t}, 'Angle': {y:.4f}, 'Current': {u:.4f}}}",
    "1/{{Time: {t}, Angle: {y:.4f}, Current: {u:.4f}}}",
])  # fmt: skip
def test_labels_need_no_commas_and_may_stand_in_braces(tmp_path: Path, row: str) -> None:
    """As a sketch prints them, as Python prints a dict, and as moteus prints its registers."""
    lines = [row.format(t=t, y=y, u=u) for t, y, u in ROWS]
    lines.insert(50, "DONE POSITIONING")
    table = table_of(tmp_path, "\n".join(lines) + "\n")
    read_as(table, ("Time", "Angle", "Current"))
    assert "DONE POSITIONING" in table.remarks[0]


@pytest.mark.parametrize(
    ("head", "row", "names"),
    [
        ("", "{t} ({y:.4f} {u:.4f}) (0 1)", ("0", "1", "2", "3", "4")),
        ("t,q,mode\n", '{t},"[{y:.4f}, {u:.4f}]",1', ("t", "q[0]", "q[1]", "mode")),
        ("", "[{t}, {y:.4f}, {u:.4f}]", ("0", "1", "2")),
    ],
)
def test_vectors_in_brackets_have_a_column_for_each_number(
    tmp_path: Path, head: str, row: str, names: tuple[str, ...]
) -> None:
    """As YARP dumps a port, as pandas writes lists, and as Python prints them."""
    text = head + "".join(row.format(t=t, y=y, u=u) + "\n" for t, y, u in ROWS)
    read_as(table_of(tmp_path, text), names)


@pytest.mark.parametrize("entry", ["- ", "  - "])
def test_documents_of_keys_are_rows(tmp_path: Path, entry: str) -> None:
    """As `ros2 topic echo` and `rostopic echo` print messages."""
    text = "".join(
        f"header:\n  stamp:\n    sec: {t // 1000}\n    nanosec: {t % 1000 * 10**6}\n"
        f"  frame_id: ''\nname:\n{entry}hip\nposition:\n{entry}{y:.4f}\n{entry}0.5\n"
        f"effort: [{u:.4f}, .nan]\n---\n"
        for t, y, u in ROWS
    )
    table = table_of(tmp_path, text)
    assert table.names[2:] == ("position[0]", "position[1]", "effort[0]", "effort[1]")
    assert table.fetch(0) == pytest.approx([1e-3 * t for t, _, _ in ROWS])
    assert table.fetch(4) == pytest.approx([round(u, 4) for _, _, u in ROWS])


@pytest.mark.parametrize(("mark", "point"), [(".", ","), (",", "."), ("'", "."), ("\u00a0", ",")])
def test_signs_between_thousands_are_no_decimal_signs(
    tmp_path: Path, mark: str, point: str
) -> None:
    own = [f"{1e3 * x:,.3f}".translate({44: mark, 46: point}) for _, x, _ in ROWS]
    text = "sep=;\nt;y\n" + "".join(f"{k};{x}\n" for k, x in enumerate(own))
    table = table_of(tmp_path, text, "a.csv")
    expected = [round(1e3 * x, 3) for _, x, _ in ROWS]
    assert table.fetch(1) == pytest.approx(expected, abs=1e-9)


def test_numbers_that_have_the_sign_otherwise_keep_it(tmp_path: Path) -> None:
    text = "t;y\n" + "".join(f"{k};{k + 0.5:.1f}\n" for k in range(99)) + "100;1.234,5\n"
    assert np.asarray(table_of(tmp_path, text, "a.csv").fetch(1)[:2]).tolist() == ["0.5", "1.5"]


def test_hexadecimal_columns_are_numbers(tmp_path: Path) -> None:
    text = "t;0x6064\n" + "".join(f"{k};0x{(k - 50) & 0xFFFF:04X}\n" for k in range(120))
    table = table_of(tmp_path, text, "a.csv")
    assert table.names == ("t", "0x6064")
    assert table.fetch(1)[[0, 60]].tolist() == [65486.0, 10.0]


def test_labels_may_have_several_words_below_other_lines(tmp_path: Path) -> None:
    """A unit before the next label stays one."""
    above = "Robot starting\nNT: Listening on port 1735, port 5810\nInverted: false\n"
    lines = [f"Loop Time: {t} Shaft Angle: {y:.4f} Motor Current: {u:.4f}" for t, y, u in ROWS]
    table = table_of(tmp_path, above + "\n".join(lines) + "\n")
    read_as(table, ("Loop Time", "Shaft Angle", "Motor Current"))
