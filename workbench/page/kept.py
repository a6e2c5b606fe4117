"""A dropped log and what came of it, kept as a machine's folder: its card and its first log."""

import secrets
import shutil
from pathlib import Path

from workbench.files import CARD_FILE, LOGS
from workbench.output import write_whole
from workbench.registry.errors import BadRegistry

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


def keep_files(root: Path, machine: str, log: Path, card: Path, report: tuple[str, Path]) -> None:
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
