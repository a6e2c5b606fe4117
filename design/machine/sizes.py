"""What quantities of servo machines lie between, in SI, with the units that are mistaken for it.

The ranges are wide on purpose: a remark on a sound machine is worse than none. They hold
positioners of a milligram and friction bearings under a hundred tonnes, cylinders of 1 mm and of
1 m, drives logged at 10 Hz and at 50 kHz.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi


@dataclass(frozen=True)
class Size:
    """What a quantity lies between in its SI unit, and the units that are mistaken for it, the most
    usual first: of it in SI, its name."""

    low: float
    high: float
    unit: str
    slips: Sequence[tuple[float, str]] = ()


_MILLIMETRES = ((1e-3, "mm"), (1e-6, "um"))
_OF_ANGLES = ((pi / 180.0, "deg"), (1e-3, "mrad"))

LINEAR = {
    # Slower than 5 Hz no breakaway shows.
    "period": Size(1.5e-5, 0.2, "s", ((1e-3, "ms"), (1e-6, "us"), (60.0, "min"))),
    "travel": Size(1e-6, 20.0, "m", _MILLIMETRES),  # piezo stages to gantries
    "speed": Size(1e-7, 20.0, "m/s", _MILLIMETRES),  # linear motors reach 10
    "force": Size(1e-5, 1e7, "N", ((1e3, "kN"), (1e-3, "mN"))),
    # Vacuum grippers to 1000 bar.
    "pressure": Size(5e3, 1e8, "Pa", ((1e5, "bar"), (1e3, "kPa"), (1e6, "MPa"))),
    "area": Size(1e-7, 1.0, "m^2", ((1e-6, "mm^2"), (1e-4, "cm^2"))),
    "mass": Size(1e-7, 1e6, "kg"),
    "acceleration": Size(0.03, 1e4, "m/s^2", _MILLIMETRES),  # of the peak force; shakers reach 1e3
    "bandwidth": Size(0.03, 2e4, "rad/s"),  # 5 mHz, which no position loop is for, to 3 kHz
}
# The same of a rotary machine, where it is another.
ROTARY = {
    **LINEAR,
    "travel": Size(1e-5, 1e6, "rad", _OF_ANGLES),
    "speed": Size(1e-6, 2e4, "rad/s", _OF_ANGLES),  # spindles reach 2e4
    "force": Size(1e-7, 1e7, "N m", ((1e-3, "mN m"), (1e3, "kN m"))),
    "mass": Size(1e-11, 1e6, "kg m^2"),
    "acceleration": Size(1e-3, 1e7, "rad/s^2", _OF_ANGLES),  # telescopes to galvanometers
}
