"""Each way in which a log can be bad has its own error, in one line, never a traceback."""

import struct
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from identification.errors import UserError
from tests.workbench.log_files import CARD, WRITERS, card, signals, write_csv
from workbench.cards.card import load_card
from workbench.logs.runs import read_log, read_runs


def refusal(path: Path, text: str = CARD) -> str:
    """The one line with which both readers refuse the file."""
    spec = card(path.parent, text)
    messages = []
    for read in (read_log, read_runs):
        assert callable(read)
        with pytest.raises(UserError) as caught:
            read(path, spec)
        messages.append(str(caught.value))
    assert messages[0] == messages[1]
    assert "\n" not in messages[0]
    assert len(messages[0]) < 400
    return messages[0]


def edited(folder: Path, row: int, change: Callable[[list[str]], list[str]], rows: int = 1) -> Path:
    """A sound CSV with the fields of some lines (counted from 1 as in the file) changed."""
    path = folder / "a.csv"
    write_csv(path, signals())
    lines = path.read_text("utf-8").splitlines()
    for k in range(row - 1, row - 1 + 2 * rows, 2):
        lines[k] = ",".join(change(lines[k].split(",")))
    path.write_text("\n".join(lines), "utf-8")
    return path


def with_columns(folder: Path, **changed: object) -> Path:
    path = folder / "a.csv"
    write_csv(path, {**signals(), **{k: np.asarray(v, dtype=float) for k, v in changed.items()}})
    return path


def test_missing_file_names_the_nearest(tmp_path: Path) -> None:
    write_csv(tmp_path / "run1.csv", signals())
    message = refusal(tmp_path / "run11.csv")
    assert "no such file" in message
    assert "did you mean 'run1.csv'?" in message


