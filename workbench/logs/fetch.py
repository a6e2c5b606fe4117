"""Where cards and data are: shipped cards by name, log files on disk, else from their source."""

import os
from pathlib import Path

from identification.errors import BadCard, BadLog
from workbench.cards.card import Card
from workbench.cards.card_tables import FileEntry
from workbench.cards.nearest import nearest
from workbench.files import CARD_FILE, refuse_special, sha256_of, shipped_cards
from workbench.links import broken_link

DATA_VARIABLE = "WORKBENCH_DATA"
"""Environment variable naming the folder that holds `<card name>/<file>`."""


def card_path(name: str | Path) -> Path:
    """The card of that path, or the shipped card of that name.

    Raises BadCard with the nearest shipped name where there is neither.
    """
    path = Path(name)
    if path.is_dir() and (path / CARD_FILE).is_file():
        return path / CARD_FILE
    if path.is_file():
        return path
    broken = broken_link(path)
    if broken:
        raise BadCard(f"{path}: {broken}")
    shipped = shipped_cards()
    if str(name) in shipped:
        return shipped[str(name)]
    refuse_special(path, BadCard)
    if path.is_dir():
        raise BadCard(f"{path}: is a directory without a card.toml; give the card's path")
    raise BadCard(f"{name}: no such card file and no shipped card{nearest(str(name), shipped)}")


def find_data(name: str | Path, card: Card) -> Path:
    """The log file: the path given, under WORKBENCH_DATA, beside the card, or from its source.

    A file of the card's set is compared with its sha256. Raises BadLog where there is none, where
    the bytes differ, or where the source cannot be reached.
    """
    path = Path(name)
    broken = broken_link(path)
    if broken:
        raise BadLog(f"{path}: {broken}")
    if path.exists() or path.is_absolute():
        return path
    entry = next((entry for entry in card.files if entry.name == str(name)), None)
    folders = [card.path.parent]
    if os.environ.get(DATA_VARIABLE):
        folders.insert(0, Path(os.environ[DATA_VARIABLE]) / card.name)
    for folder in folders:
        if (folder / path).is_file():
            return _verified(folder / path, entry)
    if entry is None:
        raise BadLog(f"{name}: no such file{_nearest(path, card)}")
    if entry.url is None:
        raise BadLog(f"{name}: not found and without a url in the card; set {DATA_VARIABLE}")
    return _download(entry, card)


def _nearest(path: Path, card: Card) -> str:
    """The end of a message on a missing log: the nearest file of the card's set, or beside it."""
    if card.files:
        named = nearest(str(path), [entry.name for entry in card.files])
        return f", and none of card {card.name!r}{named}"
    folder = path.parent
    if not folder.is_dir():
        return f"; there is no folder {str(folder)!r} either, check the path"
    return nearest(path.name, sorted(p.name for p in folder.iterdir() if p.is_file()))


def _verified(path: Path, entry: FileEntry | None) -> Path:
    if entry is None or entry.sha256 is None:
        return path
    found = sha256_of(path)
    if found != entry.sha256:
        raise BadLog(
            f"{path}: sha256 {found[:12]}... is not the card's {entry.sha256[:12]}...; "
            "it was changed or cut off, delete it to fetch it again"
        )
    return path


def _download(entry: FileEntry, card: Card) -> Path:
    import pooch

    pooch.get_logger().setLevel("WARNING")
    try:
        found = pooch.retrieve(
            url=entry.url,
            known_hash=f"sha256:{entry.sha256}" if entry.sha256 else None,
            fname=entry.name,
            path=pooch.os_cache("servo-workbench") / card.name,
        )
    except ValueError as error:
        text = " ".join(str(error).split())[:120]
        raise BadLog(f"{entry.name}: what {entry.url} sends is not the card's ({text})") from error
    except OSError as error:  # requests' errors are OSErrors too
        raise BadLog(
            f"{entry.name}: cannot be fetched from {entry.url} ({type(error).__name__}); go "
            f"online, or put it into <folder>/{card.name}/ and set {DATA_VARIABLE}=<folder>"
        ) from error
    return Path(str(found))
