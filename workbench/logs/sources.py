"""What a command names on its line: the card, and the runs in its log files; and where both are:
shipped cards by name, files on disk, else from their source."""

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from design.machine.nearest import nearest
from design.machine.source import MachineLogs, Source
from identification.errors import BadCard, BadLog, ShortLog
from identification.log import Rig
from identification.remarks import LeftOut
from identification.signals.bad_samples import BadSamples
from workbench.cards.card import Card, load_card, present_of_card
from workbench.cards.card_tables import FileEntry
from workbench.cards.headers import log_remarks
from workbench.files import CARD_FILE, broken_link, refuse_special, sha256_of, shipped_cards
from workbench.logs.runs import read_runs, runs_of, shown_name
from workbench.logs.table import Table


@dataclass(frozen=True)
class Sources:
    """The card, its rig for these files, their runs, what was repaired, what excluded."""

    card: Card
    rig: Rig
    runs: tuple[Source, ...]
    remarks: tuple[str, ...]
    bad: tuple[BadSamples, ...] = ()

    @property
    def logs(self) -> MachineLogs:
        """The same but for the card, of which they have the name and the logs kept for tests."""
        kept = tuple(self.card.split.get("test", ()))
        present = partial(present_of_card, self.card, self.rig)
        return MachineLogs(
            self.card.name, self.rig, self.runs, self.remarks, self.bad, kept, present
        )


@dataclass(frozen=True)
class Recorded:
    """A log that is no file: what it is called by, its columns, and a hash of them."""

    name: str
    table: Table
    sha256: str


def read_sources(names: Sequence[str], card_name: str, *, velocity: bool = False) -> Sources:
    """The runs of the log files `names`, each a path or a file of the card's set.

    velocity: a rig whose velocity follows the command is taken, and no other. Raises BadCard,
    BadLog; also where the files are of different machines or one is named twice.
    """
    card = load_card(card_path(card_name), with_recipe=False)
    return sources_of(names, card, velocity=velocity)


def card_of_velocity(card_name: str) -> bool:
    """Whether the card is of a rig whose velocity follows the command; raises BadCard."""
    return load_card(card_path(card_name), with_recipe=False).of_velocity


def sources_of(logs: Sequence[str | Recorded], card: Card, *, velocity: bool = False) -> Sources:
    """As `read_sources`, of a card that is read, and of logs that may be no files; of several, one
    that is too short is left out."""
    if not velocity:
        card.refuse_velocity()
    found: list[tuple[Path, Source]] = []
    remarks, bad = list[str](), list[BadSamples]()
    rigs: dict[Path, Rig] = {}
    for one in logs:
        path = Path(one.name) if isinstance(one, Recorded) else find_data(one, card)
        whole = path if isinstance(one, Recorded) else path.resolve()
        if whole in rigs:
            raise BadLog(f"{path.name}: given twice; name every log once")
        rigs[whole] = card.rig(path.name)
        try:
            if isinstance(one, Recorded):
                prepared, name, digest = runs_of(one.table, path, card), one.name, one.sha256
            else:
                prepared = read_runs(path, card)
                name, digest = shown_name(path), sha256_of(path)
        except ShortLog as short:
            if len(logs) == len(rigs) and not found:
                raise
            remarks.append(LeftOut(f"{str(short).partition('; ')[0]}: left out"))
            continue
        remarks.extend(prepared.remarks)
        bad.extend(prepared.bad)
        for run in prepared.runs:
            found.append((whole, Source(run, name, digest, len(run), prepared.period)))
    names_of = Counter(path.name for path in rigs)
    runs = [_discriminated(run, path) if names_of[path.name] > 1 else run for path, run in found]
    first = next(iter(rigs))
    for path, rig in rigs.items():
        if rig != rigs[first]:
            raise BadLog(
                f"{path.name}: the card gives it another rig than {first.name}; identify machines"
                " one by one"
            )
    if velocity and rigs[first].kind != "velocity":
        raise BadLog(
            f'{first.name}: the card {card.path} says kind = "{rigs[first].kind}",'
            ' "velocity" needed here; give the card of that machine'
        )
    remarks.extend(log_remarks([run.log for run in runs], rigs[first], card.signals))
    return Sources(card, rigs[first], tuple(runs), tuple(remarks), tuple(bad))


def _discriminated(source: Source, path: Path) -> Source:
    """The run named with its folder, as another file has the same name."""
    name = source.log.name.replace(path.name, f"{path.parent.name}/{path.name}", 1)
    return replace(source, log=replace(source.log, name=name))


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
        if not (folder / path).is_file():
            continue
        wanted = entry.sha256 if entry else None
        if wanted and (found := sha256_of(folder / path)) != wanted:
            raise BadLog(
                f"{folder / path}: sha256 {found[:12]}... is not the card's {wanted[:12]}...;"
                " it was changed or cut off, delete it to fetch it again"
            )
        return folder / path
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
