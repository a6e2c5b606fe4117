"""One screen: what a command shows in at most 40 lines of 100 columns, and what --verbose adds."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from rich.padding import Padding
    from rich.text import Text

Row = tuple[str, ...]
Command = TypeVar("Command", bound=Callable[..., Any])

SCREEN_LINES, SCREEN_WIDTH = 40, 100
VERBOSE, JSON = "--verbose", "--json"
CELL_LINE = 40  # characters of a table's cell for each line that a text may have
# How a screen that is too full is made to fit, step by step: the lines that a text may have, the
# entries to which a list is cut at most, and whether only lists that yield are cut.
TIGHTER = ((8, 1, True), (8, 3, False), (4, 2, False), (2, 1, False), (1, 0, False))


def shared_options(command: Command, json: str = "Print the result as JSON.") -> Command:
    """The options of every command: whoever prints asks for them, so no function takes them."""
    said = {"--debug": "", VERBOSE: "Print all there is to say, not one screen of it.", JSON: json}
    for name, text in said.items():
        command = click.option(
            name, is_flag=True, expose_value=False, callback=_noted, help=text, hidden=not text
        )(command)
    return command


def _noted(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    ctx.meta[f"workbench{param.opts[0]}"] = value


def is_given(name: str) -> bool:
    """Whether the command that runs has this one of `shared_options`."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(f"workbench{name}"))


@dataclass(frozen=True)
class Part:
    """Texts, or rows of a table: `entries` on one screen, `whole` with --verbose.

    head, right: of a table, its head and its columns of numbers; most: entries shown at most on one
    screen; latest: of a list that is cut the last ones are shown; yields: it is cut before others;
    whole_head: the head with --verbose, where it is another; merged: what a notebook shows in place
    of `whole`.
    """

    entries: Sequence[str] | Sequence[Row]
    whole: Sequence[str] | Sequence[Row]
    head: Row = ()
    right: Sequence[int] = (1,)
    most: int = SCREEN_LINES
    latest: bool = False
    yields: bool = False
    whole_head: Row = ()
    merged: Sequence[Any] = ()

    @property
    def full_head(self) -> Row:
        """Head of the table with --verbose."""
        return self.whole_head or self.head


def listed(texts: Iterable[str], most: int = SCREEN_LINES) -> Part:
    """A list of texts, of which one screen has the first ones."""
    every = tuple(texts)
    return Part(every, every, most=most)


def tabled(
    head: Sequence[str], rows: Iterable[Row], right: Sequence[int] = (1,), *,
    most: int = SCREEN_LINES, latest: bool = False, whole: Iterable[Row] | None = None,
) -> Part:  # fmt: skip
    """A table, of which one screen has the first rows, or the latest.

    whole: the rows with --verbose, where they are others.
    """
    every = tuple(rows)
    full = every if whole is None else tuple(whole)
    return Part(every, full, tuple(head), right, most, latest)


def more(part: Part | str) -> Part:
    """What is printed with --verbose alone."""
    if isinstance(part, str):
        return Part((), (part,))
    return Part((), part.whole, part.head, part.right)


def instead(
    first: Iterable[str], whole: Iterable[str], most: int = SCREEN_LINES, *, yields: bool = False
) -> Part:
    """Texts for one screen, and others that stand in their place with --verbose."""
    return Part(tuple(first), tuple(whole), most=most, yields=yields)


@dataclass(frozen=True)
class Screen:
    """The parts of what a command shows, in their order; a text is a part that is never cut out."""

    parts: tuple[Part | str, ...]

    def text(
        self, width: int | None = SCREEN_WIDTH, *, verbose: bool = False,
        room: int = SCREEN_LINES, rest: str = VERBOSE,
    ) -> str:  # fmt: skip
        """The screen as text; width: columns, None: this terminal's, on one screen at most 100.

        verbose: all of it; room: lines of a screen; rest: what shows the rest.
        """
        parts = [one if isinstance(one, Part) else listed([one]) for one in self.parts]
        if verbose:
            shown = [
                line for one in parts for line in _lines(one.full_head, one.right, one.whole, width)
            ]
        else:
            shown = _fitted([one for one in parts if one.entries], width, room, rest)
        return "".join(f"{line}\n" for line in shown)

    def __rich__(self) -> "Text":
        from rich.text import Text

        return Text(self.text().rstrip("\n"))


def screen(*parts: Part | str) -> Screen:
    """The parts as a screen."""
    return Screen(parts)


