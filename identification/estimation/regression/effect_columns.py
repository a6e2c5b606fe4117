"""In which equations an effect shows, and which of its parameters are columns there."""

import re
from collections.abc import Mapping

from identification.effects._base import AT_REST, Effect, Param
from identification.estimation.regression.equation_rows import ACTUATOR, BREAKAWAY, MECHANICAL, REST

LEAST_LEFT_BY_LOAD = 0.1  # of the applied force, at least left to drive

Values = Mapping[str, float]
SLIDING = "f > c"  # as an equation says it
BOUND_SLACK = 0.05  # of an effect's largest size, by which another may lie out of bounds


def equations_of(effect: Effect, by_command: bool, by_motor: bool) -> tuple[str, ...]:
    """The equations in which an effect shows; by_motor: the force is that of its command."""
    if by_motor and effect.place.on_command:
        return (MECHANICAL,)
    if effect.place.rubs or effect.place.drives:
        return (MECHANICAL,)
    if effect.place.elastic:
        return (MECHANICAL, REST)
    if effect.place.in_stops:
        return (BREAKAWAY,)
    if effect.place.in_actuator:
        return (ACTUATOR,) if by_command else ()
    if "F" in effect.depends_on:
        # In the actuator equation it is another k1 and k2 only.
        return (MECHANICAL, REST)
    return (MECHANICAL, ACTUATOR) if by_command else (MECHANICAL,)


def in_columns(effect: Effect) -> bool:
    """Whether its linear parameters are columns of a regression."""
    # The force is the regression's b.
    return effect.place.adds and not effect.load_dependent


def slow_motion(effect: Effect) -> bool:
    """Whether the effect has a speed of its own."""
    return any(p.unit in ("m/s", "rad/s") for p in effect.params)


def split(effect: Effect) -> bool:
    """Whether its one linear parameter gets a column for each direction."""
    return in_columns(effect) and "asymmetry" in effect.names and len(effect.linear) == 1


def shape_params(effect: Effect) -> list[Param]:
    """Parameters that are searched: those in which its rows are not linear."""
    return [
        p
        for p in effect.params
        if not (p.linear and in_columns(effect))
        and not (p.name == "asymmetry" and (split(effect) or effect.load_dependent))
        and p.name not in AT_REST  # no equation of sliding identifies it
    ]


def needs_rounds(effect: Effect) -> bool:
    """Whether the contribution depends on the friction parameters that are fitted with it."""
    sizes = symbols_of(effect.equation.replace(SLIDING, ""))
    return effect.place.rubs and bool({"c", "f"} & sizes)


def symbols_of(equation: str) -> set[str]:
    """Names in an equation."""
    return set(re.findall(r"[A-Za-z_]\w*", equation))


def admissible(effect: Effect, values: Values) -> bool:
    """Whether every parameter lies within its bounds.

    One size of several, or of two directions, may lie slightly beyond: one that is 0 comes out on
    either side of it.
    """
    most = max((abs(values[name]) for name in effect.linear), default=0.0)

    def slack(p: Param) -> float:
        if p.name == "asymmetry" and split(effect):
            return BOUND_SLACK
        return BOUND_SLACK * most if p.linear else 0.0

    return all(p.low - slack(p) <= values[p.name] <= p.high + slack(p) for p in effect.params)
