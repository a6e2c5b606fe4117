"""Logs of every format and layout read to the same signals, in SI."""

import json
import tempfile
from hashlib import sha256
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from design.machine.source import fingerprints
from identification.arrays import Array
from tests.workbench.log_files import CARD, WRITERS, card, signals, write_csv, write_parquet
from workbench.logs.runs import read_log, read_runs
from workbench.logs.sources import read_sources

EXACT = sorted({*WRITERS} - {"a.xlsx"})  # whose numbers have 16 digits
FINITE = st.floats(allow_nan=False, allow_infinity=False, width=64)


@settings(max_examples=15)
@given(values=arrays(np.float64, 120, elements=FINITE), name=st.sampled_from(EXACT))
def test_every_format_round_trips_bit_for_bit(values: Array, name: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        columns = {**signals(120), "extra": values}
        WRITERS[name](path, columns)
        text = CARD + 'extra = { column = "extra", unit = "1" }\n'
        log = read_log(path, card(Path(folder), text))
        for key, expected in columns.items():
            assert np.array_equal(log[key], expected), key


@pytest.mark.parametrize(
    ("delimiter", "decimal"),
    [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), (" ", "."), (" ", ",")],
)
@pytest.mark.parametrize("head", ["", "\ufeff", "# bench 3\n# 2024-01-01\n"])
def test_text_layouts_are_found(tmp_path: Path, delimiter: str, decimal: str, head: str) -> None:
    path = tmp_path / "a.csv"
    write_csv(path, signals(), delimiter, decimal)
    path.write_text(head + path.read_text("utf-8"), "utf-8")
    log = read_log(path, card(tmp_path))
    for key, expected in signals().items():
        assert np.array_equal(log[key], expected)


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "a.csv"
    write_csv(path, signals())
    text = path.read_text("utf-8").replace("y,", "öl,", 1)
    path.write_text(text, encoding)
    spec = CARD.replace('column = "y"', 'column = "öl"') + f'[file]\nencoding = "{encoding}"\n'
    assert np.array_equal(read_log(path, card(tmp_path, spec))["y"], signals()["y"])


def test_headerless_columns_count_from_zero_and_rows_are_skipped(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_csv(path, signals())
    path.write_text(path.read_text("utf-8").split("\n", 1)[1], "utf-8")
    text = CARD
    for number, key in enumerate("tyF"):
        text = text.replace(f'column = "{key}"', f"column = {number}")
    log = read_log(path, card(tmp_path, text + "[file]\nheader = false\nskip_rows = 15\n"))
    assert len(log) == 385
    assert np.array_equal(log["F"], signals()["F"][15:])
    assert len(read_log(path, card(tmp_path, text))) == 400


def test_text_columns_that_nobody_asks_for_do_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_csv(path, signals())
    lines = path.read_text("utf-8").splitlines()
    path.write_text("\n".join(["note," + lines[0], *("ok," + x for x in lines[1:])]), "utf-8")
    assert np.array_equal(read_log(path, card(tmp_path))["y"], signals()["y"])


@settings(max_examples=25)
@given(
    st.sampled_from([("mm", 1e-3), ("inch", 0.0254), ("km", 1e3)]),
    st.floats(0.01, 100.0),
    st.floats(-10.0, 10.0),
    st.booleans(),
)
def test_units_gains_and_offsets_are_taken_out(
    unit: tuple[str, float], gain: float, offset: float, negative: bool
) -> None:
    gain = -gain if negative else gain
    columns = signals(150)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.parquet"
        logged = gain * columns["y"] / unit[1] + offset
        write_parquet(path, {**columns, "y": logged})
        spec = f'column = "y", unit = "{unit[0]}", gain = {gain!r}, offset = {offset!r}'
        log = read_log(path, card(Path(folder), CARD.replace('column = "y", unit = "m"', spec)))
    np.testing.assert_allclose(log["y"], columns["y"], atol=1e-9 * (1 + abs(offset / gain) * 25))


def test_electro_pneumatic_force_is_equation_7(tmp_path: Path) -> None:
    columns = signals()
    S_p, S_n, P_s = 12.6e-4, 10e-4, 5e5
    p_n = 3e5 + 1e4 * np.sin(columns["t"])
    p_p = (columns["F"] + S_n * p_n + (S_p - S_n) * P_s) / S_p
    path = tmp_path / "a.csv"
    write_csv(path, {"t": columns["t"], "y": columns["y"], "p_p": p_p / 1e5, "p_n": p_n / 1e5})
    text = f"""
[card]
name = "bench"
[rig]
kind = "electro-pneumatic"
area_p_m2 = {S_p}
area_n_m2 = {S_n}
supply_pressure_pa = {P_s}
[signals]
t = {{ column = "t", unit = "s" }}
y = {{ column = "y", unit = "m" }}
p_p = {{ column = "p_p", unit = "bar" }}
p_n = {{ column = "p_n", unit = "bar" }}
"""
    log = read_log(path, card(tmp_path, text))
    np.testing.assert_allclose(log["F"], columns["F"], atol=1e-9)


def test_force_rig_with_a_chamber_keeps_the_logged_force(tmp_path: Path) -> None:
    columns = signals()
    path = tmp_path / "a.csv"
    write_csv(path, {**columns, "p": np.full(400, 3e5)})
    text = CARD.replace('"force"', '"force"\narea_n_m2 = 5e-4')
    text += 'p_n = { column = "p", unit = "Pa" }\n'
    log = read_log(path, card(tmp_path, text))
    np.testing.assert_allclose(log["F"], columns["F"] - 150.0)
    assert np.array_equal(log["F_logged"], columns["F"])


def test_motor_force_and_two_s_complement(tmp_path: Path) -> None:
    columns = signals()
    duty = np.round(100.0 * columns["F"]).astype(int)
    rows = [
        {"t": t, "y": y, "load": int(d) % 65536, "on": True}
        for t, y, d in zip(columns["t"], columns["y"], duty, strict=True)
    ]
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"mass": 0.5, "motor": "x", "entries": rows}), "utf-8")
    text = """
[card]
name = "bench"
[file]
rows = "entries"
[rig]
kind = "motor"
force_per_command = 2.0
[signals]
t = { column = "t", unit = "s" }
y = { column = "y", unit = "m" }
u = { column = "load", unit = "V", gain = 100, bits = 16, signed = true }
on = { column = "on", unit = "1" }
mass = { column = "mass", unit = "kg" }
"""
    log = read_log(path, card(tmp_path, text))
    np.testing.assert_allclose(log["u"], duty / 100.0)
    np.testing.assert_allclose(log["F"], duty / 50.0)
    assert np.all(log["on"] == 1.0)
    assert np.all(log["mass"] == 0.5)


