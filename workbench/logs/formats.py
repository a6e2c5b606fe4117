"""The format of a log file, by its first bytes, else by its name."""

import re
from collections.abc import Mapping
from pathlib import Path

from identification.errors import BadLog
from workbench.cards.card_tables import FileSpec, Format
from workbench.cards.nearest import nearest
from workbench.files import broken_link, refuse_special

HDF5_MAGIC = b"\x89HDF"
"""How HDF5 begins, from byte 512 on where MATLAB wrote it."""

_ZIP, _OLE = b"PK\x03\x04", b"\xd0\xcf\x11\xe0"
_PACKED = {
    b"\x1f\x8b": "compressed by gzip; unpack it (gunzip) and give the file in it",
    b"BZh": "compressed by bzip2; unpack it (bunzip2) and give the file in it",
    b"\xfd7zXZ": "compressed by xz; unpack it (unxz) and give the file in it",
    _ZIP: "a zip archive or an Excel workbook; unpack it, or save its sheet as CSV",
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
_SUFFIXES: Mapping[str, Format] = {
    ".parquet": "parquet",
    ".mat": "mat",
    ".h5": "hdf5",
    ".hdf5": "hdf5",
    ".json": "json",
    ".tdms": "tdms",
    ".mdf": "mdf",
    ".mf4": "mdf",
    ".mcap": "mcap",
    ".ulg": "ulog",
    ".xlsx": "excel",
    ".xlsm": "excel",
    ".xlsb": "excel",
    ".xls": "excel",
    ".ods": "excel",
    ".npy": "npy",
    ".npz": "npy",
    ".bag": "rosbag",
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
    return form


def find_format(path: Path, head: bytes) -> Format:
    """The format that the first bytes say, else the suffix, else CSV."""
    for form, magics in _MAGIC.items():
        if head.startswith(magics):
            return form
    suffix = path.suffix.lower()
    if suffix not in _SUFFIXES and _JSON.match(head):
        return "json"
    return _SUFFIXES.get(suffix, "csv")


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
        book = form == "excel" and magic in (_ZIP, _OLE)
        if form in ("csv", "excel") and head.startswith(magic) and not book:
            raise BadLog(f"{path}: is {what}")
    wrong = {
        # Of version 4 a MAT file has no such beginning.
        "mat": not head.startswith(b"MATLAB") and HDF5_MAGIC not in head and _is_text(head),
        "hdf5": HDF5_MAGIC not in head,
        "json": head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] not in (b"{", b"["),
        "excel": not head.startswith((_ZIP, _OLE)),
        "npy": not head.startswith((*_MAGIC["npy"], _ZIP)),
    }
    if wrong.get(form, form in _MAGIC and not head.startswith(_MAGIC[form])):
        advice = "; copy it again or rename it"
        if spec.format is not None:
            advice = ", which the card's [file] format says; take it out, or copy it again"
        raise BadLog(f"{path}: is not a {form} file by its first bytes{advice}")


def _is_text(head: bytes) -> bool:
    return all(32 <= byte < 127 or byte in b"\t\r\n" for byte in head)
