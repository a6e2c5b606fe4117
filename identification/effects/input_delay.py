"""A command that arrives late: bus, computation, pilot stage."""

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """tau."""
    return p[0]


EFFECT = Effect(
    key="input_delay",
    meaning="the command reaches the actuator late",
    equation="tau",
    source="Normey-Rico, Camacho, Control of Dead-time Processes, Springer 2007",
    acts="delay",
    params=(Param("tau", "s", 0.0, 10.0, 0.005, "the delay"),),
    value=value,
    depends_on=("u",),
)
