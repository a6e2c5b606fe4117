"""Orders of a turn in a trace: named first, proved on logs that no fit has seen, drawn before."""

from dataclasses import replace

import numpy as np
import pytest

from identification.arrays import Array
from identification.effects._library import built_in
from identification.errors import NotIdentifiable
from identification.log import Log, Rig
from identification.model.size import Size
from identification.model.surroundings import Surroundings
from identification.tracing import restored_surroundings
from identification.tracing.result import Trace
from identification.tracing.trace import trace
from tests.identification.estimation.test_turn_orders import BOTH_WAYS, ONE_WAY, RIG, log_of
from tests.workbench.trace_values import trace_of

COGGING: dict[float, float] = {7: 0.8, 28: 0.4}


def traced(y: Array, test: dict[float, float] = COGGING) -> Trace:
    """The trace of a log with cogging, and of a held-out one with that of `test`."""
    rng = np.random.default_rng(0)
    return trace([log_of(y, COGGING)], [log_of(y, test, seed=1)], RIG, built_in(), rng)


def test_each_order_is_an_effect_and_the_residual_before_shows_it() -> None:
    found = traced(BOTH_WAYS)
    assert found.verdict == "effect"
    assert [one.effect.key for one in found.effects][:2] == ["cogging", "cogging_2"]
    assert "7 times in a turn" in found.effects[0].effect.meaning
    before, after = (found_errors["test"].force_rms for found_errors in (found.before, found.after))
    assert before is not None and after is not None and after < 0.1 * before
    (rows,) = (one for one in found.residuals if one.equation == "mechanical")
    assert np.std(rows.before) > 0.5 > 10.0 * np.std(rows.after)


def test_a_log_of_one_way_has_its_orders_and_no_level_of_friction() -> None:
    found = traced(ONE_WAY)
    assert (found.verdict, found.complete) == ("effect", False)
    assert [one.effect.key for one in found.effects] == ["cogging", "cogging_2"]
    assert found.parameters_after["F_cp"].value is None
    assert not [name for name in found.parameters_after if "cogging" in name]


def test_what_is_not_in_the_held_out_log_is_not_named() -> None:
    with pytest.raises(NotIdentifiable):  # one way alone, and its orders are not there
        traced(ONE_WAY, {})


@pytest.mark.parametrize(("complete", "probable"), [(True, True), (False, False)])
def test_a_lag_that_leaves_but_noise_is_the_machines(
    complete: bool, probable: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Noise was half of what was missing: a run down to the noise had a probability of 23 %."""
    monkeypatch.setattr(restored_surroundings, "lag_explains", lambda *_: (0.155, 0.117))
    of = trace_of("none", ())
    late = Surroundings(lag=Size(8e-3, 5e-4), gives=20.0)
    log = Log("late", dict.fromkeys("ty", np.linspace(0.0, 1.0, 9)))
    found = restored_surroundings.with_surroundings(
        replace(of, complete=complete), late, [log], [log], Rig("motor", force_per_command=1.0)
    )
    (delay,) = found.effects
    assert delay.effect.key == "input_delay" and found.verdict == "effect"
    assert (delay.probability > 0.9) == probable
