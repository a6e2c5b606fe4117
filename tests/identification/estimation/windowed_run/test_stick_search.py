"""Bands and stick limits searched by themselves, where the equations tell everything else."""

from dataclasses import replace

import numpy as np
import pytest

from identification.estimation.windowed_run.refinement import refit
from identification.estimation.windowed_run.run_errors import misfit
from identification.estimation.windowed_run.stick_search import (
    nearest_limits,
    stick_ranges,
    stick_search,
    without_band,
)
from identification.thresholds import COMPLETE, HOPELESS
from tests.identification.motor_logs import NINE, made, plant, seen

COGGING = {"cogging": {"a": 1.5, "b": 0.0, "period": 0.012}}
WRONG = replace(NINE, dv_p=0.0006, dv_n=-0.03, F_sp=2.3 * NINE.F_cp, F_sn=-1.02 * NINE.F_cn)


@pytest.mark.method
@pytest.mark.parametrize("effects", [None, COGGING], ids=["plain", "cogging"])
def test_stops_are_found_from_anywhere(effects: dict[str, dict[str, float]] | None) -> None:
    true, one = plant(effects), seen(made(4, effects))
    wrong = replace(true, friction=WRONG)
    assert misfit(wrong, [one], "command") > HOPELESS
    found = stick_search(wrong, [one], "command", np.random.default_rng(0))
    p = found.friction
    assert (p.F_sp, p.F_sn) == pytest.approx((NINE.F_sp, NINE.F_sn), rel=0.02)
    assert (p.dv_p, p.dv_n) == pytest.approx((NINE.dv_p, NINE.dv_n), rel=0.5)
    # The minimum is in reach from there, and was not from the start.
    assert refit(found, [one], "command", prior={}, effort="near").misfit <= COMPLETE
    assert refit(wrong, [one], "command", prior={}, effort="near").misfit > COMPLETE


@pytest.mark.slow
def test_only_what_shows_in_stops_is_changed() -> None:
    one, true = seen(made(4)), plant()
    found = stick_search(true, [one], "command", np.random.default_rng(0))
    own = ("dv_p", "dv_n", "F_sp", "F_sn")
    assert replace(found.friction, **{k: getattr(NINE, k) for k in own}) == NINE
    assert found.actuator == true.actuator


BARE = replace(NINE, dv_p=1e-9, dv_n=-1e-9)


def test_limits_close_by_are_found_where_no_slope_leads_to_them() -> None:
    """Four per cent lower a window or two is lost, and nothing says which way to go."""
    true, one = plant(friction=BARE), seen(made(4, friction=BARE))
    low = replace(true, friction=replace(BARE, F_sp=0.96 * BARE.F_sp, F_sn=0.97 * BARE.F_sn))
    found = nearest_limits(low, [one], "command").friction
    assert (found.F_sp, found.F_sn) == pytest.approx((BARE.F_sp, BARE.F_sn), rel=4e-3)
    assert replace(found, F_sp=BARE.F_sp, F_sn=BARE.F_sn).m == BARE.m


def test_a_body_without_a_band_is_found_from_its_breakaways() -> None:
    """A search among bands as wide as the noise of the velocity took a wide one and a low limit."""
    true, one = plant(friction=BARE), seen(made(4, friction=BARE))
    wide = replace(true, friction=replace(BARE, dv_p=0.03, dv_n=-0.03, F_sp=13.0, F_sn=-11.0))
    bare = without_band(wide, [one])
    found = stick_search(bare, [one], "command", np.random.default_rng(0)).friction
    assert (found.F_sp, found.F_sn) == pytest.approx((BARE.F_sp, BARE.F_sn), rel=0.01)


def test_the_range_of_a_limit_under_a_zero_order_hold_force_holds_it() -> None:
    """No derivative says it: between two steps of the force a limit changes nothing."""
    true, one = plant(friction=BARE), seen(made(4, friction=BARE))
    found = stick_ranges(true, [one], "command", 2.0, len(one.log))
    for name in ("F_sp", "F_sn"):
        low, high = sorted(found[name])
        assert low < getattr(BARE, name) < high
        assert high - low < 0.03 * abs(getattr(BARE, name))
