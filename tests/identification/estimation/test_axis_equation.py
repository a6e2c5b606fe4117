"""An axis by its equation of motion, against the machines that made its logs."""

from dataclasses import replace

import numpy as np
import pytest

from design.machine.effect_values import written_effect
from design.simulated.recipe import Recipe
from design.simulated.record import record
from identification.effects._library import built_in
from identification.errors import NotIdentifiable
from identification.estimation.axis_equation import axis_equation
from identification.log import Log, Rig
from tests.chain import short_recipe
from workbench.cards.units import in_unit_of

MADE = Rig("force")


def recipe_with(effects: dict[str, dict[str, float]] | None = None) -> Recipe:
    """The rig of table 1, twice as long, with these effects in it."""
    _, recipe = short_recipe(12.0)
    found = tuple(
        written_effect(key, values, built_in(), in_unit_of)
        for key, values in (effects or {}).items()
    )
    return replace(recipe, plant=replace(recipe.plant, effects=found))


@pytest.mark.parametrize("seed", [101, 102, 103])
def test_mass_and_friction_of_each_direction(seed: int) -> None:
    found = axis_equation(record("made", recipe_with(), seed), MADE)
    truth = {"m": 1.0, "F_cp": 12.0, "F_cn": 15.0, "F_vp": 300.0, "F_vn": 200.0}
    for name, value in truth.items():
        assert abs(found.values[name] - value) < 1e-2 * value, name
        assert found.sd[name] < 0.02 * value
    assert found.offset[0] == pytest.approx(1.5, abs=0.05)
    assert found.relative < 0.01


@pytest.mark.parametrize("seed", [107, 108, 109])
def test_breakaway_is_that_of_slowly_rising_forces(seed: int) -> None:
    found = axis_equation(record("made", recipe_with(), seed), MADE)
    assert min(found.breakaways) >= 3
    for name, value in (("F_sp", 20.6), ("F_sn", 23.0)):
        assert found.values[name] == pytest.approx(value, rel=0.06)
        assert abs(found.values[name] - value) < 4 * found.sd[name]


def test_a_constant_force_is_the_offset() -> None:
    tilted = recipe_with({"constant_force": {"F_0": -1.0}})
    plain, found = (
        axis_equation(record("made", one, 104), MADE) for one in (recipe_with(), tilted)
    )
    assert found.offset[0] - plain.offset[0] == pytest.approx(-1.0, abs=0.02)


def test_a_tight_spot_shows_along_the_travel() -> None:
    spot = recipe_with({"tight_spot": {"size": 4.0, "y_0": 0.02, "width": 0.01}})
    found = axis_equation(record("made", spot, 105), MADE)
    near = np.abs(found.position - 0.02) < 0.005
    far = np.abs(found.position - 0.02) > 0.04
    for own in (found.up, ~found.up):
        more = np.mean(found.level[near & own]) - np.mean(found.level[far & own])
        assert 2.5 < more < 4.5


def test_a_log_that_hardly_slides_is_refused() -> None:
    log = record("made", recipe_with(), 106)
    y = np.linspace(0.0, 0.2, len(log))
    one_way = Log("made", {"t": log["t"], "y": y, "F": np.full(len(log), 50.0)})
    with pytest.raises(NotIdentifiable, match="0 in negative direction, at least 8 of each"):
        axis_equation(one_way, MADE)
