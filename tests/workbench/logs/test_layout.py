"""Headers found below what scopes and loggers write above them."""

from pathlib import Path

import numpy as np
import pytest

from identification.errors import BadLog
from tests.workbench.log_files import card, signals
from workbench.logs.layout import find_layout, period_above
from workbench.logs.runs import read_log
from workbench.logs.unknown import read_unknown

CARD = """
[card]
name = "bench"
[rig]
kind = "force"
[signals]
t = { column = "%s", unit = "ms" }
y = { column = "ActPos", unit = "mm" }
F = { column = "Force", unit = "N" }
"""


def columns(rows: int = 400, h: float = 0.01) -> dict[str, list[str]]:
    """Time [ms], position [mm] and force [N] as a German scope prints them."""
    own = signals(rows, h)
    scaled = {"t": 1e3 * own["t"], "ActPos": 1e3 * own["y"], "Force": own["F"]}
    return {name: [f"{x:.9g}".replace(".", ",") for x in v] for name, v in scaled.items()}


def twincat(single: bool, tab: str = "\t", end: str = "") -> str:
    """An export of TwinCAT's Scope: its preamble, a block of keys, and pairs of time and value.

    single: one column of times for all channels, as its option "ExcludeDoubleTimestamp" makes.
    The layout is that of version 3.4 as pytcs (github.com/CagtayFabry/pytcs) has files of it.
    """
    own = columns()
    values = {
        "Name": ["ActPos", "Force"],
        "SymbolComment": ["", ""],
        "Data-Type": ["REAL64", "REAL32"],
        "SampleTime[ms]": ["10", "10"],
        "SymbolName": ["MAIN.Axis.ActPos", "MAIN.Force"],
        "NetID": ["192.168.178.20.1.1", "192.168.178.20.1.1"],
        "Port": ["851", "851"],
        "Offset": ["0", "0"],
        "ScaleFactor": ["1", "1"],
        "BitMask": ["0xffffffffffffffff", "0xffffffffffffffff"],
        "Unit": ["(None)", "(None)"],
    }
    head = [
        ["Name", "Scope Project"],
        ["File", "C:\\logs\\a.csv"],
        ["Starttime of export", "132959733843760000", "Montag, 2. Mai 2022", "15:56:24.376"],
        ["Endtime of export", "132959733853750000", "Montag, 2. Mai 2022", "15:56:25.375"],
        [],
        [],
    ]
    for key, (first, second) in values.items():
        head.append([key, first, second] if single else [key, first, key, second])
    head.append([])
    rows = zip(own["t"], own["ActPos"], own["Force"], strict=True)
    body = [[t, y, F] if single else [t, y, t, F] for t, y, F in rows]
    return "\n".join(tab.join(line) for line in [*head, *body]) + f"\n{end}"


@pytest.mark.parametrize("tab", ["\t", ";"])
@pytest.mark.parametrize("end", ["", "EOF", "EOF\n"])
@pytest.mark.parametrize("single", [True, False])
def test_exports_of_twincat_scope(tmp_path: Path, single: bool, tab: str, end: str) -> None:
    (tmp_path / "a.csv").write_text(twincat(single, tab, end), "utf-8")
    spec = card(tmp_path, CARD % ("Time" if single else "ActPos/Time"))
    log = read_log(tmp_path / "a.csv", spec)
    for name, expected in signals().items():
        np.testing.assert_allclose(log[name], expected, rtol=1e-8, atol=1e-12)


def test_channels_of_twincat_scope_at_two_rates(tmp_path: Path) -> None:
    slow = columns(200, 0.02)
    lines = twincat(single=False).splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("0\t"))
    for k in range(first, len(lines)):
        row = k - first
        t, y, *_ = lines[k].split("\t")
        twice = f"{20 * row}" if row < 200 else ""
        lines[k] = "\t".join([t, y, twice, slow["Force"][row] if twice else ""])
    (tmp_path / "a.csv").write_text("\n".join(lines), "utf-8")
    with pytest.raises(BadLog, match=r"F is sampled every 0\.02 s, signals\.t every 0\.01 s"):
        read_log(tmp_path / "a.csv", card(tmp_path, CARD % "ActPos/Time"))
    log = read_log(tmp_path / "a.csv", card(tmp_path, CARD % "Force/Time"))
    np.testing.assert_allclose(log["t"], 0.02 * np.arange(200), rtol=1e-9)
    np.testing.assert_allclose(log["y"], signals()["y"][::2], rtol=1e-8, atol=1e-12)


