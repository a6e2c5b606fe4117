"""Cards: what a machine is and how its logs are to be read (CONTRACT, "Card").

Every key is said below its field; `[recipe]` is in workbench/cards/recipe.py, `[controller]` in
workbench/cards/controller.py, and what a gain means in workbench/cards/sensors.py.
"""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import Field, Strict, ValidationError, model_validator

from identification.effects._library import Library
from identification.errors import BadCard, BadModel
from identification.log import Rig, RigKind
from identification.model.plant import over
from workbench.cards.controller import CardController, ControllerSection
from workbench.cards.nearest import nearest
from workbench.cards.quantities import in_unit_of
from workbench.cards.recipe import Recipe, RecipeSection
from workbench.cards.sensors import column_scale, command_unit, parse_gain
from workbench.cards.table import CardTable, Positive
from workbench.cards.units import LONGEST_UNIT, Scale, force_unit, si_unit
from workbench.files import CARD_BYTES, refuse_larger, refuse_special

Format = Literal["csv", "parquet", "mat", "hdf5", "json", "tdms", "mdf", "mcap", "ulog", "excel"]

NEEDED_SIGNALS: Mapping[str, tuple[str, ...]] = {
    "electro-pneumatic": ("t", "y", "p_p", "p_n"),
    "force": ("t", "y", "F"),
    "motor": ("t", "y", "u"),
}


_OWN_COLUMN_SIGNALS = ("t", "y", "F", "p_p", "p_n", "u")


class About(CardTable):
    """`[card]`: name of the set and where it comes from."""

    name: str = Field(pattern=r"^[\w.-]+$")
    """of the machine: letters, digits, `_`, `.`, `-`; also the folder of its files under
    `WORKBENCH_DATA`"""
    title: str = ""
    """in a line"""
    source: str = ""
    """who recorded the logs, and how"""
    licence: str = ""
    """of the logs"""
    citation: str = ""
    """how their authors want them cited"""
    url: str = ""
    """where they are described"""
    notes: tuple[str, ...] = ()
    """traps, one a text"""


class FileSpec(CardTable):
    """`[file]`: how the bytes are laid out; `None` means found by looking."""

    format: Format | None = None
    """of the files; without it, by their content"""
    header: bool | None = None
    """of text: whether a row of names is there; without it, by looking"""
    skip_rows: int = Field(default=0, ge=0)
    """rows to drop before the header, or before the data where there is none"""
    delimiter: str | None = Field(default=None, min_length=1, max_length=1)
    """of text; without it, by looking"""
    decimal: Literal[".", ","] | None = None
    """of text; without it, by looking"""
    comment: str = "#"
    """of text: rows that begin so are dropped"""
    rows: str | None = None
    """what holds the signals: JSON key, HDF5 group, MAT struct (`a.b`), sheet, group of channels,
    topic or message"""
    encoding: str = "utf-8"
    """of text"""


class SignalSpec(CardTable):
    """One signal: column = gain * signal + offset (see workbench/cards/sensors.py)."""

    column: str | int
    """its name in the log, or its number from 0"""
    unit: str
    """of the column; of a sensor's output where `gain` is a number of that output for each SI
    unit"""
    gain: Annotated[float, Strict()] | str = 1.0
    """column = gain * signal + offset: a text with its unit (`"80 V/m"`, `"4096 count/turn"`), or a
    number"""
    offset: float = 0.0
    """what the column shows where the signal is 0, in the unit of the column"""
    bits: int | None = Field(default=None, ge=2, le=52)
    """of a counter in two's complement"""
    signed: bool = False
    """whether an unsigned column is such a counter; needs `bits`"""

    @model_validator(mode="after")
    def _invertible(self) -> "SignalSpec":
        parse_gain(self.gain)
        if self.signed and self.bits is None:
            raise ValueError("signed = true needs bits")
        return self

    def scale(self, signal: str, rig: Rig) -> Scale:
        """Signal in SI = factor * (column - offset) + shift; raises BadCard where it cannot be."""
        return column_scale(self.unit, self.written_gain, signal, rig.motion, rig.command_unit)

    @property
    def written_gain(self) -> float | str | None:
        """The gain as it is written; None where it is not."""
        return self.gain if "gain" in self.model_fields_set else None


