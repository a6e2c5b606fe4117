"""Effects from a recipe to its log and truth, and from a model to its prediction."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from design.closed_loop.driven_loop import driven_loop, effects_left_out, in_the_loop, run_driven
from design.machine.effect_values import exact
from design.machine.model import Model
from design.measured.predict import Prediction, predict
from design.simulated.recipe import (
    FrictionSection,
    LoopSpec,
    Recipe,
    RecipeCompensator,
    RecipeForcePI,
    RecipePD,
)
from design.simulated.record import record, truth
from identification.effects._base import Acting
from identification.effects._library import built_in
from identification.errors import BadCard, BadLog
from identification.log import Log, Rig
from identification.model.plant import Motor
from identification.signals.excitation import Steps
from identification.simulation.inverse_dynamics import of_body
from tests.chain import EMPS, designed, model_of, short_recipe
from workbench.cards.card import load_card
from workbench.logs.runs import read_log
from workbench.logs.sources import card_path
from workbench.steps.demo import recipe_of, simulated_log

PRESSURES = Rig("electro-pneumatic", area_p=12.6e-4, area_n=10e-4, supply_pressure=5e5)
CARD, RECIPE = short_recipe()
SIZES: Mapping[str, Mapping[str, float]] = {
    "stribeck": {"F_s": 4.0, "v_s": 0.1},
    "nonlinear_viscous": {"k": 40.0, "n": 2.0},
    "end_cushion": {"k_p": 3e3, "k_n": 3e3, "y_p": 0.03, "y_n": -0.03},
    "rising_stiction": {"F_r": 20.0, "tau": 0.05},
    "input_delay": {"tau": 0.003},
    "valve_dead_zone": {"u_d": 0.02},
}


def acting(key: str) -> Acting:
    """The effect at a size that shows on the plant of table 1."""
    effect = built_in()[key]
    typical = {p.name: p.typical for p in effect.params}
    return effect.acting(SIZES.get(key, typical))


def with_effects(*effects: Acting, recipe: Recipe = RECIPE) -> Recipe:
    return replace(recipe, plant=replace(recipe.plant, effects=effects), mean_pressure=4e5)


def by_command(recipe: Recipe) -> Recipe:
    """The recipe without its loop: the reference is the command [V]."""
    return replace(recipe, loop=None, drive="command")


def position_rms(found: Prediction) -> float:
    """After the first second: what was commanded before the log is not known to a late actuator."""
    late = found.t > 1.0
    error = (found.position_measured - found.position_simulated)[late]
    return float(np.sqrt(np.mean(error**2)))


def model_with(recipe: Recipe) -> Model:
    """The true model of a recipe."""
    actuator = recipe.plant.actuator
    if isinstance(actuator, Motor):
        model = model_of(recipe.plant.friction, k_a=actuator.k_a)
    else:
        model = model_of(recipe.plant.friction, actuator)
    return replace(model, effects={a.key: exact(a, "linear") for a in recipe.plant.effects})


@pytest.mark.slow
@pytest.mark.parametrize("drive", ["loop", "command"])
@pytest.mark.parametrize("key", list(built_in()))
def test_a_prediction_has_the_effect_that_its_log_has(key: str, drive: str) -> None:
    recipe = with_effects(acting(key))
    if drive == "command":
        recipe = by_command(recipe)
    log = record(key, recipe, rig=PRESSURES)
    plain, whole = (
        predict(model, log, window=1.0)
        for model in (replace(model_with(recipe), effects={}), model_with(recipe))
    )
    limit = 1.5e-4 if key == "backlash" else 6e-5
    assert position_rms(whole) < limit
    # What went before a window is not known to it: the time at rest, the side of the play.
    unsure = key in ("rising_stiction", "backlash")
    assert position_rms(whole) < position_rms(plain) * (1.2 if unsure else 0.8)
    assert whole.force_predicted_rms is not None and plain.force_predicted_rms is not None
    assert whole.force_predicted_rms < 1.1 * plain.force_predicted_rms
    assert whole.force_predicted_rms < 4.0


def test_friction_and_forces_of_effects_enter_the_predicted_force_by_their_signs() -> None:
    for key, size in (("cogging", 0.2), ("load_dependent_friction", 0.6), ("end_cushion", 0.2)):
        recipe = with_effects(acting(key))
        log = record(key, recipe)
        plain = predict(replace(model_with(recipe), effects={}), log).force_predicted_rms
        whole = predict(model_with(recipe), log).force_predicted_rms
        bare = predict(model_with(RECIPE), record("bare", RECIPE)).force_predicted_rms
        assert plain is not None and whole is not None and bare is not None
        assert plain > (1 + size) * bare
        assert whole < 1.1 * bare


@pytest.mark.parametrize("key", ["valve_dead_zone", "input_delay"])
def test_a_motor_s_force_is_that_of_the_command_that_reaches_it(key: str) -> None:
    recipe = with_effects(acting(key))
    motor = replace(recipe.plant, actuator=Motor(300.0))
    assert recipe.loop is not None
    loop = LoopSpec(position=recipe.loop.position)
    recipe = replace(recipe, plant=motor, loop=loop, noise_F=0.0)
    log = record(key, recipe)
    as_read = log.with_signals(F=300.0 * log["u"])
    found, plain = (
        predict(model, as_read, window=1.0)
        for model in (model_with(recipe), replace(model_with(recipe), effects={}))
    )
    assert position_rms(found) < 1.5e-4
    assert position_rms(found) < 0.5 * position_rms(plain)
    if key == "valve_dead_zone":
        assert np.allclose(found.force_applied, log["F"], atol=1e-9)


def test_the_body_behind_a_bent_transducer_is_found() -> None:
    recipe = with_effects(acting("sensor_nonlinearity"))
    log = record("bent", recipe)
    body = of_body(log, recipe.plant)
    bent = acting("sensor_nonlinearity").values
    y = body["y"]
    assert np.allclose(y + y**2 * (bent["a"] + bent["b"] * y), log["y"], atol=1e-6)
    assert np.max(np.abs(y - log["y"])) > 1e-4


def test_the_truth_has_every_parameter_with_its_unit() -> None:
    known = truth("x", with_effects(acting("stribeck")))
    bare = {"sd": None, "low": None, "high": None}
    assert known["effects"] == {
        "stribeck": {
            "F_s": {"value": 4.0, "unit": "N", **bare},
            "v_s": {"value": 0.1, "unit": "m/s", **bare},
            "asymmetry": {"value": 0.0, "unit": "1", **bare},
            "delta": {"value": 2.0, "unit": "1", **bare},
        }
    }
    turning = truth("x", with_effects(acting("spring")), rig=Rig("force", motion="rotary"))
    assert turning["effects"]["spring"]["k"]["unit"] == "N m/rad"


def test_the_demo_s_held_out_run_is_another(tmp_path: Path) -> None:
    card = load_card(card_path("demo"))
    one, other = (simulated_log(card, tmp_path, held_out=later) for later in (False, True))
    assert (one.name, other.name) == ("demo.parquet", "demo_held_out.parquet")
    read = [read_log(path, card) for path in (one, other)]
    assert len(read[0]) == len(read[1]) == 30001
    assert np.std(read[0]["r"] - read[1]["r"]) > 5e-3
    assert np.array_equal(read[0]["y"], record("demo", recipe_of(card))["y"])


def test_pressures_make_the_force_by_which_the_log_is_read() -> None:
    recipe = replace(with_effects(acting("pressure_dependent_friction")), noise_F=0.0)
    for one in (recipe, by_command(recipe)):
        log = record("air", one, rig=PRESSURES)
        S_p, S_n = 12.6e-4, 10e-4
        F = S_p * log["p_p"] - S_n * log["p_n"] - (S_p - S_n) * 5e5
        assert np.allclose(F, log["F"], atol=1e-6)
        assert np.allclose(0.5 * (log["p_p"] + log["p_n"]), 4e5)
    noisy = record("air", replace(recipe, noise_p=100.0), rig=PRESSURES)
    quiet = record("air", recipe, rig=PRESSURES)
    assert np.std(noisy["p_n"] - quiet["p_n"]) == pytest.approx(100.0, rel=0.05)
    assert "p_p" not in record("dry", RECIPE)


def test_a_plain_recipe_s_log_is_the_same_with_and_without_pressures() -> None:
    dry, air = record("x", RECIPE), record("x", replace(RECIPE, mean_pressure=4e5), rig=PRESSURES)
    assert all(np.array_equal(dry[key], air[key]) for key in ("t", "r", "y", "F", "u"))


def test_what_a_recipe_cannot_simulate_is_refused_in_one_line() -> None:
    recipe = with_effects(acting("pressure_dependent_friction"))
    with pytest.raises(
        BadCard, match=r"dry: effect 'pressure_dependent_friction' acts by p_p, p_n"
    ):
        record("dry", recipe)
    with pytest.raises(BadCard, match=r"air: p_. falls to -\d.*raise\s+mean_pressure_pa"):
        record("air", replace(recipe, mean_pressure=1e3), rig=PRESSURES)
    with pytest.raises(BadCard, match="mean pressure is not known"):
        bare = replace(PRESSURES, supply_pressure=0.0)
        record("air", replace(recipe, mean_pressure=None), rig=bare)
    delays = with_effects(acting("input_delay"), acting("input_delay"))
    with pytest.raises(BadCard, match="two: more than one effect delays the command"):
        record("two", delays)


def test_a_log_without_the_effect_s_signals_is_refused() -> None:
    recipe = with_effects(acting("pressure_dependent_friction"))
    log = record("air", recipe, rig=PRESSURES)
    bare = Log("bare", {key: log[key] for key in ("t", "y", "F", "u")})
    with pytest.raises(BadLog, match="acts by p_p, p_n, which the log has not"):
        predict(model_with(recipe), bare)


def test_a_motor_s_loop_has_the_model_s_effects() -> None:
    plain = model_of(EMPS, k_a=35.15)
    found = designed(plain, period=10e-3)
    assert found.rst is not None
    spring = built_in()["spring"].acting({"k": 2000.0})
    whole = replace(plain, effects={"spring": exact(spring, "linear")})
    assert [one.key for one in in_the_loop(whole)] == ["spring"]
    assert effects_left_out(whole) is None
    r = np.repeat([0.0, 0.05], round(2.0 / found.rst.h))
    one, other = (
        run_driven(machine, driven_loop(machine, found, found.rst), r, np.random.default_rng(0))
        for machine in (plain, whole)
    )
    assert np.max(np.abs(one.y - other.y)) > 1e-4
    assert other.F[-1] - one.F[-1] == pytest.approx(2000.0 * 0.05, rel=0.5)


def test_a_loop_of_two_rates_has_the_model_s_effects() -> None:
    plain = model_of(RECIPE.plant.friction, RECIPE.plant.actuator)  # type: ignore[arg-type]
    found = designed(plain)
    assert found.rst is not None and found.force is not None
    assert found.rst.h > found.force.h
    effects = {"stribeck": exact(acting("stribeck"), "linear")}
    whole = replace(plain, effects=effects)
    assert effects_left_out(plain) is None
    assert effects_left_out(whole) is None
    r = np.repeat([0.0, 0.05], 2000)
    one, other = (
        run_driven(machine, driven_loop(machine, found, found.rst), r, np.random.default_rng(0))
        for machine in (plain, whole)
    )
    assert np.max(np.abs(one.y - other.y)) > 1e-6


def test_effects_whose_signals_no_simulation_makes_are_left_out_with_a_word() -> None:
    plain = model_of(RECIPE.plant.friction, RECIPE.plant.actuator)  # type: ignore[arg-type]
    effects = {
        "pressure_dependent_friction": exact(acting("pressure_dependent_friction"), "linear")
    }
    whole = replace(plain, effects=effects)
    assert (
        effects_left_out(whole)
        == "simulated without the model's effects pressure_dependent_friction"
    )


def test_a_recipe_s_compensator_takes_the_error_at_rest_away() -> None:
    pd = RecipePD(kind="PD", k_d=200.0, T_d=0.1, eps=0.2)
    loop = LoopSpec(position=pd, force=RecipeForcePI(k_i=0.02, T_i=0.05))
    recipe = replace(RECIPE, loop=loop, reference=Steps((0.0, 0.05), 2.0), duration=8.0)

    def left(one: Recipe) -> float:
        log = record("pd", one)
        still = slice(round(3.5 / one.h), round(4.0 / one.h))
        return float(np.max(np.abs(log["r"] - log["y"])[still]))

    own = replace(
        recipe, loop=loop.model_copy(update={"compensator": RecipeCompensator(e_T=0.003)})
    )
    assert left(own) < 0.1 * left(recipe)
    wrong = replace(recipe.plant.friction, F_sp=0.3, F_sn=-0.3, F_cp=0.2, F_cn=0.2)
    beside = RecipeCompensator(e_T=0.003, friction=FrictionSection(**asdict(wrong)))
    blind = loop.model_copy(update={"compensator": beside})
    assert left(replace(recipe, loop=blind)) > 0.5 * left(recipe)
