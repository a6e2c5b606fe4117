"""A resonance of two masses with a spring between them."""

from dataclasses import dataclass

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
