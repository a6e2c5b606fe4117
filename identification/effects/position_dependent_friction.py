"""Friction that varies along the stroke: a bent rod, a worn or tight spot, a screw's lead."""

import math

from identification.effects._base import Effect, Param, R, Rs, asymmetry, at_rest


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """c1 y + c2 y^2 + a sin(2 pi y/period) + b cos(2 pi y/period), a share of it at rest."""
    turn = 2.0 * math.pi * y / p[4]
    along = p[0] * y + p[1] * y * y + p[2] * math.sin(turn) + p[3] * math.cos(turn)
    share = 1.0 if f > c else p[6] if d > 0.0 else p[7]
    return along * (1.0 + p[5] * d) * share


EFFECT = Effect(
    key="position_dependent_friction",
    meaning="friction that varies with position",
    equation="(c1*y + c2*y**2 + a*sin(2*pi*y/period) + b*cos(2*pi*y/period))*(1 + asymmetry*d)"
    "*Piecewise((1, f > c), (at_rest_p, d > 0), (at_rest_n, True))",
    source="Armstrong-Helouvry, Control of Machines with Friction, Kluwer 1991, position-dependent"
    " friction",
    acts="friction",
    params=(
        Param("c1", "N/m", -1e6, 1e6, 10.0, "slope along the stroke", True, 0.0),
        Param("c2", "N/m**2", -1e8, 1e8, 100.0, "bend along the stroke", True, 0.0),
        Param("a", "N", -1e6, 1e6, 1.0, "size of the sine", True, 0.0),
        Param("b", "N", -1e6, 1e6, 1.0, "size of the cosine", True, 0.0),
        Param("period", "m", 1e-5, 1e2, 0.05, "length over which it repeats", role="period"),
        asymmetry(),
        *at_rest(),
    ),
    value=value,
    depends_on=("y",),
)
