"""Feed-forward of acceleration and friction: the force that a machine's motion along its reference
needs, and its compiled law. That of velocity is the cascade's own (`v_ff`)."""

from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.compiled import compiled_exact
from identification.errors import BadModel
from identification.signals.filters import Filter

FF_CP, FF_CN, FF_VP, FF_VN, FF_BAND, FF_M, FF_MOST = range(7)


@compiled_exact
def feed_forward_force(law: Array, friction: Array, v: float, a: float) -> float:
    """Force [N] of the feed-forward `law` (7,) at a reference of v [m/s] and a [m/s^2].

    friction: the law itself, or a row that begins with F_cp, F_cn, F_vp, F_vn in its place.
    """
    share = min(max(v / law[FF_BAND], -1.0), 1.0)
    if v >= 0.0:
        slides = friction[FF_CP] * share + friction[FF_VP] * v
    else:
        slides = friction[FF_CN] * share + friction[FF_VN] * v
    whole = slides + law[FF_M] * a
    return float(min(max(whole, -law[FF_MOST]), law[FF_MOST]))


@dataclass(frozen=True)
class FeedForward:
    """m a + F_c sat(v/band) + F_v v of the reference, within +- most.

    F_cp, F_cn [N], F_vp, F_vn [N s/m]: friction each way; band [m/s]: of the reference's speed,
    within which Coulomb friction comes on; m [kg]; most [N]. Raises BadModel where band or most is
    not positive, or another is negative.
    """

    F_cp: float
    F_cn: float
    F_vp: float
    F_vn: float
    band: float
    m: float
    most: float

    def __post_init__(self) -> None:
        if not (self.band > 0 and self.most > 0 and np.all(self.law >= 0)):
            raise BadModel(
                f"feed-forward with a band of {self.band:g} m/s and at most {self.most:g} N: need"
                " both > 0, friction and mass >= 0"
            )

    @property
    def law(self) -> Array:
        """As `feed_forward_force` takes it, (7,)."""
        return np.array([self.F_cp, self.F_cn, self.F_vp, self.F_vn, self.band, self.m, self.most])

    @staticmethod
    def filters(h: float) -> tuple[Filter, Filter]:
        """The reference's velocity and acceleration by its differences, every h [s]."""
        return Filter((1.0 / h, -1.0 / h)), Filter((1.0 / h**2, -2.0 / h**2, 1.0 / h**2))
