"""The fewest terms of friction that predict the force."""

from dataclasses import replace

import numpy as np
import pytest

from identification.estimation.regression.equation_rows import FIVE
from identification.estimation.regression.force_terms import Lateness, fewest_terms
from identification.estimation.regression.weighted_rows import Rows

VISCOUS = (0, 3, 4)  # columns of mass and viscous friction


def sliding_rows(levels: float, viscous: float, noise: float) -> list[Rows]:
    """Rows of a body of 0.14 kg in swings of many speeds, its force with this white noise."""
    rng, n = np.random.default_rng(2), 300
    v, a = 2.0 * rng.standard_normal(n), 5.0 * rng.standard_normal(n)
    up = v > 0.0
    X = np.column_stack([a, 1.0 * up, -1.0 * ~up, v * up, v * ~up])
    b = X @ np.array([0.14, levels, levels, viscous, viscous]) + noise * rng.standard_normal(n)
    sd, blocks = np.full(n, 1e-6), np.arange(n) // 30
    return [Rows(b, X, sd, blocks, np.abs(v), FIVE)]


def strokes(
    slowest: float, fastest: float, slope: float, level: float = 14.0, noise: float = 1.0
) -> Rows:
    """Rows of strokes of these speeds [m/s] under this force [N] in their middle, and noise [N]."""
    rng, n = np.random.default_rng(4), 400
    v = rng.uniform(slowest, fastest, n) * np.where(np.arange(n) % 2, 1.0, -1.0)
    up = v > 0.0
    X = np.column_stack([np.zeros(n), 1.0 * up, -1.0 * ~up, v * up, v * ~up])
    middle = 0.5 * (slowest + fastest)
    force = np.sign(v) * (level + slope * (np.abs(v) - middle)) + noise * rng.standard_normal(n)
    return Rows(force, X, np.full(n, 1.0), np.arange(n) // 40, np.abs(v), FIVE)


@pytest.mark.parametrize("level", [-1e-3, 0.0])
def test_a_level_by_which_the_equation_errs_is_no_friction_below_none(level: float) -> None:
    """A motor that nothing rubs, held by a sine: its Coulomb level of -0.1 % of the force was
    significant beside so little noise, and two levels were fitted that are not there."""
    assert fewest_terms(sliding_rows(level, 0.065, 1e-4)).used == VISCOUS


def test_a_level_well_below_none_is_no_viscous_friction_alone() -> None:
    assert fewest_terms(sliding_rows(-0.05, 0.065, 1e-4)).used != VISCOUS


def test_friction_that_falls_with_speed_has_its_level_where_it_was_logged() -> None:
    """Strokes at 5 to 15 mm/s, 10 N up at 10.5 mm/s and less the faster: the level at rest,
    24 N, is in no row, and a body was simulated with it."""
    rng, n = np.random.default_rng(3), 400
    v = rng.uniform(5e-3, 15e-3, n) * np.where(np.arange(n) % 2, 1.0, -1.0)
    up = v > 0.0
    X = np.column_stack([np.zeros(n), 1.0 * up, -1.0 * ~up, v * up, v * ~up])
    force = np.where(up, 10.0 - 1.3e3 * (v - 10.5e-3), -6.0) + 0.1 * rng.standard_normal(n)
    rows = Rows(force, X, np.full(n, 0.1), np.arange(n) // 40, np.abs(v), FIVE)
    found = fewest_terms([rows])
    assert found.used == (1, 2, 3) and found.falling == [(1, 3)]
    assert found.theta[0] == pytest.approx(23.6, abs=0.3)
    logged = found.at_logged_speeds(rows)
    assert logged.theta[0] == pytest.approx(float(np.mean(force[up])), abs=0.01)
    # As unsure as it varies over the strokes: by 3.4 N, one sigma.
    assert logged.sd["F_cp"] == pytest.approx(1.3e3 * np.std(v[up]), rel=0.05)
    assert (logged.theta[1], logged.sd["F_cn"]) == (found.theta[1], found.sd["F_cn"])


def test_a_level_that_viscous_friction_leaves_open_is_so_down_to_none() -> None:
    """Strokes at 5 to 14 mm/s of about 14 N, steep over so little: beside F_v the level is -10 N,
    to which the interval reached, and as far above."""
    found = fewest_terms([strokes(5e-3, 14e-3, 2.5e3)])
    assert found.used == (1, 2)
    assert 14.0 < found.sd["F_cp"] < 20.0


def test_strokes_of_one_speed_show_no_slope() -> None:
    """13.2 to 13.6 mm/s: as little as this varied, it was taken for friction that falls with speed
    (27 N at rest of 5.4 N logged), and another part of the log was predicted worse by it."""
    found = fewest_terms([strokes(13.2e-3, 13.6e-3, -1.6e3, noise=0.1)])
    assert found.used == (1, 2)
    assert found.theta == pytest.approx([14.0, 14.0], abs=0.2)
    assert found.sd["F_cp"] < 0.5


def test_viscous_friction_alone_is_as_unsure_as_beside_coulomb_friction() -> None:
    """Strokes at 3 to 12 mm/s under a force that is hardly more than its noise: a slope alone
    predicts as much as a level, of which it has then all that a level would have."""
    rows = strokes(3e-3, 12e-3, 250.0, level=2.1)
    found = fewest_terms([rows])
    assert found.used == (3, 4)
    assert found.sd["F_vp"] > 20.0


def test_a_mass_that_reversals_refute_is_none() -> None:
    """Where strokes are even a drift of the force passes for inertia, of 300 kg, which as they turn
    back would need thirty times the force."""
    rng, n = np.random.default_rng(6), 400
    plain, a = strokes(6e-3, 15e-3, 0.0), 1e-3 * rng.standard_normal(n)
    X = np.column_stack([a, plain.X[:, 1:]])
    even = replace(plain, X=X, b=plain.b + 300.0 * a)
    assert 0 in fewest_terms([even]).used
    turned = X.copy()
    turned[::10, 0] *= 100.0
    every = replace(even, X=turned)
    assert 0 not in fewest_terms([even], every=every).used


@pytest.mark.parametrize("lag", [-5e-4, 0.0, 5e-4])
def test_a_force_that_acts_within_its_sample_is_no_damping(lag: float) -> None:
    """Sines of a body of 0.02 kg, its force seen by half a millisecond early or late: m w^2 lag is
    10 % of viscous friction at 2 Hz, and was taken for it by a hundred of its deviations."""
    n, rng = 4000, np.random.default_rng(5)
    t = 5e-3 * np.arange(n)
    waves = ((2.0, 1.4), (0.7, 4.5), (0.2, 12.0))
    v, a, jerk = (
        np.sum([size * w**k * np.sin(w * t + w + 0.5 * np.pi * k) for size, w in waves], axis=0)
        for k in (1, 2, 3)
    )
    up = v > 0.0
    X = np.column_stack([a, 1.0 * up, -1.0 * ~up, v * up, v * ~up])
    truth = np.array([0.02, 0.4, 0.4, 0.03, 0.03])
    rate = 0.02 * jerk + 0.03 * a  # of the force while it slides one way
    noise = 5e-3
    b = X @ truth - lag * rate + noise * rng.standard_normal(n)
    rows = [Rows(b, X, np.full(n, noise), np.arange(n) // 500, np.abs(v), FIVE)]
    found = fewest_terms(rows, Lateness(rate, 1e-3))
    assert found.used == (0, 1, 2, 3, 4)
    np.testing.assert_allclose(found.theta[3:], truth[3:], rtol=0.02)
    assert np.all(np.abs(found.theta - truth) < 3.0 * np.sqrt(np.diag(found.covariance)))
    # Rows that do not show the lag leave viscous friction as open as its prior does.
    unseen = fewest_terms(rows, Lateness(np.zeros(n), 1e-3))
    assert np.allclose(unseen.theta, fewest_terms(rows).theta)
