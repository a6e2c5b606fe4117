"""Times as durations, clock times and dates, as MATLAB, spreadsheets and loggers write them."""

from datetime import datetime, time, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.arrays import Array
from identification.errors import BadLog
from tests.workbench.channel_files import write_sheet
from tests.workbench.log_files import CARD, card, signals
from workbench.logs.runs import read_log
from workbench.logs.times import seconds

MILLISECONDS = st.lists(st.integers(0, 86_399_999), min_size=1, max_size=20).map(sorted)


def read(values: list[object]) -> Array:
    found = seconds(np.asarray(values, dtype=object), "a", 1)
    assert found is not None
    return found


def clock(ms: int) -> str:
    whole, part = divmod(ms, 1000)
    return f"{whole // 3600:02d}:{whole // 60 % 60:02d}:{whole % 60:02d}.{part:03d}"


@given(MILLISECONDS)
def test_clock_times_and_dates(times: list[int]) -> None:
    expected = np.asarray(times) / 1000
    np.testing.assert_allclose(read([clock(ms) for ms in times]), expected, atol=1e-9)
    for form in ("2024-02-28 {}", "2024-02-28T{}", "28.02.2024 {}", "28-Feb-2024 {}"):
        found = read([form.format(clock(ms)) for ms in times])
        np.testing.assert_allclose(found, expected, atol=1e-9)
    begun = datetime(2024, 2, 28)
    moments = [begun + timedelta(milliseconds=ms) for ms in times]
    np.testing.assert_allclose(read(list(moments)), expected, atol=1e-9)
    np.testing.assert_allclose(read([m.time() for m in moments]), expected, atol=1e-9)
    stamps = seconds(np.asarray(moments, "datetime64[ms]"), "a", 1)
    np.testing.assert_allclose(np.asarray(stamps), expected, atol=1e-9)


def test_midnight_passes() -> None:
    found = read(["23:59:59.9", "00:00:00.0", "00:00:00.1"])
    np.testing.assert_allclose(np.diff(found), 0.1, atol=1e-9)
    found = read(["28.02.2023 23:59:59,9", "01.03.2023 00:00:00,0"])
    np.testing.assert_allclose(np.diff(found), 0.1, atol=1e-9)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (["0 sec", "0.001 sec", "1.5e-05 sec"], [0, 0.001, 1.5e-5]),
        (["1 min", "1,5 min", ""], [60, 90, np.nan]),
        (["0.5 ms", "2 hr", "1 day"], [5e-4, 7200, 86400]),
        ([timedelta(0), timedelta(milliseconds=1), None], [0, 1e-3, np.nan]),
        ([time(0, 0, 1), time(0, 0, 1, 500)], [1, 1.0005]),
        (["-0.5 sec", "0 sec"], [-0.5, 0]),
    ],
)
def test_durations(values: list[object], expected: list[float]) -> None:
    np.testing.assert_allclose(read(values), expected, rtol=1e-12)


def test_times_of_several_zones_are_in_the_first_ones() -> None:
    zones = ["2026-03-29T01:59:59+01:00", "2026-03-29T03:00:00+02:00", "2026-03-29T01:00:01Z"]
    np.testing.assert_allclose(read([*zones]), [7199.0, 7200.0, 7201.0])
    stamps: list[object] = [datetime.fromisoformat(one) for one in zones]
    np.testing.assert_allclose(read(stamps), [7199.0, 7200.0, 7201.0])


def test_numbers_are_no_times() -> None:
    assert seconds(np.asarray([0.0, 0.1]), "a", 1) is None
    assert seconds(np.asarray(["0.1", "0.2"], dtype=object), "a", 1) is None


def test_what_is_no_time_among_times_is_reported_with_its_row() -> None:
    with pytest.raises(BadLog, match="a, row 3: 'soon' is no time as the first cell is"):
        read(["0 sec", "1 sec", "soon"])


def timetable(values: Array) -> str:
    """What MATLAB's writetimetable makes of a timetable with row times in seconds."""
    rows = zip(values.tolist(), signals()["y"].tolist(), signals()["F"].tolist(), strict=True)
    return "\n".join(["Time,y,F", *(f"{t:.12g} sec,{y!r},{F!r}" for t, y, F in rows)]) + "\n"


def test_a_timetable_of_matlab_as_csv_and_as_a_sheet(tmp_path: Path) -> None:
    own = signals()
    spec = card(tmp_path, CARD.replace('column = "t"', 'column = "Time"'))
    (tmp_path / "a.csv").write_text(timetable(own["t"]), "utf-8")
    np.testing.assert_allclose(read_log(tmp_path / "a.csv", spec)["t"], own["t"], atol=1e-12)
    begun = datetime(2024, 5, 2, 10)
    rows: list[list[object]] = [["Time", "y", "F"]]
    for t, y, F in zip(*(own[k].tolist() for k in ("t", "y", "F")), strict=True):
        rows.append([begun + timedelta(seconds=t), y, F])
    write_sheet(tmp_path / "a.xlsx", rows)
    log = read_log(tmp_path / "a.xlsx", spec)
    np.testing.assert_allclose(log["t"] - log["t"][0], own["t"], atol=1e-6)


def test_stamps_of_parquet_are_a_time_and_nothing_else(tmp_path: Path) -> None:
    own = signals()
    stamps = np.datetime64("2024-05-02T10:00", "ns") + (1e9 * own["t"]).round().astype("m8[ns]")
    table = {"t": pa.array(stamps), "y": pa.array(own["y"]), "F": pa.array(own["F"])}
    pq.write_table(pa.table(table), tmp_path / "a.parquet")
    log = read_log(tmp_path / "a.parquet", card(tmp_path))
    np.testing.assert_allclose(log["t"] - 36000.0, own["t"], atol=1e-9)
    swapped = CARD.replace('column = "F"', 'column = "t"').replace(
        'column = "t"', 'column = "F"', 1
    )
    with pytest.raises(BadLog, match="is dates, numbers needed"):
        read_log(tmp_path / "a.parquet", card(tmp_path, swapped))


def test_times_in_words_need_the_unit_of_seconds(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(timetable(signals()["t"]), "utf-8")
    text = CARD.replace('{ column = "t", unit = "s" }', '{ column = "Time", unit = "ms" }')
    with pytest.raises(BadLog, match='read in seconds; write unit = "s"'):
        read_log(tmp_path / "a.csv", card(tmp_path, text))
