"""Logs of loggers, scopes and robots, as other programs write them, read to the same signals."""

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest
from mcap.writer import CompressionType

from identification.arrays import Array
from identification.errors import BadLog
from tests.workbench.channel_files import (
    Waveforms,
    write_mcap,
    write_mdf_groups,
    write_protobuf,
    write_ros1,
    write_ros2,
    write_sheet,
    write_tdms,
    write_ulog,
    write_waveforms,
    write_xlsx,
)
from tests.workbench.log_files import WRITERS, card, signals
from workbench.cards.card_tables import FileSpec
from workbench.cli import main
from workbench.logs.runs import read_log, read_runs
from workbench.logs.tables import read_table


def text(t: str, y: str, F: str, more: str = "", unit: str = "s") -> str:
    """A card with these columns."""
    return (
        '[card]\nname = "bench"\n[rig]\nkind = "force"\n[signals]\n'
        f't = {{ column = "{t}", unit = "{unit}" }}\ny = {{ column = "{y}", unit = "m" }}\n'
        f'F = {{ column = "{F}", unit = "N" }}\n{more}'
    )


def test_waveforms_of_tdms_have_a_clock_from_the_earliest_start(tmp_path: Path) -> None:
    own = signals()
    fast = signals(4000, 0.001)
    groups: Waveforms = {
        "Slow": (0.0, 0.01, {"y": own["y"]}),
        "Fast": (0.005, 0.001, {"F": fast["F"], "y": fast["y"]}),
    }
    write_waveforms(tmp_path / "a.tdms", groups)
    log = read_log(tmp_path / "a.tdms", card(tmp_path, text("Slow/time", "Slow/y", "F")))
    np.testing.assert_allclose(log["t"], own["t"][1:], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(log["y"], own["y"][1:])
    smooth = np.abs(np.cos(2 * np.pi * (log["t"] - 0.005))) > 0.1
    expected = np.interp(log["t"] - 0.005, fast["t"], fast["F"])
    np.testing.assert_allclose(log["F"][smooth], expected[smooth], rtol=1e-4)


def test_what_is_brought_to_another_clock_is_reported(tmp_path: Path) -> None:
    fast = signals(4000, 0.001)
    groups = {"A": (0.0, 0.01, {"y": signals()["y"]}), "B": (0.0, 0.001, {"F": fast["F"]})}
    write_waveforms(tmp_path / "a.tdms", groups)
    found = read_runs(tmp_path / "a.tdms", card(tmp_path, text("A/time", "y", "F")))
    said = "signals of group 'B' (every 0.001 s) are brought to the clock of 'A' (every 0.01 s)"
    assert f"a.tdms: {said}" in found.remarks


def test_a_measured_signal_slower_than_the_clock_is_refused(tmp_path: Path) -> None:
    fast = signals(4000, 0.001)
    groups = {"A": (0.0, 0.01, {"F": signals()["F"]}), "B": (0.0, 0.001, {"y": fast["y"]})}
    write_waveforms(tmp_path / "a.tdms", groups)
    with pytest.raises(BadLog, match=r"F is sampled every 0\.01 s, signals\.t every 0") as error:
        read_log(tmp_path / "a.tdms", card(tmp_path, text("B/time", "y", "F")))
    assert "take signals.t from the group 'A'" in str(error.value)
    log = read_log(tmp_path / "a.tdms", card(tmp_path, text("A/time", "y", "F")))
    np.testing.assert_allclose(log["y"], signals()["y"], atol=1e-12)


def test_a_command_of_another_clock_is_held(tmp_path: Path) -> None:
    own = signals()
    levels = np.tile([-1.0, 0.0, 1.0], 14)[:40]
    groups: Waveforms = {
        "A": (0.0, 0.01, {k: own[k] for k in ("y", "F")}),
        "B": (0.0, 0.1, {"u": levels}),
    }
    write_waveforms(tmp_path / "a.tdms", groups)
    more = 'u = { column = "u", unit = "V" }\n'
    log = read_log(tmp_path / "a.tdms", card(tmp_path, text("A/time", "y", "F", more)))
    np.testing.assert_array_equal(log["u"], np.repeat(levels, 10)[: len(log)])


def test_a_name_of_two_groups_asks_for_its_group(tmp_path: Path) -> None:
    own = signals()
    groups = {g: (0.0, 0.01, {k: own[k] for k in ("y", "F")}) for g in ("A", "B")}
    write_waveforms(tmp_path / "a.tdms", groups)
    with pytest.raises(BadLog, match=r"2 groups have a column 'y'; .*: 'A/y' or 'B/y'"):
        read_log(tmp_path / "a.tdms", card(tmp_path, text("A/time", "y", "A/F")))
    with pytest.raises(BadLog, match=r"no column 'A/z'; did you mean 'A/y'\?"):
        read_log(tmp_path / "a.tdms", card(tmp_path, text("A/time", "A/z", "A/F")))
    chosen = text("time", "y", "F", '[file]\nrows = "B"\n')
    assert len(read_log(tmp_path / "a.tdms", card(tmp_path, chosen))) == 400
    with pytest.raises(BadLog, match=r"no group 'C'.*there is: A, B"):
        read_log(tmp_path / "a.tdms", card(tmp_path, chosen.replace('"B"', '"C"')))


def test_channels_of_unlike_lengths_are_refused(tmp_path: Path) -> None:
    write_tdms(tmp_path / "a.tdms", {**signals(), "F": signals()["F"][:200]})
    with pytest.raises(BadLog, match="signal 'F' has 200 values and t 400"):
        read_log(tmp_path / "a.tdms", card(tmp_path, text("t", "y", "F")))


@pytest.mark.parametrize("version", ["3.30", "4.10", "4.20"])
def test_groups_of_mdf_are_brought_to_one_clock(tmp_path: Path, version: str) -> None:
    own, fast = signals(), signals(8000, 0.0005)
    groups = [{"t": own["t"], "y": own["y"]}, {"t": fast["t"], "F": fast["F"]}]
    path = write_mdf_groups(tmp_path / "a.mf4", groups, version)
    names = read_table(path, FileSpec()).full_names()
    spec = card(tmp_path, text(f"{names[0].partition('/')[0]}/time", "y", "F"))
    log = read_log(path, spec)
    np.testing.assert_array_equal(log["t"], own["t"])
    np.testing.assert_array_equal(log["y"], own["y"])
    np.testing.assert_allclose(log["F"], own["F"], rtol=1e-12)


def test_conversions_of_mdf_are_applied_and_no_other_formula_is_run(tmp_path: Path) -> None:
    import asammdf
    from asammdf.blocks.conversion_utils import from_dict

    own = signals()
    counts = np.round(own["y"] * 1e6).astype(np.int32)
    for formula, runs in (("X1*1e-6+0.5", True), ("cos(X1)", False), ("X.__class__", False)):
        converted: dict[str, dict[str, object]] = {
            "y": {"a": 1e-6, "b": 0.5},
            "z": {"formula": formula},
        }
        with asammdf.MDF(version="4.10") as file:
            file.append(
                [
                    asammdf.Signal(own["F"], own["t"], name="F"),
                    *(
                        asammdf.Signal(counts, own["t"], name=name, conversion=from_dict(how))
                        for name, how in converted.items()
                    ),
                ]
            )
            file.save(str(tmp_path / "a.mf4"), overwrite=True)
        log = read_log(tmp_path / "a.mf4", card(tmp_path, text("time", "y", "F")))
        np.testing.assert_allclose(log["y"], 1e-6 * counts + 0.5, rtol=1e-15)
        spec = card(tmp_path, text("time", "z", "F"))
        if runs:
            np.testing.assert_allclose(
                read_log(tmp_path / "a.mf4", spec)["y"], log["y"], rtol=1e-12
            )
            continue
        with pytest.raises(BadLog, match=r"'z' is converted by the formula .* which is not run"):
            read_log(tmp_path / "a.mf4", spec)


def test_ros_2_messages_go_by_the_stamps_in_them(tmp_path: Path) -> None:
    own = signals()
    path = write_ros2(tmp_path / "bag", own["t"], own["y"], own["F"])
    topic = "/joint_states"
    columns = (f"{topic}/header.stamp", "position[0]", "effort[0]")
    log = read_log(path, card(tmp_path, text(*columns)))
    np.testing.assert_allclose(log["t"], own["t"] - 200e-6, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(log["y"], own["y"])
    more = 'u = { column = "/command/data", unit = "V" }\n'
    by_log = card(tmp_path, text(f"{topic}/log_time", "position[0]", "effort[0]", more))
    log = read_log(path, by_log)
    np.testing.assert_allclose(log["t"], own["t"], rtol=0, atol=1e-9)
    np.testing.assert_array_equal(log["u"], own["F"])
    with pytest.raises(BadLog, match=r"group '/command': no column '/command/header\.stamp'"):
        read_log(path, card(tmp_path, text(*columns, more)))


def test_ros_1_messages_are_read_as_ros_reads_them(tmp_path: Path) -> None:
    own = signals()
    write_ros1(tmp_path / "a.mcap", own["t"], own["y"], own["F"])
    table = read_table(tmp_path / "a.mcap", FileSpec())
    columns: dict[str, Array] = {n: table.column(n, "a") for n in table.names}
    np.testing.assert_array_equal(columns["position[0]"], own["y"])
    np.testing.assert_array_equal(columns["force[0]"], own["F"])
    np.testing.assert_allclose(columns["header.stamp"], own["t"], rtol=0, atol=1e-9)
    np.testing.assert_array_equal(columns["moving"], np.arange(400) % 2 == 0)
    np.testing.assert_array_equal(columns["tip.codes[1]"], -np.arange(400.0))
    assert set(columns["tip.x"]) == {0.25}
    assert set(columns["age"]) == {3.0}


def test_a_definition_in_a_ros_1_log_runs_nothing(tmp_path: Path) -> None:
    from mcap.writer import Writer

    mark = tmp_path / "ran"
    line = f'string A=\'"""+str(__import__("pathlib").Path({str(mark)!r}).touch())+"""\'\nfloat64 y'
    for text_of in (line, f"float64 y\n{line!r}\n", "float64[] y z\n"):
        with (tmp_path / "a.mcap").open("wb") as stream:
            writer = Writer(stream)
            writer.start()
            schema = writer.register_schema("a/B", "ros1msg", text_of.encode())
            channel = writer.register_channel("/a", "ros1", schema)
            writer.add_message(channel, 1, b"\0" * 64, 1)
            writer.finish()
        with pytest.raises(BadLog):
            read_log(tmp_path / "a.mcap", card(tmp_path, text("log_time", "y", "y2")))
        assert not mark.exists()


def test_protobuf_messages_keep_their_zeros(tmp_path: Path) -> None:
    own = signals()
    write_protobuf(tmp_path / "a.mcap", own["t"], own["y"])
    table = read_table(tmp_path / "a.mcap", FileSpec())
    assert own["y"][0] == 0.0
    np.testing.assert_array_equal(table.column("/y/value", "a"), own["y"])
    np.testing.assert_allclose(table.column("/y/log_time", "a"), own["t"], rtol=0, atol=1e-9)


@pytest.mark.parametrize("compression", list(CompressionType))
def test_mcap_of_each_compression(tmp_path: Path, compression: CompressionType) -> None:
    write_mcap(tmp_path / "a.mcap", signals(), compression)
    log = read_log(tmp_path / "a.mcap", card(tmp_path))
    np.testing.assert_array_equal(log["y"], signals()["y"])


def test_a_topic_of_another_encoding_is_named(tmp_path: Path) -> None:
    from mcap.writer import Writer

    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/a", "flatbuffer", 0)
        writer.add_message(channel, 1, b"abc", 1)
        writer.finish()
    with pytest.raises(BadLog, match=r"no topic whose encoding is read \(there is: flatbuffer\)"):
        read_log(tmp_path / "a.mcap", card(tmp_path))


def test_a_chunk_that_unpacks_to_too_much_is_not_unpacked(tmp_path: Path) -> None:
    import zstandard
    from mcap.writer import Writer

    whole = zstandard.compress(bytes(300_000_000))
    with (tmp_path / "a.mcap").open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE, use_chunking=False)
        writer.start()
        stream.flush()
    start = (tmp_path / "a.mcap").read_bytes()
    body = b"\0" * 16 + (300_000_000).to_bytes(8, "little") + bytes(4)
    body += (4).to_bytes(4, "little") + b"zstd" + len(whole).to_bytes(8, "little") + whole
    chunk = b"\x06" + len(body).to_bytes(8, "little") + body
    (tmp_path / "a.mcap").write_bytes(
        start[: 8 + 9 + int.from_bytes(start[9:17], "little")] + chunk
    )
    with pytest.raises(BadLog, match="unpacks to more than 200 MB"):
        read_log(tmp_path / "a.mcap", card(tmp_path))


def test_messages_of_ulog_are_on_the_clock_of_the_autopilot(tmp_path: Path) -> None:
    own = signals(400, 0.001)
    write_ulog(tmp_path / "a.ulg", {k: own[k] for k in ("y", "F")}, "actuator")
    log = read_log(tmp_path / "a.ulg", card(tmp_path, text("timestamp", "y", "F", unit="us")))
    np.testing.assert_allclose(log["t"], own["t"], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(log["F"], own["F"])
    chosen = text("timestamp", "actuator/y", "F", '[file]\nrows = "actuator"\n', "us")
    assert len(read_log(tmp_path / "a.ulg", card(tmp_path, chosen))) == 400


def test_a_sheet_with_lines_above_and_a_row_of_units(tmp_path: Path) -> None:
    above: list[list[Any]] = [["Prüfstand", 3], [], ["Bediener", "M. Müller"], []]
    write_xlsx(tmp_path / "a.xlsx", signals(), above)
    log = read_log(tmp_path / "a.xlsx", card(tmp_path))
    np.testing.assert_allclose(log["y"], signals()["y"], rtol=1e-15)
    rows: list[Any] = [*above, list(signals()), ["s", "m", "N"]]
    rows += zip(*(v.tolist() for v in signals().values()), strict=True)
    write_sheet(tmp_path / "a.xlsx", rows)
    np.testing.assert_allclose(
        read_log(tmp_path / "a.xlsx", card(tmp_path))["y"], signals()["y"], rtol=1e-15
    )
    with pytest.raises(BadLog, match=r"no sheet 'Tabelle1'; .*there is: log"):
        read_log(
            tmp_path / "a.xlsx", card(tmp_path, text("t", "y", "F", '[file]\nrows="Tabelle1"\n'))
        )


def test_the_first_sheet_with_a_table_is_read_and_said(tmp_path: Path) -> None:
    rows = zip(*(v.tolist() for v in signals().values()), strict=True)
    book = openpyxl.Workbook(write_only=True)
    book.create_sheet("cover").append(["axis X, shift 2"])
    sheet = book.create_sheet("data")
    for row in [list(signals()), *([str(x).replace(".", ",") for x in row] for row in rows)]:
        sheet.append(row)
    book.save(tmp_path / "a.xlsx")
    found = read_runs(tmp_path / "a.xlsx", card(tmp_path))
    assert found.remarks == ("a.xlsx: read from sheet 'data', the first with a table",)
    np.testing.assert_allclose(found.runs[0]["y"], signals()["y"], rtol=1e-12)


def test_empty_cells_are_missing_samples(tmp_path: Path) -> None:
    rows: list[Any] = [list(signals())]
    rows += [list(row) for row in zip(*(v.tolist() for v in signals().values()), strict=True)]
    rows[101][1] = None
    write_sheet(tmp_path / "a.xlsx", rows)
    found = read_runs(tmp_path / "a.xlsx", card(tmp_path))
    assert [(one.signal, one.kind, one.samples) for one in found.bad] == [("y", "missing", 1)]


@pytest.mark.parametrize(
    ("name", "modules", "extra"),
    [
        ("a.tdms", ["nptdms"], "tdms"),
        ("a.mf4", ["asammdf"], "mdf"),
        ("a.mcap", ["mcap.stream_reader", "mcap_ros2.decoder", "mcap_protobuf.decoder"], "mcap"),
        ("a.ulg", ["pyulog"], "ulog"),
        ("a.xlsx", ["python_calamine"], "excel"),
    ],
)
def test_a_missing_library_is_named_with_the_command_that_installs_it(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
    modules: list[str],
    extra: str,
) -> None:
    WRITERS[name](tmp_path / name, signals())
    card(tmp_path)
    found = importlib.import_module

    def without(module: str, package: str | None = None) -> Any:
        if module in modules:
            raise ModuleNotFoundError(f"No module named {module!r}", name=module)
        return found(module, package)

    monkeypatch.setattr(importlib, "import_module", without)
    arguments = ["identify", str(tmp_path / name), "--card", str(tmp_path / "card.toml")]
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert f"run pip install 'servo-workbench[{extra}]'" in said
    assert len(said.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_last_column_that_is_often_empty_is_a_column(tmp_path: Path) -> None:
    rows: list[Any] = [["Messung 7"], [], [*signals(), "note"]]
    rows += [[*row, None] for row in zip(*(v.tolist() for v in signals().values()), strict=True)]
    rows[300][3] = "restarted"
    write_sheet(tmp_path / "a.xlsx", rows)
    log = read_log(tmp_path / "a.xlsx", card(tmp_path))
    np.testing.assert_allclose(log["F"], signals()["F"], rtol=1e-15)
