"""A fit of a log with one bad sample is that of the log without it, and says when it was."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bad_samples import fitted, motor, moved
from identification.estimation.contradicted import DRIFTS_OVER, _Driven, _shown
from identification.estimation.fit import _explained
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.windowed_run.windows import freed, starts
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.signals.steps import LINE_SIDES, jump_size
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


def test_a_position_that_turns_within_a_few_samples_shows_no_jump() -> None:
    """Strokes of 25 samples: lines through eight of them jump by a third of the stroke all over."""
    t = np.arange(400, dtype=np.float64) * 0.01
    y = 5e-3 * np.sin(2 * np.pi * 4.0 * t)
    rig = Rig("motor", force_per_command=1.0)
    still = Log("run", {"t": t, "y": y, "u": np.cos(25.0 * t), "F": np.cos(25.0 * t)})
    one = recorded_logs([still], rig).logs[0]
    sizes = {k: jump_size(y, k, LINE_SIDES[-1]) for k in range(100, 300)}
    k = max(sizes, key=lambda at: abs(sizes[at]))
    assert abs(sizes[k]) > 1e-3 and not _shown(one, y, k, sizes[k])
    slipped = y + np.where(np.arange(len(y)) > k, 5e-3, 0.0)
    assert _shown(one, slipped, k, 5e-3)


@pytest.mark.parametrize(
    ("before", "after", "most"),
    [(20.9, 11.9, False), (20.9, 1.05, True), (9.0, 4.0, True), (0.117, 0.102, True)],
)
def test_samples_are_left_out_where_they_are_most_of_what_a_run_left(
    before: float, after: float, most: bool
) -> None:
    """A model that lacks an effect gains by any samples that are put on its run."""
    assert _explained(before, after) is most
