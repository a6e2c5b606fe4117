"""Files as tables of columns, in the format that their first bytes say, else their name.

A table hands out raw columns (numbers or text) by name or by number from 0. What foreign readers
raise on damaged files becomes BadLog in one line.
"""

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar, get_args

import numpy as np

from design.machine.nearest import nearest
from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec, Format
from workbench.files import broken_link, refuse_larger, refuse_special
from workbench.logs.channels import read_mdf, read_tdms, read_ulog
from workbench.logs.clocks import named_in_turn
from workbench.logs.excel import read_excel
from workbench.logs.messages import read_bag, read_mcap
from workbench.logs.packed import GZIP, ZIP, text_bytes
from workbench.logs.table import (
    BINARY_BYTES,
    WIDEST_ARRAY,
    RawColumn,
    Table,
    damaged,
    of_array,
    of_tree,
    of_vectors,
    plain_tree,
    records,
    refuse_long,
    tags_are_sound,
)
from workbench.logs.text import read_text_table

_OBJECT_MARK = "MATLAB_object_decode"  # attribute of an object in a MAT file of version 7.3
Value = TypeVar("Value")
JSON_BYTES = 100_000_000  # of text; as Python's values it takes ten times that

HDF5_MAGIC = b"\x89HDF"
"""How HDF5 begins, from byte 512 on where MATLAB wrote it."""

_OLE = b"\xd0\xcf\x11\xe0"
_PACKED = {
    b"BZh": "compressed by bzip2; unpack it (bunzip2) and give the file in it",
    b"\xfd7zXZ": "compressed by xz; unpack it (unxz) and give the file in it",
    _OLE: "an old Excel workbook; save its sheet as CSV",
}
_MAGIC: Mapping[Format, tuple[bytes, ...]] = {  # how files begin
    "parquet": (b"PAR1",),
    "mat": (b"MATLAB",),
    "hdf5": (HDF5_MAGIC,),
    "tdms": (b"TDSm",),
    "mdf": (b"MDF     ", b"UnFinMF "),
    "mcap": (b"\x89MCAP0\r\n",),
    "ulog": (b"ULog\x01\x12\x35",),
    "npy": (b"\x93NUMPY",),
    "rosbag": (b"#ROSBAG V2.0",),
}
_SUFFIXES: Mapping[Format, tuple[str, ...]] = {  # beside the format's own name
    "hdf5": (".h5",),
    "mdf": (".mf4",),
    "ulog": (".ulg",),
    "excel": (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods"),
    "npy": (".npz",),
    "rosbag": (".bag",),
}
_JSON = re.compile(rb"\s*(\{\s*[\"}]|\[\s*([\[{\"\d\]-]|true|false|null))")  # "[Name]" is a text's


def checked_format(path: Path, spec: FileSpec) -> Format:
    """The file's format, as the card says or found; raises BadLog where its bytes are not so."""
    head = head_of(path)
    form = spec.format or find_format(path, head)
    if form in _MAGIC and spec.format is None and path.suffix == ".csv":
        raise BadLog(
            f"{path}: is a binary {form} file named .csv; rename it, or give its format in the "
            "card's [file]"
        )
    _check_magic(path, form, head, spec)
    if form == "csv" and head.startswith((GZIP, ZIP)):
        inner = find_format(Path(path.stem), text_bytes(path, len(head)))
        if inner != "csv":
            raise BadLog(
                f"{path}: a {inner} file, packed; of packed files only text is read: unpack it"
            )
    return form


def find_format(path: Path, head: bytes) -> Format:
    """The format that the first bytes say, else the suffix, else CSV."""
    for form, magics in _MAGIC.items():
        if head.startswith(magics):
            return form
    for form in get_args(Format):
        own: Format = form
        if own != "csv" and path.suffix.lower() in (f".{own}", *_SUFFIXES.get(own, ())):
            return own
    return "json" if _JSON.match(head) else "csv"


def head_of(path: Path) -> bytes:
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
        book = form == "excel" and magic == _OLE
        if form in ("csv", "excel") and head.startswith(magic) and not book:
            raise BadLog(f"{path}: is {what}")
    is_text = all(32 <= byte < 127 or byte in b"\t\r\n" for byte in head)
    wrong = {
        # Of version 4 a MAT file has no such beginning.
        "mat": not head.startswith(b"MATLAB") and HDF5_MAGIC not in head and is_text,
        "hdf5": HDF5_MAGIC not in head,
        "json": head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] not in (b"{", b"["),
        "excel": not head.startswith((ZIP, _OLE)),
        "npy": not head.startswith((*_MAGIC["npy"], ZIP)),
    }
    if wrong.get(form, form in _MAGIC and not head.startswith(_MAGIC[form])):
        advice = "; copy it again or rename it"
        if spec.format is not None:
            advice = ", which the card's [file] format says; take it out, or copy it again"
        raise BadLog(f"{path}: is not a {form} file by its first bytes{advice}")


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

    def guarded(read: Callable[[], Value]) -> Value:
        try:
            return read()
        except BadLog:
            raise
        except Exception as error:  # damaged files make the readers raise nearly anything
            raise damaged(path, form, error) from error

    table = guarded(lambda: readers[form](path, spec))
    if form in ("excel", "json") or (form == "parquet" and _has_texts(path)):
        table = guarded(lambda: named_in_turn(table) or table)
    # Columns are read late, so damage may show only there.
    return replace(table, fetch=lambda number: guarded(lambda: table.fetch(number)))


