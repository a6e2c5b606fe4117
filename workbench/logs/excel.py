"""Excel and OpenDocument workbooks, read by calamine; macros and formulas are never run."""

import zipfile
from datetime import date, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from design.machine.nearest import nearest
from identification.columns.header import NUMBER
from identification.errors import BadLog
from identification.signals.check import SHORTEST_LOG
from workbench.cards.card_tables import FileSpec
from workbench.files import refuse_larger
from workbench.logs.channels import optional
from workbench.logs.layout import Layout, find_layout
from workbench.logs.table import RawColumn, Table, refuse_long

_BOOK_BYTES = 100_000_000
_UNPACKED = 1_000_000_000  # of the sheets in it
_ROWS_READ = 200  # rows in which the header is looked for


def read_excel(path: Path, spec: FileSpec) -> Table:
    """The sheet `spec.rows`, by default the first with a table; its header below whatever stands
    above it."""
    refuse_larger(path, _BOOK_BYTES, "a workbook", BadLog)
    library = optional("python_calamine", "excel", path)
    _refuse_unpacked(path)
    wanted, rows, remarks = _sheet(library, path, spec)
    refuse_long(path, len(rows))
    shown = _first_rows(rows, spec)
    found = find_layout(shown) if spec.header is None else None
    if found is None:
        titles = tuple(shown[0]) if shown and spec.header is not False else ()
        found = Layout(titles, int(bool(titles)))
    first = spec.skip_rows + found.data
    if first >= len(rows):
        raise BadLog(f"{path}: sheet {wanted!r} has no rows of data; name the right one in [file]")
    names = list(found.names or map(str, range(len(rows[first]))))
    return Table(
        tuple(names),
        lambda number: _column(rows[first:], number),
        first + 1,
        bool(found.names),
        found.groups,
        units=found.units,
        remarks=remarks,
    )


def _sheet(
    library: Any, path: Path, spec: FileSpec
) -> tuple[str, list[list[Any]], tuple[str, ...]]:
    """Name and cells of the sheet, and what is said of it; where none is named the first that holds
    a table, or the first at all."""
    try:
        with library.load_workbook(str(path)) as book:
            names = [str(one) for one in book.sheet_names]
            if spec.rows is not None and spec.rows not in names:
                raise BadLog(f"{path}: no sheet {spec.rows!r}{nearest(spec.rows, names)}")
            first = names[0] if spec.rows is None else spec.rows
            for name in names if spec.rows is None else ():
                rows = _cells(book, name)
                if len(rows) >= SHORTEST_LOG and find_layout(_first_rows(rows, spec)) is not None:
                    said = f"read from sheet {name!r}, the first with a table"
                    return name, rows, (said,) if name != first else ()
            return first, _cells(book, first), ()
    except BaseException as error:
        if type(error).__name__ == "PanicException":  # of Rust, on a broken file
            raise ValueError(str(error)) from None
        raise


def _cells(book: Any, name: str) -> list[list[Any]]:
    """The rows of a sheet, without the empty ones at its end."""
    rows: list[list[Any]] = book.get_sheet_by_name(name).to_python(skip_empty_area=False)
    while rows and not _shown(rows[-1]):
        rows.pop()
    return rows


def _first_rows(rows: list[list[Any]], spec: FileSpec) -> list[list[str]]:
    """The rows in which the header is looked for, as texts."""
    return [_shown(row) for row in rows[spec.skip_rows : spec.skip_rows + _ROWS_READ]]


def _refuse_unpacked(path: Path) -> None:
    if not zipfile.is_zipfile(path):  # an old workbook
        return
    with zipfile.ZipFile(path) as archive:
        size = sum(entry.file_size for entry in archive.infolist())
    if size > _UNPACKED:
        raise BadLog(
            f"{path}: unpacks to {size / 1e6:.4g} MB, at most {_UNPACKED / 1e6:g} are read; save"
            " its sheet as CSV"
        )


def _shown(row: list[Any]) -> list[str]:
    """The cells as texts; none where all are empty."""
    texts = ["" if cell is None else str(cell).strip() for cell in row]
    return texts if any(texts) else []


def _column(rows: list[list[Any]], number: int) -> RawColumn:
    """A column's cells, numbers that are text with a decimal point."""
    cells = [row[number] if number < len(row) else None for row in rows]
    texts = [isinstance(cell, str) and NUMBER.fullmatch(cell.strip()) for cell in cells]
    cells = [one[0].replace(",", ".") if one else x for x, one in zip(cells, texts, strict=True)]
    if any(isinstance(cell, str | date | time | timedelta) and cell != "" for cell in cells):
        return np.asarray(cells, dtype=object)
    return np.asarray([np.nan if cell in ("", None) else float(cell) for cell in cells])