class RigSection(CardTable):
    """`[rig]` as a card writes it."""

    kind: RigKind
    """how the force on the body is known: from two pressures, logged as F, or as force_per_command
    times u"""
    area_p_m2: Positive | None = None
    """piston area of the chamber that pushes towards +y, m²; with `force` given too, the pressures
    correct F"""
    area_n_m2: Positive | None = None
    """piston area of the other chamber, m²"""
    supply_pressure_pa: float | None = None
    """P_s of eq. (7), Pa; left out (0) where areas are the same or pressures are gauge pressures"""
    force_per_command: float | str | None = None
    """of a motor: N for each unit of u, or a text (`"35.15 N/A"`)"""
    command_unit: str | None = Field(default=None, min_length=1, max_length=LONGEST_UNIT)
    """the unit of u inside; without it V, A, 1, N or N m, as the unit of its column is"""
    control_limit: Positive | str | None = None
    """of the size of u, in `command_unit`, or a text (`"8 A"`)"""
    control_limit_v: Positive | None = None
    """the older name of `control_limit`"""
    stroke_m: tuple[float, float] | None = None
    """low and high end of the motion, m (rad)"""
    motion: Literal["linear", "rotary"] = "linear"
    """rotary: rad, N m and kg m² in place of m, N and kg"""

    @model_validator(mode="after")
    def _complete(self) -> "RigSection":
        if self.kind == "electro-pneumatic":
            for key in ("area_p_m2", "area_n_m2"):
                if getattr(self, key) is None:
                    raise ValueError(f'kind = "electro-pneumatic" needs {key!r} for eq. (7)')
        if self.stroke_m and self.stroke_m[0] >= self.stroke_m[1]:
            raise ValueError("stroke_m must be [low, high]")
        if self.control_limit is not None and self.control_limit_v is not None:
            raise ValueError("control_limit and control_limit_v are the same; give one of them")
        return self

    def value(self, signals: Mapping[str, SignalSpec]) -> Rig:
        """The rig; signals tell the unit of its command where the card does not name it.

        Raises BadCard where a number's unit is of another kind.
        """
        command = self.command_unit or self._command_unit(signals)
        limit = self.control_limit_v if self.control_limit is None else self.control_limit
        per = over(force_unit(self.motion), command)
        return Rig(
            kind=self.kind,
            area_p=self.area_p_m2,
            area_n=self.area_n_m2,
            supply_pressure=self.supply_pressure_pa,
            force_per_command=in_unit_of(self.force_per_command, per, "rig.force_per_command"),
            control_limit=_positive(in_unit_of(limit, command, "rig.control_limit")),
            stroke=self.stroke_m,
            motion=self.motion,
            command_unit=command,
        )

    def _command_unit(self, signals: Mapping[str, SignalSpec]) -> str:
        """The unit of the command's column; a force where none is logged but its limit is told."""
        if "u" in signals:
            return command_unit(signals["u"].unit, signals["u"].written_gain, self.motion)
        return "V" if self.control_limit is None else force_unit(self.motion)


def _positive(limit: float | None) -> float | None:
    if limit is not None and not limit > 0:
        raise BadCard(f"rig.control_limit = {limit:g}, must be > 0")
    return limit


class FileEntry(CardTable):
    """`[[files]]`: one file of the set, where to fetch it, and what of the rig differs for it."""

    name: str
    """of the file"""
    url: str | None = None
    """where it can be fetched"""
    sha256: str | None = Field(default=None, pattern=r"^[0-9a-f]{64}$")
    """of its bytes; another file is refused"""
    rig: dict[str, Any] = Field(default_factory=dict)
    """keys of `[rig]` that differ for this file"""


class CardFile(CardTable):
    """A card as it is written."""

    card: About
    """what the machine is called, and where its logs come from"""
    rig: RigSection
    """the machine"""
    signals: dict[str, SignalSpec] = Field(default_factory=dict)
    """what each column is; `t`, `y`, and by kind `p_p` and `p_n`, `F`, or `u` are needed"""
    file: FileSpec = FileSpec()
    """how the files are laid out; all of it is found by looking where it is not given"""
    files: tuple[FileEntry, ...] = ()
    """the files of the set, one table each"""
    split: dict[str, tuple[str, ...]] = Field(default_factory=dict)
    """names of groups of files; `trace` takes `train` and `test`"""
    recipe: RecipeSection | None = None
    """in place of a log: what `simulate` makes one from"""
    controller: ControllerSection | None = None
    """the controller that the machine has now"""


@dataclass(frozen=True)
class Card:
    """A card as read: `signals` by canonical name, `files` the set, `split` its named groups.

    `controller`: the one that the machine has now.
    """

    path: Path
    about: About
    signals: Mapping[str, SignalSpec]
    file: FileSpec
    files: tuple[FileEntry, ...]
    split: Mapping[str, tuple[str, ...]]
    recipe: Recipe | None
    rigs: Mapping[str, Rig]
    controller: CardController | None = None

    @property
    def name(self) -> str:
        """The set's name, which is also its folder under WORKBENCH_DATA."""
        return self.about.name

    def rig(self, file: str = "") -> Rig:
        """The rig, with what `[[files]]` says of the file of that name."""
        return self.rigs.get(file, self.rigs[""])


