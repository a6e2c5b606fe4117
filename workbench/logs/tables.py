"""Files as tables of columns, in the format that their content says.

A table hands out raw columns (numbers or text) by name or by number from 0. What foreign readers
raise on damaged files becomes BadLog in one line.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec
from workbench.cards.nearest import nearest
from workbench.files import refuse_larger
from workbench.logs.channels import read_mdf, read_tdms, read_ulog
from workbench.logs.excel import read_excel
from workbench.logs.formats import HDF5_MAGIC, checked_format, head_of
from workbench.logs.mcap import read_mcap
from workbench.logs.ros1 import read_bag
from workbench.logs.structs import entry, plain_tree, records, tags_are_sound, vectors_of
from workbench.logs.table import (
    BINARY_BYTES,
    RawColumn,
    Table,
    damaged,
    of_matrix,
    of_vectors,
    refuse_long,
)
from workbench.logs.text import read_text_table

_OBJECT_MARK = "MATLAB_object_decode"  # attribute of an object in a MAT file of version 7.3
JSON_BYTES = 100_000_000  # of text; as Python's values it takes ten times that


def read_table(path: Path, spec: FileSpec) -> Table:
    """The table in the file; raises BadLog where it is missing, empty, damaged or of no format."""
    form = checked_format(path, spec)
    readers: Mapping[str, Callable[[Path, FileSpec], Table]] = {
        "csv": read_text_table,
        "parquet": _read_parquet,
        "mat": _read_mat,
        "hdf5": _read_hdf5,
        "json": _read_json,
        "tdms": read_tdms,
        "mdf": read_mdf,
        "mcap": read_mcap,
        "ulog": read_ulog,
        "excel": read_excel,
        "npy": read_numpy,
        "rosbag": read_bag,
    }
    try:
        return readers[form](path, spec)
    except BadLog:
        raise
    except Exception as error:  # damaged files make the readers raise nearly anything
        raise damaged(path, form, error) from error


def _read_parquet(path: Path, spec: FileSpec) -> Table:
    import pyarrow.parquet as pq

    names = tuple(str(name) for name in pq.read_schema(path).names)
    with pq.ParquetFile(path) as file:
        refuse_long(path, file.metadata.num_rows)

    def fetch(number: int) -> RawColumn:
        with pq.ParquetFile(path) as file:
            column = file.read(columns=[names[number]]).column(0)
        return np.asarray(column.to_numpy())[spec.skip_rows :]

    return Table(names, fetch, 1 + spec.skip_rows)


def _read_mat(path: Path, spec: FileSpec) -> Table:
    import scipy.io

    if HDF5_MAGIC in head_of(path):
        return _read_hdf5(path, spec)
    refuse_larger(path, BINARY_BYTES, "a MAT file", BadLog)
    bytes_read = path.read_bytes()
    sound = not bytes_read.startswith(b"MATLAB 5") or tags_are_sound(bytes_read)
    del bytes_read
    if not sound:
        raise damaged(path, "mat", ValueError("a tag does not fit"))
    try:
        found_there = scipy.io.whosmat(str(path))
    except TypeError:  # of an object, which has no shape
        raise BadLog(_objects(path)) from None
    for _name, shape, _kind in found_there:
        refuse_long(path, max(shape, default=0))
    content: Any = scipy.io.loadmat(str(path), squeeze_me=True, struct_as_record=False)
    found: Any = {
        name: plain_tree(value) for name, value in content.items() if not name.startswith("__")
    }
    for key in spec.rows.split(".") if spec.rows else ():
        try:
            found = entry(found, key)
        except LookupError:
            there = found if isinstance(found, dict) else ()
            raise BadLog(f"{path}: no variable {spec.rows!r}{nearest(key, there)}") from None
    if isinstance(found, np.ndarray):
        return of_matrix(path, found, spec)
    return of_vectors(vectors_of(found), spec)


def _read_hdf5(path: Path, spec: FileSpec) -> Table:
    import h5py

    with h5py.File(path, "r") as file:
        matlab = file.userblock_size > 0
        if spec.rows and spec.rows.replace(".", "/") not in file:
            raise BadLog(f"{path}: no group or data set {spec.rows!r}{nearest(spec.rows, file)}")
        root = file[spec.rows.replace(".", "/")] if spec.rows else file
        if isinstance(root, h5py.Dataset):
            refuse_long(path, max(root.shape, default=0))
            values = root[()]
            if values.dtype.names:
                return of_vectors({name: values[name] for name in values.dtype.names}, spec)
            return of_matrix(path, values.T if matlab else values, spec)
        names: list[str] = []
        if matlab and all(_OBJECT_MARK in item.attrs for item in _variables(root)):
            raise BadLog(_objects(path))

        def visit(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset) and not name.startswith("#refs#"):
                refuse_long(path, item.size)
                names.append(name)

        root.visititems(visit)
        place = root.name

    def fetch(number: int) -> RawColumn:
        with h5py.File(path, "r") as file:
            values = np.atleast_1d(np.asarray(file[place][names[number]][()])).ravel()
        return values[spec.skip_rows :] if values.size > 1 else values

    return Table(tuple(names), fetch, 1 + spec.skip_rows)


def _variables(root: Any) -> list[Any]:
    """The variables of a MAT file of version 7.3; those that begin with "#" are MATLAB's own."""
    return [root[name] for name in root if not name.startswith("#")]


