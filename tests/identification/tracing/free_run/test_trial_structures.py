"""What is tried in the forward run, and from which values."""

from dataclasses import replace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.regression.row_fit import base_fits, first_stage
from identification.tracing.free_run.trial_structures import grid, grown, rigid
from identification.tracing.regression.candidates import best_of
from identification.tracing.regression.shape_grid import median_rest, shape_grid
from tests.identification.motor_logs import NINE, made, plant, seen


def test_values_to_begin_from_lie_within_bounds() -> None:
    one = seen(made(1))
    for key in ("backlash", "presliding", "rising_stiction", "load_dependent_friction"):
        effect = built_in()[key]
        values = grid(effect, plant(), [one])
        assert values
        for v in values:
            effect.acting(v)
    assert grid(built_in()["spring"], plant(), [one]) == []


@pytest.mark.method
@pytest.mark.slow
def test_growth_is_tried_from_what_a_limit_that_falls_tells() -> None:
    effect = built_in()["rising_stiction"]
    one = seen(made(3, {"rising_stiction": {"F_r": 5.0, "tau": 0.4}}, n=30_000))
    start, _ = first_stage([one], False)
    start = replace(start, sliding=NINE)
    told = best_of(start, effect, base_fits(start))
    assert told is not None
    bent = replace(NINE, m=1.2 * NINE.m, F_sp=1.1 * NINE.F_sp, F_sn=1.1 * NINE.F_sn)
    base, values = grown(told, plant(friction=bent), start)

    def after_a_rest(v: dict[str, float]) -> float:
        return float(v["F_r"] * (1.0 - np.exp(-0.3 / v["tau"])))

    true = after_a_rest({"F_r": 5.0, "tau": 0.4})
    assert (
        abs(after_a_rest(values[0]) / true - 1.0) < 0.15 < abs(after_a_rest(values[1]) / true - 1.0)
    )
    assert abs(base.friction.m / NINE.m - 1.0) < 0.01
    assert abs(base.friction.F_sp / NINE.F_sp - 1.0) < 0.02
    assert abs(base.friction.F_sn / NINE.F_sn - 1.0) < 0.02


def test_times_of_growth_are_those_of_the_rests() -> None:
    effect = built_in()["rising_stiction"]
    one = seen(made(1))
    rest = median_rest([one], 7.0)
    assert 0.1 < rest < 0.6  # the command is off for 0.1 to 0.5 s
    times = shape_grid(effect, effect.params[1], [one])
    assert times[0] < 0.3 * rest and times[-1] > 3.0 * rest
    moving = seen(made(1).with_signals(y=0.3 * made(1)["t"]))
    assert median_rest([moving], 7.0) == 7.0


def test_a_contact_is_rigid_where_nothing_moves_at_rest() -> None:
    _, first = first_stage([seen(made(2))], False)
    assert rigid(first)
    _, first = first_stage([seen(made(2, {"presliding": {"sigma_0": 5e4}}))], False)
    assert not rigid(first)
    assert not rigid({})
