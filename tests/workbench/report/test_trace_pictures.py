"""Pictures of a trace: the missing force with its band, a vibration over its own period."""

from dataclasses import replace

import numpy as np
import pytest

from design.machine.readable import Display
from identification.tracing.residual_rows import folded_at
from identification.tracing.result import Residual
from identification.tracing.shown_against import pictures
from tests.workbench.trace_values import trace_of
from workbench.report.fit import missing_chart


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


def test_the_missing_force_is_drawn_before_and_after_with_its_band() -> None:
    found = trace_of("effect", ("stribeck",))
    assert found.missing_force is not None and found.missing is not None
    (panel,) = missing_chart(found, Display(), ["a.csv", "b.csv"]).panels
    before, after = panel.lines
    first = found.missing_force.before.logs[0]
    assert np.nanstd(before.y) > 10.0 * np.nanstd(after.y)
    assert before.y[: len(first.t)] == pytest.approx(-first.force)
    wide = panel.areas[0].high - panel.areas[0].low
    assert wide[: len(first.t)] == pytest.approx(2 * 1.96 * 0.01)
    assert np.count_nonzero(np.isnan(before.y)) == 2  # after either log
    assert panel.y_range is not None and panel.y_range[1] > np.nanmax(np.abs(before.y))
    assert len(panel.marks) == 1
    before_share, after_share = found.missing
    assert before_share > 10.0 * after_share


def test_what_is_missing_against_its_signal_is_the_latent_force() -> None:
    found = trace_of("effect", ("stribeck",))
    assert found.missing_force is not None
    (one,) = [picture for picture in pictures(found) if picture.effect is not None]
    assert one.residual is found.missing_force.sliding and one.signal == "v"
    without = pictures(replace(found, missing_force=None))[0]
    assert without.residual is found.residuals[0]
