"""Parameters of an effect as a card writes them."""

from collections.abc import Mapping

from design.machine.effect_values import check_names, effect_units, known_effect, with_exponents
from identification.effects._base import Acting
from identification.effects._library import Library
from identification.errors import BadCard, BadModel
from identification.log import Motion
from workbench.cards.units import in_unit_of


def written_effect(
    key: str,
    written: Mapping[str, object],
    library: Library,
    motion: Motion = "linear",
    command: str = "V",
) -> Acting:
    """The effect as a card writes it: numbers in SI, or texts with a unit such as "30 mm/s".

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
            number = in_unit_of(value, unit, where)
        except BadCard as error:
            p = effect.params[effect.names.index(name)]
            example = f"{p.typical:g}" if p.unit == "1" else f"{p.typical:g} {p.unit}"
            raise BadModel(f'{error}; write it as "{example}"') from None
        assert number is not None
        values[name] = float(number)
    return effect.acting(values)
