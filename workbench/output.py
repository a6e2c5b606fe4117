"""What every command writes and shows: folders written whole, strict JSON, a screen, progress, and
the command to type next."""

import errno
import itertools
import json
import math
import os
import shlex
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import fields, is_dataclass
from datetime import datetime
from functools import cache
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import click

from identification.errors import NotIdentifiable, UserError
from workbench.screen import (
    JSON,
    SCREEN_LINES,
    SCREEN_WIDTH,
    VERBOSE,
    Screen,
    is_given,
    listed,
    screen,
)  # fmt: skip

if TYPE_CHECKING:
    from jinja2 import Environment

TAKES_EFFECTS = ("trace", "predict", "design", "validate", "experiment", "drift", "response")
MOST_OF_A_STEP = 6  # lines that a command to type next may have on one screen


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
    """Within the block a refusal becomes one that says `then(its reason)` as the next step; its
    reason: without what was added to it, as of logs that are left out."""
    try:
        yield
    except NotIdentifiable as error:
        own = error.__cause__ if isinstance(error.__cause__, NotIdentifiable) else error
        raise Refused(str(error), then(str(own))) from error


class Bar:
    """A bar of progress, here one that nobody sees: called with a step, it moves on."""

    def __call__(self, step: float) -> None: ...

    def describe(self, words: str) -> None:
        """Say these words behind the bar's own: what goes on."""


class BadOutput(UserError):
    """A place where results cannot be written."""


class MissingLibrary(UserError):
    """A library that an extra brings is not installed."""

    def __init__(self, what: str, library: str, extra: str) -> None:
        super().__init__(
            f"{what} needs the library {library!r}, which is not installed; run"
            f" pip install 'servo-workbench[{extra}]'"
        )


class OutputFolder:
    """Results that appear whole when the `with` block ends, or not at all where it raises.

    `path` is where the block writes; `final`, after the block, is where the results lie: `out`,
    or runs/<now>-<command>. In an `out` that exists, files of the same name are replaced one by
    one at the end and others stay. Raises BadOutput where `out` cannot be such a folder.
    """

    def __init__(self, command: str, out: Path | None = None, *, now: datetime) -> None:
        default = Path("runs") / f"{now:%Y%m%d-%H%M%S}-{command}"
        self._default = out is None
        self.final = default if out is None else out
        self._inside = not self._default and self.final.is_dir()
        home = self.final if self._inside else self.final.parent
        self.path = home / f".{self.final.name}.{os.urandom(4).hex()}.part"
        self._made: list[Path] = []

    def __enter__(self) -> Self:
        if not self._default and os.path.lexists(self.final) and not self._inside:
            what = "a link that leads nowhere" if self.final.is_symlink() else "a file"
            raise BadOutput(f"--out {self.final} is {what}; name a folder, new or existing")
        home = self.path.parent
        self._made = [p for p in (home, *home.parents) if not p.exists()]
        try:
            self.path.mkdir(parents=True)
        except (FileNotFoundError, NotADirectoryError) as error:
            self._clear()
            raise BadOutput(
                f"--out {self.final}: cannot be made there ({error.strerror}); name another folder"
            ) from None
        except BaseException:
            self._clear()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None:
                self._publish()
        finally:
            self._clear()

    def write_json(self, name: str, result: object) -> Path:
        """Path of the file that now holds `result` as strict JSON."""
        return self.write(name, dumps(result) + "\n")

    def write(self, name: str, content: str | bytes) -> Path:
        """Path of the file that now holds the content, a text in UTF-8."""
        target = self.path / name
        target.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)
        return target

    def _publish(self) -> None:
        if self._inside:
            self._replace_files()
        elif self._default:
            self._rename_to_free_name()
        else:
            self.path.rename(self.final)

    def _replace_files(self) -> None:
        new = sorted(p.relative_to(self.path) for p in self.path.rglob("*") if p.is_file())
        for name in new:
            if (self.final / name).is_dir():
                raise BadOutput(f"{self.final / name} is a folder; a result needs that name")
        for name in new:
            (self.final / name).parent.mkdir(parents=True, exist_ok=True)
            (self.path / name).replace(self.final / name)

    def _rename_to_free_name(self) -> None:
        """Two runs of one second get two folders, also where they end together."""
        first = self.final
        for number in itertools.count(2):
            try:
                self.path.rename(self.final)
                return
            except OSError as error:
                if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                    raise
            self.final = first.with_name(f"{first.name}-{number}")

    def _clear(self) -> None:
        shutil.rmtree(self.path, ignore_errors=True)
        for folder in self._made:
            with suppress(OSError):
                folder.rmdir()


