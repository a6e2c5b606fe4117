"""Files for `init_files`: logs of known machines under other names, units, signs and layouts."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.init_words import ROTARY_WORDS, WORDS
from benchmarks.outside_rig import (
    AREA_N,
    AREA_P,
    MEAN,
    REFERENCES,
    RIGS,
    SUPPLY,
    recording,
    reference,
    run,
    sizes_of,
)
from design.simulated.record import record
from identification.arrays import Array
from identification.log import Log, Rig
from workbench.cards.card import load_card
from workbench.logs.runs import read_log
from workbench.logs.sources import card_path, find_data

RECIPES = ("demo", "paper_table1_rich", "paper_table2", "paper_table3")
PNEUMATIC = Rig("electro-pneumatic", area_p=12.6e-4, area_n=10e-4, supply_pressure=6e5)
SI: Mapping[str, str] = {"t": "s", "y": "m", "r": "m", "F": "N", "p_p": "Pa", "p_n": "Pa",
                         "u": "V", "v": "m/s", "temperature": "degC"}  # fmt: skip
UNITS: Mapping[str, Mapping[str, float]] = {  # spelling: what one of it is in SI
    "t": {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "sec": 1.0},
    "y": {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "cm": 1e-2},
    "y rotary": {"rad": 1.0, "deg": np.pi / 180, "°": np.pi / 180},
    "F": {"N": 1.0, "kN": 1e3},
    "p": {"bar": 1e5, "kPa": 1e3, "MPa": 1e6, "Pa": 1.0},
    "u": {"V": 1.0, "mV": 1e-3},
    "v": {"m/s": 1.0, "mm/s": 1e-3},
    "v rotary": {"rad/s": 1.0, "deg/s": np.pi / 180},
    "temperature": {"°C": 1.0},
}
BARE = {"t": ("s", "ms"), "y": ("m", "mm"), "y rotary": ("rad", "deg"), "F": ("N",),
        "p": ("bar", "Pa"), "u": ("V",), "v": ("m/s", "mm/s"), "v rotary": ("rad/s",),
        "temperature": ("°C",)}  # fmt: skip  # of headers that give none
STYLES = ("{0} [{1}]", "{0} ({1})", "{0}/{1}", "{0}_{1}", "{0} in {1}", "{0}[{1}]")


@dataclass(frozen=True)
class Case:
    """A file and what it truly holds: signals in SI (n,) as they were before names, units and
    signs were changed, kinds of rig that are right, signals known up to a factor only, and the
    correlation from which one is the true one."""

    path: Path
    said: str
    truth: Mapping[str, Array]
    kinds: tuple[str, ...]
    rotary: bool
    up_to_factor: frozenset[str]
    alike: float = 0.9995


@dataclass(frozen=True)
class _Machine:
    said: str
    log: Log
    kinds: tuple[str, ...]
    rotary: bool = False
    keep: tuple[str, ...] = ()


def make_case(seed: int, words: str, folder: Path) -> Case:
    """The file of a seed, written into the folder."""
    rng = np.random.default_rng([seed, 35])
    machine = _machine(seed, rng)
    signals = _kept(machine, rng)
    style = _Style.drawn(words, rng)
    truth = dict(signals)
    flips = _flips(signals, rng)
    columns = {name: flips.get(name, 1.0) * x for name, x in signals.items()}
    columns |= _extras(columns, machine, rng)
    uncertain: set[str] = set()
    headers, units, values = list[str](), list[str](), list[Array]()
    order = rng.permutation(list(columns))
    for name in order:
        header, unit, x = style.column(str(name), columns[str(name)], machine.rotary, rng)
        headers.append(header)
        units.append(unit)
        values.append(x)
        if name == "u" and not style.shows_units:
            uncertain.add("u")
    path = folder / f"case_{seed}.csv"
    style.write(path, headers, units, np.column_stack(values), rng)
    said = f"{machine.said} ({', '.join(map(str, order))}; {style.said})"
    return Case(path, said, truth, machine.kinds, machine.rotary, frozenset(uncertain))


def _machine(seed: int, rng: np.random.Generator) -> _Machine:
    kind = seed % 10
    if kind < 4:
        card = load_card(card_path(RECIPES[kind]))
        assert card.recipe is not None
        recipe = replace(card.recipe, duration=float(rng.uniform(15.0, 35.0)))
        return _Machine(card.name, record(card.name, recipe, seed, card.rig()), ("force",))
    if kind in (4, 5):
        card = load_card(card_path(RECIPES[1 + kind % 2]))
        assert card.recipe is not None
        recipe = replace(card.recipe, duration=20.0, noise_p=30.0, mean_pressure=4e5)
        log = record(card.name, recipe, seed, PNEUMATIC)
        return _Machine(f"pneumatic {card.name}", log, ("electro-pneumatic", "force"))
    if kind == 6:
        return _apart(seed, rng)
    return _measured(kind, rng)


def _apart(seed: int, rng: np.random.Generator) -> _Machine:
    """A motor, or now and then another machine, of the program written apart (`outside_rig`)."""
    name = str(rng.choice(["motor", "pneumatic", "force"], p=[0.6, 0.2, 0.2]))
    rig, how = RIGS[name], recording(rng)
    r = reference(REFERENCES[seed % 3], rng, how.h, min(how.seconds, 40.0))
    nine = np.array(rig.nine) * rng.uniform(0.75, 1.3, 9)
    nine[7:] = np.sign(nine[7:]) * np.maximum(np.abs(nine[7:]), 1.15 * nine[1:3])
    e = sizes_of("none", name, float(np.mean(nine[1:3])))
    noise = how.noise_y * rng.standard_normal(len(r))
    y, u, F = run(nine, np.array(rig.gains), rig.k1, rig.k2, rig.limit, name == "motor", e, r,
                  noise, how.h, how.count)  # fmt: skip
    signals = {"t": how.h * np.arange(len(r)), "y": y, "r": r, "u": u}
    if name == "force":
        signals["F"] = F + how.noise_F * rng.standard_normal(len(r))
    if name == "pneumatic":  # eq. (7)
        both = F + (AREA_P - AREA_N) * SUPPLY
        p_n = (2.0 * AREA_P * MEAN - both) / (AREA_P + AREA_N)
        signals["p_p"] = (both + AREA_N * p_n) / AREA_P + how.noise_p * rng.standard_normal(len(r))
        signals["p_n"] = p_n + how.noise_p * rng.standard_normal(len(r))
    kind = {"motor": "motor", "force": "force"}.get(name, "electro-pneumatic")
    return _Machine(f"{name} written apart", Log(name, signals), (kind,))


def _measured(kind: int, rng: np.random.Generator) -> _Machine:
    """One of the measured logs."""
    name = {7: "emps", 8: "pneumatic_seals"}.get(kind) or str(
        rng.choice(["friction_backlash", "xl330_servo"])
    )
    card = load_card(card_path(name))
    names = [entry.name for entry in card.files]
    if name == "xl330_servo":  # runs in which the motor is switched off tell no drive
        names = list(card.split["train"])[::2]
    file = str(rng.choice(names))
    log = read_log(find_data(file, card), card)
    kinds = ("motor",) if name in ("emps", "xl330_servo") else ("force",)
    if "F_logged" in log:
        log = log.with_signals(F=log["F_logged"])
    return _Machine(f"{name} {file}", log, kinds, name == "xl330_servo")


def _kept(machine: _Machine, rng: np.random.Generator) -> dict[str, Array]:
    """The signals that are in the file; some may be left out."""
    found = {name: np.array(machine.log[name]) for name in SI if name in machine.log}
    if machine.kinds == ("motor",):
        found.pop("F", None)
    if "p_p" in found and "p_n" in found and rng.random() < 0.8:
        found.pop("F", None)
    for name in ("r", "u") if machine.kinds != ("motor",) else ("r",):
        if name in found and rng.random() < 0.2:
            del found[name]
    if "velocity" in machine.log:
        found["v"] = np.array(machine.log["velocity"]) * 0.0254
    if "r" in found and np.ptp(found["r"]) == 0.0:
        del found["r"]
    return found


def _flips(signals: Mapping[str, Array], rng: np.random.Generator) -> dict[str, float]:
    """Signs that the file has other than the machine."""
    axis = -1.0 if rng.random() < 0.2 else 1.0
    out = dict.fromkeys(("y", "r", "v"), axis)
    for name in ("F", "u"):
        if name in signals and rng.random() < 0.2:
            out[name] = -1.0
    return out


def _extras(
    columns: Mapping[str, Array], machine: _Machine, rng: np.random.Generator
) -> dict[str, Array]:
    """Columns that no card needs."""
    t, y = columns["t"], columns["y"]
    n = len(t)
    out: dict[str, Array] = {}
    if "v" not in columns and rng.random() < 0.4:
        from identification.signals.differentiate import differentiate

        out["v"] = differentiate(y, float(np.median(np.diff(t)))).v
    if "temperature" not in columns and rng.random() < 0.3:
        out["temperature"] = np.round(25.0 + 3.0 * (t - t[0]) / (t[-1] - t[0]), 1)
    if rng.random() < 0.25:
        out["n"] = np.arange(n, dtype=np.float64)
    if rng.random() < 0.25:
        out["status"] = np.full(n, 8.0)
    if "r" in columns and rng.random() < 0.3:
        out["e"] = columns["r"] - y
    if rng.random() < 0.2 and not machine.rotary:
        out["raw"] = np.round(5.0 + 4.0 * y / np.max(np.abs(y)), 3)
    return out


@dataclass(frozen=True)
class _Style:
    """How a file is written."""

    words: str
    language: str
    unit_style: str  # a pattern, "bare", "row" or "none" (without header)
    delimiter: str
    decimal: str
    encoding: str
    preamble: int
    unit_of: Mapping[str, int]  # by kind of signal; pressures have one unit, and so have y and r

    @classmethod
    def drawn(cls, words: str, rng: np.random.Generator) -> "_Style":
        language = str(rng.choice(["english", "german", "japanese", "terse"]))
        shown = str(
            rng.choice(
                [*STYLES, "bare", "bare", "row", "none"],
                p=[0.15, 0.15, 0.1, 0.08, 0.07, 0.1, 0.1, 0.1, 0.1, 0.05],
            )
        )
        german = language == "german" and rng.random() < 0.6
        delimiter = ";" if german else str(rng.choice([",", "\t", ";"], p=[0.7, 0.15, 0.15]))
        decimal = "," if german else "."
        encodings = {"german": ("utf-8-sig", "cp1252", "utf-8"),
                     "japanese": ("utf-8-sig", "cp932", "utf-8")}  # fmt: skip
        encoding = str(rng.choice(encodings.get(language, ("utf-8", "utf-8-sig"))))
        return cls(words, language, shown, delimiter, decimal, encoding,
                   int(rng.integers(1, 6)) if rng.random() < 0.15 else 0,
                   {key: int(rng.integers(12)) for key in UNITS})  # fmt: skip

    @property
    def shows_units(self) -> bool:
        return self.unit_style not in ("bare", "none")

    @property
    def said(self) -> str:
        """The style in a few words."""
        layout = f"{self.delimiter!r} {self.decimal!r} {self.encoding}"
        head = f", {self.preamble} lines before" if self.preamble else ""
        return f"{self.language}, units {self.unit_style!r}, {layout}{head}"

    def column(
        self, name: str, x: Array, rotary: bool, rng: np.random.Generator
    ) -> tuple[str, str, Array]:
        """Header, unit and values of a signal in this style."""
        turning = ROTARY_WORDS[self.words].get(name, ()) if rotary else ()
        words = turning or WORDS[self.words][self.language][name]
        word = str(rng.choice(words))
        key = "p" if name.startswith("p_") else {"r": "y", "e": "y"}.get(name, name)
        key = f"{key} rotary" if rotary and key in ("y", "v") else key
        if key not in UNITS:
            return word, "", x
        offered = list(UNITS[key]) if self.shows_units else list(BARE[key])
        if rotary and name == "u":
            return word, "", x
        unit = offered[self.unit_of.get(key, 0) % len(offered)]
        value = x / UNITS[key][unit]
        if self.encoding == "cp932":  # which has no micro sign of its own
            unit = unit.replace("µ", "μ")
        if self.unit_style in STYLES:
            return self.unit_style.format(word, unit), unit, value
        return word, unit, value

    def write(
        self, path: Path, headers: list[str], units: list[str], table: Array,
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        """The file."""
        lines = [f"Export {k}: bench {rng.integers(100)}" for k in range(self.preamble)]
        if self.unit_style != "none":
            lines.append(self.delimiter.join(headers))
        if self.unit_style == "row":
            lines.append(self.delimiter.join(f"[{one}]" if one else "" for one in units))
        for row in table.tolist():
            text = self.delimiter.join(f"{one:.10g}" for one in row)
            lines.append(text.replace(".", self.decimal) if self.decimal == "," else text)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes("\r\n".join(lines).encode(self.encoding, "replace"))
