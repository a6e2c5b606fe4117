"""What a command names on its line: the card, and the runs in its log files."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from identification.errors import BadLog
from identification.log import Log, Rig
from identification.signals.bad_samples import BadSamples
from workbench.cards.card import Card, load_card
from workbench.documents.plausible import log_remarks
from workbench.files import sha256_of
from workbench.logs.fetch import card_path, find_data
from workbench.logs.runs import read_runs, runs_of, shown_name
from workbench.logs.table import Table


@dataclass(frozen=True)
class Source:
    """One run of a file: its log on an even clock, the file's name, hash and rows.

    period: of the samples in the file [s]; None where it is that of the log.
    """

    log: Log
    file: str
    sha256: str
    rows: int
    period: float | None = None


@dataclass(frozen=True)
class Sources:
    """The card, its rig for these files, their runs, what had to be repaired in them, and which
    samples were excluded."""

    card: Card
    rig: Rig
    runs: tuple[Source, ...]
    remarks: tuple[str, ...]
    bad: tuple[BadSamples, ...] = ()


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
    """As `read_sources`, of a card that is read, and of logs that may be no files."""
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
        if isinstance(one, Recorded):
            prepared = runs_of(one.table, path, card)
        else:
            prepared = read_runs(path, card)
        remarks.extend(prepared.remarks)
        bad.extend(prepared.bad)
        found.extend((whole, _source(one, path, run, prepared.period)) for run in prepared.runs)
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


def _source(log: str | Recorded, path: Path, run: Log, period: float | None) -> Source:
    if isinstance(log, Recorded):
        return Source(run, log.name, log.sha256, len(run), period)
    return Source(run, shown_name(path), sha256_of(path), len(run), period)


def _discriminated(source: Source, path: Path) -> Source:
    """The run named with its folder, as another file has the same name."""
    name = source.log.name.replace(path.name, f"{path.parent.name}/{path.name}", 1)
    return replace(source, log=replace(source.log, name=name))


def refuse_twins(train: Sequence[Source], test: Sequence[Source]) -> None:
    """Raises BadLog where a test file has the bytes of a training file."""
    names = {source.sha256: source.file for source in train}
    for source in test:
        if source.sha256 in names:
            raise BadLog(
                f"--test {source.file}: the same bytes as the training log"
                f" {names[source.sha256]}; test on a log that the fit has not used"
            )


def fingerprints(sources: Sequence[Source]) -> list[dict[str, Any]]:
    """Name, digest and rows of each file, as a result names the logs that it is of."""
    found = {s.sha256: {"file": s.file, "sha256": s.sha256, "rows": s.rows} for s in sources}
    return list(found.values())