def _has_texts(path: Path) -> bool:
    import pyarrow.parquet as pq

    return any("string" in str(kind) for kind in pq.read_schema(path).types)


def _read_parquet(path: Path, spec: FileSpec) -> Table:
    """Columns of numbers, and of lists of a few numbers a column each: "state[0]"."""
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    with pq.ParquetFile(path) as file:
        refuse_long(path, file.metadata.num_rows)
        lists = [one.name for one in file.schema_arrow if pa.types.is_nested(one.type)]
        first = next(file.iter_batches(1, columns=lists), None) if lists else None
        places = list[tuple[str, int | None]]()
        for name in map(str, file.schema_arrow.names):
            one = first.column(name)[0].as_py() if first is not None and name in lists else None
            wide = len(one) if isinstance(one, list) and len(one) <= WIDEST_ARRAY else 0
            places += [(name, k) for k in range(wide)] if name in lists else [(name, None)]

    def fetch(number: int) -> RawColumn:
        name, at = places[number]
        with pq.ParquetFile(path) as file:
            column = file.read(columns=[name]).column(name)
        column = column if at is None else pc.list_element(column, at)
        return np.asarray(column.to_numpy())[spec.skip_rows :]

    names = tuple(name if at is None else f"{name}[{at}]" for name, at in places)
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
    variables = {k: plain_tree(value) for k, value in content.items() if not k.startswith("__")}
    found = _part(path, variables, spec, f"no variable {spec.rows!r}")
    if isinstance(found, np.ndarray):
        return of_array(path, found, spec)
    return of_tree(found, spec)


def _part(path: Path, tree: Any, spec: FileSpec, missing: str) -> Any:
    """What stands at `spec.rows` in nested tables and lists; raises BadLog where nothing does."""
    for key in spec.rows.split(".") if spec.rows else ():
        if isinstance(tree, dict) and key in tree:
            tree = tree[key]
        elif isinstance(tree, list) and key.isdigit() and int(key) < len(tree):
            tree = tree[int(key)]
        else:
            there = tree if isinstance(tree, dict) else ()
            raise BadLog(f"{path}: {missing}{nearest(key, there)}")
    return tree


