"""Cards read: a machine, and how its logs are to be read (CONTRACT, "Card").

Their tables are in workbench/cards/card_tables.py; what is wrong with one is said in one line, by
the names that the card uses.
"""

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol, TypeVar

from pydantic import ValidationError

from design.machine.card_table import InUnit
from design.machine.controller import CardController, present
from design.machine.drive import Present
from design.machine.effect_values import written_effect
from design.machine.nearest import nearest
from design.machine.table_keys import keys_at
from design.simulated.recipe import Recipe, RecipeSection
from identification.effects._library import Library, built_in
from identification.errors import BadCard, BadModel, BadSpecification
from identification.log import Rig
from workbench.cards.card_tables import About, CardFile, FileEntry, FileSpec, RigSection, SignalSpec
from workbench.cards.units import in_unit_of, si_unit
from workbench.files import CARD_BYTES, refuse_larger, refuse_special

NEEDED_SIGNALS: Mapping[str, tuple[str, ...]] = {
    "electro-pneumatic": ("t", "y", "p_p", "p_n"),
    "force": ("t", "y", "F"),
    "motor": ("t", "y", "u"),
    "velocity": ("t", "y", "u"),
}
OFFERED_FOR_VELOCITY = "doctor, identify, trace, predict, design and validate"

Value = TypeVar("Value")
Made = TypeVar("Made", covariant=True)


class InUnits(Protocol[Made]):
    """A table that is given what reads a text with its unit."""

    def value(self, rig: Rig, in_unit: InUnit, /) -> Made: ...


_OWN_COLUMN_SIGNALS = ("t", "y", "F", "p_p", "p_n", "u")


@dataclass(frozen=True)
class Card:
    """A card as read: `signals` by canonical name, `files` the set, `split` its named groups.

    `controller`: the one that the machine has now; `limits`: of `axis-test`, in SI, by name.
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
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The set's name, which is also its folder under WORKBENCH_DATA."""
        return self.about.name

    @property
    def of_velocity(self) -> bool:
        """Whether the velocity follows the command on any rig of the card."""
        return any(rig.kind == "velocity" for rig in self.rigs.values())

    def refuse_velocity(self) -> None:
        """Raises BadCard where the velocity follows the command: there is no friction to find."""
        if self.of_velocity:
            raise BadCard(
                f'{self.path}: [rig] kind = "velocity" has no friction, which this needs; for such'
                f" a rig there are {OFFERED_FOR_VELOCITY}"
            )

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
        rigs = {"": _of(path, parsed.rig.value, signals)}
        for number, entry in enumerate(parsed.files):
            if entry.rig:
                merged = CardFile.model_validate({**raw, "rig": {**raw["rig"], **entry.rig}}).rig
                rigs[entry.name] = _of(path, merged.value, signals)
                _need_signals(path, merged, parsed.signals, f"[files.{number}.rig]")
        wanted = parsed.recipe if with_recipe else None
        rig = rigs[""]
        recipe = _recipe(wanted, library, rig) if wanted else None
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
        controller=_in_si(path, parsed.controller, rig) if parsed.controller else None,
        limits=MappingProxyType(_in_si(path, parsed.limits, rig) if parsed.limits else {}),
    )


def present_of_card(card: Card, rig: Rig, h: float) -> Present | None:
    """What model.json holds of the card's controller; h [s]: period of the logs.

    None where the card names none. Raises BadCard where it is none, or does not fit the rig.
    """
    if card.controller is None:
        return None
    try:
        return present(card.controller, rig, h)
    except (BadCard, BadSpecification) as error:
        raise BadCard(f"{card.path}: controller: {error}") from None


def _recipe(section: RecipeSection, library: Library | None, rig: Rig) -> Recipe:
    """The recipe, with the effects of the library, by default all but a user's own files."""
    if section.effects and not library:
        from workbench.cards import own_effects  # with it comes numba

        library = own_effects.library()
    known, motion, command = library or built_in(), rig.motion, rig.command_unit
    return section.value(
        partial(written_effect, library=known, read=in_unit_of, motion=motion, command=command)
    )


def _in_si(path: Path, table: InUnits[Value], rig: Rig) -> Value:
    """The value of a table whose numbers may be texts with a unit; raises as `_of`."""
    return _of(path, table.value, rig, in_unit_of)


def _of(path: Path, value: Callable[..., Value], *given: Any) -> Value:
    """The value of a table; raises BadCard with the card's path before what is wrong with it."""
    try:
        return value(*given)
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


def _recipe_signals(rig: RigSection) -> dict[str, SignalSpec]:
    names = ("F",) if rig.kind != "electro-pneumatic" else ("p_p", "p_n")
    units = {name: str(si_unit(name, rig.motion)) for name in ("t", "r", "y", *names)}
    units["u"] = rig.command_unit or "V"
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
    for name, other in product(("t", "y"), _OWN_COLUMN_SIGNALS):
        if other != name and {name, other} <= signals.keys():
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
    # Of a union pydantic names the validators too.
    where = ".".join(one for one in map(str, loc) if not one.startswith("function-"))
    table = f"[{where}] " if where else ""
    kind, found = first["type"], first.get("input")
    if kind == "unknown_key":
        key = str(first["msg"])
        return f"{table}unknown key {key!r}{nearest(key, keys_at(CardFile, first['loc']))}"
    if kind == "missing":
        parent = ".".join(str(part) for part in first["loc"][:-1])
        if not parent:
            return f"has no table [{first['loc'][-1]}]; add it"
        if isinstance(first["loc"][-1], int):
            return f"[{parent}] has too few values; add those that are missing"
        return f"[{parent}] has no {first['loc'][-1]!r}; add it"
    if kind == "model_type":
        keys = ", ".join(f"{key} = ..." for key in keys_at(CardFile, loc)[:2])
        return f"{table}{_shown(found)}: a table {{ {keys} }} needed"
    said = _UNIONS.get(str(union)) or _FAULTS.get(kind) or str(first["msg"])
    message = " ".join(said.removeprefix("Value error, ").split())
    shown = "" if isinstance(found, Mapping) else f"{_shown(found)}: "
    return f"{table}{shown}{message[:1].lower()}{message[1:]}"


def _shown(found: object) -> str:
    return " ".join(repr(found).split())[:60]
