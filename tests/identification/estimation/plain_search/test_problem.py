"""The plant of a search's best member."""

import pytest

from identification.errors import BadModel
from identification.estimation.plain_search.problem import plant_of, pose
from identification.progress import Halt
from identification.simulation.karnopp_step import kernel_parameters
from tests.identification.plants import ACTUATOR, made_log, table


def test_a_friction_of_nothing_that_is_a_little_below_zero_is_nothing() -> None:
    log = made_log(table(1), seed=1, seconds=3.0)
    problem = pose([log], "command", Halt())
    p = kernel_parameters(table(1).array, ACTUATOR.k1, ACTUATOR.k2)
    assert plant_of(problem, p).friction == table(1)
    beside = p.copy()
    beside[[1, 8]] = -2e-6, 1e-9
    found = plant_of(problem, beside).friction
    assert (found.F_cp, found.F_sn) == (0.0, 0.0)
    assert found.F_cn == table(1).F_cn
    beside[0] = -1.0
    with pytest.raises(BadModel, match="m = "):
        plant_of(problem, beside)
