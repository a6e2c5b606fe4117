"""Controllers that a machine may have now, sampled as a drive runs them."""

import math

import numpy as np

from design.polynomial import INTEGRATOR, add, check_period, multiply
from design.rst import RST
from identification.errors import BadSpecification


def cascade_to_rst(
    k_v: float, k_p: float, T_i: float, h: float, *, eps: float = 0.0, v_ff: float = 0.0
) -> RST:
    """A position P above a speed PI, sampled at h [s], as RST.

    v_ref = k_v (r - y) + v_ff dr/dt, u = k_p (1 + 1/(T_i s)) (v_ref - v); the speed v is the
    difference of y behind 1/(eps s + 1). k_v [1/s], k_p [u per m/s], T_i, eps [s], v_ff [-]; the
    sum is that of `design.pid`: h z^-1/(T_i (1 - z^-1)). Raises BadSpecification where a time or a
    gain is not positive (eps, v_ff may be 0).
    """
    h = check_period(h)
    for name, value in (("k_v", k_v), ("k_p", k_p), ("T_i", T_i)):
        if not (math.isfinite(value) and value > 0):
            raise BadSpecification(f"{name} = {value:g}, must be finite and > 0")
    if not (eps >= 0 and math.isfinite(eps) and math.isfinite(v_ff)):
        raise BadSpecification(f"eps = {eps:g} s, v_ff = {v_ff:g}: need eps >= 0, both finite")
    pole = math.exp(-h / eps) if eps > 0 else 0.0
    smoothing = np.array([1.0, -pole])
    difference = INTEGRATOR / h
    pi = k_p * add(INTEGRATOR, np.array([0.0, h / T_i]))
    R = np.convolve(pi, add(k_v * smoothing, (1.0 - pole) * difference))
    T = multiply(pi, add(np.array([k_v]), v_ff * difference), smoothing)
    return RST(R, np.convolve(INTEGRATOR, smoothing), T, h)
