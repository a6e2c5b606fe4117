"""Text tables: delimiter, decimal sign and header found by looking, numbers read by Arrow."""

import csv
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array
from identification.errors import BadLog
from identification.signals.stamps import are_few
from workbench.cards.card_tables import FileSpec
from workbench.files import refuse_larger
from workbench.logs.blocks import Block, are_runs, block_table, blocks_of
from workbench.logs.clocks import clock_groups, long_groups, topic_groups
from workbench.logs.layout import Layout, find_layout, is_number, period_above
from workbench.logs.packed import TEXT_BYTES, text_bytes
from workbench.logs.rewritten import as_table
from workbench.logs.table import Table
from workbench.logs.times import with_one_clock

_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_BETWEEN_NAMES = re.compile(r"\t|\s{2,}")  # between names of several words
_WHOLE = re.compile(r"[+-]?\d+")
_LETTERS = re.compile(r"[^\W\d_]{2}")
_FEW_ROWS = 3
_DELIMITERS = (";", "\t", ",", " ", "|")
_COMPARED = 40  # lines by which the delimiter is found
_END = "EOF"  # the last line of some scopes'
MANY = 10  # rows of a wrong length that make the header suspect instead
_EXAMINED = 262_144  # characters looked at to find the layout
_HEAD_BYTES = 8 * _EXAMINED  # in which they are, whatever the letters


@dataclass(frozen=True)
class _Marks:
    delimiter: str
    decimal: str


def read_text_table(path: Path, spec: FileSpec) -> Table:
    """The columns of a text file, its layout as the card says, else as the file looks.

    Raises BadLog where the file is not text, has no rows, or a row has the wrong number of fields.
    """
    refuse_larger(path, TEXT_BYTES, "a text log", BadLog)
    text = _decode(path, spec.encoding)
    if blocks := _blocks(text, spec):
        return block_table(path, blocks, spec.decimal)
    head = _head_of(path, text, spec)
    if not any(head.fields):
        raise BadLog(f"{path}: no rows after line {spec.skip_rows}; check skip_rows in the card")
    lines, fields, marks = head
    found = _layout(head, spec) if spec.header is None else None
    if found is None:  # the card says so, or nothing shows where the data begin
        at, first = next((k, line) for k, line in enumerate(fields) if line)
        headed = spec.header if spec.header is not None else not all(map(is_number, first))
        found = Layout(tuple(first) if headed else (), at + int(headed))
    names = found.names or tuple(str(k) for k in range(len(fields[found.data])))
    start = spec.skip_rows
    body = _without_again(_body(text, start + found.data, spec, marks), lines[: found.data])
    if not body.strip():
        raise BadLog(
            f"{path}: no rows below the header {lines[0].strip()[:40]!r}; log some data, or check"
            " that it is the right file"
        )
    first_row = start + found.data + 1
    content = body.encode("utf-8")
    del text, body  # of a long log a gigabyte
    columns, remarks = _parse(path, content, marks, len(names), first_row)
    headed = bool(found.names)
    table = Table(names, columns, first_row, headed, found.groups, units=found.units,
                  remarks=remarks)  # fmt: skip
    if headed and (period := period_above(fields[: found.data])):
        table = table.beside(*period)
    rows = fields[found.data : found.data + _COMPARED]
    table = with_one_clock(table, rows)
    if found.groups:
        return table
    if (long := long_groups(table, rows)) or not headed:
        return long or table
    return topic_groups(table, rows) or _grouped(table, rows, marks)


def _blocks(text: str, spec: FileSpec) -> list[Block]:
    """The blocks of a text of which the card does not say where its table begins."""
    found = blocks_of(text) if not spec.skip_rows and spec.header is None else []
    return [] if are_runs(found) else found


def _grouped(table: Table, rows: Sequence[Sequence[str]], marks: _Marks) -> Table:
    """The table, its columns in groups where each of several has a clock before it."""
    whole = [row for row in rows if len(row) == len(table.names)]
    first = list[Array]()
    for cells in zip(*whole, strict=True):
        plain = (cell.replace(marks.decimal, ".") for cell in cells if cell and is_number(cell))
        first.append(np.array([float(cell) for cell in plain]))
    return clock_groups(table, first) or table


def first_lines(path: Path, spec: FileSpec) -> Sequence[Sequence[str]]:
    """The first lines of a text file as fields. Raises BadLog where the file is not text."""
    refuse_larger(path, TEXT_BYTES, "a text log", BadLog)
    return _head_of(path, _decode(path, spec.encoding, _HEAD_BYTES), spec).fields


class _Head(NamedTuple):
    """The first lines of a text, from that which the card says: as they are, their fields (none of
    empty lines and comments), and the marks between these."""

    lines: list[str]
    fields: list[list[str]]
    marks: _Marks


