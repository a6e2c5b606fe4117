"""Breakaway force that grows with the time at rest."""

import math

from identification.effects._base import Effect, Param, R, Rs, asymmetry


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """F_r (1 - exp(-z/tau)), z the time at rest."""
    return p[0] * (1.0 + p[2] * d) * (1.0 - math.exp(-z / p[1]))


def evolve(dt: R, t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """Time at rest; it begins anew with every motion."""
    return z + dt if d == 0.0 else 0.0


EFFECT = Effect(
    key="rising_stiction",
    meaning="the stick limit grows with the time at rest",
    equation="F_r*(1 + asymmetry*d)*(1 - exp(-z/tau))",
    source="Kato, Sato, Matsubayashi, Journal of Lubrication Technology 94 (1972) 234; Rabinowicz,"
    " Proceedings of the Physical Society 71 (1958) 668",
    acts="stiction",
    params=(
        Param("F_r", "N", 0.0, 1e6, 3.0, "growth after a long rest", linear=True),
        Param("tau", "s", 1e-3, 1e4, 1.0, "time constant of the growth"),
        asymmetry(),
    ),
    value=value,
    depends_on=("rest",),
    evolve=evolve,
)
