"""Logs without a card: layout, header, units and columns found by looking."""

import json
import os
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io

from identification.errors import BadLog
from tests.workbench.log_files import signals, write_parquet
from workbench.logs.unknown import read_unknown

S = signals()
TABLE = np.column_stack([S["t"], S["y"], S["F"]])


def text(rows: list[str], delimiter: str = ",", decimal: str = ".") -> str:
    """Lines above the table, and the table."""
    body = [delimiter.join(f"{x:.9g}" for x in row).replace(".", decimal) for row in TABLE.tolist()]
    return "\n".join([*rows, *body]) + "\n"


def write(folder: Path, content: str, encoding: str = "utf-8") -> Path:
    path = folder / "log.csv"
    path.write_bytes(content.encode(encoding))
    return path


def test_a_plain_header_needs_no_layout(tmp_path: Path) -> None:
    found = read_unknown(write(tmp_path, text(["t,y,F"])))
    assert [one.key for one in found.columns] == ["t", "y", "F"]
    assert found.layout == {}
    np.testing.assert_allclose(found.columns[1].values, S["y"], rtol=1e-8)


@pytest.mark.parametrize("above", ["#Bench OL_Test", "# made by a logger, 2009", ""])
def test_names_stand_in_the_last_comment_though_they_look_like_units(
    tmp_path: Path, above: str
) -> None:
    found = read_unknown(write(tmp_path, text([above, "#t\tu\tv"], "\t")))
    assert [one.header for one in found.columns] == ["t", "u", "v"]
    below = read_unknown(write(tmp_path, text([above, "# t\ty\tF", "# s\tmm\tN"], "\t")))
    assert [one.header for one in below.columns] == ["t", "y", "F"]
    assert [one.unit_below for one in below.columns] == ["s", "mm", "N"]


def test_without_a_header_columns_go_by_number(tmp_path: Path) -> None:
    found = read_unknown(write(tmp_path, text([])))
    assert [one.key for one in found.columns] == [0, 1, 2]
    assert [one.header for one in found.columns] == ["", "", ""]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_marks_at_the_beginning_and_decimal_commas(tmp_path: Path, encoding: str) -> None:
    found = read_unknown(write(tmp_path, text(["Zeit;Weg;Kraft"], ";", ","), encoding))
    assert [one.key for one in found.columns] == ["Zeit", "Weg", "Kraft"]
    np.testing.assert_allclose(found.columns[2].values, S["F"], rtol=1e-8)


@pytest.mark.parametrize(
    ("header", "encoding"),
    [
        ("t,Weg (µm),Stellgröße", "cp1252"),
        ("時間,位置,荷重", "cp932"),
        ("时间,反馈位置,电流反馈", "gb18030"),
    ],
)
def test_encodings_of_windows_are_found(tmp_path: Path, header: str, encoding: str) -> None:
    found = read_unknown(write(tmp_path, text([header]), encoding))
    assert [one.header for one in found.columns] == header.split(",")
    assert found.layout.get("encoding", "utf-8") == encoding


def test_a_row_of_units_is_no_data(tmp_path: Path) -> None:
    found = read_unknown(write(tmp_path, text(["t,y,F", "[s],[m],[N]"])))
    assert [(one.header, one.unit_below, one.key) for one in found.columns] == [
        ("t", "s", "t"),
        ("y", "m", "y"),
        ("F", "N", "F"),
    ]
    assert len(found.columns[0].values) == len(S["t"])


def test_lines_before_the_header_are_skipped(tmp_path: Path) -> None:
    found = read_unknown(write(tmp_path, text(["scope export", "bench: 7, date: 3", "t,y,F"])))
    assert [one.key for one in found.columns] == ["t", "y", "F"]


def test_names_in_a_remark_are_taken(tmp_path: Path) -> None:
    found = read_unknown(write(tmp_path, text(["# bench", "# t y F"], " ")))
    assert [(one.header, one.key) for one in found.columns] == [("t", "t"), ("y", "y"), ("F", "F")]


def test_text_in_a_column_is_said_and_not_raised(tmp_path: Path) -> None:
    rows = [f"{a},{b},on" for a, b in TABLE[:, :2].tolist()]
    found = read_unknown(write(tmp_path, "\n".join(["t,y,mode", *rows])))
    assert found.columns[2].unusable == "text ('on')"


