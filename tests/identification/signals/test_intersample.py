"""A measured force between its samples."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identification.estimation.regression.motion_log import motion_log
from identification.estimation.windowed_run.run_errors import misfit
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Plant
from identification.signals.intersample import kinks
from identification.simulation.free_run import free_run

NINE = Karnopp(1.4, 18.0, 15.0, 300.0, 330.0, 0.03, -0.022, 24.0, -18.0)


@given(
    st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(1.0, 50.0), st.integers(3, 30)
)  # fmt: skip
def test_a_line_has_none_and_a_change_of_slope_is_overshot(
    offset: float, slope: float, change: float, at: int
) -> None:
    k = np.arange(40, dtype=np.float64)
    line = offset + slope * k
    assert np.max(np.abs(kinks(line, 1e-3))) < 1e-9
    bent = line - change * np.maximum(k - at - 0.5, 0.0)  # the top lies between two samples
    kept = bent.copy()
    more = kinks(bent, 1e-3)
    assert np.array_equal(bent, kept)
    assert np.all(more[[at, at + 1]] > 0.0)
    assert np.all(np.delete(more, [at, at + 1]) == pytest.approx(0.0, abs=1e-9))


def test_a_kink_s_height_is_right_on_average_over_its_places() -> None:
    k, n = np.arange(20, dtype=np.float64), 200
    short = []
    for place in (np.arange(n) + 0.5) / n:
        top = -np.maximum(k - 9.0 - place, 0.0)
        line = np.interp(9.0 + place, k, top + kinks(top, 1e-6))
        short.append(0.0 - line)  # of the true height there
    assert abs(np.mean(short)) < 2e-3
    assert np.mean(np.abs(short)) < 0.1  # 0.17 without


def test_noise_alone_makes_hardly_any() -> None:
    noise = 0.02 * np.random.default_rng(1).standard_normal(20_000)
    assert np.std(kinks(noise, 0.02)) < 0.25 * 0.02


def pneumatic(seed: int) -> Log:
    """20 s at 500 Hz of position and force, of a body that a slow force breaks away."""
    rng, fine, every, count = np.random.default_rng(seed), 1e-4, 20, 10_000
    n, u, way = count * every, list[float](), 1.0
    while len(u) < n:
        size, length = rng.uniform(0.01, 0.1), round(rng.uniform(0.3, 0.9) / fine)
        u += [way * size] * length
        way = -way
    blank = Log(
        "slow", {"t": fine * np.arange(n, dtype=np.float64), "u": np.array(u[:n]), "y": np.zeros(n)}
    )
    run = free_run(Plant(NINE, Actuator(1.8e4, 1.8e4)), blank, (0.0, 0.0, 0.0), "command")
    t = fine * every * np.arange(count, dtype=np.float64)
    y = run.y[::every] + 1e-5 * rng.standard_normal(count)
    return Log("slow", {"t": t, "y": y, "F": run.F[::every] + 0.02 * rng.standard_normal(count)})


@pytest.mark.parametrize("seed", [1, 2])
def test_breakaways_that_a_force_only_just_reaches_are_followed(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = motion_log(pneumatic(seed), zoh=False, by_command=False)
    found = misfit(Plant(NINE), [one], "force", every=True)
    monkeypatch.setattr(
        "identification.estimation.regression.motion_log.kinks",
        lambda F, _noise: np.zeros(len(F)),
    )
    bare = motion_log(pneumatic(seed), zoh=False, by_command=False)
    without = misfit(Plant(NINE), [bare], "force", every=True)
    assert found < 0.2 * without


def test_a_force_whose_noise_is_huge_has_no_kinks() -> None:
    assert not np.any(kinks(np.zeros(40), 1e4))
    assert not np.any(kinks(np.zeros(40), 0.0))
