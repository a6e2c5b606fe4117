"""A fit of a log with one bad sample is that of the log without it, and says when it was."""

import numpy as np
import pytest

from benchmarks.bad_samples import fitted, motor, moved


@pytest.mark.parametrize(
    ("signal", "at", "size", "kind"),
    [("y", 1800, 3e-3, "jump"), ("y", 3000, 1.5e-3, "jump"), ("u", 1150, 0.1, "spike")],
)
def test_one_bad_sample_moves_no_parameter(signal: str, at: int, size: float, kind: str) -> None:
    machine = motor(0)
    clean, _ = fitted(machine.log, machine.rig)
    assert clean.bad == ()
    x = np.array(machine.log[signal])
    x[at : at + 1 if kind == "spike" else None] += size
    fit, said = fitted(machine.log.with_signals(**{signal: x}), machine.rig)
    assert moved(clean, fit)[0] < 1.0
    assert [(one.signal, one.kind) for one in fit.bad] == [(signal, kind)]
    assert fit.bad[0].first == pytest.approx(machine.log["t"][at], abs=3 * machine.log.h)
    assert len(fit.logs) == 1
    assert "since the run contradicts it" in said
