"""A position held between renewals is found by its clock; an encoder in slow motion is not one."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.log import Log
from identification.signals.renewal import hold_length, renewed, zoh_remarks

H = 2e-3
T = H * np.arange(6000, dtype=np.float64)


def motion(seed: int) -> Array:
    """Strokes and rests [m]."""
    rng = np.random.default_rng(seed)
    swing = 0.05 * np.sin(2 * np.pi * 0.7 * T + rng.uniform(0, 6)) * (np.sin(1.3 * T) > -0.4)
    return np.asarray(swing + 1e-5 * rng.standard_normal(len(T)))


def zoh(y: Array, step: int) -> Array:
    return np.asarray(np.repeat(y[::step], step)[: len(y)])


@pytest.mark.parametrize("step", [2, 5, 10, 25])
@pytest.mark.parametrize("count", [0.0, 2e-5])
def test_the_period_of_renewal_is_found(step: int, count: float) -> None:
    y = motion(step)
    y = np.round(y / count) * count if count else y
    assert hold_length(zoh(y, step)) == step


@pytest.mark.parametrize("count", [1e-5, 1e-4, 1e-3, 5e-3])
def test_an_encoder_s_counts_are_no_renewal(count: float) -> None:
    ramp = 0.02 * T + 0.01 * np.sin(T)
    assert hold_length(np.round(ramp / count) * count) == 1
    assert hold_length(np.round(motion(3) / count) * count) == 1
    assert hold_length(motion(4)) == 1


def test_new_positions_are_kept_with_the_mean_command_until_the_next() -> None:
    y, u = zoh(motion(1), 10), np.sin(5.0 * T)
    found = renewed(Log("a", {"t": T, "y": y, "u": u, "F": 2.0 * u}))
    assert "renewed at 50 Hz" in found.remarks[0]
    log = found.log
    assert log.h == pytest.approx(0.02)
    assert len(log) == pytest.approx(600, abs=12)
    k = 100
    first = int(np.searchsorted(T, log["t"][k] - 1e-9))
    assert log["y"][k] == y[first] and log["y"][k] != y[first - 1]
    assert log["u"][k] == pytest.approx(np.mean(u[first : first + 10]))


def test_a_log_without_renewals_is_the_same() -> None:
    log = Log("a", {"t": T, "y": motion(2)})
    assert renewed(log).log is log and renewed(log).remarks == ()


def test_a_command_that_is_renewed_less_often_than_the_position_is_reported() -> None:
    rng = np.random.default_rng(5)
    log = Log("a", {"t": T, "y": motion(2), "u": zoh(rng.standard_normal(len(T)), 7)})
    (said,) = zoh_remarks(log)
    assert "the command is renewed every 7 rows, at 71.4 Hz" in said and "14 ms old" in said
    assert zoh_remarks(log.with_signals(y=zoh(motion(2), 7))) == ()  # which it waits for
    assert zoh_remarks(log.with_signals(u=zoh(log["u"], 100))) == ()  # steps of a command
    assert zoh_remarks(log.with_signals(u=rng.standard_normal(len(T)))) == ()