def load_card(path: Path, library: Library | None = None, *, with_recipe: bool = True) -> Card:
    """The card in the file `path`.

    library: the effects that a recipe may name, by default all but a user's own files;
    with_recipe False leaves its recipe out, as for a log that is there. Raises BadCard, one line:
    what was found, in which key, what is needed; an unknown key comes with the nearest right one.
    """
    return card_from(_read_toml(path), path, library, with_recipe=with_recipe)


def card_from(
    raw: Mapping[str, Any], path: Path, library: Library | None = None, *, with_recipe: bool = True
) -> Card:
    """As `load_card`, of a card's tables; path: what messages call the card."""
    try:
        parsed = CardFile.model_validate(raw)
        signals = parsed.signals or (_recipe_signals(parsed.rig) if parsed.recipe else {})
        rigs = {"": _rig(path, parsed.rig, signals)}
        for number, entry in enumerate(parsed.files):
            if entry.rig:
                merged = CardFile.model_validate({**raw, "rig": {**raw["rig"], **entry.rig}}).rig
                rigs[entry.name] = _rig(path, merged, signals)
                _need_signals(path, merged, parsed.signals, f"[files.{number}.rig]")
        wanted = parsed.recipe if with_recipe else None
        rig = rigs[""]
        recipe = wanted.value(library, rig.motion, rig.command_unit) if wanted else None
    except ValidationError as error:
        raise BadCard(f"{path}: {explain(error)}") from None
    except BadModel as error:
        raise BadCard(f"{path}: [recipe] {error}") from None
    _need_signals(path, parsed.rig, signals, "[rig]")
    _check_split(path, parsed)
    if recipe is not None and recipe.by_card and parsed.controller is None:
        raise BadCard(
            f"{path}: [recipe] needs a 'loop' with a position where drive is \"loop\", or the card"
            " a [controller]"
        )
    return Card(
        path=path,
        about=parsed.card,
        signals=MappingProxyType(signals),
        file=parsed.file,
        files=parsed.files,
        split=MappingProxyType(parsed.split),
        recipe=recipe,
        rigs=MappingProxyType(rigs),
        controller=_controller(path, parsed, rigs[""]),
    )


def _rig(path: Path, section: RigSection, signals: Mapping[str, SignalSpec]) -> Rig:
    try:
        return section.value(signals)
    except BadCard as error:
        raise BadCard(f"{path}: {error}") from None


def _controller(path: Path, parsed: CardFile, rig: Rig) -> CardController | None:
    try:
        return None if parsed.controller is None else parsed.controller.value(rig)
    except BadCard as error:
        raise BadCard(f"{path}: {error}") from None


def _read_toml(path: Path) -> dict[str, Any]:
    refuse_special(path, BadCard)
    refuse_larger(path, CARD_BYTES, "a card", BadCard)
    try:
        text = path.read_text(encoding="utf-8-sig")
        if found := _DEEP.search(text):
            line = text.count("\n", 0, found.start()) + 1
            raise BadCard(f"{path}: line {line}: {_TOO_DEEP}")
        return tomllib.loads(text)
    except FileNotFoundError:
        raise BadCard(f"{path}: no such card; give a path or the name of a shipped card") from None
    except IsADirectoryError:
        raise BadCard(f"{path}: is a directory; give the card.toml in it") from None
    except UnicodeDecodeError:
        raise BadCard(f"{path}: is not UTF-8 text; give a TOML file, saved as UTF-8") from None
    except OSError as error:
        raise BadCard(f"{path}: cannot be read ({error.strerror}); check its rights") from None
    except tomllib.TOMLDecodeError as error:
        raise BadCard(f"{path}: is not TOML: {error}; correct that line") from None
    except RecursionError:
        raise BadCard(f"{path}: {_TOO_DEEP}") from None
    except ValueError as error:  # a whole number of thousands of digits
        raise BadCard(f"{path}: holds no card's number ({error}); correct it") from None


