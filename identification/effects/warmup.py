"""Friction that changes within a log, as grease warms up or seals bed in."""

import math

from identification.effects._base import Effect, Param, R, Rs, asymmetry, at_rest


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """(a c + b |v|)(1 - exp(-t/tau)): at rest c is the stick limit, and a share of it changes."""
    share = 1.0 if f > c else p[4] if d > 0.0 else p[5]
    return (p[0] * c * share + p[1] * abs(v)) * (1.0 - math.exp(-t / p[2])) * (1.0 + p[3] * d)


EFFECT = Effect(
    key="warmup",
    meaning="friction that changes in time within a log to a steady value (warming up, bedding in)",
    equation="(a*c*Piecewise((1, f > c), (at_rest_p, d > 0), (at_rest_n, True)) + b*Abs(v))"
    "*(1 - exp(-t/tau))*(1 + asymmetry*d)",
    source="Bittencourt, Wernholt, Sander-Tavallaey, Brogardh, IEEE/RSJ IROS 2010, 6161: friction"
    " of a joint that warms up",
    acts="friction",
    params=(
        Param(
            "a", "1", -0.95, 10.0, -0.2, "final relative change of Coulomb and stick level", True
        ),
        Param("b", "N s/m", -1e6, 1e6, -10.0, "final change of the viscous coefficient", True, 0.0),
        Param("tau", "s", 1e-2, 1e5, 15.0, "time constant"),
        asymmetry(),
        *at_rest(),
    ),
    value=value,
    depends_on=("t", "v"),
)
