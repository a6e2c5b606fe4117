"""Parameters of effects: as results write them, and as simulation takes them."""

import re
from collections.abc import Mapping
from dataclasses import replace

from design.machine.card_table import InUnit
from design.machine.nearest import nearest
from design.machine.readable import Conversion, in_unit
from identification.effects._base import Acting, Effect
from identification.effects._library import Library, of_key
from identification.errors import BadCard, BadModel
from identification.log import Motion
from identification.model.estimates import Estimate

_COMMAND = re.compile(r"\bV\b")
_SYMBOLIC_EXPONENT = re.compile(r"\*\*([A-Za-z_]\w*)")


def effect_units(effect: Effect, motion: Motion, command: str = "V") -> dict[str, str]:
    """Units of an effect's parameters, by name; an exponent may be the name of a parameter.

    Effects declare them for a linear machine whose command is a voltage; a rotary one has rad and
    N m in the same places, another command its own unit in that of V.
    """
    units = {p.name: _COMMAND.sub(lambda _: command, p.unit) for p in effect.params}
    return units if motion == "linear" else {name: _turned(unit) for name, unit in units.items()}


def known_effect(key: str, library: Library) -> Effect:
    """The effect of that key; raises BadModel with the nearest one where there is none."""
    found = of_key(key, library)
    if found is None:
        raise BadModel(
            f"unknown effect {key!r}{nearest(key, library)}; one of your own needs its folder:"
            " --effects FOLDER"
        )
    return found


def estimates_in_si(
    key: str,
    estimates: Mapping[str, Estimate],
    library: Library,
    conversion: Conversion,
    motion: Motion,
    command: str = "V",
) -> dict[str, Estimate]:
    """An effect's estimates in their SI units; raises BadModel, naming key and parameter, where one
    is unknown, missing or of another kind."""
    effect = known_effect(key, library)
    units = effect_units(effect, motion, command)
    check_names(key, estimates, effect)

    known = {
        name: one.assumed if one.value is None else one.value for name, one in estimates.items()
    }
    values = {name: value for name, value in known.items() if value is not None}
    out: dict[str, Estimate] = {}
    for name, found in estimates.items():
        unit = units[name]
        plain, target = (with_exponents(one, values) for one in (found.unit, unit))
        same = in_unit(replace(found, unit=plain), target, f"[effects.{key}.{name}]", conversion)
        out[name] = replace(same, unit=unit)
    return out


def relabelled(
    effect: Effect, estimates: Mapping[str, Estimate], motion: Motion, command: str = "V"
) -> dict[str, Estimate]:
    """Estimates in SI under the machine's own units; their numbers are as they were."""
    units = effect_units(effect, motion, command)
    return {name: replace(found, unit=units[name]) for name, found in estimates.items()}


def exact(acting: Acting, motion: Motion, command: str = "V") -> dict[str, Estimate]:
    """Parameters that are known exactly, as those of a recipe."""
    units = effect_units(acting.effect, motion, command)
    return {name: Estimate(value, units[name]) for name, value in acting.values.items()}


def check_names(key: str, given: Mapping[str, object], effect: Effect) -> None:
    """Raises BadModel where a parameter is given that the effect has not, or one is missing."""
    for name in given:
        if name not in effect.names:
            raise BadModel(f"{key}: unknown parameter {name!r}{nearest(name, effect.names)}")
    for p in effect.params:
        if p.name not in given and p.default is None:
            raise BadModel(f"{key} has no {p.name!r} [{p.unit}], {p.meaning}; add it")


def with_exponents(unit: str, values: Mapping[str, float]) -> str:
    """A unit, its exponents that are parameters as numbers; 1 where one is not known."""
    return _SYMBOLIC_EXPONENT.sub(lambda found: f"**{values.get(found[1], 1.0):g}", unit)


def _turned(unit: str) -> str:
    """The unit on a rotary machine."""
    turned = re.sub(r"\bm\b", "rad", unit)
    return re.sub(r"(/?)\bN\b", lambda found: "/(N m)" if found[1] else "N m", turned)


def written_effect(
    key: str,
    written: Mapping[str, object],
    library: Library,
    read: InUnit,
    motion: Motion = "linear",
    command: str = "V",
) -> Acting:
    """The effect as a card writes it: numbers in SI, or texts with a unit such as "30 mm/s",
    which `read` takes.

    Raises BadModel, naming key and parameter, where one is unknown, missing, out of its bounds or
    of another kind.
    """
    effect = known_effect(key, library)
    units = effect_units(effect, motion, command)
    check_names(key, written, effect)
    values = dict[str, float]()
    # Units with an exponent of their own last, when the exponent is known.
    for name in sorted(written, key=lambda name: "**" in units[name]):
        value, where = written[name], f"{key}.{name}"
        unit = with_exponents(units[name], values)
        try:
            if isinstance(value, bool) or not isinstance(value, int | float | str):
                raise BadCard(f"{where} = {value!r}: a number in {unit!r} or a text with its unit")
            number = read(value, unit, where)
        except BadCard as error:
            p = effect.params[effect.names.index(name)]
            example = f"{p.typical:g}" if p.unit == "1" else f"{p.typical:g} {p.unit}"
            raise BadModel(f'{error}; write it as "{example}"') from None
        assert number is not None
        values[name] = float(number)
    return effect.acting(values)
