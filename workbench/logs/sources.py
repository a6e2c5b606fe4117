"""What a command names on its line: the card, and the runs in its log files."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from identification.errors import BadLog
from identification.log import Log, Rig
from identification.signals.bad_samples import BadSamples
from workbench.cards.card import Card, load_card
from workbench.documents.plausible import log_remarks
from workbench.logs.fetch import card_path, find_data
from workbench.logs.runs import fingerprint, read_runs


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
    samples were set aside."""

    card: Card
    rig: Rig
    runs: tuple[Source, ...]
    remarks: tuple[str, ...]
    bad: tuple[BadSamples, ...] = ()


def read_sources(names: Sequence[str], card_name: str) -> Sources:
    """The runs of the log files `names`, each a path or a file of the card's set.

    Raises BadCard, BadLog; also where the files are of different machines or one is named twice.
    """
    card = load_card(card_path(card_name), with_recipe=False)
    found: list[tuple[Path, Source]] = []
    remarks, bad = list[str](), list[BadSamples]()
    rigs: dict[Path, Rig] = {}
    for name in names:
        path = find_data(name, card)
        whole = path.resolve()
        if whole in rigs:
            raise BadLog(f"{path.name}: given twice; name every log once")
        rigs[whole] = card.rig(path.name)
        prepared = read_runs(path, card)
        remarks.extend(prepared.remarks)
        bad.extend(prepared.bad)
        found.extend((whole, _source(path, run, prepared.period)) for run in prepared.runs)
    names_of = Counter(path.name for path in rigs)
    runs = [_told_apart(run, path) if names_of[path.name] > 1 else run for path, run in found]
    first = next(iter(rigs))
    for path, rig in rigs.items():
        if rig != rigs[first]:
            raise BadLog(
                f"{path.name}: the card gives it another rig than {first.name}; identify machines"
                " one by one"
            )
    remarks.extend(log_remarks([run.log for run in runs], rigs[first], card.signals))
    return Sources(card, rigs[first], tuple(runs), tuple(remarks), tuple(bad))


def _source(path: Path, run: Log, period: float | None) -> Source:
    found = fingerprint(path, run)
    return Source(run, found.file, found.sha256, found.rows, period)


def _told_apart(source: Source, path: Path) -> Source:
    """The run named with its folder, as another file has the same name."""
    name = source.log.name.replace(path.name, f"{path.parent.name}/{path.name}", 1)
    return replace(source, log=replace(source.log, name=name))