PREAMBLES = {
    "key and value": "Trace;Axis_1\nDevice;S7-1500\nCycle time;2 ms\nSamples;400\n\n",
    "key and value, no blank line": "Trace;Axis_1\nDevice;S7-1500\nCycle;2\nSamples;400\nRate;9\n",
    "as wide as the data": "Trace;Axis_1;\nOperator;Miller;x\nSamples;400;\n;;\n",
    "words": "Oscilloscope, drive 4\nmeasured by M. Müller\n",
}
UNITS = {
    "none": "",
    "plain": "ms;mm;N\n",
    "brackets": "[ms];[mm];[N]\n",
    "types": "REAL;REAL;REAL\n",
}


@pytest.mark.parametrize("units", UNITS.values(), ids=UNITS.keys())
@pytest.mark.parametrize("above", PREAMBLES.values(), ids=PREAMBLES.keys())
def test_a_header_below_a_preamble(tmp_path: Path, above: str, units: str) -> None:
    rows = zip(*columns().values(), strict=True)
    body = "\n".join(";".join(row) for row in rows)
    (tmp_path / "a.csv").write_text(f"{above}t;ActPos;Force\n{units}{body}\n", "utf-8")
    log = read_log(tmp_path / "a.csv", card(tmp_path, CARD % "t"))
    for name, expected in signals().items():
        np.testing.assert_allclose(log[name], expected, rtol=1e-8, atol=1e-12)


def test_a_bad_field_is_reported_with_its_line_in_the_file(tmp_path: Path) -> None:
    rows = [";".join(row) for row in zip(*columns().values(), strict=True)]
    rows[50:60] = ["500;OFF;1"] * 10
    head = PREAMBLES["key and value"] + "t;ActPos;Force\n" + UNITS["plain"]
    (tmp_path / "a.csv").write_text(head + "\n".join(rows), "utf-8")
    with pytest.raises(BadLog, match="column 'ActPos', row 58: 'OFF' is not a number"):
        read_log(tmp_path / "a.csv", card(tmp_path, CARD % "t"))
    assert (head + "\n".join(rows)).splitlines()[57] == "500;OFF;1"


def test_two_columns_below_keys_and_numbers() -> None:
    lines = [["Samples", "3"], ["Rate", "1000"], ["Gain", "1"], ["t", "y"]]
    data = [[str(k), f"{k}.5"] for k in range(5)]
    found = find_layout([*lines, *data])
    assert found is not None
    assert (found.names, found.data) == (("t", "y"), 4)


def test_what_shows_no_data_or_no_header_is_left_to_the_card() -> None:
    assert find_layout([["a", "b"], ["c", "d"], ["e", "f"]]) is None
    found = find_layout([["only one"], ["1", "2"], ["3", "4"], ["5", "6"]])
    assert found is not None and (found.names, found.data) == ((), 1)
    found = find_layout([["1", "2"], ["3", "4"]])
    assert found is not None
    assert (found.names, found.data) == ((), 0)


def test_rows_of_missing_samples_at_the_start_are_rows() -> None:
    found = find_layout([["t", "y"], ["", ""], ["", ""], *[["1", "2"]] * 4])
    assert found is not None
    assert (found.names, found.data) == (("t", "y"), 1)


