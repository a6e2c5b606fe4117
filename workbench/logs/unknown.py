"""A log that no card describes yet: its layout found by looking, its columns as numbers."""

import json
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np

from identification.arrays import Array
from identification.columns.column import RawColumn
from identification.columns.log_columns import UnknownLog
from identification.columns.several_clocks import on_clock_of_most
from identification.errors import BadLog
from identification.signals.check import SHORTEST_LOG
from workbench.cards.card_tables import FileSpec, Format
from workbench.cards.headers import read_header
from workbench.files import refuse_larger
from workbench.logs.notation import NOTATION
from workbench.logs.packed import TEXT_BYTES, text_bytes
from workbench.logs.table import Table
from workbench.logs.tables import JSON_BYTES, checked_format, read_table
from workbench.logs.times import numbers_in, seconds

ONE_ROW = 1  # by which vectors of one log may differ in length
_OF_PATHS = ("json", "mat", "hdf5", "mcap", "rosbag")  # formats whose names are paths
_ONLY_NUMBER = ("data", "value")  # of a message that holds one number
_DEEPEST = 5  # tables in each other, in which the rows are looked for
_FRAMES = re.compile(  # as candump prints them, with and without -L
    r"(?:^\s*(?:\(\d+\.\d+\)\s+)?[sv]*can\d+\s+[0-9A-F]{3,8}(?:\s*##?|\s+\[\d+\]).*\n){3}",
    re.I | re.M,
)
_ONLY_DATES = "dates, not numbers"
_ENCODINGS = ("utf-8", "gb18030", "cp932", "cp1252", "latin-1")
_FIRST_LINES, _FEWEST_SPOKEN = 40, 2  # of a text, in which so many Chinese headers are known


def read_unknown(path: Path) -> UnknownLog:
    """The log in the file, without a card.

    Encoding, preamble, header and row of units of a text file, and the table in a JSON or MAT
    file, are found by looking. Raises BadLog, one line, where there are no columns of numbers.
    """
    form = checked_format(path, FileSpec())
    said = ""
    if form == "csv":
        refuse_larger(path, TEXT_BYTES, "a text log", BadLog)
        spec = FileSpec(encoding=_encoding(path))
        if _FRAMES.match(text_bytes(path, 1000).decode("latin-1")):
            raise BadLog(
                f"{path}: holds raw frames of a CAN bus, of which only its description says what"
                " the bytes mean; decode them by its DBC or EDS file, and give a column a signal"
            )
    elif form == "json":
        rows, said = _rows_of(path)
        spec = FileSpec(rows=rows)
    else:
        spec = FileSpec(rows=_struct_of(path) if form == "mat" else None)
    table = read_table(path, spec)
    texts, full = _plain_names(table, form), table.full_names()
    if form == "csv" and (count := len(table.fetch(0))) < SHORTEST_LOG:
        raise BadLog(_too_short(path, f"{count} row" + ("s" if count != 1 else "")))
    found, scalars = list[RawColumn](), list[RawColumn]()
    for number in range(len(table.names)):
        text = texts[number] if table.headed else ""
        called = table.names if table.clocks and table.names.count(text) == 1 else full
        twice = called.count(called[number]) > 1
        key = called[number] if text and not twice else number
        below = table.units[number] if table.units else ""
        values, why = _numbers(table, number)
        if why.startswith(("text", _ONLY_DATES)):
            with suppress(BadLog):
                times = seconds(np.asarray(table.fetch(number)), str(path), table.first_row)
                if times is not None:
                    values, why, below = times, "", "s"
        group = table.groups[number] if table.groups else ""
        one = RawColumn(number, key, text, below, values, why, group)
        found.append(one)
        if np.count_nonzero(known := np.isfinite(values)) == 1:  # a period, in the first row alone
            scalars.append(replace(found.pop(), header=table.names[number], values=values[known]))
    found = on_clock_of_most(found, table.clocks, NOTATION)
    longest = max((len(one.values) for one in found if not one.unusable), default=0)
    if longest < SHORTEST_LOG:
        many = f"{longest} rows of numbers" if longest else "no column of numbers"
        raise BadLog(_too_short(path, many))
    same = [one for one in found if longest - ONE_ROW <= len(one.values) <= longest]
    shortest = min((len(one.values) for one in same), default=0)
    same = [replace(one, values=one.values[:shortest]) for one in same]
    notes = tuple(one for one in (said, *table.remarks) if one)
    layout = spec.model_dump(exclude_defaults=True)
    return UnknownLog(str(path), layout, tuple(same), tuple(scalars), notes)


def _plain_names(table: Table, form: Format) -> tuple[str, ...]:
    """What to read of the columns' names: of a path within tables its last part, where no other
    column has that, and of a message's only number its topic."""
    if form not in _OF_PATHS:
        return table.names
    topics = table.groups or ("",) * len(table.names)
    last = [
        topic.strip("/") if name in _ONLY_NUMBER and topic else name.rpartition(".")[2] or name
        for name, topic in zip(table.names, topics, strict=True)
    ]
    return tuple(one if last.count(one) == 1 else name
                 for one, name in zip(last, table.names, strict=True))  # fmt: skip


def _too_short(path: Path, found: str) -> str:
    return (
        f"{path}: {found}, at least {SHORTEST_LOG} rows needed; give a log of one run, a column a"
        " signal"
    )


