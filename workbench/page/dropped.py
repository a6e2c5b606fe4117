"""Where dropped logs lie: a folder each below the machines, the log, its card, and what was found.

A file's name on the page is a text alone; on the disk it is made of letters that no path uses.
"""

import re
import secrets
import shutil
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from identification.errors import BadLog
from workbench.files import CARD_FILE, LOGS, sha256_of
from workbench.output import write_whole
from workbench.registry.values import BadRegistry

LOG_FOLDER = "log"  # of an upload, in which nothing else lies
DROPS = ".drops"  # no machine's name begins so, and no pass looks into it
ENDINGS = (
    ".csv", ".txt", ".tsv", ".dat", ".log", ".parquet", ".mat", ".h5", ".hdf5", ".json", ".tdms",
    ".mdf", ".mf4", ".mcap", ".ulg", ".xlsx", ".xlsm", ".xlsb", ".xls", ".ods",
)  # fmt: skip
RESULT_FILE, CHARTS_FILE = "result.json", "charts.html"
LONGEST_FILE_NAME = 80
_ID = re.compile(r"[0-9a-f]{16}")
_ODD = re.compile(r"[^A-Za-z0-9_.-]+")


@dataclass(frozen=True)
class Drop:
    """The files of an upload below the folder of machines."""

    root: Path
    upload: str

    @property
    def folder(self) -> Path:
        """The folder of the upload; raises BadRegistry where the name is none."""
        if not _ID.fullmatch(self.upload):
            raise BadRegistry("no such upload")
        return self.root / DROPS / self.upload

    @property
    def log(self) -> Path:
        """The log's file; raises BadRegistry where it is gone."""
        for path in (self.folder / LOG_FOLDER).glob("*"):
            return path
        raise BadRegistry("this upload's file is gone")

    @property
    def card(self) -> Path:
        """The card's file, whether it is there or not."""
        return self.folder / CARD_FILE

    def results(self, task: int) -> Path:
        """The folder of a task's results, whether it is there or not."""
        return self.folder / f"task-{task}"

    def store(self, name: str, content: BinaryIO) -> tuple[int, str]:
        """Write the log, whole or not at all: its size [bytes] and fingerprint.

        Raises BadLog where it is empty.
        """
        part = self.folder.with_name(f"{self.upload}.part")
        path = part / LOG_FOLDER / name
        path.parent.mkdir(parents=True)
        try:
            with path.open("wb") as file:
                shutil.copyfileobj(content, file)
            size, digest = path.stat().st_size, sha256_of(path)
            if size == 0:
                raise BadLog(f"{name}: is empty")
            part.rename(self.folder)
        finally:
            shutil.rmtree(part, ignore_errors=True)
        return size, digest


def file_name(given: str) -> str:
    """The name under which a log is kept: what follows the last slash, without odd characters.

    Raises BadLog where its ending is that of no log.
    """
    last = re.split(r"[/\\]", given)[-1]
    plain = _ODD.sub("_", last).strip("._-") or "log"
    stem, dot, end = plain.rpartition(".")
    ending = dot + end
    if ending.lower() not in ENDINGS:
        raise BadLog(
            f"{plain[:LONGEST_FILE_NAME]}: no log by its ending; one of {' '.join(ENDINGS)}"
        )
    return (stem[: LONGEST_FILE_NAME - len(ending)].strip("._-") or "log") + ending.lower()


def without_path(said: str, paths: Iterable[Path]) -> str:
    """A message without the folders of the server in it."""
    for path in paths:
        said = said.replace(f"{path.parent}/", "")
    return said


LONGEST_MACHINE = 80


def refuse_machine(root: Path, machine: str, card: Path) -> None:
    """Raises BadRegistry where the name can be no folder's, or the machine has another card."""
    if len(machine) > LONGEST_MACHINE or machine.startswith((".", "_")) or machine.endswith("~"):
        raise BadRegistry(
            f"machine {machine[:LONGEST_MACHINE]!r}: at most {LONGEST_MACHINE} characters needed,"
            " the first no '.' or '_', the last no '~'"
        )
    there = root / machine / CARD_FILE
    if there.exists() and there.read_bytes() != card.read_bytes():
        raise BadRegistry(
            f"machine {machine!r} has another card; give another name, or change its card by hand"
        )


def store_files(root: Path, machine: str, log: Path, card: Path, report: tuple[str, Path]) -> None:
    """Put card, log and report into the machine's folder; card and log that are there stay.

    report: its name there, and where it lies.
    All can be done again, so that a server killed in between loses nothing.
    """
    folder = root / machine
    (folder / LOGS).mkdir(parents=True, exist_ok=True)
    if not (folder / CARD_FILE).exists():
        write_whole(folder / CARD_FILE, card.read_text("utf-8"), "card")
    place = folder / LOGS / log.name
    if place.exists() and place.read_bytes() != log.read_bytes():
        place = place.with_name(f"{log.stem}-{secrets.token_hex(4)}{log.suffix}")
    if not place.exists():
        part = place.with_name(f".{place.name}.part")
        shutil.copy2(log, part)
        part.replace(place)
    reports = folder / "reports"
    reports.mkdir(exist_ok=True)
    name, path = report
    write_whole(reports / name, path.read_text("utf-8"), "report")
