"""The table's entries: how each log is made, and what is right of it."""

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

TABLE = Path(__file__).parents[1] / "reference" / "verdicts.toml"
EVALUATIONS = 24_000  # at which a trace is halted, unless its entry says otherwise
_NUMBER = r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
_WITHIN = re.compile(
    rf"(?:(?P<value>{_NUMBER}) \+- )?(?P<share>{_NUMBER}) %"
    rf"|(?P<low>{_NUMBER}) to (?P<high>{_NUMBER})"
)
_OR_NONE = " or not identifiable"
Tables = Mapping[str, Any]


@dataclass(frozen=True)
class Within:
    """What a number may be: from low to high, or, where `open`, not identifiable."""

    low: float
    high: float
    open: bool = False

    def holds(self, value: float | None) -> bool:
        """Whether this is right."""
        return self.open if value is None else self.low <= value <= self.high

    def off(self, value: float) -> float:
        """How far a number is beside it, in half widths of it."""
        half = max(0.5 * (self.high - self.low), 1e-300)
        return max(self.low - value, value - self.high, 0.0) / half


@dataclass(frozen=True)
class Right:
    """The right answer: verdicts that are honest, effects that have to be named and their sizes,
    those that may be named beside, signals of which one is named where something is left, whether
    the model is complete (None: either), and parameters."""

    verdict: tuple[str, ...]
    effects: Mapping[str, Mapping[str, Within]] = field(default_factory=dict)
    may: tuple[str, ...] = ()
    depends_on: tuple[str, ...] = ()
    complete: bool | None = None
    parameters: Mapping[str, Within] = field(default_factory=dict)


@dataclass(frozen=True)
class Entry:
    """One line of the table; `tables` as the file has them, the machine's beneath its own."""

    name: str
    tables: Tables
    right: Right

    @property
    def evaluations(self) -> int:
        """How often the trace may ask whether it is to go on, which it does before every run.

        A budget of seconds would answer otherwise on another computer.
        """
        return int(self.tables.get("evaluations", EVALUATIONS))

    @property
    def long(self) -> bool:
        """Whether it is left out of the table that every change has to pass."""
        return bool(self.tables.get("long", False))


def entries(path: Path = TABLE) -> dict[str, Entry]:
    """The entries by name, in the file's order."""
    raw = tomllib.loads(path.read_text(encoding="utf-8"))
    machines = raw.get("machines", {})
    return {name: _entry(name, one, machines) for name, one in raw["logs"].items()}


def _entry(name: str, raw: Tables, machines: Tables) -> Entry:
    own = {key: value for key, value in raw.items() if key not in ("machine", "right")}
    beneath: Tables = machines[raw["machine"]] if "machine" in raw else {}
    whole = merged(beneath, own)
    return Entry(name, whole, right_answer(name, raw["right"], whole.get("recipe", {})))


def merged(base: Tables, over: Tables) -> dict[str, Any]:
    """Tables over tables; a table that names its `kind` replaces the one below it whole."""
    out = dict(base)
    for key, value in over.items():
        below = out.get(key)
        if isinstance(value, Mapping) and isinstance(below, Mapping) and "kind" not in value:
            out[key] = merged(below, value)
        else:
            out[key] = value
    return out


def right_answer(name: str, raw: Tables, recipe: Tables) -> Right:
    """The right answer as the table writes it; raises ValueError where that is no such thing."""
    unknown = set(raw) - {"verdict", "effects", "may", "depends_on", "complete", "parameters"}
    if unknown:
        raise ValueError(f"{name}.right: unknown {sorted(unknown)}")
    verdict = raw["verdict"]
    drive = recipe.get("actuator") or recipe.get("motor") or {}
    known = {**recipe.get("friction", {}), **drive}
    effects = recipe.get("effects", {})
    return Right(
        verdict=(verdict,) if isinstance(verdict, str) else tuple(verdict),
        effects={
            key: _all_within(f"{name}.{key}", sizes, with_amplitudes(effects.get(key, {})))
            for key, sizes in raw.get("effects", {}).items()
        },
        may=tuple(raw.get("may", ())),
        depends_on=tuple(raw.get("depends_on", ())),
        complete=raw.get("complete"),
        parameters=_all_within(name, raw.get("parameters", {}), known),
    )


def _all_within(where: str, raw: Mapping[str, str], known: Tables) -> dict[str, Within]:
    return {key: within(f"{where}.{key}", text, known.get(key)) for key, text in raw.items()}


def within(where: str, text: str, known: float | None) -> Within:
    """ "0.86 +- 5 %", "2.5 to 4.3", or "3 %" of what is known of it, as of a recipe."""
    interval = text.removesuffix(_OR_NONE)
    found = _WITHIN.fullmatch(interval)
    if found is None:
        raise ValueError(f'{where} = {text!r}: "3 %", "0.86 +- 5 %" or "2.5 to 4.3" needed')
    if found["low"]:
        return Within(float(found["low"]), float(found["high"]), interval != text)
    middle = float(found["value"]) if found["value"] else known
    if middle is None:
        raise ValueError(f"{where} = {text!r}: of what? the recipe does not name it")
    half = abs(middle) * float(found["share"]) / 100.0
    return Within(middle - half, middle + half, interval != text)


def with_amplitudes(sizes: Mapping[str, float | None]) -> dict[str, float | None]:
    """An effect's sizes and the amplitude of each of its waves, whatever their phase."""
    out = dict(sizes)
    for end in ("", "_2"):
        a, b = out.get(f"a{end}"), out.get(f"b{end}")
        if a is not None and ("b" in out or "period" in out):
            out[f"amplitude{end}"] = math.hypot(a, b or 0.0)
    return out