def _head_of(path: Path, text: str, spec: FileSpec) -> _Head:
    lines = text[:_EXAMINED].splitlines()
    lines = (lines if len(text) <= _EXAMINED else lines[:-1])[spec.skip_rows :]
    skipped = [_skipped(line, spec.comment) for line in lines]
    considered = [line for line, out in zip(lines, skipped, strict=True) if not out]
    marks = _marks(considered[1:][-_COMPARED:], spec)
    fields = [[] if out else _split(line, marks) for line, out in zip(lines, skipped, strict=True)]
    if spec.decimal is None and marks.delimiter == ",":
        _refuse_comma_as_both(path, fields)
    return _Head(lines, fields, marks)


def _layout(head: _Head, spec: FileSpec) -> Layout | None:
    """Where header and data lie in these lines."""
    noted = {}
    for k, line in enumerate(head.lines if spec.comment else ()):
        if len(head.fields[k]) > 1 and is_number(head.fields[k][0]):
            break
        if line.lstrip().startswith(spec.comment):
            bare = _split(line.lstrip().lstrip(f"{spec.comment} "), head.marks)
            key = bool(bare) and (not bare[0] or bare[0].endswith(":"))  # "columns: t y F"
            noted[k] = bare[int(key) :]
    return find_layout(head.fields, noted)


def _refuse_comma_as_both(path: Path, rows: Sequence[Sequence[str]]) -> None:
    """Raises BadLog where a comma both parts the columns and is the decimal sign of all numbers.

    Each row then has twice the fields of the header, all of them whole numbers.
    """
    header, *body = [row for row in rows if any(row)][:_COMPARED] or [()]
    width = len(header)
    if width < 2 or len(body) < _FEW_ROWS or any(map(is_number, header)):
        return
    if all(len(row) == 2 * width and all(map(_WHOLE.fullmatch, row)) for row in body):
        raise BadLog(
            f"{path}: a comma both parts the columns and is the decimal sign ({width} names,"
            f" {2 * width} fields a row); export it with ';' between the columns, or with decimal"
            " points"
        )


