"""The asymmetric Karnopp friction model, paper eq. (1): nine parameters, units and bounds."""

from dataclasses import dataclass, fields

import numpy as np

from identification.arrays import Array
from identification.errors import BadModel

NAMES = ("m", "F_cp", "F_cn", "F_vp", "F_vn", "dv_p", "dv_n", "F_sp", "F_sn")
COULOMB_NAMES, VISCOUS_NAMES = ("F_cp", "F_cn"), ("F_vp", "F_vn")
NEGATIVE = frozenset({"dv_n", "F_sn"})
UNITS = {
    "m": "kg",
    "F_cp": "N",
    "F_cn": "N",
    "F_vp": "N s/m",
    "F_vn": "N s/m",
    "dv_p": "m/s",
    "dv_n": "m/s",
    "F_sp": "N",
    "F_sn": "N",
}
ROTARY_UNITS = {
    "m": "kg m^2",
    "F_cp": "N m",
    "F_cn": "N m",
    "F_vp": "N m s/rad",
    "F_vn": "N m s/rad",
    "dv_p": "rad/s",
    "dv_n": "rad/s",
    "F_sp": "N m",
    "F_sn": "N m",
}


@dataclass(frozen=True)
class Karnopp:
    """The nine parameters by the paper's names; all are positive but `dv_n` and `F_sn`.

    m [kg], Coulomb F_cp, F_cn [N], viscous F_vp, F_vn [N s/m], band limits dv_p, dv_n [m/s],
    stick limits F_sp, F_sn [N]. Raises BadModel where a sign is wrong, `m` is not positive or a
    value is not finite. Source: paper, eq. (1).
    """

    m: float
    F_cp: float
    F_cn: float
    F_vp: float
    F_vn: float
    dv_p: float
    dv_n: float
    F_sp: float
    F_sn: float

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            sign = -1.0 if field.name in NEGATIVE else 1.0
            if not np.isfinite(value) or sign * value < 0 or (field.name == "m" and value <= 0):
                need = (
                    "negative or 0" if sign < 0 else ("> 0" if field.name == "m" else "0 or more")
                )
                raise BadModel(f"{field.name} = {value:g} {UNITS[field.name]}, must be {need}")

    @property
    def array(self) -> Array:
        """The nine as an array, in the order of `NAMES`."""
        return np.array([getattr(self, name) for name in NAMES], dtype=np.float64)

    @classmethod
    def from_array(cls, values: Array) -> "Karnopp":
        """The model of nine values in the order of `NAMES`."""
        return cls(*(float(v) for v in values))


def slip_friction(v: Array, p: Karnopp) -> Array:
    """Friction force while sliding [N], shape of `v`.

    v: velocity [m/s], outside the band (p.dv_n, p.dv_p). Raises BadModel where a velocity lies
    inside it. Source: paper, eq. (1), F_slip.
    """
    v = np.asarray(v, dtype=np.float64)
    if np.any((v > p.dv_n) & (v < p.dv_p)):
        raise BadModel(f"velocity inside the band ({p.dv_n:g}, {p.dv_p:g}) m/s: no slip there")
    return np.where(v > 0, p.F_cp + p.F_vp * v, -p.F_cn + p.F_vn * v)


def friction(v: Array, driving: Array, p: Karnopp) -> Array:
    """Friction force [N] at velocity `v` [m/s] under the driving force [N], shape of `v`.

    Inside the band it equals the driving force up to its limits F_sn and F_sp. Source: eq. (1).
    """
    v = np.asarray(v, dtype=np.float64)
    stick = np.clip(driving, p.F_sn, p.F_sp)
    slip = np.where(v > 0, p.F_cp + p.F_vp * v, -p.F_cn + p.F_vn * v)
    return np.where((v > p.dv_n) & (v < p.dv_p), stick, slip)
