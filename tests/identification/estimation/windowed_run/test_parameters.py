"""A plant with other values: how far they may lie from those that it has."""

import numpy as np
import pytest

from identification.estimation.windowed_run.parameters import plant_with, values_of
from tests.identification.motor_logs import plant

DIP = {"F_s": 4.0, "v_s": 0.02, "asymmetry": 1e-5, "delta": 2.0}


def test_a_shape_stays_near_and_an_asymmetry_is_free() -> None:
    """Of either sign and often next to none: within a factor of that it had no derivative."""
    names = ["stribeck.v_s", "stribeck.asymmetry"]
    found = plant_with(plant({"stribeck": DIP}), names, np.array([2.0, -0.3]))
    v_s, asymmetry = values_of(found, names)
    assert asymmetry == pytest.approx(-0.3)
    assert 0.02 < v_s < 0.2
