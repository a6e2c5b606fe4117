"""The search for a plant where no start leads to it: its box, its costs, what it finds."""

from dataclasses import replace

import numpy as np
import pytest

from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.regressed_plant import first_plant
from identification.estimation.windowed_run.plant_search import Box, PlantCost, searched_plant
from identification.estimation.windowed_run.run_errors import misfit
from identification.log import Rig
from identification.model.estimates import Drive
from identification.model.karnopp import Karnopp
from identification.progress import Halt, Halted
from tests.identification.plants import made_log, table

RIG = Rig("force")


def test_the_box_holds_the_truth_and_every_point_of_it_is_a_plant() -> None:
    logs = recorded_logs([made_log(table(1), seed=1)], RIG).logs
    box, rng = Box.about(logs), np.random.default_rng(0)
    around = box.around(table(1).array, 40, rng)
    np.testing.assert_allclose(box.nine(around[:1])[0], table(1).array, rtol=1e-9)
    for nine in box.nine(rng.integers(0, 2, (40, 9)).astype(np.float64)):
        Karnopp.from_array(nine)  # which refuses a wrong sign


@pytest.mark.parametrize("drive", ["command", "force"])
def test_the_truth_costs_least(drive: Drive) -> None:
    recorded = recorded_logs([made_log(table(2), seed=3)], RIG, drive)
    cost = PlantCost.of(first_plant(recorded), recorded.logs, drive)
    off = table(2).array * (1.0 + 0.1 * np.random.default_rng(1).standard_normal((20, 9)))
    found = cost(np.vstack([table(2).array, off]))
    assert np.argmin(found) == 0
    assert np.all(np.isfinite(found))


@pytest.mark.parametrize("drive", ["command", "force"])
def test_a_search_comes_near_enough_for_a_refinement(drive: Drive) -> None:
    recorded = recorded_logs([made_log(table(1), seed=1)], RIG, drive)
    first, rng = first_plant(recorded), np.random.default_rng(0)
    found = searched_plant(first, recorded.logs, drive, rng)
    left = misfit(found, recorded.logs, drive)
    assert left < 0.2 * misfit(first, recorded.logs, drive) or left < 5.0
    assert found.actuator == first.actuator


def test_a_search_is_halted() -> None:
    recorded = recorded_logs([made_log(table(1), seed=1, seconds=3.0)], RIG)
    logs = [replace(one, halt=Halt(lambda: False)) for one in recorded.logs]
    with pytest.raises(Halted):
        searched_plant(first_plant(recorded), logs, "command", np.random.default_rng(0))
