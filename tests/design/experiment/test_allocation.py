"""Shares of the time: known optima, and a bound for all whole numbers."""

from dataclasses import dataclass

import numpy as np
import pytest

from design.experiment.allocation import d_optimal, t_optimal
from design.experiment.precision import log_det
from identification.experiment.structures import discriminated

ALL = np.arange(2)


@dataclass(frozen=True)
class Pair:
    one: int
    others: tuple[int, ...]


def test_two_parameters_each_identified_by_a_segment_share_the_time() -> None:
    matrices = np.array([np.diag([3.0, 1e-6]), np.diag([1e-6, 50.0])])
    found = d_optimal([matrices], ALL, np.array([1.0, 2.0]), 4.0)
    assert found.times @ [1.0, 2.0] == pytest.approx(4.0, rel=1e-4)
    assert found.times == pytest.approx([2.0, 1.0], rel=1e-3)  # half of the time each


def test_where_one_is_asked_the_other_gets_what_it_needs_to_be_distinguished() -> None:
    alone = np.array([np.diag([3.0, 1e-6]), np.diag([1e-6, 50.0])])
    found = d_optimal([alone], np.array([0]), np.array([1.0, 1.0]), 4.0)
    assert found.times[0] > 3.9


def test_no_whole_number_does_better() -> None:
    rng = np.random.default_rng(3)
    J = rng.standard_normal((4, 6, 2)) * rng.uniform(0.1, 3.0, (4, 1, 2))
    matrices = np.einsum("knd,kne->kde", J, J)
    found = d_optimal([matrices], ALL, np.ones(4), 5.0)
    best = log_det(np.tensordot(found.times, matrices, 1), ALL)
    whole = [
        log_det(np.tensordot(np.array(times), matrices, 1), ALL)
        for times in np.ndindex(6, 6, 6, 6)
        if sum(times) == 5
    ]
    assert best >= max(whole) - 1e-4


def test_rivals_are_distinguished_by_the_segment_in_which_they_differ() -> None:
    # Effects 1 and 2 beside parameter 0: alike in the first segment, apart in the second.
    same = np.array([[1.0, 2.0, 2.0], [1.0, 0.0, 0.0]])
    other = np.array([[1.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]])
    matrices = np.array([x.T @ x for x in (same, other)])
    pairs = [Pair(1, (0, 2)), Pair(2, (0, 1))]
    found = t_optimal(matrices, pairs, np.ones(2), 3.0)
    assert found.times[1] > 2.9
    left = discriminated(np.tensordot(found.times, matrices, 1), 1, (0, 2))
    assert found.value == pytest.approx(np.log(left + 1.0), rel=1e-3)
