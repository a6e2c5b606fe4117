"""Files that a user names: what never ends, and what is too large, is refused before it is read."""

import errno
import stat
from pathlib import Path

from identification.errors import UserError

CARD_FILE = "card.toml"
"""Name of a card in a machine's folder."""

REPORT_FILE = "report.html"

LOGS = "logs"
"""Name of the folder of a machine's logs, beside its card."""

CARD_BYTES = 1_000_000
"""Size above which a file is no card; the largest that ships has 8 kB."""

RESULT_BYTES = 50_000_000
"""Size above which a file is no model, design or state; a posterior makes the largest, of 1 MB."""

_KINDS = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def refuse_special(path: Path, wrong: type[UserError]) -> None:
    """Raises `wrong`, one line, where the path is a pipe, a device or a socket.

    To open or to read one may take for ever. What else is wrong with a path shows on opening.
    """
    try:
        kind = _KINDS.get(stat.S_IFMT(path.stat().st_mode))
    except (OSError, ValueError):
        return
    if kind:
        raise wrong(f"{path}: is {kind}, not a file; write its data to a file and give that")


def refuse_larger(path: Path, most: int, what: str, wrong: type[UserError]) -> None:
    """Raises `wrong`, one line, where the file has more than `most` bytes; `what` it should be."""
    try:
        size = path.stat().st_size
    except (OSError, ValueError):
        return
    if size > most:
        raise wrong(
            f"{path}: has {size / 1e6:.4g} MB, {what} at most {most / 1e6:g} MB; give another file,"
            " or a part of it"
        )


def sha256_of(path: Path) -> str:
    """The SHA-256 of the file's bytes, as hexadecimal digits; raises OSError."""
    import hashlib  # a tenth of the time of --help

    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def shipped_cards() -> dict[str, Path]:
    """Paths of the shipped cards by name, from the wheel or else from the checkout."""
    here = Path(__file__).resolve().parent
    for root in (here / "_datasets", here.parent / "datasets"):
        found = {path.parent.name: path for path in sorted(root.glob(f"*/{CARD_FILE}"))}
        if found:
            return found
    return {}


def broken_link(path: Path) -> str | None:
    """What is wrong with a link and what to do, as the end of a message; None where it is none."""
    try:
        path.stat()
    except FileNotFoundError:
        if path.is_symlink():
            target = str(path.readlink())
            return f"is a link to {target!r}, which is missing; mend it, or name the file itself"
    except (OSError, RuntimeError) as error:  # RuntimeError: older Pythons, of a circle
        if isinstance(error, RuntimeError) or error.errno == errno.ELOOP:
            return "its links lead in a circle; mend them, or name the file itself"
    return None
