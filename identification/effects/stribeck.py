"""Friction that falls with speed before the viscous part takes over."""

import math

from identification.effects._base import Effect, Param, R, Rs, asymmetry


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """F_s exp(-(|v|/v_s)^delta)."""
    return p[0] * (1.0 + p[2] * d) * math.exp(-((abs(v) / p[1]) ** p[3]))


EFFECT = Effect(
    key="stribeck",
    meaning="friction falls with speed from a higher level at slow sliding (Stribeck)",
    equation="F_s*(1 + asymmetry*d)*exp(-(Abs(v)/v_s)**delta)",
    source="Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083, eq. (5)",
    acts="slip",
    params=(
        Param("F_s", "N", 0.0, 1e6, 3.0, "level above Coulomb at vanishing speed", linear=True),
        Param("v_s", "m/s", 1e-5, 1e2, 0.03, "speed at which 37 % of it is left"),
        asymmetry(),
        Param("delta", "1", 0.5, 4.0, 2.0, "how sharply it falls; 1 is Tustin's law", default=2.0),
    ),
    value=value,
    depends_on=("v",),
)
