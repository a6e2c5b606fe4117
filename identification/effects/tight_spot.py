"""Friction that is higher around one place: a dent, dirt, a bent or worn part of the guide."""

import math

from identification.effects._base import Effect, Param, R, Rs, asymmetry, at_rest


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """size exp(-((y - y_0)/width)^2/2), a share of it at rest."""
    off = (y - p[1]) / p[2]
    share = 1.0 if f > c else p[4] if d > 0.0 else p[5]
    return p[0] * math.exp(-0.5 * off * off) * (1.0 + p[3] * d) * share


EFFECT = Effect(
    key="tight_spot",
    meaning="friction that is higher (or lower) around one place of the stroke",
    equation="size*exp(-((y - y_0)/width)**2/2)*(1 + asymmetry*d)"
    "*Piecewise((1, f > c), (at_rest_p, d > 0), (at_rest_n, True))",
    source="Armstrong-Helouvry, Control of Machines with Friction, Kluwer 1991, position-dependent"
    " friction; the bell is ours",
    acts="friction",
    params=(
        Param("size", "N", -1e6, 1e6, 2.0, "friction added at the place", True),
        Param("y_0", "m", -1e3, 1e3, 0.01, "the place", role="place"),
        Param("width", "m", 1e-6, 1e2, 0.01, "standard width of it", role="width"),
        asymmetry(),
        *at_rest(),
    ),
    value=value,
    depends_on=("y",),
)
