"""A constant force beyond friction is seen and spoken of; one within it is left to the levels."""

import numpy as np
import pytest

from identification.tracing.constant_force import beyond_friction, constant_force, constant_remark
from tests.identification.motor_logs import NINE, made


@pytest.mark.parametrize("force", [-60.0, 60.0])
def test_a_weight_larger_than_friction_is_found(force: float) -> None:
    log = made(3)
    pulled = log.with_signals(F=log["F"] - force)  # the force that the weight spares
    found = constant_force([pulled], held=True)
    assert found == pytest.approx(force, abs=0.5 * abs(NINE.F_cp - NINE.F_cn) + 0.5)
    assert f"{force:.3g} N" in constant_remark(force, "N")


def test_what_unequal_levels_can_hold_is_not_spoken_of() -> None:
    assert beyond_friction(np.array([1.0, 2.0, 30.0, 1.0, 1.0])) is None
    assert beyond_friction(np.array([1.0, -2.0, 30.0, 1.0, 1.0])) == pytest.approx(16.0)
