"""Machine folders and the log files in them that are complete.

ROOT/<machine>/card.toml says how ROOT/<machine>/logs/* are read. A file counts as complete when
nobody has it open for writing, as far as the system says, and it has not changed for a while;
where the writer leaves a marker beside each finished file ("run1.csv.done"), when that is there.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from identification.errors import UserError
from workbench.cards.card_tables import FileSpec
from workbench.files import CARD_FILE, LOGS, sha256_of
from workbench.logs.layout import is_number
from workbench.logs.runs import shown_name
from workbench.logs.text import first_lines
from workbench.logs.times import is_time
from workbench.registry.values import SeenLog

SUFFIXES = (".csv", ".txt", ".tsv", ".parquet", ".mat", ".h5", ".hdf5", ".json")
NOTES = ".txt"  # ending of logs, but of notes too
Known = Mapping[tuple[str, int, int], str]


class BadRoot(UserError):
    """A folder of machines that is none, or of a machine whose name no registry can hold."""


@dataclass(frozen=True)
class MachineFolder:
    """A machine's name, its card and the folder of its logs."""

    name: str
    card: Path
    logs: Path


@dataclass(frozen=True)
class Scan:
    """Complete log files by fingerprint, and how many are still being written.

    later: files whose time of change lies in the future, by the clock here; no_logs: texts without
    a line of numbers, such as notes.
    """

    complete: Mapping[str, tuple[Path, SeenLog]]
    growing: int
    later: tuple[str, ...]
    no_logs: tuple[str, ...] = ()


def machine_folders(root: Path) -> tuple[MachineFolder, ...]:
    """The folders of `root` that hold a card, by name; raises BadRoot where `root` is no folder.

    One whose name is not UTF-8 comes by `shown_name`, which says so of itself.
    """
    if not root.is_dir():
        raise BadRoot(
            f"{root}: no such folder; one with <machine>/{CARD_FILE} and <machine>/{LOGS} needed"
        )
    found = sorted(path.parent for path in root.glob(f"*/{CARD_FILE}"))
    return tuple(
        MachineFolder(shown_name(p), p / CARD_FILE, p / LOGS) for p in found if _plain(p.name)
    )


def scan(
    folder: MachineFolder,
    known: Known,
    *,
    settle: timedelta,
    now: datetime,
    marker: str | None = None,
) -> Scan:
    """The log files of a machine; those in `known` by name, size and time are not read again.

    marker: ending of a file beside each log that its writer has finished; None: none is needed.
    """
    complete: dict[str, tuple[Path, SeenLog]] = {}
    growing, later, no_logs = 0, [], []
    names = {name for name, _, _ in known}
    for path in sorted(folder.logs.iterdir()) if folder.logs.is_dir() else []:
        if not (_plain(path.name) and path.suffix.lower() in SUFFIXES and path.is_file()):
            continue
        try:
            before = path.stat()
        except FileNotFoundError:
            continue
        age = now.timestamp() - before.st_mtime
        if age < 0:
            later.append(shown_name(path))
        marked = marker is None or path.with_name(path.name + marker).exists()
        if not marked or age < settle.total_seconds() or open_for_writing(path):
            growing += 1
            continue
        if path.suffix.lower() == NOTES and shown_name(path) not in names and not has_rows(path):
            no_logs.append(shown_name(path))
            continue
        found = _seen(path, before, known)
        if found is None:
            growing += 1
        else:
            complete.setdefault(found.sha256, (path, found))
    return Scan(complete, growing, tuple(later), tuple(no_logs))


def has_rows(path: Path) -> bool:
    """Whether most fields of a line are numbers or times, as in every log; True where it cannot be
    read, which is said when it is tested."""
    try:
        rows = first_lines(path, FileSpec())
    except (UserError, OSError):
        return True
    filled = ([field for field in row if field] for row in rows)
    return any(2 * sum(is_number(x) or is_time(x) for x in row) > len(row) for row in filled)


def unchanged(path: Path, log: SeenLog) -> bool:
    """Whether the file still is what its fingerprint was taken of."""
    try:
        now = path.stat()
    except OSError:
        return False
    return (now.st_size, now.st_mtime_ns) == (log.size, log.mtime_ns)


def open_for_writing(path: Path) -> bool:
    """Whether a process has the file open for writing; False where the system does not say.

    By a read lease, which Linux grants on files that nobody writes.
    """
    try:
        import fcntl

        with path.open("rb") as file:
            fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_RDLCK)
            fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_UNLCK)
    except BlockingIOError:
        return True
    except (ImportError, AttributeError, OSError):
        # Another system; a file of another user's, of a file system without leases, or one that
        # cannot be opened, which is refused when it is read.
        return False
    return False


def _plain(name: str) -> bool:
    return not name.startswith((".", "_")) and not name.endswith("~")


def _seen(path: Path, before: os.stat_result, known: Known) -> SeenLog | None:
    """The file's fingerprint; None where it changes while it is read, or is gone."""
    size, mtime = before.st_size, before.st_mtime_ns
    name = shown_name(path)
    digest = known.get((name, size, mtime))
    if digest is None:
        try:
            digest = sha256_of(path)
        except FileNotFoundError:
            return None
    found = SeenLog(digest, name, size, mtime)
    return found if unchanged(path, found) else None
