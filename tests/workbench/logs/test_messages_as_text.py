"""Messages written as text: a stamp in two columns, rows with the values of one topic alone, a row
a signal."""

from pathlib import Path

import numpy as np
import pytest

from workbench.cards.card_tables import FileSpec
from workbench.logs.tables import read_table
from workbench.logs.unknown import read_unknown

N, H = 400, 5e-3
T = 1_700_000_000.25 + H * np.arange(N)
Y = np.sin(3.0 * H * np.arange(N))


def test_seconds_and_nanoseconds_of_a_stamp_are_one_clock(tmp_path: Path) -> None:
    """As `ros2 topic echo --csv` writes a joint's state; by the nanoseconds alone the clock begins
    again every second."""
    path = tmp_path / "joint_states.csv"
    parts = [(int(t), round((t % 1.0) * 1e9)) for t in T]
    path.write_text("".join(f"{s},{ns},base,hip,{y:.6f}\n"
                            for (s, ns), y in zip(parts, Y, strict=True)))  # fmt: skip
    table = read_table(path, FileSpec())
    assert table.fetch(0) == pytest.approx(T, abs=1e-6)
    assert np.ptp(table.fetch(1)) == 0.0
    assert any("are one clock" in one for one in table.remarks)


@pytest.mark.parametrize("second", ["12", "999", "{k}"])
def test_other_whole_numbers_are_no_stamp(tmp_path: Path, second: str) -> None:
    path = tmp_path / "a.csv"
    rows = "".join(f"{k},{second.format(k=k)},{y:.6f}\n" for k, y in enumerate(Y))
    path.write_text("t,n,y\n" + rows)
    table = read_table(path, FileSpec())
    assert table.fetch(0).tolist() == list(range(N))
    assert not table.remarks


def test_a_row_a_signal_is_read_as_a_column_a_signal(tmp_path: Path) -> None:
    """As `numpy.savetxt` writes a list of signals."""
    path = tmp_path / "chirp.csv"
    np.savetxt(path, np.vstack([T, Y, 2.0 * Y]), delimiter=",")
    found = read_unknown(path)
    assert [one.number for one in found.columns] == [0, 1, 2]
    assert found.columns[1].values == pytest.approx(Y)


def test_rows_of_one_message_alone_are_groups_on_their_own_clocks(tmp_path: Path) -> None:
    """As plots of topics are exported: each row has the values of one of them, the rest empty."""
    rows = []
    for k, (t, y) in enumerate(zip(T, Y, strict=True)):
        rows.append(f"{t:.6f},{y:.6f},{2 * y:.6f},")
        rows += [f"{t + 1e-3:.6f},,,{y + 1.0:.6f}"] * (k % 2)
    path = tmp_path / "log.csv"
    path.write_text("__time,/joint/position,/joint/effort,/cmd/position\n" + "\n".join(rows))
    table = read_table(path, FileSpec())
    assert len(set(table.groups)) == 2
    found = {one.header: one for one in read_unknown(path).columns if not one.unusable}
    assert found["/joint/position"].values == pytest.approx(Y, abs=1e-6)
    asked = found["/cmd/position"].values
    inside = np.isfinite(asked)
    assert np.mean(inside) > 0.95
    assert asked[inside] == pytest.approx(Y[inside] + 1.0, abs=0.05)


def test_a_few_empty_cells_make_no_groups(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = [
        f"{t:.6f},{y:.6f},{'' if k == 3 else k}" for k, (t, y) in enumerate(zip(T, Y, strict=True))
    ]
    path.write_text("t,y,F\n" + "\n".join(rows))
    assert read_table(path, FileSpec()).groups == ()