@pytest.mark.parametrize(
    "content",
    [
        {"data": {"rows": TABLE.tolist()}, "rate": 100},
        [{"t": a, "y": b, "F": c} for a, b, c in TABLE.tolist()],
        {"t": TABLE[:, 0].tolist(), "y": TABLE[:, 1].tolist(), "F": TABLE[:, 2].tolist()},
        {"log": {k: TABLE[:, i].tolist() for i, k in enumerate("tyF")}, "note": "x"},
    ],
)
def test_the_rows_of_a_json_file_are_found(tmp_path: Path, content: object) -> None:
    path = tmp_path / "log.json"
    path.write_text(json.dumps(content), "utf-8")
    found = read_unknown(path)
    assert len(found.columns) == 3
    np.testing.assert_allclose(found.columns[1].values, S["y"], rtol=1e-8)


def test_a_struct_of_a_mat_file_is_found_and_scalars_stand_apart(tmp_path: Path) -> None:
    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"rec": {"t": S["t"], "y": S["y"], "F": S["F"], "gain": 35.15}})
    found = read_unknown(path)
    assert found.layout["rows"] == "rec"
    assert [one.header for one in found.columns] == ["t", "y", "F"]
    assert [one.header for one in found.scalars] == ["gain"]


@pytest.mark.parametrize("content", ["", "hello\nworld\n", "t,y\n1,2\n2,3\n"])
def test_a_file_without_a_log_is_refused_in_one_line(tmp_path: Path, content: str) -> None:
    with pytest.raises(BadLog) as refused:
        read_unknown(write(tmp_path, content))
    assert "\n" not in str(refused.value)


def test_a_pipe_is_refused_before_it_is_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "log.csv")
    with pytest.raises(BadLog, match="is a pipe"):
        read_unknown(tmp_path / "log.csv")


def test_damage_that_shows_only_in_a_column_is_said_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    write_parquet(path, signals())
    content = bytearray(path.read_bytes())
    content[60:90] = bytes(30)
    path.write_bytes(content)
    with pytest.raises(BadLog, match="cannot be read as a parquet file") as refused:
        read_unknown(path)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("frame", [" (1436509052.25)  can0  181   [6]  4E 0A 00 00 7A FF",
                                   "(1436509052.25) can0 181#4E0A00007AFF"])  # fmt: skip
def test_raw_frames_of_a_bus_are_called_so(tmp_path: Path, frame: str) -> None:
    with pytest.raises(BadLog, match=r"raw frames of a CAN bus.*by its DBC or EDS file"):
        read_unknown(write(tmp_path, f"{frame}\n" * 200))


def test_lists_in_parquet_have_a_column_for_each_number(tmp_path: Path) -> None:
    """As robots' policies are recorded, with an image of which nothing is read."""
    state = pa.array(TABLE[:, 1:].tolist(), pa.list_(pa.float32(), 2))
    image = pa.array([[0.0] * 64] * len(TABLE), pa.list_(pa.float32()))
    content = {"observation.state": state, "image": image, "timestamp": pa.array(TABLE[:, 0])}
    pq.write_table(pa.table(content), tmp_path / "a.parquet")
    found = {one.header: one.values for one in read_unknown(tmp_path / "a.parquet").columns}
    assert list(found) == ["observation.state[0]", "observation.state[1]", "timestamp"]
    np.testing.assert_allclose(found["observation.state[1]"], S["F"], rtol=1e-6)


def test_a_signal_in_whole_numbers_names_no_machines(tmp_path: Path) -> None:
    """A pressure to the next 100 Pa beside a slow temperature, without names."""
    rng, k = np.random.default_rng(2), np.arange(3000)
    steps = 1000 + rng.integers(0, 12, len(k))
    rows = zip(25 + k // 600, 17 + 10 * k, 0.02 * np.sin(0.01 * k), 100 * steps, strict=True)
    path = write(tmp_path, "\n".join(f"{a},{b},{c:.6g},{d}" for a, b, c, d in rows) + "\n")
    assert [one.number for one in read_unknown(path).columns] == [0, 1, 2, 3]
