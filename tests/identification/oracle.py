"""Eq. (1) by plain Euler in very fine steps, written without the kernels; and wrong variants."""

import numpy as np

from identification.arrays import Array
from identification.compiled import compiled
from identification.model.karnopp import Karnopp

RIGHT = 0
COASTS_IN_BAND = 1  # inside the band velocity stays instead of falling to 0
BREAKS_AWAY_AT_COULOMB = 2  # the stick limits are F_cp, -F_cn
SYMMETRIC_BAND = 3
SYMMETRIC_VISCOUS = 4
SYMMETRIC_STICK = 5
COULOMB_IN_BAND = 6  # beyond the limit the band has Coulomb friction
NO_COUPLING = 7  # dF/dt = k1 u
FREE_IN_BAND = 8  # beyond the limit the band has no friction
MUTANTS = range(1, 9)


@compiled
def _euler(p: Array, k1: float, k2: float, u: Array, h: float, sub: int, wrong: int) -> Array:
    out = np.zeros((3, len(u)))
    y, v, force, d = 0.0, 0.0, 0.0, h / sub
    m, f_cp, f_cn, f_vp, f_vn, dv_p, dv_n, f_sp, f_sn = p
    if wrong == 2:
        f_sp, f_sn = f_cp, -f_cn
    if wrong == 3:
        dv_n = -dv_p
    if wrong == 4:
        f_vn = f_vp
    if wrong == 5:
        f_sn = -f_sp
    if wrong == 7:
        k2 = 0.0
    for k in range(len(u)):
        out[0, k], out[1, k], out[2, k] = y, v, force
        for _ in range(sub):
            if v >= dv_p:
                friction = f_cp + f_vp * v
            elif v <= dv_n:
                friction = -f_cn + f_vn * v
            elif force > f_sp:
                friction = f_cp if wrong == 6 else (0.0 if wrong == 8 else f_sp)
            elif force < f_sn:
                friction = -f_cn if wrong == 6 else (0.0 if wrong == 8 else f_sn)
            else:
                friction = force
                v = v if wrong == 1 else 0.0
            v_next = v + d * (force - friction) / m
            force += d * (k1 * u[k] - k2 * v)
            y += d * v
            v = v_next
    return out


def euler(
    nine: Karnopp, k1: float, k2: float, u: Array, h: float, sub: int, wrong: int = RIGHT
) -> Array:
    """Position, velocity and force (3, n) before every sample, from rest, `sub` steps a sample."""
    return _euler(nine.array, k1, k2, u, h, sub, wrong)
