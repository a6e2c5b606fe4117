"""A signal that hangs is found; a body at rest, a limit and an encoder are not."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.errors import BadLog
from identification.log import Log, Rig
from identification.signals.check import check
from identification.signals.frozen import clipped, frozen, noise_shows


def motion(noise: float = 1e-5, count: float = 0.0, n: int = 4000) -> Array:
    """A position to and fro with rests, every millisecond."""
    t = 1e-3 * np.arange(n)
    y = 0.05 * np.clip(1.3 * np.sin(2.0 * np.pi * t), -1.0, 1.0)
    y = y + noise * np.random.default_rng(0).standard_normal(n)
    return np.asarray(count * np.round(y / count) if count else y)


@pytest.mark.parametrize("at", [60, 1000, 1250])
@pytest.mark.parametrize("value", [None, 0.0])
def test_a_noisy_signal_that_stands_still(at: int, value: float | None) -> None:
    y = motion()
    y[at : at + 30] = y[at] if value is None else value
    found = np.flatnonzero(frozen(y))
    assert (found[0], found[-1]) == (at, at + 29)


def test_a_counter_that_catches_up_with_a_motion() -> None:
    y = motion(noise=0.0, count=1e-5)
    assert not np.any(frozen(y))
    y[985:1015] = y[985]
    found = np.flatnonzero(frozen(y))
    assert found[0] in (984, 985)
    assert found[-1] == 1014


@pytest.mark.parametrize("count", [0.0, 1e-6, 2e-5, 1e-3])
@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-5])
def test_rests_and_counts_are_no_fault(count: float, noise: float) -> None:
    assert not np.any(frozen(motion(noise, count)))


def test_a_command_at_its_limit_or_off_is_no_fault() -> None:
    u = np.clip(20.0 * motion(noise=1e-3), -0.9, 0.9)
    u[:500] = 0.0
    assert not np.any(frozen(u, at_limits=True))


def test_a_command_that_drops_out_for_a_moment() -> None:
    u = 20.0 * motion(noise=1e-3)
    u[1300:1315] = 0.0
    assert np.count_nonzero(frozen(u, at_limits=True)) == 15


def jittering(count: float, noise: float = 0.0) -> Array:
    """An encoder's position to and fro with rests, by a clock that jitters."""
    rng = np.random.default_rng(1)
    t = 1e-3 * np.arange(8000) + 2e-5 * rng.standard_normal(8000)
    y = 0.05 * np.clip(1.3 * np.sin(2.0 * np.pi * t), -1.0, 1.0)
    return np.asarray(count * np.round((y + noise * rng.standard_normal(8000)) / count))


def test_an_encoder_at_rest_is_no_fault_though_its_clock_jitters() -> None:
    y = jittering(1e-6)
    assert np.mean(np.diff(y) == 0.0) > 0.2  # it stands, and repeats nothing else
    assert not np.any(frozen(y))
    check(Log("encoder", {"t": 1e-3 * np.arange(len(y), dtype=np.float64), "y": y}), Rig("force"))


def test_an_encoder_with_noise_at_rest_is_one_where_it_stands() -> None:
    y = jittering(1e-8, noise=2e-5)
    y[2000:2300] = y[2000]
    assert np.flatnonzero(frozen(y)).tolist() == list(range(2000, 2300))
    with pytest.raises(BadLog, match="sticks"):
        check(
            Log("encoder", {"t": 1e-3 * np.arange(len(y), dtype=np.float64), "y": y}), Rig("force")
        )


def test_a_body_that_creeps_and_rests_shows_no_noise_but_its_rounding() -> None:
    x = np.resize([5.0, 3.0], 4000) * np.where(np.arange(4000) % 1000 < 300, 0.0, 1.0)
    x[300:400] = 1.0
    y = 1e-6 * np.cumsum(x)  # whole counts, to either side of 4 a sample
    still = x == 0.0
    assert not noise_shows(y, still)
    assert noise_shows(y + 1e-6 * np.random.default_rng(0).integers(-4, 5, len(y)), still)
    check(Log("creep", {"t": 2e-3 * np.arange(len(y), dtype=np.float64), "y": y}), Rig("force"))


def test_a_sensor_at_an_end_of_its_range() -> None:
    force = np.sin(6e-3 * np.arange(4000)) + 0.02 * np.random.default_rng(0).standard_normal(4000)
    assert not np.any(clipped(force))
    cut = np.clip(force, -0.9, 0.8)
    assert np.array_equal(clipped(cut), cut != force)


@pytest.mark.parametrize(("noise", "count"), [(0.0, 0.0), (1e-3, 5e-3), (0.0, 1e-4)])
def test_levels_that_are_repeated_are_no_end_of_a_range(noise: float, count: float) -> None:
    assert not np.any(clipped(np.clip(motion(noise, count), -0.04, 0.04)))
