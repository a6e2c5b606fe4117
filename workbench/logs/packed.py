"""Text logs packed by gzip, or alone in a zip archive: unpacked as they are read."""

import gzip
import zipfile
import zlib
from contextlib import nullcontext
from pathlib import Path

from identification.errors import BadLog

TEXT_BYTES = 400_000_000
"""Bytes of a text log, unpacked; three times that is needed to read it."""

GZIP, ZIP = b"\x1f\x8b", b"PK\x03\x04"
_BOOK = "[Content_Types].xml"  # in every Excel workbook
_SHOWN = 3  # names of files in an archive


def text_bytes(path: Path, most: int | None = None) -> bytes:
    """The bytes of a text log, at most the first `most`; unpacked where it is packed.

    Raises BadLog, one line, where it holds more than `TEXT_BYTES`, an archive has not one file, or
    what is packed is damaged.
    """
    with path.open("rb") as file:
        magic = file.read(len(ZIP))
        file.seek(0)
        limit = TEXT_BYTES + 1 if most is None else most
        if not magic.startswith((GZIP, ZIP)):
            return file.read(limit)
    try:
        with (
            zipfile.ZipFile(path) if magic.startswith(ZIP) else nullcontext() as archive,
            archive.open(_only(path, archive)) if archive else gzip.open(path) as packed,
        ):
            content: bytes = packed.read(limit)
    except (OSError, EOFError, RuntimeError, NotImplementedError, zlib.error,
            zipfile.BadZipFile) as error:  # fmt: skip
        text = " ".join(str(error).split())[:120]
        what = "gzip" if magic.startswith(GZIP) else "a zip archive"
        raise BadLog(
            f"{path}: cannot be unpacked as {what} ({text}); copy it again, or unpack it yourself"
        ) from None
    if len(content) > TEXT_BYTES:
        raise BadLog(
            f"{path}: unpacks to more than {TEXT_BYTES / 1e6:g} MB, a text log at most that; give a"
            " part of it"
        )
    return content


def _only(path: Path, archive: zipfile.ZipFile) -> str:
    """Name of the only file in an archive; raises BadLog where it holds several, or a workbook."""
    names = [one.filename for one in archive.infolist() if not one.is_dir()]
    if _BOOK in names:
        raise BadLog(f"{path}: is an Excel workbook by its content; name it .xlsx")
    if len(names) != 1:
        shown = ", ".join(names[:_SHOWN]) + (", ..." if len(names) > _SHOWN else "")
        raise BadLog(
            f"{path}: is a zip archive of {len(names)} files ({shown}), of one it would be read;"
            " unpack it and give the log's file"
        )
    return names[0]
