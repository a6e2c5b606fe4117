"""An effect's part against its signal: within one period where its law repeats."""

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.regression.row_fit import first_stage
from identification.tracing.free_curve import free_curves
from identification.tracing.regression.stepwise import choose
from tests.identification.motor_logs import made, seen

A, PERIOD = 1.5, 0.03  # N, m: several periods along the strokes


@pytest.mark.slow
def test_a_law_that_repeats_is_drawn_within_its_period() -> None:
    one = seen(made(4, {"cogging": {"a": A, "period": PERIOD}}))
    start, first = first_stage([one], False)
    library, rng = {"cogging": built_in()["cogging"]}, np.random.default_rng(0)
    (curve,) = free_curves(choose(start, first, library, rng, lambda _stage, _share: None))
    assert curve.period == pytest.approx(PERIOD, rel=1e-3)
    assert curve.signal == "y" and 0.0 <= np.min(curve.at) <= np.max(curve.at) < PERIOD
    assert np.ptp(curve.law) == pytest.approx(2.0 * A, rel=0.1)
    wave = A * np.sin(2.0 * np.pi * curve.at / PERIOD)
    assert abs(np.corrcoef(curve.law, wave)[0, 1]) > 0.99
    assert np.mean(((curve.free - curve.law) / curve.sd) ** 2) < 2.0
