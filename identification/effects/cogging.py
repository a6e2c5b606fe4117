"""The force of magnets or teeth that repeats along the stroke, whichever the direction."""

import math

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """a sin(2 pi y/period) + b cos(2 pi y/period)."""
    turn = 2.0 * math.pi * y / p[2]
    return p[0] * math.sin(turn) + p[1] * math.cos(turn)


EFFECT = Effect(
    key="cogging",
    meaning="a force that repeats along the stroke (magnets, gear teeth)",
    equation="a*sin(2*pi*y/period) + b*cos(2*pi*y/period)",
    source="Otten, de Vries, van Amerongen, Rankers, Gaal, IEEE/ASME Transactions on Mechatronics 2"
    " (1997) 179",
    acts="force",
    params=(
        Param("a", "N", -1e6, 1e6, 2.0, "size of the sine", True),
        Param("b", "N", -1e6, 1e6, 2.0, "size of the cosine", True, 0.0),
        Param("period", "m", 1e-5, 1e2, 0.02, "length over which it repeats"),
    ),
    value=value,
    depends_on=("y",),
)
