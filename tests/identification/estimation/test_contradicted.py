"""A fit of a log with one bad sample is that of the log without it, and says when it was."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bad_samples import fitted, motor, moved
from identification.estimation.contradicted import DRIFTS_OVER, _Driven
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.windowed_run.windows import freed, starts
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.thresholds import FAULT_FROM


@pytest.mark.method
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


def test_what_an_actuators_noisy_command_adds_up_to_is_no_bad_sample() -> None:
    """Over half a second, in which the noise of many samples passes for one."""
    machine = motor(0)
    one = recorded_logs([machine.log], machine.rig).logs[0]
    one = replace(one, noise=replace(one.noise, walk=0.2))
    begun = starts(one, "command")
    nine = Karnopp(5.0, 10.0, 10.0, 20.0, 20.0, 0.01, -0.01, 14.0, -14.0)

    def usual(actuator: Actuator | Motor) -> float:
        plant = Plant(nine, actuator)
        states = freed(plant, one, "command", begun)
        assert states is not None
        return _Driven(plant, one, "command", states).usual

    noise = 0.2 / (2000.0 * one.log.h)  # of one sample of the command [V]
    expected = FAULT_FROM * noise * np.sqrt(DRIFTS_OVER / one.log.h)
    assert usual(Actuator(2000.0, 100.0)) == pytest.approx(expected)
    assert usual(Motor(30.0)) == 0.0
