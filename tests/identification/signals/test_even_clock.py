"""Rows in bursts: a logger that stops for a moment every few rows."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.errors import BadLog
from identification.log import Log, Rig
from identification.signals.clean import prepare
from identification.signals.even_clock import even_clock

H, BURST, HOLE = 0.002, 8, 0.012


def bursts(n: int = 1200, hole: float = HOLE) -> Array:
    """A clock of 2 ms that stops after every eighth row."""
    rows = np.arange(n, dtype=np.float64)
    return np.asarray(H * rows + (hole - H) * np.floor(rows / BURST))


def log_of(t: Array) -> Log:
    """A body of 1 kg driven to and fro at 0.5 Hz against 10 N of Coulomb friction."""
    w = np.pi
    y, v = 0.1 * np.sin(w * t), 0.1 * w * np.cos(w * t)
    return Log("run", {"t": t, "y": y, "F": 10.0 * np.sign(v) - 0.1 * w**2 * np.sin(w * t)})


def test_bursts_are_one_run_at_their_mean_period() -> None:
    log = log_of(bursts())
    (run,) = even_clock(log)
    mean = log.duration / (len(log) - 1)
    assert run.h == pytest.approx(mean) and len(run) == pytest.approx(len(log), abs=1)
    np.testing.assert_allclose(run["y"], 0.1 * np.sin(np.pi * run["t"]), atol=2e-5)
    remark = prepare(log, Rig("force")).remarks[0]
    assert remark.startswith("run: rows in bursts, 149 holes between them, resampled every 3.2")


def test_holes_longer_than_the_mean_period_bridges_are_gaps() -> None:
    with pytest.raises(BadLog, match=r"149 gaps leave no run of 100 samples at 0.002 s"):
        even_clock(log_of(bursts(hole=0.2)))


def test_one_gap_is_no_gaps() -> None:
    t = 0.01 * np.arange(150, dtype=np.float64)
    t[75:] += 30.0
    with pytest.raises(BadLog, match=r"run: 1 gap leaves no run of 100 samples"):
        even_clock(log_of(t))


def test_a_pause_among_bursts_cuts_them() -> None:
    t = bursts()
    t[600:] += 30.0
    runs = even_clock(log_of(t))
    assert [run.h for run in runs] == pytest.approx([0.00325, 0.00325], rel=0.01)
