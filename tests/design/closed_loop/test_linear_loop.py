"""The linear plant that a design stands on, and of which models there is none."""

from dataclasses import replace

import pytest

from design.closed_loop.linear_loop import carries_design, linear_of
from design.machine.arx_plant import ArxPlant
from design.machine.model import Model, used
from identification.errors import NotIdentifiable
from identification.model.plant import Actuator
from tests.chain import TABLES, model_of


def knowing(*names: str) -> Model:
    """A model with a linear plant that follows its logs, of whose nine these alone are known."""
    model = model_of(TABLES["paper_table1"], Actuator(19530.0, 10405.0))
    plant = ArxPlant(
        1, 1, 1, (1.0, -0.9), (0.0, 1.0), 0.01, "F", 0.0, (0.1,), (0.1,), 0.1, 0.1, 0.1, None
    )
    found = {
        name: one if name in names else one.withheld("why; what to do", used(one))
        for name, one in model.friction.items()
    }
    return replace(model, friction=found, plant=plant)


def test_of_motion_one_way_there_is_no_design() -> None:
    up = knowing("F_vp")
    with pytest.raises(NotIdentifiable, match=r"F_vp alone identified, .* log motion both ways"):
        linear_of(up)
    assert not carries_design(up)


def test_of_motion_both_ways_a_linear_plant_carries_one_without_the_mass() -> None:
    assert carries_design(knowing("F_cp", "F_cn", "F_vp", "F_vn"))
