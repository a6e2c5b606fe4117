"""A reference is known by what a controller makes of it and the position."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification.columns.pairs import Seen

T = np.linspace(0.0, 10.0, 2000)


@pytest.mark.parametrize(("size", "gain", "noise", "known"), [
    (1.0, 3.0, 0.0, True),
    (1.0, 3.45, 0.0, False),  # the gains of reference and position are apart
    (1.0, 3.0, 0.075, False),  # more is left of the command than a controller leaves
    (0.33, 3.0, 0.03, False),  # the reference alone makes nearly as much of it
])  # fmt: skip
def test_what_a_controller_makes_of_both(
    size: float, gain: float, noise: float, known: bool
) -> None:
    r, y = np.sin(3.0 * T), size * np.sin(5.3 * T + 1.0)
    made = 3.0 * r - gain * y
    rest = np.random.default_rng(2).standard_normal(len(T))
    u = made + rest * np.std(made) * (noise / (1.0 - noise)) ** 0.5
    seen: Any = SimpleNamespace(smooth=np.column_stack([y, r, u]), at=0)
    assert Seen.is_followed_by_control(seen, 1) == known
