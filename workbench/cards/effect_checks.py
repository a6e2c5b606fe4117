"""What a user's effect is checked for: all that every effect must hold to, and its units, which a
package of units multiplies out."""

from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np

from identification.effect_contract.declaration import (
    STATE_NAMES,
    Broken,
    check_declaration,
    check_depends_on,
    check_equation,
    check_linear,
    parsed,
)
from identification.effect_contract.runs import (
    check_never_drives,
    check_sampling,
    check_shows,
    check_signals,
    check_vanishes,
)
from identification.effects._base import Effect
from identification.errors import BadModel
from workbench.cards.units import si_unit

STATE_UNITS = dict(t="s", y="m", v="m/s", F="N", u="V", d="1", c="N", f="N")
USUAL_STATES = ("N", "m", "s", "m/s")  # units of a state that does not say its own


def check_units(effect: Effect) -> None:
    """The written equation multiplies out to the unit of what the effect gives."""
    import pint
    import sympy  # type: ignore[import-untyped]

    registry: pint.UnitRegistry[float] = pint.UnitRegistry()
    equation, errors = parsed(effect), []
    units = {**STATE_UNITS, **{name: si_unit(name, "linear") or "1" for name in effect.signals}}
    for p in effect.params:
        units[p.name] = p.unit.replace("**n", "**2")  # a unit with the exponent's own value
    remembers = equation.has(sympy.Symbol("z", real=True))
    own = USUAL_STATES if effect.state_unit is None else (effect.state_unit,)
    for unit in own if remembers else ("1",):
        names = (*STATE_NAMES, *effect.signals, *effect.names)
        try:
            values = [registry.Quantity(2.0, {**units, "z": unit}[n]) for n in names]
            numbers = [2 if n == "n" else a for n, a in zip(names, values, strict=True)]
            function = sympy.lambdify(
                [sympy.Symbol(n, real=True) for n in names], equation, [_quantities(), "math"]
            )
            registry.Quantity(function(*numbers)).to(effect.place.unit)
        except (pint.PintError, TypeError, AttributeError) as error:
            errors.append(" ".join(str(error).split()))
        else:
            return
    advice = "" if not remembers or effect.state_unit else "; say the state's unit as state_unit"
    raise Broken(f"units do not multiply out to {effect.place.unit}: {errors[0]}{advice}")


@cache
def _quantities() -> dict[str, Callable[..., Any]]:
    """Functions that an equation may use, of quantities with units."""
    return {
        "exp": np.exp, "sin": np.sin, "cos": np.cos, "Abs": abs,
        "copysign": lambda a, b: float(np.copysign(a, b.magnitude)),
        "Max": _with_unit(max), "Min": _with_unit(min),
    }  # fmt: skip


def _with_unit(choose: Callable[..., Any]) -> Callable[..., Any]:
    """max or min of quantities, in which a plain 0 is a 0 of the others' unit."""
    import pint

    def of(*given: Any) -> Any:
        unit = next((a.units for a in given if isinstance(a, pint.Quantity)), None)
        same = [a if unit is None or isinstance(a, pint.Quantity) else a * unit for a in given]
        return choose(*same)

    return of


Check = Callable[[Effect], None]
CHECKS: Mapping[str, Check] = MappingProxyType(
    {
        "declaration is complete": check_declaration,
        "equation, Python and compiled kernel agree": check_equation,
        "linear where declared": check_linear,
        "units multiply out": check_units,
        "signals and parameters are those declared": check_depends_on,
        "signals can be simulated": check_signals,
        "friction never drives": check_never_drives,
        "vanishes with its size": check_vanishes,
        "shows at its typical size": check_shows,
        "needs no finer step": check_sampling,
    }
)
LAST_WITHOUT_A_RUN = "signals can be simulated"


def failures(effect: Effect) -> dict[str, str]:
    """What the effect does not hold to: name of the check and what it found; empty where none."""
    out: dict[str, str] = {}
    for name, check in CHECKS.items():
        try:
            check(effect)
        except (Broken, BadModel) as error:
            out[name] = str(error)
        if name == LAST_WITHOUT_A_RUN and name in out:
            break
    return out