def _decode(path: Path, encoding: str, most: int | None = None) -> str:
    """The text, or the whole lines among so many first bytes of it."""
    content = text_bytes(path, most)
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        encoding, content = "utf-16", content[: len(content) // 2 * 2]
    elif len(content) == most:
        content = content[: content.rfind(b"\n") + 1]
    try:
        text = content.decode(encoding)
    except LookupError:
        raise BadLog(f"{path}: encoding {encoding!r} is unknown; write it as 'latin-1'") from None
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        what = "is not text" if b"\0" in content[:_EXAMINED] else f"is not {encoding} text"
        raise BadLog(
            f"{path}: {what} (byte 0x{content[error.start]:02x} in line {line}); give a CSV file, "
            'or name its encoding in the card, [file] encoding = "latin-1"'
        ) from None
    if "\0" in text:
        raise BadLog(f"{path}: is a binary file, not text; give its format in the card's [file]")
    if "\n" not in text:
        text = text.replace("\r", "\n")
    return as_table(text.removeprefix("\ufeff"))


def _skipped(line: str, comment: str) -> bool:
    return not line.strip() or bool(comment and line.lstrip().startswith(comment))


def _marks(lines: list[str], spec: FileSpec) -> _Marks:
    """The delimiter that makes most fields numbers in lines of equal length, and the decimal."""
    best, most = ",", -1.0
    for delimiter in (spec.delimiter,) if spec.delimiter else _DELIMITERS:
        rows = [_split(line, _Marks(delimiter, ".")) for line in lines]
        widths = [len(row) for row in rows]
        if not widths or max(widths) == 1:
            continue
        width = max(set(widths), key=widths.count)
        fields = [field for row in rows for field in row]
        share = sum(map(is_number, fields)) / len(fields) + widths.count(width) / len(widths)
        if share > most:
            best, most = delimiter, share
    best = spec.delimiter or best
    fields = [field for line in lines for field in _split(line, _Marks(best, "."))]
    # Between commas only a quoted field can hold one; "1,000.5" is no decimal comma.
    comma = any(map(_DECIMAL_COMMA.fullmatch, fields)) and not (
        best == "," and any("." in field for field in fields)
    )
    return _Marks(best, spec.decimal or ("," if comma else "."))


def _split(line: str, marks: _Marks) -> list[str]:
    if marks.delimiter == " ":
        words = line.removesuffix(";").split()
        names = [one.strip() for one in _BETWEEN_NAMES.split(line.strip())]
        of_words = 1 < len(names) < len(words) and not any(map(is_number, names))
        return names if of_words else words  # "Encoder 1 Pos" is one name
    fields = next(csv.reader([line.rstrip("\r\n")], delimiter=marks.delimiter), [])
    return [field.strip() for field in fields]


def _body(text: str, start: int, spec: FileSpec, marks: _Marks) -> str:
    """The rows' text from line `start`, comments left out, one delimiter between fields."""
    at = 0
    for _ in range(start):
        at = text.find("\n", at) + 1
        if at == 0:
            return ""
    body = text[at:]
    if body.endswith((_END, _END + "\n", _END + "\r\n")):
        body = body.rstrip().removesuffix(_END)
    if spec.comment and spec.comment in body:
        remaining = (
            line for line in body.splitlines() if not line.lstrip().startswith(spec.comment)
        )
        body = "\n".join(remaining)
    if marks.delimiter == " ":
        body = "\n".join(" ".join(_split(line, marks)) for line in body.splitlines())
    return body


def _without_again(body: str, header: Sequence[str]) -> str:
    """The rows' text without the header where a logger started anew wrote it once more."""
    again = {line.strip() for line in header if line.strip() and f"\n{line.strip()}" in body}
    if not again:
        return body
    return "\n".join(line for line in body.splitlines() if line.strip() not in again)


class _Parsed:
    """Columns of a text, read by Arrow; rows of another number of fields are left out."""

    def __init__(self, content: bytes, marks: _Marks, width: int) -> None:
        self.content, self.marks, self.width = content, marks, width
        self.wrong: list[tuple[int, int, str]] = []  # row, its fields, its text

    def load(self, kind: Any, wanted: list[str]) -> Any:
        """These columns as one kind; raises ArrowInvalid where a cell is not of it."""
        import pyarrow as pa
        from pyarrow import csv as arrow

        def note(row: Any) -> str:
            wrong.append((int(row.number or 0), int(row.actual_columns), str(row.text)[:40]))
            return "skip"

        wrong = self.wrong = []
        names = [str(k) for k in range(self.width)]
        parse = arrow.ParseOptions(delimiter=self.marks.delimiter, invalid_row_handler=note)
        read = arrow.ReadOptions(column_names=names, use_threads=False)
        convert = arrow.ConvertOptions(
            column_types=dict.fromkeys(wanted, kind),
            decimal_point=self.marks.decimal,
            include_columns=wanted,
        )
        return arrow.read_csv(pa.BufferReader(self.content), read, parse, convert)

    def refused(self, path: Path, first_row: int, rows: int) -> str:
        """What is said of rows left out; raises BadLog where they are too many for a message of the
        logger or a row cut off."""
        if not self.wrong:
            return ""
        (row, fields, text), count = self.wrong[0], len(self.wrong)
        many = "1 field" if fields == 1 else f"{fields} fields"
        shown = f" ({text!r})" if _LETTERS.search(text) else ""
        said = f"row {first_row + row - 1}{shown} has {many}, {self.width} needed"
        more = f" ({count} such rows)" if count > 1 else ""
        if are_few(count, rows):
            return f"{said}{more}: left out"
        advice = "correct or remove it"
        if count > MANY and fields > self.width and self.marks.delimiter == ",":
            advice = "if the numbers have decimal commas, export with ';' between the columns"
        raise BadLog(f"{path}: {said}{more}; {advice}")


def _parse(
    path: Path, content: bytes, marks: _Marks, width: int, first_row: int
) -> tuple[Callable[[int], NDArray[Any]], tuple[str, ...]]:
    """What reads a column, and what is said of rows left out."""
    import pyarrow as pa

    parsed, names = _Parsed(content, marks, width), [str(k) for k in range(width)]
    try:
        numbers = parsed.load(pa.float64(), names)
    except pa.ArrowInvalid:  # some hold text: the others are read at once all the same
        plain = [names[k] for k in _plain(content, marks, width)]
        try:
            numbers = parsed.load(pa.float64(), plain) if plain else None
        except pa.ArrowInvalid:
            numbers = None
    whole = numbers
    if whole is None:
        try:
            whole = parsed.load(pa.string(), names[:1])
        except pa.ArrowInvalid:
            many = "1 field" if width == 1 else f"{width} fields"
            raise BadLog(
                f"{path}, from row {first_row}: cannot be cut into rows of {many}: a row is longer"
                " than 1 MB, or a quote in it is not closed; write one row a line"
            ) from None
    said = parsed.refused(path, first_row, len(whole) + len(parsed.wrong))
    numeric = set() if numbers is None else set(numbers.column_names)

    def fetch(number: int) -> NDArray[Any]:
        if numbers is not None and names[number] in numeric:
            return np.asarray(numbers.column(names[number]).to_numpy())
        try:
            return np.asarray(parsed.load(pa.float64(), [names[number]]).column(0).to_numpy())
        except pa.ArrowInvalid:
            column = parsed.load(pa.string(), [names[number]]).column(0).to_pylist()
        if marks.decimal == ",":
            column = [None if value is None else value.replace(",", ".") for value in column]
        return np.asarray(column, dtype=object)

    return fetch, (said,) if said else ()


def _plain(content: bytes, marks: _Marks, width: int) -> list[int]:
    """The columns that hold numbers alone, by the first and the last rows."""
    head, tail = content[:_EXAMINED].splitlines()[:-1], content[-_EXAMINED:].splitlines()[1:]
    rows = [
        _split(line.decode("utf-8", "replace"), marks)
        for line in (*head[:_COMPARED], *tail[-_COMPARED:])
    ]
    rows = [row for row in rows if len(row) == width]
    return [k for k in range(width) if all(is_number(row[k]) for row in rows)]