def as_text(shown: object, width: int | None = SCREEN_WIDTH) -> str:
    """A text, or anything rich can show, as a terminal of that width does; None: as this one."""
    from rich.console import Console

    # No markup: "[m/s]" is a unit here, not a style.
    console = Console(
        markup=False, highlight=False, emoji=False, width=width, force_jupyter=False
    )  # fmt: skip
    with console.capture() as captured:
        console.print(shown)
    return captured.get()


def table(head: Sequence[str], rows: Iterable[Row], right: Sequence[int] = (1,)) -> "Padding":
    """A plain table for a terminal, a blank line above it; right: the columns of numbers."""
    from rich.box import SIMPLE_HEAD
    from rich.padding import Padding
    from rich.table import Table

    out = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False, collapse_padding=True)
    for number, name in enumerate(head):
        out.add_column(name, justify="right" if number in right else "left", overflow="fold")
    for row in rows:
        out.add_row(*row)
    return Padding(out, (1, 0, 0, 0))


def _fitted(parts: Sequence[Part], width: int | None, room: int, rest: str) -> list[str]:
    """The lines of the parts, at most `room`: the longest list is cut first."""
    counts = [min(len(one.entries), one.most) for one in parts]
    blocks: list[list[str]] = []
    for tall, few, yielding in TIGHTER:

        def block(i: int, tall: int = tall) -> list[str]:
            return _cut(parts[i], counts[i], width, tall, rest)

        blocks = [block(i) for i in range(len(parts))]
        while sum(map(len, blocks)) > room:
            longest = [
                i for i, one in enumerate(parts)
                if counts[i] > few and len(one.entries) > 1 and (one.yields or not yielding)
            ]  # fmt: skip
            if not longest:
                break
            i = max(longest, key=lambda i: len(blocks[i]))
            counts[i] = max(counts[i] - max(1, (counts[i] - few) // 8), few)
            blocks[i] = block(i)
        else:
            _fill(parts, counts, blocks, room, block)
            return [line for block in blocks for line in block]
    flat = [line for block in blocks for line in block]
    return [*flat[: room - 1], f"... and more: {rest}"] if len(flat) > room else flat


def _fill(
    parts: Sequence[Part], counts: list[int], blocks: list[list[str]], room: int,
    block: Callable[[int], list[str]],
) -> None:  # fmt: skip
    """Show again what fits after all, as the last entry in place of "and 1 more"."""
    for i, one in enumerate(parts):
        while counts[i] < min(len(one.entries), one.most):
            counts[i] += 1
            fuller = block(i)
            if sum(map(len, blocks)) - len(blocks[i]) + len(fuller) > room:
                counts[i] -= 1
                break
            blocks[i] = fuller


def _cut(part: Part, count: int, width: int | None, tall: int, rest: str) -> list[str]:
    """The lines of so many entries, and how many there are beside them."""
    entries = part.entries[-count or len(part.entries) :] if part.latest else part.entries[:count]
    left = len(part.entries) - count
    out = _lines(part.head, part.right, entries if count else (), width, tall)
    return [*out, f"... and {left} {'earlier' if part.latest else 'more'}: {rest}"] if left else out


def _lines(
    head: Row, right: Sequence[int], entries: Sequence[str] | Sequence[Row], width: int | None,
    tall: int | None = None,
) -> list[str]:  # fmt: skip
    """A table's lines, or those of its texts; tall: lines that a text may have."""
    if not entries:
        return []
    if head:
        most = None if tall is None else CELL_LINE * tall
        rows = [tuple(_short(cell, most) for cell in one) for one in entries]
        return _stripped(as_text(table(head, rows, right), width))
    out = list[str]()
    for one in (text for text in entries if isinstance(text, str)):
        short = one.isascii() and "\n" not in one and len(one) <= (width or SCREEN_WIDTH)
        lines = [one.rstrip()] if short else _stripped(as_text(one, width))
        if tall is not None and len(lines) > tall:
            lines = [*lines[: tall - 1], f"{lines[tall - 1][: (width or SCREEN_WIDTH) - 4]} ..."]
        out += lines
    return out


def _short(cell: str, most: int | None) -> str:
    return cell if most is None or len(cell) <= most else f"{cell[: most - 4]} ..."


def _stripped(text: str) -> list[str]:
    return [line.rstrip() for line in text.removesuffix("\n").split("\n")]
