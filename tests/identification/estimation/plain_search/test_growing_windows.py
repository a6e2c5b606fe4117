"""Search on short stretches and ever longer ones: where a search over long windows is lost."""

import numpy as np
import pytest

from identification.estimation.fit import fit_plant
from identification.estimation.plain_search.fitted_runs import total_cost
from identification.estimation.plain_search.growing_windows import climb
from identification.estimation.plain_search.local_search import _solved, refine
from identification.estimation.plain_search.problem import pose
from identification.estimation.plain_search.short_windows import stretches
from identification.estimation.regression.sliding_friction import fit_sliding
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant
from identification.simulation.free_run import free_run
from tests.identification.plants import made_log, table

SERVO = Karnopp(0.62, 4.1, 5.2, 22.0, 17.0, 0.02, -0.015, 6.3, -7.9)
K_A, H = 6.4, 2e-3
RIG = Rig("motor", force_per_command=K_A)


def motor_log(seed: int = 0, seconds: float = 10.0) -> Log:
    """A motor's log that begins in full motion: sine and steps of force, noise 1e-5 m."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / H), dtype=np.float64) * H
    steps = np.repeat(rng.uniform(-1.0, 1.0, 60), 1 + len(t) // 60)[: len(t)]
    u = (9.0 * np.sin(2 * np.pi * 0.7 * t) + 7.0 * steps) / K_A
    blank = Log("motor", {"t": t, "y": np.zeros(len(t)), "u": u})
    run = free_run(Plant(SERVO, Motor(K_A)), blank, (0.1, 0.35, K_A * u[0]), "command")
    y = run.y + 1e-5 * rng.standard_normal(len(t))
    return Log("motor", {"t": t, "y": y, "u": u, "F": K_A * u})


def test_stretches_hold_every_sample_once_and_join_to_the_whole() -> None:
    problem = pose([motor_log()], RIG, "command")
    cut = stretches(problem.runs, 0.4)
    whole = problem.runs[0].measured
    assert len(cut.all) > 15
    assert np.array_equal(np.concatenate([part.measured.y for part in cut.all]), whole.y)
    assert np.array_equal(np.concatenate([part.measured.force for part in cut.all]), whole.force)
    apart = [index == 0 for index in range(len(cut.all))]
    kept = cut.longer(3, apart)
    assert [len(part.measured.y) for part in kept.all[:3]] == [
        len(part.measured.y) for part in cut.all[:3]
    ]
    while not cut.whole:
        cut = cut.longer(3)
    assert np.array_equal(cut.all[0].measured.y, whole.y)


def test_restarted_run_costs_what_its_parts_cost() -> None:
    problem = pose([made_log(table(2), seconds=6.0)], Rig("force"), "command")
    cut = stretches(problem.runs, 0.4)
    rows = problem.row[None]
    parts = total_cost(cut.all, rows, 0.0)[0]
    assert total_cost(cut.restarted(), rows, 0.0)[0] == pytest.approx(parts, rel=1e-9)


def test_starts_of_stretches_are_found_at_the_truth() -> None:
    problem = pose([motor_log()], RIG, "command")
    cut = stretches(problem.runs, 0.4)
    row = np.concatenate([SERVO.array, [0.0, 0.0]])
    found = refine(cut.all, row, problem.free[:0])
    assert found.cost / problem.count == pytest.approx(1.0, abs=0.15)


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


def test_weak_form_gives_mass_and_sliding_friction() -> None:
    problem = pose([motor_log()], RIG, "command")
    found = fit_sliding(problem.logs[0], problem.firsts[0], 0.1, held=True)
    assert found is not None
    assert np.max(np.abs(found.five / SERVO.array[:5] - 1.0)) < 0.05


@pytest.mark.method
@pytest.mark.slow
def test_climb_reaches_the_whole_run() -> None:
    problem = pose([made_log(table(1), seed=2, seconds=6.0)], Rig("force"), "command")
    reached = climb(problem, np.random.default_rng(0), lambda _stage, _share: None)
    assert len(reached.starts) == 1  # the whole run
    assert reached.cost / problem.count == pytest.approx(1.0, abs=0.2)
    assert np.max(np.abs(reached.p[:9] / table(1).array - 1.0)) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_motor_that_begins_in_full_motion_is_found(seed: int) -> None:
    fit = fit_plant([motor_log(seed)], np.random.default_rng(seed), rig=RIG)
    assert fit.adequate
    assert fit.chi_square == pytest.approx(1.0, abs=0.2)
    assert np.max(np.abs(fit.friction.array / SERVO.array - 1.0)) < 0.02
