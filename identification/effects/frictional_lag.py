"""Friction that follows the speed late (frictional memory).

The state z is the lagged friction itself, signed as the motion. At rest the friction of the nine
parameters is what holds the body, so z goes towards the applied force within the stick limit:
after a slow breakaway friction falls from the stick limit, not from nought. The lag is that of the
nine parameters' friction; other effects add to it without lag. Unequal directions enter by f.
"""

import math

from identification.effects._base import Effect, Param, R, Rs


def value(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """What the lagged friction exceeds the present one by, never below nought in total."""
    return max(d * z, 0.0) - f


def evolve(dt: R, t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """dz/dt = (d f - z)/tau exactly; at rest towards the applied force within the stick limit."""
    to = min(max(F, -f), f) if d == 0.0 else d * f
    return to + (z - to) * math.exp(-dt / p[0])


def initial(t: R, y: R, v: R, F: R, u: R, d: R, z: R, c: R, f: R, s: Rs, p: Rs) -> R:
    """The present friction."""
    return min(max(F, -f), f) if v == 0.0 else d * f


EFFECT = Effect(
    key="frictional_lag",
    meaning="sliding friction follows the speed late (frictional memory)",
    equation="Max(d*z, 0) - f",
    source="Hess, Soom, Journal of Tribology 112 (1990) 147",
    acts="slip",
    params=(Param("tau", "s", 1e-5, 10.0, 0.01, "time constant of the lag"),),
    value=value,
    depends_on=("v", "reversal"),
    evolve=evolve,
    initial=initial,
)
