"""Text in which tables stand one below the other: a block for each variable of a PLC's trace.

Above each block a tool writes its variable: as "key;value", "key=value", in a row of names, or as a
line by itself. What differs from block to block is the name. A CODESYS trace numbers its keys
("1.Variable; speed") and begins its rows with the mark.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice, pairwise
from pathlib import Path

import numpy as np

from identification.errors import BadLog
from identification.signals.check import SHORTEST_LOG
from workbench.logs.layout import is_number
from workbench.logs.table import UNIT_KEYS, RawColumn, Table

FEWEST_BLOCKS = 2
PAIR = 2  # columns of a block of one variable: its clock, and its values
MOST_WORDS = 1000  # lines that begin with a letter, among which one is looked for that is no row
MOST_LETTERS = 100_000_000  # of a text that is looked through line by line
_TEXT_LINE = re.compile(r"\n[ \t]*[\[\"]?(?:\d+\.)?[^\W\d_]")
_ROW = r"[;,|\s]*[+-]?[\d.]+[^\n]*\n"
_NUMBERS_BEGIN = re.compile(f"^{_ROW}{_ROW}", re.M)
_NO_TEXT = re.compile(r"(nan|inf|infinity|eof)\b", re.I)  # what a row of numbers may begin with
_MARKS = (";", "\t", ",", " ", "|")
_KEY = re.compile(r"^\s*(?:\d+\.(?=[^\W\d]))?([^=:;\t,]{1,40}?)\s*[=:;\t,]\s*(.+?)\s*$")
_COUNTED = re.compile(r"\d+([.,]\d+)?")  # values that differ by chance: numbers of samples


@dataclass(frozen=True)
class Block:
    """A block: the lines above it, its first row from 0, its rows, and the sign between fields."""

    above: tuple[str, ...]
    first: int
    rows: tuple[str, ...]
    mark: str

    @property
    def width(self) -> int:
        return len(self.fields(self.rows[0]))

    @cached_property
    def begins(self) -> int:
        """Fields without a value before the first of every row: 1 where all begin with the mark."""
        return int(all(row.lstrip(" ").startswith(self.mark) for row in self.rows))

    def fields(self, row: str) -> list[str]:
        """The fields of one of its rows."""
        return _fields(row, self.mark)[self.begins :]


def blocks_of(text: str) -> list[Block]:
    """The blocks of a text, none where it is one table or no table at all."""
    if len(text) > MOST_LETTERS or not _may_have_blocks(text):
        return []
    lines = text.splitlines()
    mark = _mark(lines)
    found, above, rows, first = list[Block](), list[str](), list[str](), 0

    def close() -> None:
        nonlocal above, rows
        if len(rows) >= SHORTEST_LOG:
            found.append(Block(tuple(above), first, tuple(rows), mark))
            above, rows = [], []
        elif rows:
            above, rows = [*above, *rows], []

    for number, line in enumerate(lines):
        if _is_row(line, mark):
            first = first if rows else number
            rows.append(line)
        elif line.strip():
            close()
            above.append(line)
    close()
    return found if len(found) >= FEWEST_BLOCKS and not _goes_on(found) else []


def _goes_on(blocks: Sequence[Block]) -> bool:
    """Whether one table goes on below lines that are no rows, as a logger's messages: without names
    of their own, by a clock that goes on."""
    if any(_heads(one) or one.width != blocks[0].width for one in blocks[1:]):
        return False
    ends = [[one.fields(row)[0] for row in (one.rows[0], one.rows[-1])] for one in blocks]
    if not all(cell for pair in ends for cell in pair):
        return False
    times = [[float(cell.replace(",", ".")) for cell in pair] for pair in ends]
    return all(one[1] < after[0] < after[1] for one, after in pairwise(times))


def are_runs(blocks: Sequence[Block]) -> bool:
    """Whether the blocks have one header: then they are runs, and not variables."""
    heads = {tuple(_heads(one)) for one in blocks}
    return len(heads) == 1 and heads != {()} and any(one.width > PAIR for one in blocks)


def block_table(path: Path, blocks: Sequence[Block], decimal: str | None) -> Table:
    """The columns of the blocks, a group each: its clock, and its variables; decimal: the sign of
    numbers, None: by looking.

    Raises BadLog where the blocks are of the same names, and not of the same columns.
    """
    called = [_own_names(blocks, k) for k in range(len(blocks))]
    if len(set(called)) < len(called):
        raise BadLog(
            f"{path}: holds {len(blocks)} tables one below the other, of the same columns (rows"
            f" again from line {blocks[1].first + 1}): several runs, it seems; give each a file"
        )
    middle = blocks[0].rows[len(blocks[0].rows) // 2]
    sign = decimal or ("," if "," in middle and blocks[0].mark != "," else ".")
    columns, clocks = list[tuple[str, str, Block, int]](), dict[str, int]()
    for k, (block, own) in enumerate(zip(blocks, called, strict=True)):
        group = own if own not in clocks else f"{own} {k + 1}"
        heads = _heads(block)
        clocks[group] = len(columns)
        for column in range(block.width):
            if column == 0:
                name = heads[0] if heads else "time"
            elif block.width == PAIR:
                name = own + _unit(block)
            else:
                name = heads[column] if heads else f"{own} {column}"
            columns.append((name, group, block, column))
    names, groups, *_ = zip(*columns, strict=True)

    def fetch(number: int) -> RawColumn:
        *_, one, column = columns[number]
        cells = (one.fields(row)[column] for row in one.rows)
        return np.array([float(cell.replace(sign, ".")) if cell else np.nan for cell in cells])

    return Table(names, fetch, blocks[0].first + 1, True, groups, clocks)


def _may_have_blocks(text: str) -> bool:
    """Whether a line that is no row stands below rows of numbers; at little cost for long files."""
    begin = _NUMBERS_BEGIN.search(text)
    if begin is None:
        return False
    lines = islice(_TEXT_LINE.finditer(text, begin.end() - 1), MOST_WORDS)
    return any(not _NO_TEXT.match(text, one.end() - 1) for one in lines)


def _mark(lines: Sequence[str]) -> str:
    """The sign between fields by which most lines are rows of two numbers or more."""
    part = lines[: 40 * SHORTEST_LOG : max(1, len(lines) // 400)]
    return max(_MARKS, key=lambda mark: sum(_is_row(line, mark) for line in part))


def _fields(line: str, mark: str) -> list[str]:
    parts = line.split() if mark == " " else line.rstrip("\r\n").split(mark)
    return [one.strip() for one in parts]


def _is_row(line: str, mark: str) -> bool:
    fields = _fields(line, mark)
    full = [one for one in fields if one]
    return len(full) > 1 and all(map(is_number, full))


def _heads(block: Block) -> list[str]:
    """The names in the row right above a block, none where it is no row of names."""
    last = _fields(block.above[-1], block.mark) if block.above else []
    return last if len(last) == block.width and all(last) else []


def _own_names(blocks: Sequence[Block], k: int) -> str:
    """What the lines above a block say that those above the others do not."""
    own = _keyed(blocks[k])
    others = [_keyed(one) for j, one in enumerate(blocks) if j != k]
    for key, value in own.items():
        if key.lower() in UNIT_KEYS:
            continue
        if not _COUNTED.fullmatch(value) and all(
            other.get(key, value) != value for other in others
        ):
            return value
    heads = _heads(blocks[k])
    if heads and all(_heads(one) != heads for j, one in enumerate(blocks) if j != k):
        return heads[-1]
    plain = [line.strip().strip("[]#; ") for line in blocks[k].above]
    elsewhere = {line.strip().strip("[]#; ") for j, one in enumerate(blocks) if j != k
                 for line in one.above}  # fmt: skip
    return next((line for line in plain[::-1] if line and line not in elsewhere), "")


def _unit(block: Block) -> str:
    """The unit that a line above a block gives, in brackets."""
    found = next((value for key, value in _keyed(block).items() if key.lower() in UNIT_KEYS), "")
    return f" [{found.strip('[]()')}]" if found else ""


def _keyed(block: Block) -> dict[str, str]:
    """The lines "key;value" or "key=value" above a block."""
    found = (_KEY.match(line.strip().strip("#")) for line in block.above)
    return {one[1]: one[2].strip("\"'") for one in found if one}
