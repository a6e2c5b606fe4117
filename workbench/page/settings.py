"""How the page is served, as the command line says it and every process of it reads it."""

import os
import re
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

import click

from workbench import options
from workbench.output import MissingLibrary, dumps
from workbench.signature import asked

SETTINGS_VARIABLE = "WORKBENCH_PAGE"
LOOPBACK = ("localhost", "127.0.0.1", "[::1]", "::1")
MEGA = 1e6


def _prefix(ctx: click.Context, param: click.Parameter, value: str) -> str:
    text = value.rstrip("/")
    if not (text.isascii() and re.fullmatch(r"(/[^/ ?#%\\\"'<>]+)*", text)):
        raise click.UsageError(f"--prefix {value!r}: a path needed, as /servo.", ctx)
    return text


@dataclass(frozen=True)
class PageSettings:
    """The registry, the folder of machines, in which dropped logs lie too, and each option.

    prefix: "" or as "/servo". servers, workers: processes.
    """

    where: str = options.REGISTRY_OPTION
    machines: Path = options.MACHINES_OPTION
    host: str = asked("127.0.0.1", "Address to bind to.")
    port: int = asked(8000, "", type=click.IntRange(0, 65535))
    names: tuple[str, ...] = asked(
        (), "Name under which the page is asked for, beside localhost; may be repeated.",
        "--name", metavar="HOST",
    )  # fmt: skip
    prefix: str = asked(
        "", "Path below which a proxy serves the page.",
        show_default=False, metavar="/PATH", callback=_prefix,
    )  # fmt: skip
    reading: Literal["open", "token"] | None = asked(
        None, "Who may read.  [default: open on the loopback, else token]"
    )
    secure: bool = asked(False, "The proxy speaks https: send cookies by it alone.")
    silent_days: float = asked(
        7.0, "A machine without a log for so long counts as not heard from.",
        type=options.POSITIVE, metavar="D",
    )  # fmt: skip
    most_megabytes: float = asked(
        200.0, "Largest log that may be dropped.", type=options.POSITIVE, metavar="MB"
    )
    servers: int = asked(2, "Processes that answer.", type=click.IntRange(1, 64), metavar="N")
    workers: int = asked(
        1, "Processes that identify and trace; more by 'workbench work'.",
        type=click.IntRange(0, 64), metavar="N",
    )  # fmt: skip

    @property
    def open_reading(self) -> bool:
        """Whether reading needs no token."""
        return self.host in LOOPBACK if self.reading is None else self.reading == "open"

    @property
    def most_bytes(self) -> int:
        """Of one dropped log."""
        return round(self.most_megabytes * MEGA)

    @property
    def hosts(self) -> frozenset[str]:
        """Names that a request's Host may give."""
        return frozenset((*LOOPBACK, self.host, *self.names))


def hand_over(settings: PageSettings) -> None:
    """Leave the settings to the processes that this one starts; not on their command lines."""
    os.environ[SETTINGS_VARIABLE] = dumps(settings)


def handed_over() -> PageSettings:
    """The settings that the process which started this one has left."""
    from pydantic import TypeAdapter

    return TypeAdapter(PageSettings).validate_json(os.environ[SETTINGS_VARIABLE])


NEEDED_LIBRARIES = ("starlette", "uvicorn", "python_multipart")


def refuse_missing() -> None:
    """Raises MissingLibrary with the extra to install."""
    for name in NEEDED_LIBRARIES:
        if find_spec(name) is None:
            raise MissingLibrary("the page", name, "page")
