"""How a command ends: its exit status, given in its help, and the command to type next."""

import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from os import PathLike
from typing import Any, NamedTuple

import click

from identification.errors import NotIdentifiable

DONE = "done"
REFUSAL = "done, and the answer is a refusal or an alarm; it ends with the next command"
BAD_INPUT = "bad input: one line says what was found, where, what is needed, what to do"
FAULT = "a fault of ours; --debug shows where"
TAKES_EFFECTS = ("trace", "predict", "design", "validate", "experiment", "drift", "response")


class StatusCommand(click.Command):
    """A command whose help ends with its exit status; refusal: what 1 means, "" where it has none.

    done: what 0 means.
    """

    def __init__(self, *given: Any, refusal: str = "", done: str = DONE, **named: Any) -> None:
        super().__init__(*given, **named)
        self.refusal, self.done = refusal, done

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The exit status, then the example."""
        rows = [("0", self.done), ("1", self.refusal), ("2", BAD_INPUT), ("3", FAULT)]
        write_status(formatter, [row for row in rows if row[1]])
        super().format_epilog(ctx, formatter)


class StatusGroup(click.Group):
    """A command of several; each of them gives its exit status."""

    command_class = StatusCommand


def write_status(formatter: click.HelpFormatter, rows: list[tuple[str, str]]) -> None:
    """The section of a help page on the exit status."""
    with formatter.section("Exit status"):
        formatter.write_dl(rows)


class Step(NamedTuple):
    """A command line to type next, and why."""

    why: str
    command: str

    def __str__(self) -> str:
        return f"next ({self.why}): {self.command}"

    def lines(self, width: int, most: int | None = None) -> list[str]:
        """The step in lines of so many columns, that a shell takes as they stand.

        A word is never broken, so that a long path may stick out. most: lines that are printed; of
        a longer one, as of 40 logs, the middle is left out.
        """
        if len(str(self)) <= width:
            return [str(self)]
        out = [f"next ({self.why}):"]
        for word in map(shlex.quote, shlex.split(self.command)):
            if len(out) > 1 and len(out[-1]) + len(word) + 3 <= width:
                out[-1] += f" {word}"
            else:
                out.append(f"    {word}")
        left = 0 if most is None else len(out) - most
        if most is not None and left > 0:
            cut = f"    ... ({left + 1} lines of it: --verbose)"
            return [*_continued(out[: most - 2]), cut, out[-1]]
        return [out[0], *_continued(out[1:-1]), out[-1]]


def _continued(lines: list[str]) -> list[str]:
    """The lines, each but the first of a step going on in the next one."""
    return [line if line.startswith("next (") else f"{line} \\" for line in lines]


def step(why: str, command: str | None, *words: str | PathLike[str] | None) -> Step:
    """The step of these words after `workbench`, quoted for a shell; those that are None fall.

    The folders of effects go on to a command that takes them, since a model may need them.
    """
    every = ["workbench", *(str(word) for word in (command, *words) if word is not None)]
    running = click.get_current_context(silent=True)
    if running is not None and command in TAKES_EFFECTS:
        given = running.params.get("effects") or ()
        every += [word for one in given for word in ("--effects", str(one))]
    return Step(why, shlex.join(every))


class Refused(NotIdentifiable):
    """A refusal that knows what to type next."""

    def __init__(self, reason: str, then: Step) -> None:
        super().__init__(reason)
        self.then = then


@contextmanager
def refused_with(then: Callable[[str], Step]) -> Iterator[None]:
    """Within the block a refusal becomes one that says `then(its reason)` as the next step."""
    try:
        yield
    except NotIdentifiable as error:
        raise Refused(str(error), then(str(error))) from error
