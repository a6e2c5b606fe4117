"""Bands and stick limits searched by themselves, where the equations tell everything else."""

from dataclasses import replace

import numpy as np
import pytest

from identification.estimation.windowed_run.refinement import refit
from identification.estimation.windowed_run.run_errors import misfit
from identification.estimation.windowed_run.stick_search import stick_search
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
