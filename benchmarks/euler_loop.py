"""A position loop around eq. (1) in plain Euler steps, written apart from the fit's kernels."""

import numpy as np

from identification.arrays import Array
from identification.compiled import compiled


@compiled
def closed_loop(
    p: Array, k1: float, k2: float, motor: bool, gains: Array, r: Array, n_y: Array, n_f: Array,
    h: float, sub: int,
) -> Array:  # fmt: skip
    """Position, velocity, force and command (4, n) before every sample, from rest."""
    m, f_cp, f_cn, f_vp, f_vn, dv_p, dv_n, f_sp, f_sn = p
    k_p, k_d, k_i, c_p, c_i = gains
    out = np.zeros((4, len(r)))
    y, v, force, d = 0.0, 0.0, 0.0, h / sub
    speed, before, sum_e, sum_f = 0.0, 0.0, 0.0, 0.0
    for k in range(len(r)):
        seen = y + n_y[k]
        speed += 0.3 * ((seen - before) / h - speed)
        before = seen
        sum_e += h * (r[k] - seen)
        wanted = k_p * (r[k] - seen) - k_d * speed + k_i * sum_e
        if motor:
            u = wanted / k1
            force = k1 * u
        else:
            off = wanted - force - n_f[k]
            sum_f += h * off
            u = c_p * off + c_i * sum_f
        out[0, k], out[1, k], out[2, k], out[3, k] = y, v, force, u
        for _ in range(sub):
            if v >= dv_p:
                friction = f_cp + f_vp * v
            elif v <= dv_n:
                friction = -f_cn + f_vn * v
            elif force > f_sp:
                friction = f_sp
            elif force < f_sn:
                friction = f_sn
            else:
                friction = force
                v = 0.0
            after = v + d * (force - friction) / m
            if not motor:
                force += d * (k1 * u - k2 * v)
            y += 0.5 * d * (v + after)
            v = after
    return out
