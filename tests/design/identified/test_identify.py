"""A model of logs that identify no parameter of the machine."""

import numpy as np
import pytest

from design.identified.identify import NONE_IDENTIFIABLE, identify
from design.machine.source import Source
from design.measured.predict import predict
from identification.errors import NotIdentifiable
from identification.log import Log, Rig


def strokes(disturbance: float) -> Source:
    """A rig's strokes at 10 mm/s, which 8 N oppose, beside a force that swings by so much [N]."""
    t = 1e-2 * np.arange(4000, dtype=np.float64)
    rng = np.random.default_rng(0)
    back = (t % 4.0) >= 2.0
    y = np.cumsum(np.where(back, -1e-2, 1e-2)) * 1e-2
    F = (
        np.where(back, -8.0, 8.0)
        + disturbance * np.sin(0.7 * t)
        + 0.2 * rng.standard_normal(len(t))
    )
    log = Log("strokes", {"t": t, "y": y + 2e-6 * rng.standard_normal(len(t)), "F": F})
    return Source(log, "strokes.csv", "0" * 64, len(t))


def test_a_model_of_which_nothing_is_identifiable_predicts_its_motion() -> None:
    source = strokes(0.0)
    model, fit = identify([source], np.random.default_rng(0), card="rig", rig=Rig("force"))
    assert all(one.value is None for one in model.friction.values())
    assert NONE_IDENTIFIABLE in fit.remarks[0]
    error = predict(model, source.log).force_predicted_rms
    assert error is not None and error < 3.0  # of 8 N, most of it where the strokes turn


def test_a_model_that_would_predict_nothing_either_is_refused() -> None:
    with pytest.raises(NotIdentifiable, match=NONE_IDENTIFIABLE):
        identify([strokes(30.0)], np.random.default_rng(0), card="rig", rig=Rig("force"))
