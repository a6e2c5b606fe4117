"""Long logs: what a slower clock keeps, which part is taken, and that others are left alone."""

from itertools import pairwise

import numpy as np
import pytest

from identification.log import Log
from identification.signals import thin
from identification.signals.thin import at_needed_rate, thinned


def oscillation(n: int, h: float) -> Log:
    """A body to and fro at 3 Hz, its velocity as the command that is held over each period."""
    t = h * np.arange(n, dtype=np.float64)
    w = 2 * np.pi * 3.0
    y = np.sin(w * t)
    zoh = np.diff(np.sin(w * h * np.arange(n + 1))) / h
    return Log("a", {"t": t, "y": y, "u": zoh, "on": (t > 1.0).astype(np.float64)})


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
    assert np.std(left) == pytest.approx(1e-3 / np.sqrt(9), rel=0.1)


def test_of_a_slow_log_the_liveliest_part_is_taken(small: None) -> None:
    log = oscillation(50_000, 2e-3)
    lively = (log["t"] > 61.0) & (log["t"] < 83.0)
    found, remarks = thinned(log.with_signals(y=np.where(lively, log["y"], 0.01 * log["y"])))
    assert len(found) == 10_000 and found.h == pytest.approx(2e-3)
    assert found["t"][0] >= 60.9 and found["t"][-1] <= 83.1
    assert f"from t = {found['t'][0]:.6g} s were used, where the body moves most" in remarks[0]


def sensed(
    h: float, noise: float, jitter: float = 0.0, ring: float = 0.0, rate: float = 330.0
) -> Log:
    """20 s of a body to and fro under a held command, behind sensors of position and force.

    jitter: of the clock, as a share of a sample; ring [m]: at this rate [Hz].
    """
    rng = np.random.default_rng(4)
    t = h * np.arange(round(20.0 / h), dtype=np.float64)
    at = t + jitter * h * rng.standard_normal(len(t))
    w = 2 * np.pi * 3.0
    y = 0.02 * np.sin(w * at) + ring * np.sin(2 * np.pi * rate * t)
    F = 40.0 * np.cos(w * t)
    signals = {"t": t, "y": y + noise * rng.standard_normal(len(t))}
    signals["F"] = F + 0.1 * rng.standard_normal(len(t))
    signals["u"] = np.floor(5.0 * np.cos(w * t))
    return Log("fast", signals)


@pytest.mark.parametrize(("h", "slow"), [(1e-4, 1e-3), (2.5e-4, 1e-3), (5e-4, 1e-3)])
@pytest.mark.parametrize("jitter", [0.0, 0.05])
def test_a_log_is_taken_as_slowly_as_its_motion_allows(
    h: float, slow: float, jitter: float
) -> None:
    log = sensed(h, 2e-6, jitter)
    found = at_needed_rate(log)
    step = round(slow / h)
    assert found.h == pytest.approx(slow)
    w = 2 * np.pi * 3.0
    left = found["y"] - 0.02 * np.sin(w * found["t"])
    own = log["y"] - 0.02 * np.sin(w * log["t"])
    assert np.std(left) < 1.15 * np.std(own) / np.sqrt(step)
    assert abs(np.mean(left * found["y"])) < 3 * np.std(left) * 0.02 / np.sqrt(len(left))
    # What moved the body until the next sample is what the command was over it.
    at = np.searchsorted(log["t"], found["t"][10:14] - 0.5 * h)
    for i, (low, high) in enumerate(pairwise(at)):
        assert found["u"][10 + i] == pytest.approx(np.mean(log["u"][low:high]))


def test_what_a_slower_clock_would_lose_is_kept() -> None:
    """A usual rate as it is; of a ringing as much as shows it."""
    usual = sensed(1e-3, 2e-6)
    assert at_needed_rate(usual) is usual
    assert at_needed_rate(sensed(5e-4, 1e-6, ring=1e-5)).h == pytest.approx(1e-3)
    fast = sensed(1e-4, 1e-6, ring=1e-5)
    assert at_needed_rate(fast).h < 0.5 / 330.0
    hidden = sensed(2.5e-4, 2e-6, ring=6e-7, rate=700.0)
    assert at_needed_rate(hidden).h == pytest.approx(1e-3)
    shown = sensed(2.5e-4, 2e-6, ring=2.4e-6, rate=700.0)
    assert at_needed_rate(shown).h < 0.9e-3
    short = Log("short", {key: x[:3000] for key, x in sensed(5e-4, 2e-6).signals.items()})
    assert len(at_needed_rate(short)) >= 400