def _objects(path: Path) -> str:
    return (
        f"{path}: holds a MATLAB object (a timetable or table), which only MATLAB reads; there,"
        " write it by writetimetable(TT, 'log.csv'), or S = table2struct(timetable2table(TT),"
        " 'ToScalar', true) with S.Time = seconds(S.Time) and save('log.mat', '-struct', 'S')"
    )


def _read_json(path: Path, spec: FileSpec) -> Table:
    refuse_larger(path, JSON_BYTES, "a JSON log", BadLog)
    try:
        text = path.read_text(encoding=spec.encoding)
        content = json.loads(text.removeprefix("\ufeff"))
    except UnicodeDecodeError as error:
        raise damaged(path, "json", error) from None
    except json.JSONDecodeError as error:
        raise _no_json(path, text, error) from None
    outer = content if isinstance(content, dict) else {}
    rows = content
    for key in spec.rows.split(".") if spec.rows else ():
        try:
            rows = entry(rows, key)
        except LookupError:
            there = rows if isinstance(rows, dict) else ()
            raise BadLog(
                f"{path}: no key {spec.rows!r} for the rows{nearest(key, there)}"
            ) from None
    if isinstance(rows, dict):
        return of_vectors(vectors_of(rows), spec)
    if not isinstance(rows, list) or not rows:
        raise BadLog(f"{path}: holds no list of rows; name its key in the card, [file] rows")
    scalars = {k: np.asarray([v]) for k, v in outer.items() if not isinstance(v, list | dict)}
    return _records(path, rows, scalars, spec)


def _no_json(path: Path, text: str, error: json.JSONDecodeError) -> BadLog:
    """The one-line error for a text that is no JSON: cut off, lines of JSON, or wrong somewhere."""
    if error.msg == "Extra data" and text[: error.pos].count("\n") == 1:
        return BadLog(
            f"{path}: holds one JSON value a line (JSON Lines), which is not read; write the lines"
            " as one list, [a, b, ...], or its numbers as CSV"
        )
    if error.pos >= len(text.rstrip()) or error.msg.startswith("Unterminated"):
        return BadLog(
            f"{path}: the JSON ends in the middle (line {error.lineno}), damaged or cut off; copy"
            " it again"
        )
    return BadLog(
        f"{path}: line {error.lineno}, column {error.colno} is no JSON ({error.msg}); correct it"
        " there, or write the columns as CSV"
    )


def _records(path: Path, rows: list[Any], scalars: dict[str, RawColumn], spec: FileSpec) -> Table:
    if isinstance(rows[0], dict):
        return of_vectors({**dict(records("", rows)), **scalars}, spec)
    for number, row in enumerate(rows, start=1):
        if not isinstance(row, list) or len(row) != len(rows[0]):
            raise BadLog(f"{path}: row {number} has not the length of row 1 ({len(rows[0])})")
    return of_matrix(path, np.asarray(rows), spec)


def read_numpy(path: Path, spec: FileSpec) -> Table:
    """The columns of an array, of its named fields, or of an archive's arrays.

    `rows` of the spec names one array of an archive. Raises BadLog, one line, where an array holds
    Python objects, or none holds rows and columns.
    """
    refuse_larger(path, BINARY_BYTES, "a NumPy file", BadLog)
    try:
        loaded = np.load(path, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            return _table(path, loaded, spec)
        with loaded as archive:
            found = {name: archive[name] for name in archive.files}
    except ValueError as error:
        if "allow_pickle" not in str(error):
            raise
        raise BadLog(
            f"{path}: holds Python objects (an array of dtype object), which are never unpickled;"
            " save the numbers alone: np.save(file, np.asarray(rows, dtype=float))"
        ) from None
    return _of_archive(path, found, spec)


def _of_archive(path: Path, found: dict[str, RawColumn], spec: FileSpec) -> Table:
    if spec.rows:
        if spec.rows not in found:
            raise BadLog(f"{path}: no array {spec.rows!r}{nearest(spec.rows, found)}")
        return _table(path, found[spec.rows], spec)
    vectors = {name: np.atleast_1d(np.squeeze(x)) for name, x in found.items()}
    flat = {name: x for name, x in vectors.items() if x.ndim == 1}
    long = max((x.size for x in flat.values()), default=0)
    matrices = [x for x in vectors.values() if x.ndim == 2]
    if matrices and long < max(max(x.shape) for x in matrices):
        return _table(path, max(matrices, key=lambda x: x.size), spec)
    for name, x in vectors.items():
        refuse_long(path, max(x.shape, default=0))
        if x.ndim == 2 and long in x.shape:  # a row, or a column, an axis
            each = x if x.shape[1] == long else x.T
            flat |= {f"{name}_{k}": row for k, row in enumerate(each)}
    return of_vectors(flat, spec)


def _table(path: Path, values: RawColumn, spec: FileSpec) -> Table:
    refuse_long(path, max(values.shape, default=0))
    if values.dtype.names:
        return of_vectors({name: values[name] for name in values.dtype.names}, spec)
    return of_matrix(path, np.squeeze(values), spec)
