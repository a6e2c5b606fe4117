"""Tracing on the measured sets, by the splits that their cards fix.

    python benchmarks/chapters.py [NAME ...]     (WORKBENCH_DATA names the folder of the sets)

Prints a Markdown table, one line for each chapter (NAME: only those whose name begins so): verdict,
effects in the order they joined, errors before -> after on training and held-out logs, what
drifted between the two, and seconds. A set that is absent is skipped with a word, one that the
workbench refuses is printed with the reason.
"""

import os
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from design.identified.trace_logs import Traced, effect_estimates, trace_logs
from identification.effects._library import built_in
from identification.errors import UserError
from identification.log import Log, Rig
from identification.tracing.result import Errors, FoundEffect, Trace
from workbench.cards.card import load_card
from workbench.logs.sources import DATA_VARIABLE, Sources, card_path, read_sources

ROOT = Path(__file__).parents[1]
HEAD = (
    "set", "verdict", "effects", "force rms [N], train", "force rms [N], test",
    "position rms [mm], train", "position rms [mm], test", "actuator rms [N/s], test", "drift", "s",
)  # fmt: skip


SEALS = ("O-ring257", "O-ring", "X-ring257")
SHORTEST = 100  # samples of a run


@dataclass(frozen=True)
class Chapter:
    """Training and held-out logs of one machine of a card.

    relative: the card knows no force for the command, so force is in parts of that at full command;
    halved: of each file the first half is for training, and the second of every test file held out.
    """

    name: str
    card: str
    train: tuple[str, ...]
    test: tuple[str, ...]
    relative: bool = False
    halved: bool = False


def chapters() -> list[Chapter]:
    """Every chapter, from the cards' [split]."""
    train, test = _split("pneumatic_seals")
    out = [Chapter("seals O-ring257, 3 bar", "pneumatic_seals", train, test[:1])]
    out += [
        Chapter(f"seals O-ring257, {name.removesuffix('.csv')}", "pneumatic_seals", train, (name,))
        for name in test[1:]
    ]
    for seal in SEALS[1:]:
        logs = tuple(f"{seal}_{bar}bar.csv" for bar in (1, 5, 7))
        held_out = (f"{seal}_3bar.csv",)
        out.append(Chapter(f"seals {seal}, 3 bar", "pneumatic_seals", logs, held_out))
    for seal in SEALS:
        logs = tuple(f"{seal}_{bar}bar.csv" for bar in (1, 3, 5, 7))
        name = f"seals {seal}, later strokes"
        out.append(Chapter(name, "pneumatic_seals", logs, logs, halved=True))
    for card in ("emps", "friction_backlash"):
        out.append(Chapter(card, card, *_split(card)))
    out.append(Chapter("xl330_servo", "xl330_servo", *_split("xl330_servo"), relative=True))
    return out