def _read_hdf5(path: Path, spec: FileSpec) -> Table:
    import h5py

    with h5py.File(path, "r") as file:
        matlab = file.userblock_size > 0
        if spec.rows and spec.rows.replace(".", "/") not in file:
            raise BadLog(f"{path}: no group or data set {spec.rows!r}{nearest(spec.rows, file)}")
        root = file[spec.rows.replace(".", "/")] if spec.rows else file
        if isinstance(root, h5py.Dataset):
            refuse_long(path, max(root.shape, default=0))
            return of_array(path, root[()].T if matlab else root[()], spec)
        columns = dict[str, tuple[str, int | None]]()
        variables = (root[name] for name in root if not name.startswith("#"))  # "#": MATLAB's own
        if matlab and all(_OBJECT_MARK in item.attrs for item in variables):
            raise BadLog(_objects(path))

        def visit(name: str, item: Any) -> None:
            if isinstance(item, h5py.Dataset) and not name.startswith("#refs#"):
                refuse_long(path, item.size)
                wide = min(item.shape) if len(item.shape) == 2 else 1
                if 1 < wide <= WIDEST_ARRAY:
                    columns.update({f"{name}[{k}]": (name, k) for k in range(wide)})
                else:
                    columns[name] = name, None

        root.visititems(visit)
        place = root.name

    def read(name: str) -> RawColumn:
        of, k = columns[name]
        with h5py.File(path, "r") as file:
            values = np.asarray(file[place][of][()])
        return values if k is None else np.take(values, k, axis=int(np.argmin(values.shape)))

    return of_vectors(tuple(columns), read, spec)


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
        text = text.removeprefix("\ufeff")
        content = json.loads(text)
    except UnicodeDecodeError as error:
        raise damaged(path, "json", error) from None
    except json.JSONDecodeError as error:
        content = _of_lines(text)
        if content is None:
            raise _no_json(path, text, error) from None
    rows = _part(path, content, spec, f"no key {spec.rows!r} for the rows")
    if isinstance(rows, dict):
        return of_tree(rows, spec)
    if not isinstance(rows, list) or not rows:
        raise BadLog(f"{path}: holds no list of rows; name its key in the card, [file] rows")
    if isinstance(rows[0], dict):
        outer = content.items() if isinstance(content, dict) else ()
        scalars = {k: np.asarray([v]) for k, v in outer if not isinstance(v, list | dict)}
        vectors = {**dict(records("", rows)), **scalars}
        return of_vectors(tuple(vectors), vectors.__getitem__, spec)
    for number, row in enumerate(rows, start=1):
        if not isinstance(row, list) or len(row) != len(rows[0]):
            raise BadLog(f"{path}: row {number} has not the length of row 1 ({len(rows[0])})")
    return of_array(path, np.asarray(rows), spec)


def _of_lines(text: str) -> list[Any] | None:
    """The rows of a text with one JSON value a line (JSON Lines), but for a last one that is cut
    off; None where it is no such text."""
    rows = list[Any]()
    lines = [line for line in text.splitlines() if line.strip()]
    for line in lines:
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            return rows if line is lines[-1] and len(rows) > 1 else None
    return rows


def _no_json(path: Path, text: str, error: json.JSONDecodeError) -> BadLog:
    """The one-line error for a text that is no JSON: cut off, or wrong somewhere."""
    if error.pos >= len(text.rstrip()) or error.msg.startswith("Unterminated"):
        return BadLog(
            f"{path}: the JSON ends in the middle (line {error.lineno}), damaged or cut off; copy"
            " it again"
        )
    return BadLog(
        f"{path}: line {error.lineno}, column {error.colno} is no JSON ({error.msg}); correct it"
        " there, or write the columns as CSV"
    )


def read_numpy(path: Path, spec: FileSpec) -> Table:
    """The columns of an array, of its named fields, or of an archive's arrays.

    `rows` of the spec names one array of an archive. Raises BadLog, one line, where an array holds
    Python objects, or none holds rows and columns.
    """
    refuse_larger(path, BINARY_BYTES, "a NumPy file", BadLog)
    try:
        loaded = np.load(path, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            return of_array(path, np.squeeze(loaded), spec)
        with loaded as archive:
            found = {name: archive[name] for name in archive.files}
    except ValueError as error:
        if "allow_pickle" not in str(error):
            raise
        raise BadLog(
            f"{path}: holds Python objects (an array of dtype object), which are never unpickled;"
            " save the numbers alone: np.save(file, np.asarray(rows, dtype=float))"
        ) from None
    if spec.rows:
        if spec.rows not in found:
            raise BadLog(f"{path}: no array {spec.rows!r}{nearest(spec.rows, found)}")
        return of_array(path, np.squeeze(found[spec.rows]), spec)
    vectors = {name: np.squeeze(x) for name, x in found.items()}
    longest = max(vectors.values(), key=lambda x: max(x.shape, default=0))
    refuse_long(path, max(longest.shape, default=0))
    return of_array(path, longest, spec) if longest.ndim == 2 else of_tree(vectors, spec)
