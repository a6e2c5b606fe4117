"""How the page is served, as the command line says it and every process of it reads it."""

import json
import os
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from identification.errors import UserError

SETTINGS_VARIABLE = "WORKBENCH_PAGE"
LOOPBACK = ("localhost", "127.0.0.1", "[::1]", "::1")
UPLOAD_BYTES = 200_000_000


@dataclass(frozen=True)
class PageSettings:
    """where: the registry; machines: folder of machines, in which dropped logs lie too.

    prefix: path below which a proxy serves the page, "" or as "/servo". names: hosts by which it
    may be asked for. open_reading: whether reading needs no token. silent_days: after which a
    machine counts as not heard from. most_bytes: of one dropped log. secure: cookies go by https
    only. servers, workers: processes.
    """

    where: str
    machines: str
    host: str = "127.0.0.1"
    port: int = 8000
    prefix: str = ""
    names: tuple[str, ...] = ()
    open_reading: bool = True
    silent_days: float = 7.0
    most_bytes: int = UPLOAD_BYTES
    secure: bool = False
    servers: int = 1
    workers: int = 1

    @property
    def root(self) -> Path:
        """The folder of machines."""
        return Path(self.machines)

    @property
    def hosts(self) -> frozenset[str]:
        """Names that a request's Host may give."""
        return frozenset((*LOOPBACK, self.host, *self.names))


def hand_over(settings: PageSettings) -> None:
    """Leave the settings to the processes that this one starts; not on their command lines."""
    os.environ[SETTINGS_VARIABLE] = json.dumps(asdict(settings))


def handed_over() -> PageSettings:
    """The settings that the process which started this one has left."""
    found: dict[str, Any] = json.loads(os.environ[SETTINGS_VARIABLE])
    return PageSettings(**{**found, "names": tuple(found["names"])})


NEEDED_LIBRARIES = ("starlette", "uvicorn", "python_multipart")


class MissingPage(UserError):
    """A library of the page is not installed."""


def refuse_missing() -> None:
    """Raises MissingPage with the extra to install."""
    lost = [name for name in NEEDED_LIBRARIES if find_spec(name) is None]
    if lost:
        raise MissingPage(
            f"the page needs the library {lost[0]!r}, which is not installed; run"
            " pip install 'servo-workbench[page]'"
        )
