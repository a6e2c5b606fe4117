"""A resonance of two masses with a spring between them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import bilinear, lfilter

from identification.arrays import Array
from identification.model.size import Size


@dataclass(frozen=True)
class Resonance:
    """What two masses show in the motion of the first: resonance and anti-resonance [Hz], damping
    of the resonance, the mass that is measured and the one behind the spring [kg], and friction of
    sliding on the first: Coulomb [N] and viscous [N s/m] each way."""

    frequency: Size
    anti_resonance: Size
    damping: Size
    m_1: Size
    m_2: Size
    F_cp: Size
    F_cn: Size
    F_vp: Size
    F_vn: Size

    @property
    def mass(self) -> Size:
        """Both masses together [kg]."""
        return Size(self.m_1.value + self.m_2.value, (self.m_1.sd**2 + self.m_2.sd**2) ** 0.5)


def load_acceleration(
    a: Array, h: float, frequency: float, anti_resonance: float, damping: float
) -> Array:
    """Acceleration of the second mass where the first has a (n,), every h [s].

    (2 z_a w_a s + w_a^2)/(s^2 + 2 z_a w_a s + w_a^2), as the spring and its damping take it along;
    frequencies [Hz] and damping as of a `Resonance`.
    """
    w_a = 2.0 * np.pi * anti_resonance
    drag = 2.0 * damping * anti_resonance / frequency * w_a
    sampled: Any = bilinear([drag, w_a**2], [1.0, drag, w_a**2], fs=1.0 / h)
    return np.asarray(lfilter(sampled[0], sampled[1], a))
