"""Options that `reidentify` and `watch` share."""

import os
import secrets
import socket
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

import click

from workbench import options
from workbench.signature import argument, asked


def _suffix(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    if value is not None and (not value.strip() or "/" in value or "\0" in value):
        raise click.UsageError(
            f"--marker {value!r}: the end of a file's name needed, as .done.", ctx
        )
    return value


@dataclass(frozen=True)
class JobOptions:
    """What the command line says, each field as its option; times in s, margin relative."""

    root: Path = argument()
    where: str | None = options.REGISTRY_OPTION
    first: bool = asked(False, "Give a machine without a model its first from its first log.")
    settle: float = asked(
        10.0, "Take a file that has not changed for this long.", type=options.SECONDS, metavar="S"
    )
    marker: str | None = asked(
        None,
        "Take a file once one named <file>SUFFIX lies beside it, as .done; for writers that pause"
        " for longer than --settle.",
        metavar="SUFFIX", callback=_suffix,
    )  # fmt: skip
    order: Literal["time-or-name", "time"] = asked(
        "time-or-name",
        "What makes a log older than another, so that its model does not become active: the"
        " file's time, or also the numbers in its name.",
    )
    lease: float = asked(
        120.0, "Take a silent worker's machine over after this long.",
        type=options.SECONDS_ABOVE_0, metavar="S",
    )  # fmt: skip
    patience: float = asked(
        60.0, "Wait this long for a database that is away.", type=options.SECONDS, metavar="S"
    )
    margin: float = asked(
        0.1, "Relative fall of a held-out error that wins.",
        type=options.Finite(0, 1, max_open=True),
    )  # fmt: skip
    webhook: str | None = asked(None, "Send alarms there, as JSON by POST.", metavar="URL")
    metrics: Path | None = asked(
        None, "Write Prometheus metrics there after each pass.", metavar="FILE"
    )
    seed: int = options.SEED_OPTION
    effects: tuple[Path, ...] = options.EFFECTS_OPTION


def worker_name() -> str:
    """This process by computer and number, as claims and events name it."""
    return f"{socket.gethostname()}:{os.getpid()}:{secrets.token_hex(2)}"


def is_gone(owner: str) -> bool:
    """Whether a worker of that name ran on this computer and does not any more.

    False where that is not known: of another computer, or of a system without /proc.
    """
    host, pid = ["", "", *owner.split(":")][-3:-1]
    here = host == socket.gethostname() and pid.isdigit() and Path("/proc/self").exists()
    return here and not Path(f"/proc/{pid}").exists()


def clock() -> datetime:
    """The time now, in UTC."""
    return datetime.now(UTC)
