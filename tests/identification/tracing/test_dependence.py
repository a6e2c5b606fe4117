"""Dependence: the signal on which a residual depends, and none where it is noise."""

import numpy as np
import pytest

from identification.arrays import Array, IntArray
from identification.tracing.dependence import dependence


def signals(n: int, rng: np.random.Generator) -> dict[str, Array]:
    return {"v": rng.normal(size=n), "y": rng.uniform(-1, 1, n), "t": np.linspace(0, 60, n)}


@pytest.mark.parametrize("name", ["v", "y", "t"])
def test_names_the_signal(name: str) -> None:
    rng = np.random.default_rng(3)
    n = 2000
    s = signals(n, rng)
    up = s["v"] > 0
    r = np.where(up, 1.0, -1.0) * np.tanh(s[name] - np.median(s[name])) + 0.5 * rng.normal(size=n)
    found = dependence(r, s, up, np.arange(n) * 8 // n)
    assert found.depends_on[0] == name


def test_a_fine_ripple_is_seen() -> None:
    rng = np.random.default_rng(4)
    n = 4000
    s = signals(n, rng)
    r = np.sin(2 * np.pi * s["y"] / 0.15) + 0.3 * rng.normal(size=n)
    found = dependence(r, s, s["v"] > 0, np.arange(n) % 400 * 8 // 400)
    assert found.depends_on == ("y",)


@pytest.mark.slow
def test_noise_depends_on_nothing() -> None:
    named = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        s = signals(1500, rng)
        r = rng.normal(size=1500)
        named += bool(dependence(r, s, s["v"] > 0, np.arange(1500) * 8 // 1500).depends_on)
    assert named == 0


@pytest.mark.slow
def test_a_switch_is_a_signal() -> None:
    rng = np.random.default_rng(4)
    n = 4000
    named = signals(n, rng)
    named["vibration"] = np.repeat(rng.integers(0, 2, n // 100), 100).astype(np.float64)
    r = 2.0 * named["vibration"] + 0.3 * rng.standard_normal(n)
    found = dependence(r, named, named["v"] >= 0, np.arange(n) * 64 // n % 8)
    assert found.depends_on[0] == "vibration"


def shaken(n: int, rng: np.random.Generator) -> tuple[dict[str, Array], Array, IntArray]:
    """Signals of two logs, the time in each and the blocks."""
    named = signals(n, rng)
    named["t"] = np.tile(np.linspace(0.0, 60.0, n // 2), 2)
    return named, named["t"], np.arange(n) * 64 // n % 8


def test_a_vibration_depends_on_time() -> None:
    rng = np.random.default_rng(5)
    named, t, block = shaken(4000, rng)
    phase = np.repeat([0.3, 1.9], 2000)
    r = np.sin(2 * np.pi * 1.3 * t + phase) + 0.5 * rng.standard_normal(4000)
    found = dependence(r, named, named["v"] >= 0, block)
    assert found.depends_on == ("t",)
    assert found.swing == pytest.approx(1.3, abs=0.01)


def test_what_depends_on_a_periodic_place_is_no_vibration() -> None:
    rng = np.random.default_rng(6)
    named, t, block = shaken(4000, rng)
    named["y"] = np.sin(2 * np.pi * 0.4 * t)
    named["v"] = np.cos(2 * np.pi * 0.4 * t)
    r = named["y"] + 0.2 * rng.standard_normal(4000)
    found = dependence(r, named, named["v"] >= 0, block)
    assert found.depends_on[0] == "y"
    assert found.swing == 0.0


@pytest.mark.parametrize("harmonic", [1, 2, 3])
def test_what_swings_with_the_reference_is_no_vibration(harmonic: int) -> None:
    """A lag of a decimated log swings at the reference's rate, or at a harmonic of it."""
    rng = np.random.default_rng(4)
    t = np.sort(rng.uniform(0.0, 40.0, 2000))
    rate = 1.3 / harmonic
    y = np.sin(2 * np.pi * rate * t) + 0.2 * np.sin(2 * np.pi * 0.11 * t + 1.0)
    v = np.cos(2 * np.pi * rate * t) + 0.02 * np.cos(2 * np.pi * 0.11 * t + 1.0)
    r = np.sin(2 * np.pi * 1.3 * t + 0.8) + 0.3 * rng.standard_normal(len(t))
    # No function of place and speed one by one follows it as well as the swing does.
    other = {"t": t, "y": y + 0.5 * rng.standard_normal(len(t)), "v": v}
    found = dependence(r, other, v > 0, np.arange(len(t)) * 64 // len(t) % 8)
    assert found.swing == 0.0


def test_few_rows_tell_no_swing() -> None:
    swings = 0
    for seed in range(200):  # the frequency that fits best is one of many
        rng = np.random.default_rng(seed)
        s = {"t": np.sort(rng.uniform(0.0, 60.0, 40)), "v": rng.standard_normal(40)}
        found = dependence(rng.standard_normal(40), s, s["v"] > 0, np.arange(40) % 8)
        swings += found.swing > 0.0
    assert swings == 0
