"""The weight of an arm, a rod or a wheel out of balance: a torque that the angle sets.

Every rotary machine but a bare rotor has it, so it is part of the plain model of a rotary machine
(`estimation/surroundings`) and no discovery.
"""

import math

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """-a sin(y/turn) - b cos(y/turn)."""
    angle = y / p[2]
    return -p[0] * math.sin(angle) - p[1] * math.cos(angle)


EFFECT = Effect(
    key="gravity",
    meaning="the weight of an arm, a torque by the sine of its angle",
    equation="-a*sin(y/turn) - b*cos(y/turn)",
    source="Gautier, Khalil, On the identification of the inertial parameters of robots, 27th IEEE"
    " Conference on Decision and Control 1988: the gravity terms of the inverse dynamic model",
    acts="force",
    params=(
        Param("a", "N", -1e6, 1e6, 2.0, "size of the sine: weight times lever", True),
        Param("b", "N", -1e6, 1e6, 0.5, "size of the cosine: where 0 is not hanging", True, 0.0),
        Param(
            "turn", "m", 1e-6, 1e3, 1.0, "motion per radian (1 of an angle)", False, 1.0, "known"
        ),
    ),
    value=value,
    depends_on=("y",),
)
