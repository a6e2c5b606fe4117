"""The columns of a frequency response, as response.csv has them."""

import numpy as np

from design.measured.response import Responded, decibels, degrees, measured_curves
from identification.arrays import Array
from identification.frequency.stretches import ComplexArray


def response_columns(found: Responded) -> dict[str, Array]:
    """The columns of response.csv by name, a row a frequency; NaN where nothing is seen."""
    curves, f = found.curves, found.found.f
    columns: dict[str, Array] = {"frequency_hz": f}
    blank = np.full(len(f), np.nan + 0j)
    for name, one in measured_curves(found).items():
        H, half, coherence = blank, blank.real, blank.real
        if one is not None:
            H, half = (np.where(one.seen, x, np.nan) for x in (one.H, one.half_band))
            coherence = one.coherence
        columns |= {
            **_of_curve(name, H),
            f"{name}_band_db": decibels(1.0 + half),
            f"{name}_band_deg": np.minimum(np.degrees(half), 180.0),
            f"{name}_coherence": coherence,
        }
    plant, controller = (curves.plant, curves.controller) if curves else (None, None)
    for key, curve in (("plant_model", plant), ("controller_card", controller)):
        columns |= _of_curve(key, blank if curve is None else curve)
    return columns


def _of_curve(name: str, H: ComplexArray) -> dict[str, Array]:
    return {f"{name}_magnitude_db": decibels(np.abs(H)), f"{name}_phase_deg": degrees(H)}