def _numbers(table: Table, number: int) -> tuple[Array, str]:
    """A column as numbers, text in a few cells as missing; the reason where it is none."""
    raw = np.asarray(table.fetch(number))
    if raw.ndim != 1:
        return np.zeros(0), "no column"
    if raw.dtype.kind in "Mm":
        return np.full(len(raw), np.nan), _ONLY_DATES
    found = numbers_in(raw)
    if not np.any(found.is_text) or found.few:
        return found.values, ""
    text = found.first_text
    alone = len(set(raw.tolist())) == 1 and not text.isalnum()
    shown = repr(text[:20])
    return np.full(len(raw), np.nan), f"{shown} alone" if alone else f"text ({shown})"


def _encoding(path: Path) -> str:
    """The first encoding in which the file is text; Chinese by its headers' words, Japanese by its
    letters."""
    content = text_bytes(path)
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-8"  # the reader sees the mark itself
    for name in _ENCODINGS:
        try:
            text = content.decode(name)
        except UnicodeDecodeError:
            continue
        if name == "gb18030" and not _speaks(text):
            continue
        if name != "cp932" or any("\u3040" <= letter <= "\u9fff" for letter in text):
            return name
    return "utf-8"


def _speaks(text: str) -> bool:
    """Whether headers among the first lines are Chinese and known."""
    cells = re.split(r"[,;\t\n]", "\n".join(text.splitlines()[:_FIRST_LINES]))
    chinese = ("".join(re.findall("[\u4e00-\u9fff]", cell)) for cell in cells)
    return sum(bool(read_header(one).means) for one in chinese if one) >= _FEWEST_SPOKEN


def _rows_of(path: Path) -> tuple[str | None, str]:
    """Where the rows of a JSON file lie ("a.b", "a.0.b" within lists; None: at the top), and what
    else is there."""
    refuse_larger(path, JSON_BYTES, "a JSON log", BadLog)
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return None, ""  # the reader of tables says what is wrong with it
    lists = list(_lists(content, (), _DEEPEST))
    if (isinstance(content, list) and len(content) >= SHORTEST_LOG) or not lists:
        return None, ""
    longest = max(len(one) for one, _ in lists)
    long = [(one, place) for one, place in lists if len(one) >= longest - ONE_ROW]
    run, said = _run_of([place for _, place in long])
    own = [(one, place) for one, place in long if place[: len(run)] == run]
    if isinstance(own[0][0][0], dict | list):
        return ".".join(own[0][1]) or None, said or _more_runs(lists, *own[0])
    levels = zip(*(place for _, place in own), strict=False)
    place = tuple(keys[0] for keys in takewhile(lambda keys: len(set(keys)) == 1, levels))
    alone = len(own) == 1 or own[0][1][len(place)].isdigit()  # a list of signals, a table each
    return ".".join(place[:-1] if alone else place) or None, said


def _more_runs(
    lists: Sequence[tuple[list[Any], tuple[str, ...]]], rows: list[Any], place: tuple[str, ...]
) -> str:
    """What is said of further lists that hold rows as the one that is read does."""
    more = [repr(".".join(other)) for one, other in lists
            if other != place and _shape(one[0]) == _shape(rows[0])]  # fmt: skip
    runs = f"{', '.join(more)} hold rows as {'.'.join(place)!r} does, which the card reads"
    return f"{runs}; give another run by the card's [file] rows" if more else ""


def _shape(row: Any) -> Any:
    """What rows of one kind have in common: their keys, or how many values they hold."""
    return sorted(row) if isinstance(row, dict) else len(row) if isinstance(row, list) else None


def _run_of(places: Sequence[tuple[str, ...]]) -> tuple[tuple[str, ...], str]:
    """The first of several runs in a list, by the places of its vectors, and what is said of it.

    A table in a list that holds one vector alone is a signal, and no run.
    """
    for place in places:
        at = next((k for k, key in enumerate(place) if key.isdigit()), None)
        if at is None or sum(other[: at + 1] == place[: at + 1] for other in places) < 2:
            continue
        several = {other[: at + 1] for other in places if other[:at] == place[:at]}
        name = ".".join(place[:at]) or "the file"
        said = f"{len(several)} runs in {name}: the card reads the first" if several else ""
        return place[: at + 1], said if len(several) > 1 else ""
    return (), ""


def _lists(
    value: Any, place: tuple[str, ...], depth: int
) -> Iterator[tuple[list[Any], tuple[str, ...]]]:
    """The lists that are long enough for a log, each with its place."""
    if isinstance(value, list) and len(value) >= SHORTEST_LOG:
        yield value, place
    elif isinstance(value, list) and depth:
        for k, inner in enumerate(value):
            yield from _lists(inner, (*place, str(k)), depth - 1)
    elif isinstance(value, dict) and depth:
        for key, inner in value.items():
            yield from _lists(inner, (*place, str(key)), depth - 1)


def _struct_of(path: Path) -> str | None:
    """Name of the struct or matrix of a MAT file that holds the signals; None: its top does."""
    import scipy.io

    try:
        content = scipy.io.whosmat(str(path))
    except Exception:  # v7.3, or damaged: the reader of tables says so
        return None
    vectors = [one for one in content if one[2] != "struct" and max(one[1]) >= SHORTEST_LOG]
    matrices = [name for name, shape, _ in vectors if min(shape) > 1]
    if len(matrices) < len(vectors) or len({max(shape) for _, shape, _ in vectors}) == 1 < len(
        vectors
    ):
        return None  # vectors, or matrices of one clock
    structs = [name for name, _, kind in content if kind == "struct"]
    return next(iter([*matrices, *structs]), None)