def _split(card: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    split = load_card(card_path(card), with_recipe=False).split
    return split["train"], split["test"]


def data_folder() -> Path:
    """Folder of the measured sets: WORKBENCH_DATA, else ../shared/data beside the checkout."""
    return Path(os.environ.setdefault(DATA_VARIABLE, str(ROOT.parent / "shared" / "data")))


def traced(chapter: Chapter) -> Traced:
    """The trace of a chapter."""
    with tempfile.TemporaryDirectory() as folder:
        card = chapter.card
        if chapter.relative:
            text = card_path(card).read_text(encoding="utf-8")
            card = str(Path(folder) / "card.toml")
            Path(card).write_text(
                text.replace("[rig]\n", "[rig]\nforce_per_command = 1.0\n"), encoding="utf-8"
            )
        train, test = (read_sources(n, card) for n in (chapter.train, chapter.test))
        if chapter.halved:
            train, test = half(train, first=True), half(test, first=False)
        return trace_logs(train.logs, test.logs, built_in())


def half(sources: Sources, *, first: bool) -> Sources:
    """The first or the second half of each file, by its time."""
    ends: dict[str, tuple[float, float]] = {}
    for run in sources.runs:
        t = run.log["t"]
        low, high = ends.get(run.file, (np.inf, -np.inf))
        ends[run.file] = (min(low, float(t[0])), max(high, float(t[-1])))
    runs = []
    for run in sources.runs:
        keep = (run.log["t"] < sum(ends[run.file]) / 2.0) == first
        if np.count_nonzero(keep) >= SHORTEST:
            signals = {key: x[keep] for key, x in run.log.signals.items()}
            part = f"{run.sha256}, {'first' if first else 'second'} half"  # other bytes
            runs.append(replace(run, log=Log(run.log.name, signals), sha256=part))
    return replace(sources, runs=tuple(runs))


def row(chapter: Chapter) -> tuple[Sequence[str], list[str]]:
    """The table's line of a chapter, and its remarks."""
    folder = data_folder() / chapter.card
    absent = [n for n in (*chapter.train, *chapter.test) if not (folder / n).is_file()]
    if absent:
        return (chapter.name, f"skipped: no {absent[0]}", *[""] * (len(HEAD) - 2)), []
    start = time.perf_counter()
    try:
        found = traced(chapter)
    except UserError as error:
        spent = time.perf_counter() - start
        return (chapter.name, f"refused: {error}", *[""] * (len(HEAD) - 3), f"{spent:.1f}"), []
    spent = time.perf_counter() - start
    rig = found.model.rig
    cells = (
        chapter.name,
        verdict(found.trace),
        "; ".join(effect(e, rig) for e in found.trace.effects) or "-",
        *(force(found.trace, where) for where in ("train", "test")),
        *(errors(found.trace, "position_rms", where, 1e3) for where in ("train", "test")),
        errors(found.trace, "actuator_rms", "test", 1.0),
        drift(found.trace),
        f"{spent:.1f}",
    )
    notes = list(found.trace.remarks)
    if found.trace.next_experiment:
        notes.append(f"next: {found.trace.next_experiment}")
    return cells, notes


def verdict(found: Trace) -> str:
    """The verdict, and what is left unexplained."""
    left = found.unknown
    if not left.depends_on:
        return found.verdict
    return f"{found.verdict} ({', '.join(left.depends_on)}: {100 * left.explained:.0f} %)"


def effect(found: FoundEffect, rig: Rig) -> str:
    """An effect with its parameters and their 95 % half-widths."""
    parts = []
    for name, one in effect_estimates(found, rig).items():
        if one.value == 0 and not one.sd:
            continue  # held at nothing
        value = "?" if one.value is None else f"{one.value:.4g}"
        width = f" ± {1.96 * one.sd:.2g}" if one.sd else ""
        parts.append(f"{name} {value}{width} {one.unit}".removesuffix(" 1"))
    return f"{found.effect.key} ({', '.join(parts)}; {100 * found.explained:.3g} %)"


def force(found: Trace, where: str) -> str:
    """The force error before and after, and beside it the same relative to the force."""
    relative = errors(found, "force_relative", where, 100.0)
    return f"{errors(found, 'force_rms', where, 1.0)} ({relative} %)"


def errors(found: Trace, name: str, where: str, factor: float) -> str:
    """An error before and after; `-` where there is none."""
    was, now = (_number(of[where], name, factor) for of in (found.before, found.after))
    return "-" if was == now == "-" else f"{was} -> {now}"


def _number(of: Errors, name: str, factor: float) -> str:
    value = getattr(of, name)
    return "-" if value is None else f"{factor * value:.4g}"


def drift(found: Trace) -> str:
    """What differs between training and held-out logs."""
    parts = (
        f"{c.name} {c.before:.4g} -> {c.after:.4g} ± {1.96 * c.sd:.2g} {c.unit}"
        for c in found.drift
    )
    return "; ".join(parts) or "-"


def main(wanted: Sequence[str]) -> int:
    """Print the table and the remarks; 2 where no set is there."""
    chosen = [c for c in chapters() if not wanted or c.name.startswith(tuple(wanted))]
    notes: list[str] = []
    ran = False
    print("|", " | ".join(HEAD), "|")
    print("|" + "---|" * len(HEAD))
    for chapter in chosen:
        cells, said = row(chapter)
        print("|", " | ".join(cells), "|", flush=True)
        notes += [f"- {chapter.name}: {line}" for line in said]
        ran |= not cells[1].startswith("skipped")
    print("", *notes, sep="\n")
    return 0 if ran else 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