_TOO_DEEP = "tables or lists lie deeper in each other than in any card; correct it"
# The TOML reader's time and memory grow with the square of a dotted key's length.
_DEEP = re.compile(r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')\s*+\.\s*+){32}""")
_FAULTS = {  # what pydantic finds missing, in the words of a card
    "string_type": "a text in quotes needed",
    "float_type": "a number needed",
    "float_parsing": "a number needed",
    "int_type": "a whole number needed",
    "int_parsing": "a whole number needed",
    "int_from_float": "a whole number needed",
    "bool_type": "true or false needed",
    "bool_parsing": "true or false needed",
    "tuple_type": "a list [...] needed",
    "dict_type": "a table { key = value, ... } needed",
}
_UNIONS = {  # fields that may be of two types: pydantic names the one that it tried
    "column": "the column's name in quotes, or its number, needed",
    "gain": 'a number, or a text with its unit as "80 V/m", needed',
}


def explain(error: ValidationError) -> str:
    """The first of pydantic's errors in one line, by the names that the card uses."""
    first = error.errors(include_url=False)[0]
    union = next((part for part in first["loc"][:-1] if part in _UNIONS), None)
    loc = first["loc"][:-1] if union else first["loc"]
    where = ".".join(str(part) for part in loc if part != "function-before")
    table = f"[{where}] " if where else ""
    kind, found = first["type"], first.get("input")
    if kind == "unknown_key":
        key = str(first["msg"])
        return f"{table}unknown key {key!r}{nearest(key, _keys_at(first['loc']))}"
    if kind == "missing":
        parent = ".".join(str(part) for part in first["loc"][:-1])
        if not parent:
            return f"has no table [{first['loc'][-1]}]; add it"
        if isinstance(first["loc"][-1], int):
            return f"[{parent}] has too few values; add those that are missing"
        return f"[{parent}] has no {first['loc'][-1]!r}; add it"
    if kind == "model_type":
        keys = ", ".join(f"{key} = ..." for key in _keys_at(loc)[:2])
        return f"{table}{_shown(found)}: a table {{ {keys} }} needed"
    said = _UNIONS.get(str(union)) or _FAULTS.get(kind) or str(first["msg"])
    message = " ".join(said.removeprefix("Value error, ").split())
    shown = "" if isinstance(found, Mapping) else f"{_shown(found)}: "
    return f"{table}{shown}{message[:1].lower()}{message[1:]}"


def _shown(found: object) -> str:
    return " ".join(repr(found).split())[:60]


def _keys_at(loc: tuple[int | str, ...]) -> list[str]:
    """Keys of the section that stands at `loc`, found by walking the sections' fields."""
    sections: list[type[CardTable]] = [CardFile]
    for part in loc:
        found = [s.model_fields[str(part)].annotation for s in sections if part in s.model_fields]
        if found:
            sections = [inner for annotation in found for inner in _sections_in(annotation)]
        elif isinstance(part, str):
            sections = [s for s in sections if _tag(s) == part] or sections
    return [key for section in sections for key in section.model_fields]


def _sections_in(annotation: Any) -> list[type[CardTable]]:
    if isinstance(annotation, type) and issubclass(annotation, CardTable):
        return [annotation]
    parts = getattr(annotation, "__args__", ())
    return [section for part in parts for section in _sections_in(part)]


def _tag(section: type[CardTable]) -> str | None:
    field = section.model_fields.get("kind")
    tags = [str(tag) for tag in getattr(field.annotation, "__args__", ())] if field else []
    return tags[0] if len(tags) == 1 else None


def _recipe_signals(rig: RigSection) -> dict[str, SignalSpec]:
    linear = rig.motion == "linear"
    position, force = ("m", "N") if linear else ("rad", "N m")
    command = rig.command_unit or "V"
    units = {"t": "s", "r": position, "y": position, "F": force, "u": command}
    if rig.kind == "electro-pneumatic":
        units = {"t": "s", "r": position, "y": position, "p_p": "Pa", "p_n": "Pa", "u": command}
    return {name: SignalSpec(column=name, unit=unit) for name, unit in units.items()}


def _need_signals(
    path: Path, rig: RigSection, signals: Mapping[str, SignalSpec], where: str
) -> None:
    for name in NEEDED_SIGNALS[rig.kind]:
        if name not in signals:
            others = [key for key in signals if key not in NEEDED_SIGNALS[rig.kind]]
            unit = si_unit(name, rig.motion)
            raise BadCard(
                f"{path}: {where} kind = {rig.kind!r} needs signals.{name}{nearest(name, others)};"
                f' add {name} = {{ column = "<its name in the log>", unit = "{unit}" }}'
            )
    _refuse_twice(path, signals)


def _refuse_twice(path: Path, signals: Mapping[str, SignalSpec]) -> None:
    """Raises BadCard where time or position is read from the column of another signal."""
    for name in ("t", "y"):
        for other in _OWN_COLUMN_SIGNALS:
            if other != name and other in signals and name in signals:
                column = signals[name].column
                if signals[other].column == column:
                    raise BadCard(
                        f"{path}: signals.{name} and signals.{other} are both read from the column"
                        f" {column!r}; correct one of them"
                    )


def _check_split(path: Path, parsed: CardFile) -> None:
    known = [entry.name for entry in parsed.files]
    for group, names in parsed.split.items():
        for name in names:
            if known and name not in known:
                raise BadCard(f"{path}: [split] {group} names {name!r}{nearest(name, known)}")
    both = set(parsed.split.get("train", ())) & set(parsed.split.get("test", ()))
    if both:
        raise BadCard(f"{path}: [split] {min(both)!r} is in train and in test; keep it in one")
