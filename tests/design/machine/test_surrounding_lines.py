"""Unequal Coulomb friction is said to be, as well, equal friction and a constant force."""

import pytest

from design.machine.surrounding_lines import surrounding_lines, unequal_friction
from identification.log import Rig
from identification.model.estimates import Estimate
from identification.model.size import Size
from identification.model.surroundings import Surroundings


def levels(up: float | None, down: float | None, sd: float) -> dict[str, Estimate]:
    return {"F_cp": Estimate(up, "N", sd), "F_cn": Estimate(down, "N", sd)}


def test_a_weight_that_makes_friction_unequal_is_said() -> None:
    (line,) = unequal_friction(levels(150.0, 18.0, 1.0), ())
    assert "84 N in both directions and a constant force of -66 N" in line


@pytest.mark.parametrize(
    ("up", "down", "sd"),
    [(20.0, 15.0, 0.1), (3.0, 1.0, 1.0), (None, 15.0, 0.1)],
    ids=["nearly equal", "not significant", "not identifiable"],
)
def test_else_nothing_is_said(up: float | None, down: float | None, sd: float) -> None:
    assert unequal_friction(levels(up, down, sd), ()) == ()


def test_a_preload_of_a_spring_is_said_to_be_in_friction() -> None:
    (line,) = unequal_friction(levels(20.0, 15.0, 0.1), ("spring",))
    assert "a preload stands in F_cp and F_cn" in line


def test_a_force_of_a_command_without_a_scale_is_in_units_of_it() -> None:
    around = Surroundings(force=Size(-0.36, 0.01))
    known, unknown = (
        surrounding_lines(around, Rig("motor"), scaled=one)[0] for one in (True, False)
    )
    assert known.startswith("constant force: -0.36 N (")
    assert unknown.startswith("constant force: -0.36 units of u (")


@pytest.mark.parametrize(("lag", "until"), [(Size(0.0, 0.0), "from"), (Size(-1e-3, 1e-5), "until")])
def test_a_zero_order_hold_force_is_said_to_be_one_and_no_late_position(
    lag: Size, until: str
) -> None:
    (line,) = surrounding_lines(Surroundings(lag=lag, zoh=True), Rig("force"))
    assert line == f"the force acts as it stands {until} its row, constant between rows"