@contextmanager
def results(
    command: str, out: Path | None, then: Callable[[str], Step] | None = None
) -> Iterator[OutputFolder]:
    """The folder of a command's results.

    then: what to type after a refusal within the block, by its reason.
    """
    with (
        refused_with(then) if then else nullcontext(),
        OutputFolder(command, out, now=datetime.now()) as folder,
    ):
        yield folder


def write_whole(path: Path, text: str, option: str) -> None:
    """Write the text to the file, whole or not at all.

    option: that named the file, for the message. Raises BadOutput where it cannot be written.
    """
    part = path.with_name(f".{path.name}.{os.urandom(4).hex()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        raise BadOutput(
            f"{option} {path}: cannot be written ({error.strerror}); name another file"
        ) from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def strict(value: object) -> object:
    """The value as plain JSON types; NaN and infinity become None.

    Takes dataclasses, mappings, sequences, arrays, dates and paths. Raises TypeError on others.
    """
    match value:
        case None | bool() | int() | str():
            return value
        case float():
            return float(value) if math.isfinite(value) else None
        case Mapping():
            return {str(key): strict(entry) for key, entry in value.items()}
        case Path():
            return str(value)
        case datetime():
            return value.isoformat()
        case _ if is_dataclass(value):
            return {field.name: strict(getattr(value, field.name)) for field in fields(value)}
        case Sequence() if not isinstance(value, bytes):
            return [strict(entry) for entry in value]
        case _ if hasattr(value, "tolist"):
            return strict(value.tolist())
        case _:
            raise TypeError(f"{type(value).__name__} has no form in JSON")


def dumps(result: object) -> str:
    """The result as strict JSON text, in ASCII."""
    return json.dumps(strict(result), indent=2, allow_nan=False)


def emit(result: object, view: Callable[[], Screen | str], then: Step | None = None) -> None:
    """Print `result` where --json is given, else what `view()` returns: one screen of it unless
    --verbose is given.

    then: the command to type next, as JSON the key `next`, else what the screen ends with.
    """
    if is_given(JSON):
        next_one = {"next": then.command} if then and isinstance(result, Mapping) else {}
        click.echo(dumps({**result, **next_one} if isinstance(result, Mapping) else result))
        return
    verbose, shown = is_given(VERBOSE), view()
    width: int | None = SCREEN_WIDTH  # one screen has at most 100 columns
    if sys.stdout.isatty():
        width = None if verbose else min(shutil.get_terminal_size().columns, SCREEN_WIDTH)
    last = then.lines(SCREEN_WIDTH, None if verbose else MOST_OF_A_STEP) if then else []
    found = screen(listed(shown.splitlines())) if isinstance(shown, str) else shown
    click.echo(found.text(width, verbose=verbose, room=SCREEN_LINES - len(last)), nl=False)
    for line in last:
        click.echo(line)


@contextmanager
def progress(label: str, total: float | None = None) -> Iterator[Bar]:
    """A bar on standard error; mute without a terminal and with --json.

    total: what the advances add up to; None shows that something goes on.
    """
    if is_given(JSON) or not sys.stderr.isatty():  # a notebook's is none
        yield Bar()
        return
    from rich.console import Console
    from rich.progress import Progress, TaskID

    class Shown(Bar):
        def __init__(self, bar: Progress, task: TaskID) -> None:
            self.bar, self.task = bar, task

        def __call__(self, step: float) -> None:
            self.bar.advance(self.task, step)

        def describe(self, words: str) -> None:
            self.bar.update(self.task, description=f"{label}: {words}" if words else label)

    with Progress(console=Console(stderr=True), transient=True) as bar:
        yield Shown(bar, bar.add_task(label, total=total))


@cache
def templates(package: str, *, escaped: bool = True, **how: Any) -> "Environment":
    """The templates of a package, strict about names; escaped: values are, for HTML and XML."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader(package),
        autoescape=escaped,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        **how,
    )


def next_step(text: str) -> str:
    """What to do next, as a line for a terminal; commands stand in `...` as in a report."""
    return f"next: {text.replace('`', '')}"


def written(folder: Path, *names: str) -> str:
    """Where the results lie."""
    return "written: " + ", ".join(str(folder / name) for name in names)
