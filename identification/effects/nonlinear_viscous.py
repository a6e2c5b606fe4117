"""Viscous friction that is not in proportion to speed: a power of it."""

import math

from identification.effects._base import Effect, Param, R, Rs, asymmetry


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """k |v|^n."""
    return p[0] * (1.0 + p[2] * d) * math.pow(abs(v), p[1])


EFFECT = Effect(
    key="nonlinear_viscous",
    meaning="friction that grows with a power of speed (turbulent flow, churning, thick grease)",
    equation="k*(1 + asymmetry*d)*Abs(v)**n",
    source="Olsson, Astrom, Canudas de Wit, Gafvert, Lischinsky, European Journal of Control 4"
    " (1998) 176, viscous friction as a power of velocity",
    acts="slip",
    params=(
        Param("k", "N (s/m)**n", 0.0, 1e6, 20.0, "friction at unit speed", linear=True),
        Param("n", "1", 0.3, 4.0, 2.0, "exponent of speed"),
        asymmetry(),
    ),
    value=value,
    depends_on=("v",),
)
