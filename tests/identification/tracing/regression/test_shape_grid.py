"""Where the shapes of effects are tried first: the periods of a force."""

from dataclasses import replace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.regression.motion_log import again
from identification.tracing.regression.shape_grid import shape_grid
from tests.identification.motor_logs import made, seen


@pytest.mark.parametrize(
    ("key", "rotary", "longest"),
    [
        ("cogging", False, 1 / 1.5),
        ("cogging", True, 2.5),
        ("position_dependent_friction", False, 2),
    ],
)
def test_a_force_is_seen_to_repeat_but_gravity_where_it_turns(
    key: str, rotary: bool, longest: float
) -> None:
    one = replace(seen(made(4, {})), rotary=rotary)
    effect = built_in()[key]
    period = next(p for p in effect.params if p.name == "period")
    travel = float(np.ptp(one.log["y"]))
    periods = shape_grid(effect, period, [one])
    assert np.max(periods) == pytest.approx(longest * travel)
    assert np.min(periods) < 0.1 * travel


def test_another_log_of_the_machine_is_seen_alike() -> None:
    one = replace(seen(made(4, {})), rotary=True)
    same = again(one, one.log)
    assert same.rotary
    assert same.held == one.held
    assert same.noise == one.noise
