"""Cells with a label, a unit or a monitor's time around the number are read as a plain table."""

from pathlib import Path

import numpy as np
import pytest

from workbench.cards.card_tables import FileSpec
from workbench.logs.rewritten import as_table
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
        "",
    ],
)
def test_other_texts_stay_as_they_are(text: str) -> None:
    assert as_table(text) == text