def test_missing_column_names_the_nearest(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_csv(path, {("pos_m" if k == "y" else k): v for k, v in signals().items()})
    message = refusal(path, CARD.replace('column = "y"', 'column = "posm"'))
    assert "signals.y: no column 'posm'; did you mean 'pos_m'? (there is: t, pos_m, F)" in message


@pytest.mark.parametrize("column", ["3", "-1", "99"])
def test_column_number_out_of_range(tmp_path: Path, column: str) -> None:
    path = with_columns(tmp_path)
    message = refusal(path, CARD.replace('column = "y"', f"column = {column}"))
    assert f"no column {column}, there are 3 (0 to 2" in message


def test_name_in_a_file_without_header(tmp_path: Path) -> None:
    path = with_columns(tmp_path)
    path.write_text(path.read_text("utf-8").split("\n", 1)[1], "utf-8")
    assert "the file has no header" in refusal(path)


def test_wrong_unit(tmp_path: Path) -> None:
    message = refusal(with_columns(tmp_path), CARD.replace('unit = "m"', 'unit = "bar"'))
    assert "signals.y: unit 'bar' is not a length" in message


@pytest.mark.parametrize("text", ["n/e", "1.2.3", "0x10", "12:30", "OFF"])
def test_text_in_numbers_names_row_and_column(tmp_path: Path, text: str) -> None:
    message = refusal(edited(tmp_path, 57, lambda f: [f[0], text, f[2]], rows=5))
    assert f"column 'y', row 57: '{text}' is not a number" in message


def test_text_in_one_cell_is_a_missing_sample(tmp_path: Path) -> None:
    path = edited(tmp_path, 57, lambda f: [f[0], "#VALUE!", f[2]])
    found = read_runs(path, card(tmp_path, CARD))
    assert found.remarks[0] == (
        "a.csv: column 'y': a cell that holds text ('#VALUE!', row 57) left out"
    )
    (run,) = found.runs
    assert len(run) == 400
    np.testing.assert_allclose(run["y"], signals()["y"], atol=1e-3)


def test_a_column_of_text(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_csv(path, signals())
    lines = path.read_text("utf-8").splitlines()
    rows = [lines[0]] + [",".join([x.split(",")[0], "high", "0"]) for x in lines[1:]]
    path.write_text("\n".join(rows), "utf-8")
    assert "column 'y', row 2: 'high' is not a number" in refusal(path)


@pytest.mark.parametrize("fields", [1, 2, 4])
def test_rows_of_another_length(tmp_path: Path, fields: int) -> None:
    message = refusal(edited(tmp_path, 57, lambda f: [*f, "9"][:fields], rows=5))
    many = "1 field" if fields == 1 else f"{fields} fields"
    assert f"row 57 has {many}, 3 needed (5 such rows)" in message


def test_a_row_without_an_end_is_refused_in_our_words(tmp_path: Path) -> None:
    path = edited(tmp_path, 3, lambda fields: fields * 400_000)
    message = refusal(path)
    assert "cannot be cut into rows of" in message and "write one row a line" in message
    assert "straddling" not in message


@pytest.mark.parametrize("fields", [1, 2, 4])
def test_one_row_of_another_length_is_left_out(tmp_path: Path, fields: int) -> None:
    path = edited(tmp_path, 57, lambda f: [*f, "9"][:fields])
    found = read_runs(path, card(tmp_path, CARD))
    many = "1 field" if fields == 1 else f"{fields} fields"
    assert found.remarks[0] == f"a.csv: row 57 has {many}, 3 needed: left out"
    (run,) = found.runs
    assert run.lost is not None
    assert np.flatnonzero(run.lost).tolist() == [55]
    np.testing.assert_allclose(run["y"], signals()["y"], atol=1e-3)


def test_a_last_row_that_is_cut_off_is_left_out(tmp_path: Path) -> None:
    path = with_columns(tmp_path)
    path.write_text(path.read_text("utf-8").rstrip().rpartition(",")[0], "utf-8")
    found = read_runs(path, card(tmp_path, CARD))
    assert found.remarks == ("a.csv: row 401 has 2 fields, 3 needed: left out",)
    assert len(found.runs[0]) == 399


def test_a_logger_that_was_started_anew_gives_two_runs(tmp_path: Path) -> None:
    """Its header stands in the middle of the file, and its clock begins again."""
    path = with_columns(tmp_path)
    once = path.read_text("utf-8")
    path.write_text(once + once, "utf-8")
    found = read_runs(path, card(tmp_path, CARD))
    assert found.remarks == ("a.csv: its clock begins again: 2 runs",)
    assert [run.name for run in found.runs] == ["a.csv (run 1)", "a.csv (run 2)"]
    for run in found.runs:
        np.testing.assert_allclose(run["y"], signals()["y"], rtol=1e-12)


def test_a_row_that_is_there_twice_counts_once(tmp_path: Path) -> None:
    path = with_columns(tmp_path)
    lines = path.read_text("utf-8").splitlines()
    path.write_text("\n".join([lines[0], *(x for line in lines[1:] for x in (line, line))]))
    found = read_runs(path, card(tmp_path, CARD))
    assert found.remarks == ("a.csv: 400 rows that repeat the row before left out",)
    np.testing.assert_allclose(found.runs[0]["y"], signals()["y"], rtol=1e-12)


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", ""])
def test_runs_of_nan_or_infinite_are_cut_out_and_reported(tmp_path: Path, value: str) -> None:
    path = with_columns(tmp_path)
    lines = path.read_text("utf-8").splitlines()
    for row in range(99, 120):
        lines[row] = f"{0.01 * (row - 1)},{value},1.0"
    path.write_text("\n".join(lines), "utf-8")
    found = read_runs(path, card(tmp_path, CARD))
    assert "a.csv: 'y' has missing samples at t = 0.98 s to 1.18 s (21 samples): cut out" in (
        found.remarks
    )
    (bad,) = found.bad
    assert (bad.signal, bad.kind, bad.samples, bad.done) == ("y", "missing", 21, "cut out")
    for run in found.runs:
        assert all(np.all(np.isfinite(x)) for x in run.signals.values())
        assert not np.any((run["t"] > 0.975) & (run["t"] < 1.185))


def test_absurd_values(tmp_path: Path) -> None:
    message = refusal(edited(tmp_path, 57, lambda f: [f[0], f[1], "1e300"]))
    assert "signal 'F' is 1e+300 in row 57" in message


def test_time_going_back_or_repeated(tmp_path: Path) -> None:
    t = signals()["t"]
    t[50:] += 5.0 * (t[1] - t[0])  # rows are lost, so that the rest are not even
    t[20] = t[19]
    assert "time repeats in row 22 " in refusal(with_columns(tmp_path, t=t))
    t[20], t[50] = 0.5 * (t[19] + t[21]), t[30]
    assert "time goes back in row 52 " in refusal(with_columns(tmp_path, t=t))


def test_rows_that_are_stamped_late_together_are_even(tmp_path: Path) -> None:
    t = signals()["t"]
    h, late = float(t[1] - t[0]), np.arange(40, len(t), 90)
    stamped = t.copy()
    stamped[late] += 1.0 * h  # with the next, which has another position
    found = read_runs(with_columns(tmp_path, t=stamped), card(tmp_path, CARD))
    (run,) = found.runs
    np.testing.assert_allclose(np.diff(run["t"]), h, rtol=1e-3)
    said = f"{len(late)} rows with the time of the row before and other values: stamped late"
    assert any(said in one for one in found.remarks)


def test_constant_position(tmp_path: Path) -> None:
    assert "position is constant (0.3 m" in refusal(with_columns(tmp_path, y=np.full(400, 0.3)))


def test_force_of_the_wrong_sign(tmp_path: Path) -> None:
    assert "wrong sign" in refusal(with_columns(tmp_path, F=-signals()["F"]))


def test_force_and_position_swapped(tmp_path: Path) -> None:
    s = signals()
    assert "look swapped" in refusal(with_columns(tmp_path, y=s["F"], F=s["y"]))
    stroke = CARD.replace('"force"', '"force"\nstroke_m = [-0.12, 0.12]')
    assert "the card's stroke" in refusal(with_columns(tmp_path, y=s["F"], F=s["y"]), stroke)


def test_far_too_short(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    write_csv(path, signals(20))
    assert "20 samples, at least 100 needed" in refusal(path)


def test_header_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t,y,F\n", "utf-8")
    assert "no rows" in refusal(path)
    path.write_text("# nothing\n\n", "utf-8")
    assert "no rows" in refusal(path)


def test_signals_of_different_lengths(tmp_path: Path) -> None:
    s = signals()
    WRITERS["a.h5"](tmp_path / "a.h5", {**s, "y": s["y"][:200]})
    assert "'y' has 200 values and t 400" in refusal(tmp_path / "a.h5")


def test_unknown_key_in_the_card(tmp_path: Path) -> None:
    (tmp_path / "card.toml").write_text(CARD + '[file]\ndelimeter = ";"\n', "utf-8")
    with pytest.raises(UserError, match=r"\[file\] unknown key 'delimeter'; .* 'delimiter'\?"):
        load_card(tmp_path / "card.toml")


@pytest.mark.parametrize("name", sorted(WRITERS))
def test_zero_bytes(tmp_path: Path, name: str) -> None:
    (tmp_path / name).touch()
    assert "is empty (0 bytes)" in refusal(tmp_path / name)


def test_directory(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    assert "is a directory" in refusal(tmp_path / "logs")


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted({*WRITERS} - {"a.csv", "a.tdms", "a.ulg"}))
@pytest.mark.parametrize("share", [0.02, 0.3, 0.5, 0.8, 0.99])
def test_truncated_files(tmp_path: Path, name: str, share: float) -> None:
    path = tmp_path / name
    WRITERS[name](path, signals())
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    message = refusal(path)
    assert "copy it again" in message or "no column" in message


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    content=st.one_of(
        st.binary(min_size=1, max_size=300),
        st.text(max_size=300).map(lambda text: text.encode("utf-8", "replace")),
        st.text(alphabet="0123456789.,;-e\n\t\"' #", max_size=300).map(str.encode),
    ),
    name=st.sampled_from([*WRITERS, "a.dat"]),
)
def test_no_bytes_make_a_traceback(tmp_path: Path, content: bytes, name: str) -> None:
    (tmp_path / name).write_bytes(content)
    refusal(tmp_path / name)


@pytest.mark.slow
@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@example("a.mat", 1161, 0x08)  # the complex flag: scipy's reader died of it
@given(
    name=st.sampled_from(sorted({*WRITERS} - {"a.csv", "a.json"})),
    at=st.integers(0, 3000),
    value=st.integers(0, 255),
)
def test_a_flipped_byte_makes_no_traceback(tmp_path: Path, name: str, at: int, value: int) -> None:
    path = tmp_path / name
    WRITERS[name](path, signals(120))
    content = bytearray(path.read_bytes())
    content[at % len(content)] = value
    path.write_bytes(bytes(content))
    try:
        read_log(path, card(tmp_path))
    except UserError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize(
    "name", ["a.parquet", "a.mat", "a.h5", "a.tdms", "a.mf4", "a.mcap", "a.ulg"]
)
def test_binary_format_named_csv(tmp_path: Path, name: str) -> None:
    WRITERS[name](tmp_path / name, signals())
    (tmp_path / name).rename(tmp_path / "b.csv")
    assert "file named .csv; rename it" in refusal(tmp_path / "b.csv")
    forms = {"a.h5": "hdf5", "a.mf4": "mdf", "a.ulg": "ulog"}
    form = forms.get(name, name.removeprefix("a."))
    named = card(tmp_path, CARD + f'[file]\nformat = "{form}"\n')
    assert len(read_log(tmp_path / "b.csv", named)) == 400


def test_unknown_binary_file_named_csv(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(bytes(range(256)) * 20)
    assert "is not text" in refusal(path)
    path.write_bytes(b"ab\0cd" * 100)
    assert "is a binary file, not text" in refusal(path)


def test_a_text_file_named_parquet_or_mat(tmp_path: Path) -> None:
    for name in ("a.parquet", "a.h5", "a.mat"):
        write_csv(tmp_path / name, signals())
        assert "copy it again" in refusal(tmp_path / name)


def test_header_that_is_not_utf8(tmp_path: Path) -> None:
    path = with_columns(tmp_path)
    path.write_bytes(path.read_bytes().replace(b"y", b"\xf6l", 1))
    message = refusal(path)
    assert "byte 0xf6 in line 1" in message
    assert 'encoding = "latin-1"' in message
    assert "unknown" in refusal(path, CARD + '[file]\nencoding = "latin-99"\n')


def test_lines_before_a_header_that_cannot_be_found_say_what_to_skip(tmp_path: Path) -> None:
    path = with_columns(tmp_path)
    rows = path.read_text("utf-8").replace("\n", "\nq,off,x\n", 1)
    path.write_text("Logger 3.1\nDate: 2024-01-01\n\n" + rows, "utf-8")
    message = refusal(path)
    assert "did you mean 'q'" in message or "no column 't'" in message


@pytest.mark.parametrize("text", ["00:00:01.002", "2024-01-01 00:00", "2024/01/01"])
def test_times_as_dates_or_clocks(tmp_path: Path, text: str) -> None:
    message = refusal(edited(tmp_path, 57, lambda f: [text, *f[1:]], rows=5))
    assert "log times in seconds, not as dates or clock times" in message


def test_a_column_name_that_is_there_twice(tmp_path: Path) -> None:
    path = with_columns(tmp_path)
    path.write_text(path.read_text("utf-8").replace("t,y,F", "t,y,y", 1), "utf-8")
    text = CARD.replace('column = "F"', "column = 2")
    assert "columns 1 and 2 (counted from 0) are all named 'y'" in refusal(path, text)
    assert len(read_log(path, card(tmp_path, text.replace('column = "y"', "column = 1")))) == 400


@pytest.mark.parametrize(
    ("magic", "needed"),
    [
        (b"\x1f\x8b", "gzip"),
        (b"BZh9", "bzip2"),
        (b"\xfd7zXZ\0", "xz"),
        (b"PK\x03\x04", "zip archive"),
        (b"\xd0\xcf\x11\xe0", "old Excel workbook"),
    ],
)
@pytest.mark.parametrize("name", ["a.csv", "a.csv.gz", "a.zip"])
def test_packed_files_say_how_to_unpack(
    tmp_path: Path, magic: bytes, needed: str, name: str
) -> None:
    (tmp_path / name).write_bytes(magic + bytes(range(256)))
    assert needed in refusal(tmp_path / name)


def test_another_format_than_the_card_says(tmp_path: Path) -> None:
    for form in ("parquet", "mat", "hdf5", "json"):
        message = refusal(with_columns(tmp_path), CARD + f'[file]\nformat = "{form}"\n')
        assert f"is not a {form} file by its first bytes, which the card's [file]" in message


def test_decimal_commas_between_commas(tmp_path: Path) -> None:
    path = with_columns(tmp_path)
    lines = [line.split(",") for line in path.read_text("utf-8").splitlines()]
    bare = [lines[0], *([field.replace(".", ",") for field in line] for line in lines[1:])]
    path.write_text("\n".join(",".join(line) for line in bare), "utf-8")
    assert "a comma both parts the columns and is the decimal sign" in refusal(path)
    quoted = "\n".join(",".join(f'"{field}"' for field in line) for line in bare)
    path.write_text(quoted, "utf-8")
    np.testing.assert_array_equal(read_log(path, card(tmp_path))["y"], signals()["y"])


def test_rows_that_end_in_a_delimiter(tmp_path: Path) -> None:
    path = with_columns(tmp_path)
    header, *rows = path.read_text("utf-8").splitlines()
    path.write_text("\n".join([header, *(f"{row},1" for row in rows)]), "utf-8")
    assert "no header of its 4 columns; name the column by its number" in refusal(path)
    for names in (header, f"{header},"):
        path.write_text("\n".join([names, *(f"{row}," for row in rows)]), "utf-8")
        assert len(read_log(path, card(tmp_path))) == 400


@pytest.mark.parametrize(("old", "new"), [(",", "|"), ("\n", "\r"), ("\n", "\r\n")])
def test_other_delimiters_and_line_ends_are_read(tmp_path: Path, old: str, new: str) -> None:
    path = with_columns(tmp_path)
    path.write_bytes(path.read_bytes().replace(old.encode(), new.encode()))
    np.testing.assert_array_equal(read_log(path, card(tmp_path))["y"], signals()["y"])


def test_a_text_in_a_mat_file_is_shown_plainly(tmp_path: Path) -> None:
    columns: dict[str, object] = {**signals(), "y": "hello"}
    scipy.io.savemat(str(tmp_path / "a.mat"), columns)
    assert "row 1: 'hello' is not a number" in refusal(tmp_path / "a.mat")


def test_a_timetable_as_an_object_of_matlab_says_how_to_write_it(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    WRITERS["a73.mat"](path, {})
    with h5py.File(path, "r+") as file:
        file["TT"] = np.zeros((1, 6), np.uint32)
        file["TT"].attrs["MATLAB_class"] = np.bytes_("timetable")
        file["TT"].attrs["MATLAB_object_decode"] = np.int32(3)
        file["#subsystem#/MCOS"] = np.zeros(4)
    assert "writetimetable(TT, 'log.csv')" in refusal(path)
    path.write_bytes(opaque())
    assert "holds a MATLAB object (a timetable or table)" in refusal(path)


def opaque() -> bytes:
    """A MAT file of version 5 that holds nothing but a timetable, an object of class 17."""

    def element(kind: int, data: bytes) -> bytes:
        return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)

    numbers = element(6, struct.pack("<II", 13, 0)) + element(5, struct.pack("<ii", 6, 1))
    numbers += element(1, b"") + element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1))
    parts = element(6, struct.pack("<II", 17, 0)) + element(1, b"TT") + element(1, b"MCOS")
    parts += element(1, b"timetable") + element(14, numbers)
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + element(14, parts)


def test_a_page_of_html_is_no_log(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("<html><body>404 not found</body></html>", "utf-8")
    assert "no rows below the header '<html><body>404" in refusal(tmp_path / "a.csv")
