"""Files as tables of columns: CSV, Parquet, MAT (v5 to v7.3), HDF5 and JSON, found by content.

A table hands out raw columns (numbers or text) by name or by number from 0. What foreign readers
raise on damaged files becomes BadLog in one line.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.errors import BadLog
from workbench.cards.card import FileSpec, Format
from workbench.cards.nearest import nearest
from workbench.files import refuse_larger, refuse_special
from workbench.links import broken_link
from workbench.logs.mat import tags_are_sound
from workbench.logs.text import read_text_table

RawColumn = NDArray[Any]
MOST_ROWS = 20_000_000  # of which a gigabyte of signals can be made
BINARY_BYTES = 1_000_000_000
JSON_BYTES = 100_000_000  # of text; as Python's values it takes ten times that
_PACKED = {
    b"\x1f\x8b": "compressed by gzip; unpack it (gunzip) and give the file in it",
    b"BZh": "compressed by bzip2; unpack it (bunzip2) and give the file in it",
    b"\xfd7zXZ": "compressed by xz; unpack it (unxz) and give the file in it",
    b"PK\x03\x04": "a zip archive or an Excel workbook; unpack it, or save its sheet as CSV",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook; save its sheet as CSV",
}


@dataclass(frozen=True)
class Table:
    """Columns of a file: their names, a function that reads one by number, the first row's number.

    `headed` is false where the file gives no names: then columns go by number alone.
    """

    names: tuple[str, ...]
    fetch: Callable[[int], RawColumn]
    first_row: int = 1
    headed: bool = True

    def column(self, key: str | int, where: str) -> RawColumn:
        """The column named or numbered `key`; raises BadLog with the nearest name."""
        count = len(self.names)
        if isinstance(key, int):
            if not 0 <= key < count:
                raise BadLog(
                    f"{where}: no column {key}, there are {count} (0 to {count - 1}, counted "
                    "from 0); correct it in the card"
                )
            return self.fetch(key)
        if not self.headed:
            raise BadLog(
                f"{where}: no column {key!r}, the file has no header; "
                f"name the column by its number (0 to {count - 1}) in the card"
            )
        if key not in self.names:
            raise BadLog(f"{where}: no column {key!r}{nearest(key, self.names)}")
        if self.names.count(key) > 1:
            which = " and ".join(str(k) for k, name in enumerate(self.names) if name == key)
            raise BadLog(
                f"{where}: columns {which} (counted from 0) are all named {key!r}; name the right"
                " one by its number in the card"
            )
        return self.fetch(self.names.index(key))


def read_table(path: Path, spec: FileSpec) -> Table:
    """The table in the file; raises BadLog where it is missing, empty, damaged or of no format."""
    head = _head(path)
    form = spec.format or find_format(path, head)
    if form in ("parquet", "mat", "hdf5") and spec.format is None and path.suffix == ".csv":
        raise BadLog(
            f"{path}: is a binary {form} file named .csv; rename it, or give its format in the "
            "card's [file]"
        )
    _check_magic(path, form, head, spec)
    readers: Mapping[str, Callable[[Path, FileSpec], Table]] = {
        "csv": _read_csv,
        "parquet": _read_parquet,
        "mat": _read_mat,
        "hdf5": _read_hdf5,
        "json": _read_json,
    }
    try:
        return readers[form](path, spec)
    except BadLog:
        raise
    except Exception as error:  # damaged files make the readers raise nearly anything
        raise damaged(path, form, error) from error


def damaged(path: Path, form: str, error: Exception) -> BadLog:
    """The one-line error for a file on which its reader failed."""
    text = " ".join(str(error).split())[:120] or type(error).__name__
    return BadLog(f"{path}: damaged or cut off, not a whole {form} file ({text}); copy it again")


def find_format(path: Path, head: bytes) -> Format:
    """The format that the first bytes say, else the suffix, else CSV."""
    if head.startswith(b"PAR1"):
        return "parquet"
    if head.startswith(b"MATLAB"):
        return "mat"
    if head.startswith(b"\x89HDF"):
        return "hdf5"
    suffixes: Mapping[str, Format] = {
        ".parquet": "parquet",
        ".mat": "mat",
        ".h5": "hdf5",
        ".hdf5": "hdf5",
        ".json": "json",
    }
    if path.suffix.lower() not in suffixes and head.lstrip()[:1] in (b"{", b"["):
        return "json"
    return suffixes.get(path.suffix.lower(), "csv")


def _head(path: Path) -> bytes:
    refuse_special(path, BadLog)
    try:
        with path.open("rb") as file:
            head = file.read(1024)
    except FileNotFoundError:
        broken = broken_link(path)
        if broken:
            raise BadLog(f"{path}: {broken}") from None
        folder = path.parent
        around = sorted(p.name for p in folder.iterdir()) if folder.is_dir() else []
        raise BadLog(f"{path}: no such file{nearest(path.name, around)}") from None
    except IsADirectoryError:
        raise BadLog(f"{path}: is a directory; name the log files in it") from None
    except OSError as error:
        wrong = broken_link(path) or f"cannot be read ({error.strerror}); check its rights"
        raise BadLog(f"{path}: {wrong}") from None
    if not head:
        raise BadLog(f"{path}: is empty (0 bytes); copy it again")
    return head


def _check_magic(path: Path, form: Format, head: bytes, spec: FileSpec) -> None:
    """Raises BadLog where the first bytes are those of no such file."""
    for magic, what in _PACKED.items():
        if form == "csv" and head.startswith(magic):
            raise BadLog(f"{path}: is {what}")
    wrong = {
        "mat": not head.startswith(b"MATLAB") and b"\x89HDF" not in head and _is_text(head),
        "parquet": not head.startswith(b"PAR1"),
        "hdf5": b"\x89HDF" not in head,
        "json": head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] not in (b"{", b"["),
    }
    if wrong.get(form, False):
        advice = "; copy it again or rename it"
        if spec.format is not None:
            advice = ", which the card's [file] format says; take it out, or copy it again"
        raise BadLog(f"{path}: is not a {form} file by its first bytes{advice}")


def _refuse_long(path: Path, rows: int) -> None:
    if rows > MOST_ROWS:
        raise BadLog(
            f"{path}: has {rows} rows, at most {MOST_ROWS} are read; cut the log, or keep every"
            " tenth row"
        )


def _is_text(head: bytes) -> bool:
    return all(32 <= byte < 127 or byte in b"\t\r\n" for byte in head)


def _read_csv(path: Path, spec: FileSpec) -> Table:
    text = read_text_table(path, spec)
    return Table(text.names, text.fetch, text.first_row, text.headed)


def _read_parquet(path: Path, spec: FileSpec) -> Table:
    import pyarrow.parquet as pq

    names = tuple(str(name) for name in pq.read_schema(path).names)
    with pq.ParquetFile(path) as file:
        _refuse_long(path, file.metadata.num_rows)

    def fetch(number: int) -> RawColumn:
        with pq.ParquetFile(path) as file:
            column = file.read(columns=[names[number]]).column(0)
        return np.asarray(column.to_numpy())[spec.skip_rows :]

    return Table(names, fetch, 1 + spec.skip_rows)


def _read_mat(path: Path, spec: FileSpec) -> Table:
    import scipy.io

    if b"\x89HDF" in _head(path):
        return _read_hdf5(path, spec)
    refuse_larger(path, BINARY_BYTES, "a MAT file", BadLog)
    bytes_read = path.read_bytes()
    sound = not bytes_read.startswith(b"MATLAB 5") or tags_are_sound(bytes_read)
    del bytes_read
    if not sound:
        raise damaged(path, "mat", ValueError("a tag does not fit"))
    for _name, shape, _kind in scipy.io.whosmat(str(path)):
        _refuse_long(path, max(shape, default=0))
    content: Any = scipy.io.loadmat(str(path), squeeze_me=True, struct_as_record=False)
    found = {name: value for name, value in content.items() if not name.startswith("__")}
    for key in spec.rows.split(".") if spec.rows else ():
        if key not in found:
            raise BadLog(f"{path}: no variable {spec.rows!r}{nearest(key, found)}")
        inner = found[key]
        if isinstance(inner, np.ndarray):
            return _matrix(path, inner, spec)
        found = {name: getattr(inner, name) for name in inner._fieldnames}
    return _vectors({name: np.atleast_1d(np.asarray(value)) for name, value in found.items()}, spec)


def _read_hdf5(path: Path, spec: FileSpec) -> Table:
    import h5py

    with h5py.File(path, "r") as file:
        matlab = file.userblock_size > 0
        if spec.rows and spec.rows.replace(".", "/") not in file:
            raise BadLog(f"{path}: no group or data set {spec.rows!r}{nearest(spec.rows, file)}")
        root = file[spec.rows.replace(".", "/")] if spec.rows else file
        if isinstance(root, h5py.Dataset):
            _refuse_long(path, max(root.shape, default=0))
            values = root[()]
            if values.dtype.names:
                return _vectors({name: values[name] for name in values.dtype.names}, spec)
            return _matrix(path, values.T if matlab else values, spec)
        names: list[str] = []

        def visit(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset) and not name.startswith("#refs#"):
                _refuse_long(path, item.size)
                names.append(name)

        root.visititems(visit)
        place = root.name

    def fetch(number: int) -> RawColumn:
        with h5py.File(path, "r") as file:
            values = np.atleast_1d(np.asarray(file[place][names[number]][()])).ravel()
        return values[spec.skip_rows :] if values.size > 1 else values

    return Table(tuple(names), fetch, 1 + spec.skip_rows)


def _read_json(path: Path, spec: FileSpec) -> Table:
    refuse_larger(path, JSON_BYTES, "a JSON log", BadLog)
    try:
        content = json.loads(path.read_text(encoding=spec.encoding))
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise damaged(path, "json", error) from None
    outer = content if isinstance(content, dict) else {}
    rows = content
    for key in spec.rows.split(".") if spec.rows else ():
        if not isinstance(rows, dict) or key not in rows:
            there = rows if isinstance(rows, dict) else ()
            raise BadLog(f"{path}: no key {spec.rows!r} for the rows{nearest(key, there)}")
        rows = rows[key]
    if isinstance(rows, dict):
        return _vectors({name: np.atleast_1d(np.asarray(v)) for name, v in rows.items()}, spec)
    if not isinstance(rows, list) or not rows:
        raise BadLog(f"{path}: holds no list of rows; name its key in the card, [file] rows")
    scalars = {k: np.asarray([v]) for k, v in outer.items() if not isinstance(v, list | dict)}
    return _records(path, rows, scalars, spec)


def _records(path: Path, rows: list[Any], scalars: dict[str, RawColumn], spec: FileSpec) -> Table:
    if isinstance(rows[0], dict):
        names = [str(name) for name in rows[0]]
        columns = {name: np.asarray([row.get(name) for row in rows]) for name in names}
        return _vectors({**columns, **scalars}, spec)
    for number, row in enumerate(rows, start=1):
        if not isinstance(row, list) or len(row) != len(rows[0]):
            raise BadLog(f"{path}: row {number} has not the length of row 1 ({len(rows[0])})")
    return _matrix(path, np.asarray(rows), spec)


def _vectors(found: Mapping[str, RawColumn], spec: FileSpec) -> Table:
    """A table of named vectors; a scalar stays one value, which the caller may spread."""

    def fetch(number: int) -> RawColumn:
        values = list(found.values())[number].ravel()
        return values[spec.skip_rows :] if values.size > 1 else values

    return Table(tuple(found), fetch, 1 + spec.skip_rows)


def _matrix(path: Path, values: RawColumn, spec: FileSpec) -> Table:
    if values.ndim != 2:
        raise BadLog(f"{path}: {spec.rows!r} has the shape {values.shape}, rows and columns needed")
    names = tuple(str(number) for number in range(values.shape[1]))
    return Table(names, lambda k: values[spec.skip_rows :, k], 1 + spec.skip_rows, headed=False)
