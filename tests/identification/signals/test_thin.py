"""Long logs: what a slower clock keeps, which part is taken, and that others are left alone."""

import numpy as np
import pytest

from identification.log import Log
from identification.signals import thin
from identification.signals.thin import thinned


def oscillation(n: int, h: float) -> Log:
    """A body to and fro at 3 Hz, its velocity as the command that is held over each period."""
    t = h * np.arange(n, dtype=np.float64)
    w = 2 * np.pi * 3.0
    y = np.sin(w * t)
    held = np.diff(np.sin(w * h * np.arange(n + 1))) / h
    return Log("a", {"t": t, "y": y, "u": held, "on": (t > 1.0).astype(np.float64)})


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(thin, "LONGEST_UNTHINNED", 20_000)
    monkeypatch.setattr(thin, "LONGEST_THINNED", 10_000)


def test_a_log_of_usual_size_is_passed_on_as_it_is(small: None) -> None:
    log = oscillation(20_000, 1e-4)
    assert thinned(log) == (log, ())


@pytest.mark.parametrize("n", [20_001, 35_000, 90_000])
def test_a_fast_log_keeps_its_motion_at_a_slower_clock(small: None, n: int) -> None:
    found, remarks = thinned(oscillation(n, 1e-4))
    step = -(-n // 10_000)
    assert found.h == pytest.approx(step * 1e-4)
    assert n // step - 1 <= len(found) <= 10_000
    w = 2 * np.pi * 3.0
    np.testing.assert_allclose(found["y"], np.sin(w * found["t"]), atol=2e-6)
    # The command is what moves the body from one instant to the next.
    moved = np.cumsum(found["u"][:-1]) * found.h
    np.testing.assert_allclose(found["y"][1:] - found["y"][0], moved, atol=1e-5)
    assert set(np.unique(found["on"])) == {0.0, 1.0}
    assert len(remarks) == 1 and f"{n} samples every 0.0001 s, taken every" in remarks[0]


def test_means_take_out_noise(small: None) -> None:
    log = oscillation(90_000, 1e-4)
    noise = 1e-3 * np.random.default_rng(0).standard_normal(len(log))
    found, _ = thinned(log.with_signals(y=log["y"] + noise))
    left = found["y"] - np.sin(2 * np.pi * 3.0 * found["t"])
    assert np.std(left) == pytest.approx(1e-3 / np.sqrt(3), rel=0.05)


def test_of_a_slow_log_the_liveliest_part_is_taken(small: None) -> None:
    log = oscillation(50_000, 2e-3)
    lively = (log["t"] > 61.0) & (log["t"] < 83.0)
    found, remarks = thinned(log.with_signals(y=np.where(lively, log["y"], 0.01 * log["y"])))
    assert len(found) == 10_000 and found.h == pytest.approx(2e-3)
    assert found["t"][0] >= 60.9 and found["t"][-1] <= 83.1
    assert f"from t = {found['t'][0]:.6g} s were used, where the body moves most" in remarks[0]
