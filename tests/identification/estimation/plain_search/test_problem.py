"""The plant of an optimum over whole runs."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.errors import BadModel
from identification.estimation.plain_search.local_search import Optimum
from identification.estimation.plain_search.problem import plant_of, pose
from identification.log import Rig
from identification.progress import Halt
from identification.simulation.karnopp_step import kernel_parameters
from tests.identification.plants import ACTUATOR, made_log, table


def optimum(p: Array) -> Optimum:
    none = np.zeros((0, 0))
    return Optimum(p, np.zeros((1, 3)), 0.0, np.zeros(0, dtype=np.int64), 0, none)


def test_a_friction_of_nothing_that_a_step_leaves_below_zero_is_nothing() -> None:
    log = made_log(table(1), seed=1, seconds=3.0)
    problem = pose([log], Rig("force"), "command", Halt())
    p = kernel_parameters(table(1).array, ACTUATOR.k1, ACTUATOR.k2)
    assert plant_of(problem, optimum(p)).friction == table(1)
    beside = p.copy()
    beside[[1, 8]] = -2e-6, 1e-9
    found = plant_of(problem, optimum(beside)).friction
    assert (found.F_cp, found.F_sn) == (0.0, 0.0)
    assert found.F_cn == table(1).F_cn
    beside[0] = -1.0
    with pytest.raises(BadModel, match="m = "):
        plant_of(problem, optimum(beside))
