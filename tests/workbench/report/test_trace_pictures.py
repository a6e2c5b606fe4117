"""Pictures of a trace: a vibration is drawn over its own period."""

import numpy as np
import pytest

from identification.tracing.result import Residual
from workbench.report.trace_pictures import folded_at


def test_a_swing_is_drawn_over_its_period_in_the_first_log() -> None:
    t = np.tile(np.linspace(0.0, 9.0, 901), 2)
    log = np.repeat([0.0, 1.0], 901)
    r = np.where(log == 0.0, np.sin(2 * np.pi * 1.3 * t), np.cos(2 * np.pi * 1.3 * t))
    whole = Residual("mechanical", t + 9.0 * log, log, r, r, np.ones(len(r)), {"t": t})
    found = folded_at(whole, 1.3)
    phase = found.signals["phase"]
    assert len(found.before) == 901 and phase.min() >= 0.0 and phase.max() < 1.0
    assert found.before == pytest.approx(np.sin(2 * np.pi * phase), abs=1e-9)
    assert "phase" not in whole.signals
