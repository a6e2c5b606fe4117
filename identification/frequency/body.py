"""Frequency response of a body by its parameters, beside which a measured one is laid."""

import numpy as np

from identification.arrays import Array
from identification.frequency.stretches import ComplexArray


def body_response(
    f: Array, m: float, viscous: float, *, stiffness: float = 0.0, lag: float = 0.0,
    second_mass: tuple[float, float, float] | None = None,
) -> ComplexArray:  # fmt: skip
    """Position over force [m/N] at f [Hz], (k,).

    m: mass, of both where there are two [kg]; viscous friction [N s/m], stiffness of a spring to
    the ground [N/m], lag of the position [s]; second_mass: resonance and anti-resonance [Hz], and
    damping of the resonance, as of a `Resonance`.
    """
    s = 2j * np.pi * f
    inertia = m * s**2
    if second_mass is not None:
        frequency, anti, damping = second_mass
        w_r, w_a = 2.0 * np.pi * frequency, 2.0 * np.pi * anti
        drag = 2.0 * damping * w_a / w_r  # z_a w_r = z w_a, as `two_masses` has it
        zero = s**2 + drag * w_a * s + w_a**2
        inertia = inertia * (w_a / w_r) ** 2 * (s**2 + 2.0 * damping * w_r * s + w_r**2) / zero
    return np.asarray(np.exp(-s * lag) / (inertia + viscous * s + stiffness), dtype=np.complex128)
