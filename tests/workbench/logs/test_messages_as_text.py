"""Messages written as text: a stamp in two columns, rows with the values of one topic alone, a row
a signal."""

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.workbench.channel_files import write_sheet
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


def long_rows(blocks: bool) -> list[str]:
    """A row a value, of three signals in turn, or of one after the other."""
    signals = {"hip/pos": Y, "hip/effort": 2.0 * Y, "mode": 0.0 * Y}
    own = [
        [f"{t:.6f},{name},{x:.6f},0" for t, x in zip(T, values, strict=True)]
        for name, values in signals.items()
    ]
    own[2][7] = f"{T[7]:.6f},mode,auto,0"
    return [one for rows in (own if blocks else zip(*own, strict=True)) for one in rows]


@pytest.mark.parametrize("blocks", [False, True])
def test_rows_of_one_value_each_have_a_column_for_each_signal(tmp_path: Path, blocks: bool) -> None:
    """As databases of series export them (blocks), and loggers of robots."""
    path = tmp_path / "log.csv"
    path.write_text("Timestamp,Key,Value,Quality\n" + "\n".join(long_rows(blocks)))
    found = {one.header: one for one in read_unknown(path).columns if not one.unusable}
    assert found["hip/pos"].values == pytest.approx(Y, abs=1e-6)
    assert found["hip/effort"].values == pytest.approx(2.0 * Y, abs=1e-6)
    assert found["Timestamp"].values == pytest.approx(T)
    table = read_table(path, FileSpec())
    assert "which column 'Key' names" in table.remarks[-1]
    assert table.clocks["hip/effort"] != table.clocks["mode"]  # of other times: one is a text


@pytest.mark.parametrize("suffix", [".parquet", ".xlsx", ".json"])
def test_other_formats_of_one_value_a_row_are_read_so_too(tmp_path: Path, suffix: str) -> None:
    own = [
        (t, name, x) for t, y in zip(T, Y, strict=True) for name, x in (("pos", y), ("F", 2 * y))
    ]
    times, names, values = (list(one) for one in zip(*own, strict=True))
    frame = pd.DataFrame({"time": times, "signal": names, "value": values})
    path = tmp_path / f"log{suffix}"
    if suffix == ".parquet":
        frame.to_parquet(path)
    elif suffix == ".json":
        frame.to_json(path, orient="records")
    else:
        write_sheet(path, [list(frame.columns), *frame.to_numpy().tolist()])
    found = {one.header: one.values for one in read_unknown(path).columns}
    assert found["pos"] == pytest.approx(Y, abs=1e-6)
    assert found["F"] == pytest.approx(2.0 * Y, abs=1e-6)


@pytest.mark.parametrize("name", ["{k}", "run {half}", "{state}"])
def test_other_texts_beside_numbers_are_no_names(tmp_path: Path, name: str) -> None:
    path, half = tmp_path / "log.csv", len(T) // 2
    rows = [
        f"{t - T[half if k >= half else 0]:.6f}," + name.format(
            k=f"k{k}", half=k // half, state="on" if 50 < k < 250 else "off"
        ) + f",{y:.6f},{2.0 * y:.6f}"
        for k, (t, y) in enumerate(zip(T, Y, strict=True))
    ]  # fmt: skip
    path.write_text("t,note,y,F\n" + "\n".join(rows))
    assert read_table(path, FileSpec()).groups == ()


@pytest.mark.parametrize("day", ["%d.%m.%Y", "%Y-%m-%d", "%m/%d/%Y"])
@pytest.mark.parametrize("parted", [True, False])
def test_date_time_and_milliseconds_are_one_clock(tmp_path: Path, day: str, parted: bool) -> None:
    begun = datetime(2024, 5, 3, 23, 59, 59)
    moments = [begun + timedelta(milliseconds=5 * k) for k in range(N)]
    form = f"{day};%H:%M:%S" + ("" if parted else ".%f")
    part = [f";{one.microsecond // 1000}" if parted else "" for one in moments]
    rows = [f"{one:{form}}{ms};{y:.6f}" for one, ms, y in zip(moments, part, Y, strict=True)]
    rows[200] = ";" * rows[200].count(";")  # of missing samples
    head = "Datum;Uhrzeit;ms;Weg" if parted else "Datum;Uhrzeit;Weg"
    (tmp_path / "log.csv").write_text("\n".join([head, *rows]))
    t = read_unknown(tmp_path / "log.csv").columns[0]
    assert t.unit_below == "s"
    expected = np.where(np.arange(N) == 200, np.nan, H * np.arange(N))
    assert t.values - t.values[0] == pytest.approx(expected, abs=1e-6, nan_ok=True)
