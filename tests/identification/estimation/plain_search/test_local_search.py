"""Local refinement, its covariance, and the cloud of likely sets."""

from dataclasses import replace

import numpy as np
import pytest

from identification.arrays import Array
from identification.estimation.plain_search.actuator_fit import fit_actuator
from identification.estimation.plain_search.fitted_runs import FittedRun, prepare_run, total_cost
from identification.estimation.plain_search.local_search import (
    _solved,
    pack,
    refine,
    sample,
    unpack,
)
from identification.simulation.karnopp_step import DV_N, F_SN, kernel_parameters
from tests.identification.plants import ACTUATOR, NOISE_F, NOISE_Y, made_log, table

FREE = np.arange(11, dtype=np.int64)


def posed(number: int, seed: int) -> tuple[FittedRun, Array]:
    """A log as one whole run, and the true kernel parameters."""
    log = made_log(table(number), seed=seed, seconds=6.0)
    constant = float(fit_actuator([log]).constants[0])
    run = prepare_run(
        log,
        "command",
        constant=constant,
        window=1.0,
        hold=False,
        noise=(NOISE_Y, NOISE_F),
    )
    return run.whole(), kernel_parameters(table(number).array, ACTUATOR.k1, ACTUATOR.k2)


def test_returns_from_a_small_offset() -> None:
    run, truth = posed(2, 1)
    offset = truth * (1 + 1e-4 * np.array([1, -1, 1, -1, 1, 5, 5, -1, 1, 0.1, 0.1]))
    found = refine([run], offset, FREE)
    assert found.cost / run.measured.count == pytest.approx(1.0, abs=0.05)
    assert found.cost < total_cost([run], offset[None], 0.0)[0]
    assert np.max(np.abs(found.p / truth - 1)) < 5e-3


def test_the_covariance_is_that_of_repeated_logs() -> None:
    """Spread of the estimates over noise seeds agrees with the covariance of one fit."""
    run, truth = posed(3, 2)
    clean = refine([run], truth, FREE)
    rng = np.random.default_rng(5)
    found = []
    for _ in range(12):
        y = run.measured.y + 0.5 * NOISE_Y * rng.standard_normal(len(run.measured.y))
        force = run.measured.force + 0.5 * NOISE_F * rng.standard_normal(len(y))
        noisy = replace(run, measured=replace(run.measured, y=y, force=force))
        found.append(refine([noisy], clean.p, FREE).p)
    spread = np.std(found, axis=0)
    expected = 0.5 * np.sqrt(np.diag(clean.covariance))[:11]
    ratio = spread / expected
    assert 0.4 < np.median(ratio) < 2.5


def test_the_cloud_converges_on_a_smooth_likelihood() -> None:
    run, truth = posed(2, 3)
    optimum = refine([run], truth, FREE)
    cloud = sample([run], optimum, np.random.default_rng(1))
    assert cloud.weights.sum() == pytest.approx(1.0)
    assert np.all(cloud.members[:, DV_N] < 0)
    assert np.all(cloud.members[:, F_SN] < 0)
    if cloud.converged:
        center = pack([run], optimum.p, optimum.starts, FREE)
        shift = np.abs(cloud.weights @ cloud.members - center)
        assert np.all(shift < 3 * np.sqrt(np.diag(optimum.covariance)))


def test_pack_and_unpack_are_inverse() -> None:
    run, truth = posed(1, 5)
    starts = run.start[None]
    theta = pack([run], truth, starts, FREE)
    sets, begun = unpack([run], truth * 2, starts + 1, FREE, theta[None])
    assert np.array_equal(sets[0], truth)
    assert np.array_equal(begun[0, 0, list(run.open)], run.start[list(run.open)])


def test_elimination_of_starts_equals_the_dense_solution() -> None:
    rng = np.random.default_rng(0)
    own = [2, 1, 3] * 8
    shared, d = 9, 9 + sum(own)
    matrix = np.diag(rng.uniform(5.0, 9.0, d))
    matrix[:shared, :] += 0.1 * rng.standard_normal((shared, d))
    matrix[:, :shared] = matrix[:shared, :].T
    pull = rng.standard_normal(d)
    step = _solved(matrix, pull, shared, own)
    assert np.allclose(matrix @ step, pull, atol=1e-10)
