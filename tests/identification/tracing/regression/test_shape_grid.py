"""Where the shapes of effects are tried first: the periods of a force."""

from dataclasses import replace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.regression.motion_log import again
from identification.tracing.regression.candidates import bounds_of
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
    assert same.zoh == one.zoh
    assert same.noise == one.noise


@pytest.mark.parametrize("stretched", [1.0, 40.0])
def test_a_bent_scale_is_sought_from_a_straight_one_in_shares_of_the_travel(
    stretched: float,
) -> None:
    one = seen(made(4))
    one = replace(one, log=one.log.with_signals(y=stretched * np.asarray(one.log["y"])))
    reach = float(np.max(np.abs(one.log["y"])))
    effect = built_in()["sensor_nonlinearity"]
    for p, power in zip(effect.params, (1, 2), strict=True):
        tried = shape_grid(effect, p, [one]) * reach**power
        assert 0.0 in tried
        assert np.max(np.abs(tried)) == pytest.approx(0.1)
        assert np.min(np.abs(tried[tried != 0.0])) == pytest.approx(0.003)
        # An unbounded one bends a real rig's scale by more than the travel itself.
        assert bounds_of(p, tried) == pytest.approx((-0.1, 0.1))