def test_a_line_that_only_begins_the_values_is_no_header(tmp_path: Path) -> None:
    """As a recorder writes it between its channels' names and their values."""
    own = columns(120)
    rows = [",".join(x.replace(",", ".") for x in row) for row in zip(*own.values(), strict=True)]
    head = ["descriptor,,", '"date","2025-05-05 12:12"', "", "X-Axis,Angle [deg],Torque [Nm]"]
    path = tmp_path / "rec1.csv"
    path.write_text("\n".join([*head, "trace_values,,", *rows]) + "\n")
    found = read_unknown(path).columns
    assert [one.header for one in found] == ["X-Axis", "Angle [deg]", "Torque [Nm]"]
    assert len(found[0].values) == 120


def test_names_of_several_words_stand_apart(tmp_path: Path) -> None:
    """As ECP's program writes them, with a bracket around the rows and a sign behind each."""
    path = tmp_path / "raw.txt"
    rows = [
        f"{k:6d}  {0.01 * k:8.3f}  {3 * k:8d}  {2 * k:8d}  {0.1 * k:9.4f} ;" for k in range(120)
    ]
    head = "[ Sample     Time    Commanded Pos    Encoder 1 Pos    Control Effort"
    path.write_text("\n".join(["", head, "", *rows, "]"]))
    found = read_unknown(path)
    names = [one.header for one in found.columns]
    assert names == ["[ Sample", "Time", "Commanded Pos", "Encoder 1 Pos", "Control Effort"]
    assert {len(one.values) for one in found.columns} == {120}


LABVIEW = [
    *[
        "LabVIEW Measurement\t",
        "Separator\tTab",
        "***End_of_Header***\t",
        "\t",
        "Channels\t2\t\t\t",
    ],
    *["Y_Unit_Label\tmm\tN\t", "X0\t0.0\t0.0\t", "Delta_X\t0.005000\t0.005000\t"],
    *["***End_of_Header***\t\t\t", "X_Value\tActPos\tForce\tComment"],
]


def test_units_and_the_period_may_stand_above_the_names(tmp_path: Path) -> None:
    """As LabVIEW writes a measurement without its column of times."""
    own = columns()
    rows = [f"\t{y}\t{F}" for y, F in zip(own["ActPos"], own["Force"], strict=True)]
    path = tmp_path / "a.lvm"
    path.write_text("\n".join([*LABVIEW, *(row.replace(",", ".") for row in rows)]))
    found = read_unknown(path)
    assert [one.header for one in found.columns] == ["X_Value", "ActPos", "Force"]
    assert [one.unit_below for one in found.columns] == ["", "mm", "N"]
    assert [(one.header, one.values[0]) for one in found.scalars] == [("Delta_X", 0.005)]


@pytest.mark.parametrize(
    ("line", "period"),
    [
        (["Sampling Period [us]", "500"], ("Sampling Period [us]", 500.0, "")),
        (["Sampling interval", "2", "ms"], ("Sampling interval", 2.0, "ms")),
        (["Takt", "2,5 ms"], ("Takt", 2.5, "ms")),
        (["Sample rate", "2 kHz"], ("period by Sample rate", 5e-4, "s")),
        (["Sample rate", "fast"], None),
        (["Samples", "400"], None),
        (["dt", "0"], None),
    ],
)
def test_a_line_above_gives_the_period(
    line: list[str], period: tuple[str, float, str] | None
) -> None:
    assert period_above([["Device", "X7"], [], line]) == period


def test_names_may_stand_behind_a_key_in_a_comment(tmp_path: Path) -> None:
    body = [" ".join(row).replace(",", ".") for row in zip(*columns().values(), strict=True)]
    above = ["# run 7 of stage LM", "# columns: t ActPos Force", "# units: ms mm N"]
    (tmp_path / "a.dat").write_text("\n".join([*above, *body]))
    found = read_unknown(tmp_path / "a.dat").columns
    assert [one.header for one in found] == ["t", "ActPos", "Force"]
    assert [one.unit_below for one in found] == ["ms", "mm", "N"]


def test_names_in_a_comment_may_stand_below_a_single_number() -> None:
    """As scripts write a length of the machine between comments."""
    lines = [["0.41"], [], *[[str(k), f"{k}.5", "7"] for k in range(5)]]
    found = find_layout(lines, {1: ["t", "th1", "th2"]})
    assert found is not None and found.names == ("t", "th1", "th2")
