"""Logs of the table's entries: simulated by recipe or roughly, or measured; read from files."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from design.machine.source import Source
from design.simulated.record import record
from identification.arrays import Array
from tests.verdicts.entries import Entry, Tables, merged
from tests.verdicts.rough_machine import Rough, columns
from workbench.cards.card import Card, card_from, load_card
from workbench.logs.sources import Sources, card_path, sources_of
from workbench.steps.simulate import as_columns


class Absent(Exception):
    """Measured data that are not on this computer."""


def sources(entry: Entry, data: Path | None, folder: Path) -> tuple[Sources, Sources | None]:
    """Training and held-out runs of an entry, through files and a card.

    data: the measured sets' folder, with that of the small cases beside it; folder: where
    simulated logs are written. Raises Absent where an entry needs data that are not there.
    """
    one = entry.tables
    if "files" in one:
        return _measured(one, data, folder)
    card = _card(one, folder)
    written = [_simulated(entry, part, folder) for part in ("train", "test")]
    train, test = (sources_of([str(path)], card) for path in written)
    return train, test


def _card(one: Tables, folder: Path) -> Card:
    named = one.get("card")
    if isinstance(named, str):
        return load_card(card_path(named), with_recipe=False)
    tables = {key: one[key] for key in ("rig", "signals", "recipe", "file") if key in one}
    raw = {"card": {"name": "verdict"}, **tables, **(named or {})}
    return card_from(raw, folder / "card.toml", with_recipe=False)


def _simulated(entry: Entry, part: str, folder: Path) -> Path:
    """A simulated log's file; the held-out one has other seeds, and what its entry changes."""
    one, number = entry.tables, ("train", "test").index(part)
    if number:
        one = merged(one, one.get("test", {}))
    seed = int(one.get("seed", 1)) + 100 * number
    if "rough" in one:
        found = columns(Rough(**one["rough"]), seed)
    else:
        raw = {"card": {"name": "verdict"}, "rig": one["rig"], "recipe": one["recipe"]}
        card = card_from({**raw, "signals": one.get("signals", {})}, folder / "card.toml")
        assert card.recipe is not None
        found = as_columns(record(entry.name, card.recipe, seed, card.rig()), card)
    path = folder / f"{part}.csv"
    seen = _sensed(found, one.get("sensor", {}), np.random.default_rng(seed + 1000))
    pd.DataFrame(seen).to_csv(path, index=False, float_format="%.12g")
    return path


def _sensed(found: dict[str, Array], sensor: Tables, rng: np.random.Generator) -> dict[str, Array]:
    """The columns as a poorer recorder has them.

    every: samples of the simulation to one of the log; late: share of the log's period by which
    an instant is off; told: whether its clock says so; count: step of the position's encoder.
    """
    every, late = int(sensor.get("every", 1)), float(sensor.get("late", 0.0))
    n = len(found["t"])
    even = np.arange(every, n - every, every)
    off = np.rint(every * late * rng.uniform(-1.0, 1.0, len(even))).astype(np.int64)
    at = even + off if every > 1 else np.arange(n)
    out = {key: x[at] for key, x in found.items()}
    if every > 1 and not sensor.get("told", True):
        out["t"] = found["t"][even]
    count = float(sensor.get("count", 0.0))
    if count > 0.0:
        out["y"] = count * np.round(out["y"] / count)
    return out


def _measured(one: Tables, data: Path | None, folder: Path) -> tuple[Sources, Sources | None]:
    """Runs of files on this computer, cut to the seconds that the entry takes of them."""
    files = one["files"]
    if data is None:
        raise Absent("no measured data: set WORKBENCH_DATA")
    home = data.parent / "cases" if files.get("cases") else data / files["folder"]
    names = [*files["train"], *files.get("test", ())]
    missing = [name for name in names if not (home / name).is_file()]
    if missing:
        raise Absent(f"no {missing[0]} in {home}")
    card = load_card(home / files["cases"]) if files.get("cases") else _card(one, folder)
    spans = [files.get("train_s"), files.get("test_s")]
    parts = [files["train"], files.get("test", ())]
    read = [
        _cut(sources_of([str(_readable(home / name, folder)) for name in part], card), span)
        for part, span in zip(parts, spans, strict=True)
        if part
    ]
    return read[0], read[1] if len(read) > 1 else None


def _readable(path: Path, folder: Path) -> Path:
    """The file itself; numpy's own, which no reader of logs takes, as columns with numbers."""
    if path.suffix != ".npy":
        return path
    rows = np.load(path).T
    copy = folder / f"{path.stem}.csv"
    pd.DataFrame(rows[np.all(np.isfinite(rows), axis=1)]).to_csv(copy, index=False, header=False)
    return copy


def _cut(whole: Sources, span: Sequence[float] | None) -> Sources:
    """From second to second of each run, and a hash that tells the parts of one file apart."""
    if span is None:
        return whole
    runs = [part for run in whole.runs if (part := _part(run, span)) is not None]
    return replace(whole, runs=tuple(runs))


def _part(run: Source, span: Sequence[float]) -> Source | None:
    t = run.log["t"] - run.log["t"][0]
    first, last = np.searchsorted(t, span)
    if last - first < 100:
        return None
    part = run.log.part(int(first), int(last))
    return replace(
        run, log=part, sha256=f"{run.sha256}:{span[0]:g}-{span[1]:g}", rows=int(last - first)
    )