def test_rows_inside_groups_structs_and_matrices(tmp_path: Path) -> None:
    columns = signals()
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for key, values in columns.items():
            file[f"run/one/{key}"] = values
    log = read_log(tmp_path / "a.h5", card(tmp_path, CARD + '[file]\nrows = "run.one"\n'))
    assert np.array_equal(log["F"], columns["F"])
    scipy.io.savemat(tmp_path / "a.mat", {"run": {"one": columns}, "other": 1.0})
    log = read_log(tmp_path / "a.mat", card(tmp_path, CARD + '[file]\nrows = "run.one"\n'))
    assert np.array_equal(log["F"], columns["F"])
    numbered = CARD
    for number, key in enumerate("tyF"):
        numbered = numbered.replace(f'column = "{key}"', f"column = {number}")
    numbered = card(tmp_path, numbered + '[file]\nrows = "m"\n').path.read_text("utf-8")
    matrix = np.column_stack(list(columns.values()))
    scipy.io.savemat(tmp_path / "b.mat", {"m": matrix})
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["m"] = matrix
    with h5py.File(tmp_path / "c.mat", "w", userblock_size=512) as file:
        file["m"] = matrix.T
    (tmp_path / "b.json").write_text(json.dumps({"m": matrix.tolist(), "n": 3}), "utf-8")
    for name in ("b.mat", "b.h5", "c.mat", "b.json"):
        log = read_log(tmp_path / name, card(tmp_path, numbered))
        assert np.array_equal(log["F"], columns["F"]), name


def test_isolated_empty_fields_are_repaired_and_remarked(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_csv(path, signals())
    lines = path.read_text("utf-8").splitlines()
    t, _, F = lines[60].split(",")
    lines[60] = f"{t},,{F}"
    path.write_text("\n".join(lines), "utf-8")
    prepared = read_runs(path, card(tmp_path))
    assert prepared.remarks == ("a.csv: 1 isolated missing samples of 'y' interpolated",)
    assert prepared.runs[0]["y"][59] == pytest.approx(signals()["y"][59], abs=1e-3)


def test_a_result_names_bytes_and_rows_of_its_logs(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_csv(path, signals())
    (found,) = fingerprints(read_sources([str(path)], str(card(tmp_path).path)).runs)
    assert found == {"file": "a.csv", "rows": 400, "sha256": sha256(path.read_bytes()).hexdigest()}
