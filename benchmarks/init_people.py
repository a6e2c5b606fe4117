"""Does `workbench init` propose the right card for files as people have them?

    python benchmarks/init_people.py [--part judge|choose] [--files 40] [--first 0] [--out FOLDER]

`init_files` varies names, units and order, `init_real_tables` what a table holds; this varies the
layout (a clock for each signal, two instruments, stamps, ticks, blocks of a PLC's trace, bags,
structs, nested JSON, arrays, no header, what instruments write above the names) and takes names of
languages and plants that no word list holds, so that the signals' own course has to tell. Machines
are those of `init_real_tables`, and cylinders of two pressures.

Right at first: as for `init_real_tables`; where neither unit nor known word says so, force and
command count up to a factor, and either of "force" and "motor" is right. With the other: as many
lines put right by the answer "+". Layouts and languages of the part "choose" served to choose by;
those of "judge" judge.
"""

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks import init_people_layouts as layouts
from benchmarks.init_cases import Case
from benchmarks.init_people_words import KNOWN, PEOPLE
from benchmarks.init_real_tables import Table, fewest_wrong, machine, shared, with_the_other
from benchmarks.init_table_words import Kind
from identification.arrays import Array
from identification.errors import UserError
from workbench.steps.first_card.proposal import proposed

AREA_P, AREA_N = 12.6e-4, 9.4e-4
CORRELATED = 0.995  # correlation from which a signal brought to another clock is the true one


@dataclass(frozen=True)
class Layout:
    """A layout: how it is written, what a table of it holds, and whether names reach the file."""

    said: str
    write: layouts.Layout
    holds: tuple[str, ...] = ("y", "v", "F", "r", "temperature", "mode")
    named: bool = True
    alike: float = 0.9995
    changed: Mapping[str, str] = field(default_factory=dict)


_DRIVEN = ("y", "v", "a", "F")
KINDS: tuple[Layout, ...] = (
    Layout("position, velocity, acceleration", layouts.plain, (*_DRIVEN, "state", "n")),
    Layout("target, demand, measured", layouts.plain, ("y", "r", "target", "u", "v", "e")),
    Layout("before and behind a limiter", layouts.plain, ("y", "u0", "ff", "u", "r")),
    Layout("clutter", layouts.plain, ("y", "F", "v", "pred", "e", "temperature", "supply", "mode",
                                      "state", "constant", "i2t")),
    Layout("two pressures", layouts.plain, ("y", "p_p", "p_n", "r", "temperature")),
    Layout("a clock for each signal", layouts.clock_pairs, ("y", "F", "r"), alike=CORRELATED),
    Layout("two instruments", layouts.two_clocks, ("y", "v", "F", "temperature"), alike=CORRELATED),
    Layout("stamps", layouts.stamps),
    Layout("ticks", layouts.ticks),
    Layout("ugly headers", layouts.ugly),
    Layout("lines of an instrument", layouts.instrument),
    Layout("no header", layouts.headless, ("y", "v", "F", "mode"), named=False),
    Layout("arrays", layouts.array, ("y", "F"), named=False),
    Layout("struct of a trace", layouts.struct, ("y", "F", "r")),
    Layout("rollout", layouts.rollouts, ("y", "v", "F", "r")),
    Layout("bag", layouts.bag, ("y", "F", "v"), named=False),
    Layout("blocks", layouts.blocks, ("y", "F", "r", "mode"), alike=CORRELATED),
    Layout("current", layouts.plain, ("y", "current", "v", "supply", "i2t")),
)  # fmt: skip
UNITS: Mapping[str, tuple[str, ...]] = {"y": ("mm", "m"), "v": ("mm/s", "m/s"), "F": ("N",),
                                        "u": ("V",), "current": ("A",), "p": ("bar",)}  # fmt: skip
TURNING: Mapping[str, tuple[str, ...]] = {"y": ("deg", "rad", "°"), "v": ("deg/s", "rad/s", "°/s"),
                                          "F": ("Nm",)}  # fmt: skip
SI = {"mm": 1e-3, "m": 1.0, "mm/s": 1e-3, "m/s": 1.0, "N": 1.0, "V": 1.0, "A": 1.0, "bar": 1e5,
      "deg": np.pi / 180, "rad": 1.0, "°": np.pi / 180, "deg/s": np.pi / 180, "rad/s": 1.0,
      "°/s": np.pi / 180, "Nm": 1.0, "": 1.0}  # fmt: skip
KEY = {"r": "y", "target": "y", "pred": "y", "e": "y", "u0": "u", "ff": "u", "p_p": "p", "p_n": "p"}


