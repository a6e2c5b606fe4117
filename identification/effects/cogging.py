"""The force of magnets or teeth that repeats along the stroke, whichever the direction."""

import math

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """a sin(2 pi y/period) + b cos(2 pi y/period), and the same at half the period."""
    turn = 2.0 * math.pi * y / p[2]
    sine, cosine = math.sin(turn), math.cos(turn)
    twice = p[3] * 2.0 * sine * cosine + p[4] * (1.0 - 2.0 * sine * sine)
    return p[0] * sine + p[1] * cosine + twice


EFFECT = Effect(
    key="cogging",
    meaning="a force that repeats along the stroke (magnets, gear teeth)",
    equation="a*sin(2*pi*y/period) + b*cos(2*pi*y/period)"
    " + a_2*sin(4*pi*y/period) + b_2*cos(4*pi*y/period)",
    source="Otten, de Vries, van Amerongen, Rankers, Gaal, IEEE/ASME Transactions on Mechatronics 2"
    " (1997) 179",
    acts="force",
    params=(
        Param("a", "N", -1e6, 1e6, 2.0, "size of the sine", True),
        Param("b", "N", -1e6, 1e6, 2.0, "size of the cosine", True, 0.0),
        Param("period", "m", 1e-5, 1e2, 0.02, "length over which it repeats", role="period"),
        Param("a_2", "N", -1e6, 1e6, 0.5, "size of the sine at half the period", True, 0.0),
        Param("b_2", "N", -1e6, 1e6, 0.5, "size of the cosine at half the period", True, 0.0),
    ),
    value=value,
    depends_on=("y",),
)
