"""A lag between the columns of force and position: found where a run or the equation shows it."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from identification.estimation import late_position
from identification.estimation.late_position import what_acts_beside
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.structure_fit import plain_structure
from identification.estimation.windowed_run.run_errors import misfit
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.model.size import Size
from identification.model.surroundings import Surroundings
from identification.progress import Halt
from identification.simulation.free_run import free_run
from tests.identification.jumping_command import MASS, cart_log
from tests.identification.jumping_command import H as ROW

H = 2e-3
BODY = Plant(Karnopp(0.15, 0.3, 0.3, 0.05, 0.05, 1e-3, -1e-3, 0.36, -0.36))


def late_log(seconds: float) -> Log:
    """A rotor driven by a torque, whose position is read so many seconds after its torque."""
    t = np.asarray(np.arange(8000) * H, dtype=np.float64)
    torque = 0.9 * np.sin(2 * np.pi * 0.7 * t) + 0.5 * np.sin(2 * np.pi * 1.9 * t + 1.0)
    blank = Log("late", {"t": t, "y": np.zeros(len(t)), "F": torque})
    y = np.asarray(free_run(BODY, blank, (0.0, 0.0, 0.0), "force").y)
    noise = 1e-5 * np.random.default_rng(1).standard_normal(len(t))
    return Log("late", {"t": t, "y": np.interp(t - seconds, t, y) + noise, "F": torque})


@pytest.mark.parametrize("samples", [-8.0, 0.0, 2.0])
def test_a_lag_of_a_measured_force_is_found_to_a_fraction_of_a_sample(samples: float) -> None:
    found = what_acts_beside([late_log(samples * H)], Rig("force", motion="rotary"))
    assert abs(found.lag.value / H - samples) < 0.25


def test_a_current_that_is_logged_late_is_found() -> None:
    log = late_log(-8 * H)
    motor = log.with_signals(u=log["F"])
    found = what_acts_beside([motor], Rig("motor", motion="rotary", force_per_command=1.0))
    assert abs(found.lag.value / H + 8.0) < 0.6  # half a sample: a command is held until the next


@pytest.mark.parametrize(("left", "believed"), [(0.8, False), (0.6, True)])
@pytest.mark.parametrize("in_loop", [False, True])
def test_a_lag_that_no_run_bears_out_is_believed_where_it_explains_most_and_no_loop_is_known(
    left: float, believed: bool, in_loop: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is missing beside, as cogging, may pass for a lag in the equation."""
    lag = Surroundings(lag=Size(3.0 * H, 0.1 * H))
    monkeypatch.setattr(late_position, "surroundings", lambda *_: lag)
    monkeypatch.setattr(late_position, "lag_explains", lambda *_: (1.0, left))
    monkeypatch.setattr(late_position, "_run", lambda *_: late_position._Run(20.0))
    log = late_log(0.0)
    motor = log.with_signals(u=log["F"], **({"r": log["y"]} if in_loop else {}))
    rig = Rig("motor", motion="rotary", force_per_command=1.0)
    assert bool(what_acts_beside([motor], rig).lag.value) == (believed and not in_loop)


@pytest.mark.parametrize(("without", "with_it"), [(np.inf, 80.0), (90.0, 60.0)])
def test_a_run_that_no_lag_lets_follow_bears_none_out(
    without: float, with_it: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Cogging of 20 % of friction passed for 15 ms, and with it taken out for nothing else."""
    left = iter([without, with_it])
    monkeypatch.setattr(
        late_position, "surroundings", lambda *_: Surroundings(lag=Size(7.0 * H, 0.5 * H))
    )
    monkeypatch.setattr(late_position, "lag_explains", lambda *_: (1.08, 0.93))
    monkeypatch.setattr(late_position, "_run", lambda *_: late_position._Run(next(left)))
    assert not what_acts_beside([late_log(0.0)], Rig("force", motion="rotary")).lag.value


def test_a_lag_of_the_equation_is_refined_by_a_run_that_shows_another() -> None:
    """In a loop the position's noise draws it: 4 samples were 6."""

    def left(samples: float) -> float:
        return 1.0 + (samples - 4.0) ** 2

    assert late_position._best_lag(left, Halt(), 6.0) == 4.0
    assert late_position._best_lag(lambda _: 1.2, Halt(), 6.0) == 6.0  # it follows as it is


def test_the_lags_beside_that_of_the_equation_come_first() -> None:
    """Where hardly any lag lets a run follow, a step down a flat slope leads past the one."""

    def left(samples: float) -> float:
        return 0.5 if samples == 1.5 else 50.0 - samples

    assert late_position._best_lag(left, Halt(), 1.0) == 1.5


@pytest.mark.parametrize(("seed", "late"), [(0, 0), (0, 1), (1, 0), (1, 2), (4, 1)])
def test_a_lag_of_a_short_slow_log_is_found_where_the_command_jumps_and_nowhere_else(
    seed: int, late: int
) -> None:
    """Of such a command's jumps no noise is made, and a plant that drifts more gains nothing by it:
    seed 0 had a lag of a sample, which it has not, and 1 of the others none."""
    found = what_acts_beside([cart_log(seed, late)], Rig("motor", force_per_command=1.0))
    assert abs(found.lag.value / ROW - late) < 0.3


def test_a_plant_that_drifts_more_gains_nothing_by_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each at its own weights, a body of a sixth of the mass would follow a noisy log as well."""
    log = cart_log(0, 0)
    noisy = log["F"] + 0.6 * np.random.default_rng(1).standard_normal(len(log))
    log, rig = log.with_signals(F=noisy, u=noisy), Rig("motor", force_per_command=1.0)
    recorded = recorded_logs([log], rig)
    model = plain_structure(recorded, np.random.default_rng(0))
    light = replace(model.plant, friction=replace(model.plant.friction, m=MASS / 6.0))
    own = misfit(light, recorded.logs, recorded.drive)
    none = late_position._run([log], rig, None, None)
    made = replace(model, plant=light, misfit=own)
    monkeypatch.setattr(late_position, "plain_structure", lambda *_: made)
    assert late_position._run([log], rig, None, none).misfit > 1.2 * own


def test_a_halted_run_is_reported_as_well_as_a_whole_one() -> None:
    """The doctor's own end of a run is no end of the comparison."""
    log, rig = cart_log(1, 1), Rig("motor", force_per_command=1.0)
    none = late_position._run([log], rig, None, None)
    for evaluations in (0, 20):
        halt = Halt(partial(next, iter([True] * evaluations), False))
        assert np.isfinite(late_position._run([log], rig, halt, none).misfit)
        assert halt.reached()