def make_file(seed: int, part: str, folder: Path) -> Table:
    """The file of a seed, written into the folder."""
    rng = np.random.default_rng([seed, 83])
    kind = KINDS[seed % len(KINDS)]
    language = str(rng.choice(list(PEOPLE[part])))
    words, known = PEOPLE[part][language], language in KNOWN
    shown = kind.named and bool(rng.random() < 0.5)
    rotary = bool(rng.random() < 0.5) and "p_p" not in kind.holds
    t: Array = float(rng.choice([1e-3, 2e-3, 5e-3])) * np.arange(
        int(rng.integers(4000, 6000)), dtype=np.float64
    )
    signals = _signals(rng, t, rotary)
    units = _units(rng, rotary)
    columns = [("t", "", t)]
    for name in rng.permutation(kind.holds):
        unit = units.get(KEY.get(str(name), str(name)), "")
        columns.append((str(name), unit, signals[str(name)] / SI[unit]))
    if not kind.named:
        columns[1:] = sorted(columns[1:], key=lambda one: kind.holds.index(one[0]))
    pick = int(rng.integers(2))
    table = []
    for name, unit, x in columns:
        at = pick if name not in ("F", "v") else 0 if rotary else 1  # no torque slides
        word = words[name][at % len(words[name])]
        table.append((f"{word} [{unit}]" if shown and unit else word, x))
    path = kind.write(folder / f"people_{seed}", table, rng, part)
    said = f"{kind.said}, {language}, {'units' if shown else 'no units'}, " + (
        "turns" if rotary else "slides"
    )
    labelled = kind.named and not (kind.write is layouts.rollouts and part == "judge")
    shown, known = shown and labelled, known and labelled
    return Table(path, said, _cases(path, said, kind, signals, rotary, shown, known))


def _cases(
    path: Path, said: str, kind: Layout, signals: Mapping[str, Array], rotary: bool, shown: bool,
    known: bool,
) -> tuple[Case, ...]:  # fmt: skip
    """What is right: by the signals' own kind, and where nothing says so by the other too."""
    truth = {"t": signals["t"]} | {key: signals[key] for key in ("y", "r") if key in kind.holds}
    if "p_p" in kind.holds:
        both = {key: signals[key] for key in ("p_p", "p_n")}
        return (Case(path, said, truth | both, ("electro-pneumatic",), rotary, frozenset(),
                     kind.alike),)  # fmt: skip
    drive = next(key for key in ("F", "u", "current") if key in kind.holds)
    own = "F" if drive == "F" else "u"
    names = (own,) if known or shown else ("F", "u")
    uncertain = frozenset(() if shown else ("F", "u"))
    return tuple(
        Case(path, said, truth | {name: signals[drive]},
             ("force",) if name == "F" else ("motor",), rotary, uncertain, kind.alike)
        for name in names
    )  # fmt: skip


def _signals(rng: np.random.Generator, t: Array, rotary: bool) -> dict[str, Array]:
    """Every signal in SI that a table may hold."""
    body = Kind("", (), (), "F", (), rotary)
    out = {"t": t, **machine(rng, t, body), **shared(rng, t)}
    out["current"] = out["u"]
    heat = np.cumsum(out["u"] ** 2 - 0.5 * np.mean(out["u"] ** 2))
    out["i2t"] = np.round(100.0 * np.clip(heat / np.max(np.abs(heat)), 0.0, None), 1)
    area = 30.0 * out["F"] / max(float(np.max(np.abs(out["F"]))), 1e-9)  # N, well below the supply
    p_n = 3e5 - area / (AREA_P + AREA_N)
    out["p_p"] = (area + AREA_N * p_n) / AREA_P + 30.0 * rng.standard_normal(len(t))
    out["p_n"] = p_n + 30.0 * rng.standard_normal(len(t))
    return out


def _units(rng: np.random.Generator, rotary: bool) -> dict[str, str]:
    """One unit for each kind of signal; position and velocity mostly go together."""
    offered = {**UNITS, **(TURNING if rotary else {})}
    at = int(rng.integers(2))
    return {key: units[at % len(units)] for key, units in offered.items()}


def main() -> int:
    """Exit status 0 where nine in ten are right at first."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--part", choices=["choose", "judge"], default="judge")
    parser.add_argument("--files", type=int, default=40)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--out", type=Path, help="keep the files there")
    given = parser.parse_args()
    right = other = sure = bad = 0
    failed: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(given.first, given.first + given.files):
            table = make_file(seed, given.part, given.out or Path(folder))
            kind = KINDS[seed % len(KINDS)].said
            try:
                found = proposed(table.path)
            except UserError as error:
                failed[kind] += 1
                print(f"{seed} {table.said}: WRONG refused: {error}", flush=True)
                continue
            wrong = fewest_wrong(found, table)
            saved = not wrong or with_the_other(found, table)
            right, other = right + (not wrong), other + saved
            sure += sum(one.sure for one in found.signals)
            bad += sum(one.sure and one.name in wrong for one in found.signals)
            if wrong:
                failed[kind] += 1
                said = "; ".join(f"{name}: {why}" for name, why in wrong.items())
                print(f"{seed} {table.said}: {'other' if saved else 'WRONG'} {said}", flush=True)
    print(
        f"right at first: {right} of {given.files}, with the other: {other} (part {given.part});"
        f" {sure} lines called sure, {bad} of these wrong"
    )
    print("not right at first: " + ", ".join(f"{name} {many}" for name, many in failed.items()))
    return int(right < 0.9 * given.files)


if __name__ == "__main__":
    sys.exit(main())
