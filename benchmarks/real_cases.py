"""The rigs and cases of `real`, as `real.toml` has them, and their files as the workbench can read
them."""

import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from benchmarks.yardstick import Terms
from workbench.cards.card import Card, load_card
from workbench.logs.sources import DATA_VARIABLE, card_path, find_data

TABLE = Path(__file__).with_name("real.toml")
SPLITS = TABLE.with_name("real_splits.toml")
Group = Literal["rig", "case", "split", "half"]
HALF = 0.6  # of a file, on which a model is fitted that the rest judges
CUT = (".csv", ".txt", ".npy")  # files of which rows can be taken


@dataclass(frozen=True)
class Part:
    """A file, or the rows of it between two shares of their number."""

    file: str
    begin: float = 0.0
    end: float = 1.0

    @classmethod
    def of(cls, entry: str | Mapping[str, Any]) -> "Part":
        """An entry of `train` or `test`."""
        if isinstance(entry, str):
            return cls(entry)
        return cls(entry["file"], entry["from"], entry["to"])


@dataclass(frozen=True)
class Truth:
    """A parameter that is known: the range that is right, the value where there is one, and whether
    "not identifiable" is right too."""

    name: str
    low: float
    high: float
    value: float | None = None
    or_none: bool = False

    @classmethod
    def of(cls, entry: Mapping[str, Any]) -> "Truth":
        """An entry of `truth`: a value and how far off it may be, as a share, or a range."""
        free = bool(entry.get("or_none", False))
        if "value" not in entry:
            return cls(entry["name"], entry["low"], entry["high"], None, free)
        value, within = float(entry["value"]), float(entry["within"])
        low, high = sorted([value * (1 - within), value * (1 + within)])
        return cls(entry["name"], low, high, value, free)


@dataclass(frozen=True)
class Right:
    """What is right: of init and doctor as `real_judge` reads it, truths, verdicts, effects."""

    init: Mapping[str, Any] | None
    doctor: Mapping[str, Any] | None
    truth: tuple[Truth, ...]
    verdicts: tuple[str, ...]
    must: tuple[str, ...]
    must_not: tuple[str, ...]


@dataclass(frozen=True)
class Case:
    """A rig or case: its card (a name, a file or the text), training and held-out files, the terms
    of its yardstick, and what is right."""

    name: str
    group: Group
    card: str | None
    folder: str
    rig: str
    train: tuple[Part, ...]
    test: tuple[Part, ...]
    terms: Terms
    array: bool
    prescribed: bool
    right: Right = field(repr=False)

    @property
    def home(self) -> Path:
        """The folder of its files."""
        data = Path(os.environ[DATA_VARIABLE])
        return cases_folder() if self.group == "case" else data / self.folder

    @property
    def there(self) -> bool:
        """Whether its first file is."""
        folder = self.home
        if self.group != "case" and not self.folder:
            folder = folder / str(self.card)
        return (folder / self.train[0].file).is_file()


def cases_folder() -> Path:
    """The folder `cases` beside that of the measured data."""
    return Path(os.environ[DATA_VARIABLE]).parent / "cases"


def every_case() -> tuple[Case, ...]:
    """All of the table, and the other splits of its rigs."""
    cases = tomllib.loads(TABLE.read_text("utf-8"))["case"]
    named = {one["name"]: one for one in cases}
    splits = tomllib.loads(SPLITS.read_text("utf-8"))["split"]
    own_cards = {"init": None, "doctor": None}  # at the rig's own
    others = [{**named[one["of"]], **own_cards, **one, "group": "split"} for one in splits]
    found = tuple(_case(entry) for entry in (*cases, *others))
    return (*found, *_halves(found))


def _halves(cases: Sequence[Case]) -> tuple[Case, ...]:
    """Each recorded file of the rigs by itself: fitted on its first part, judged on the rest."""
    own = {
        part.file: case
        for case in reversed(cases)
        if case.group != "case"
        for part in (*case.train, *case.test)
        if part.file.endswith(CUT)
    }
    return tuple(
        replace(
            case, name=f"{file}, halves", group="half", train=(Part(file, 0.0, HALF),),
            test=(Part(file, HALF, 1.0),), right=Right(None, None, (), (), (), ()),
        )
        for file, case in sorted(own.items())
    )  # fmt: skip


def _case(entry: Mapping[str, Any]) -> Case:
    terms = dict(entry.get("terms", {}))
    every = range(1, terms.pop("counts_to", 0) + 1)
    terms["counts"] = tuple(float(n) for n in (*terms.get("counts", ()), *every))
    names = ("verdicts", "must", "must_not")
    truths = tuple(Truth.of(one) for one in entry.get("truth", ()))
    verdicts, must, must_not = (tuple(entry.get(name, ())) for name in names)
    return Case(
        name=entry["name"],
        group=entry["group"],
        card=entry.get("card"),
        folder=entry.get("folder", ""),
        rig=entry.get("rig", ""),
        train=tuple(Part.of(one) for one in entry["train"]),
        test=tuple(Part.of(one) for one in entry.get("test", ())),
        terms=Terms(**terms),
        array=entry.get("array", False),
        prescribed=entry.get("prescribed", False),
        right=Right(
            entry.get("init"), entry.get("doctor"), truths, verdicts, must, must_not
        ),
    )  # fmt: skip


@dataclass(frozen=True)
class Prepared:
    """Card and files of a case as paths; card None where the case has none."""

    card: Card | None
    train: tuple[Path, ...]
    test: tuple[Path, ...]


def prepared(case: Case, work: Path) -> Prepared:
    """The card and the files of a case; what has to be written for it lies in `work`."""
    card = _card(case, work)

    def paths(parts: tuple[Part, ...]) -> tuple[Path, ...]:
        return tuple(_file(one, _found(one, case, card), work) for one in parts)

    return Prepared(card, paths(case.train), paths(case.test))


def _card(case: Case, work: Path) -> Card | None:
    if case.card is None:
        return None
    path = work / "card.toml"
    if "\n" in case.card:
        path.write_text(case.card, "utf-8")
    elif case.card.endswith(".toml"):
        path = case.home / case.card
    elif case.rig:
        text = card_path(case.card).read_text("utf-8")
        path.write_text(text.replace("[rig]\n", f"[rig]\n{case.rig}\n", 1), "utf-8")
    else:
        path = card_path(case.card)
    return load_card(path, with_recipe=False)


def _found(part: Part, case: Case, card: Card | None) -> Path:
    if card is not None and case.group != "case" and not case.folder:
        return find_data(part.file, card)
    return case.home / part.file


def _file(part: Part, path: Path, work: Path) -> Path:
    """The file itself, or rows of it and arrays written as text."""
    array = path.suffix == ".npy"
    if not array and (part.begin, part.end) == (0.0, 1.0):
        return path
    if array:
        rows = [",".join(f"{x:.9g}" for x in row) for row in np.load(path).T]
        head = "time_s,pos_counts,iq_A"
    else:
        head, *rows = path.read_text("utf-8").splitlines()
    n = len(rows)
    kept = rows[round(part.begin * n) : round(part.end * n)]
    suffix = ".csv" if array else path.suffix
    out = work / f"{part.begin:g}_to_{part.end:g}" / f"{path.stem}{suffix}"
    out.parent.mkdir(exist_ok=True)
    out.write_text("\n".join([head, *kept]) + "\n", "utf-8")
    return out
