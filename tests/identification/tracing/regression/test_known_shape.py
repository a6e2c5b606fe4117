"""A parameter that the machine's geometry gives is not sought."""

import numpy as np

from identification.effects._library import built_in
from identification.tracing.regression.candidates import bounds_of


def test_gravity_goes_once_a_turn_while_another_default_is_refined() -> None:
    effects = built_in()
    turn = next(p for p in effects["gravity"].params if p.name == "turn")
    delta = next(p for p in effects["stribeck"].params if p.name == "delta")
    assert bounds_of(turn, np.array([1.0])) == (1.0, 1.0)
    assert bounds_of(delta, np.array([2.0])) == (delta.low, delta.high)
