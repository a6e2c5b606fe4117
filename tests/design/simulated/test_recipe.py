"""Recipes: from TOML to values, and their contradictions."""

from pathlib import Path

import numpy as np
import pytest

from design.simulated.recipe import (
    Recipe,
    RecipeCompensator,
    RecipeForcePI,
    RecipePD,
    RecipePID,
    RecipeRST,
)
from identification.errors import BadCard
from identification.model.plant import Actuator, Motor
from identification.signals.excitation import Multisine, Ramps, RandomSteps, Steps, Sum
from workbench.cards.card import load_card

HEAD = '[card]\nname = "a"\n[rig]\nkind = "force"\n'
RECIPE = """
[recipe]
duration_s = 2.0
h_s = 1e-3
noise_F = 0.01
seed = 7
actuator = { k1 = 19530.0, k2 = 10405.0 }
friction = { m = 1, F_cp = 12, F_cn = 15, F_vp = 300, F_vn = 200, dv_p = 0.04, dv_n = -0.04, F_sp = 20.6, F_sn = -23 }
reference = { kind = "steps", levels = [0.0, 0.1], dwell_s = 0.5 }
effects.spring = { k = 3.0 }
loop = { position = { kind = "PD", k_d = 200.0, T_d = 0.1, eps = 0.2 }, force = { k_i = 0.02, T_i = 0.05 } }
"""  # noqa: E501


def recipe(folder: Path, text: str) -> Recipe:
    path = folder / "card.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    found = load_card(path).recipe
    assert found is not None
    return found


def test_a_recipe_is_read_whole(tmp_path: Path) -> None:
    found = recipe(tmp_path, RECIPE)
    assert found.plant.friction.F_sn == -23.0
    assert found.plant.actuator == Actuator(19530.0, 10405.0)
    assert [(one.key, one.values) for one in found.plant.effects] == [
        ("spring", {"k": 3.0, "k_3": 0.0})
    ]
    assert found.reference == Steps((0.0, 0.1), 0.5)
    assert found.loop is not None
    assert found.loop.position == RecipePD(kind="PD", k_d=200.0, T_d=0.1, eps=0.2)
    assert found.loop.force == RecipeForcePI(k_i=0.02, T_i=0.05)
    assert (found.seed, found.noise_F, found.noise_y) == (7, 0.01, 0.0)
    assert len(found.t) == 2001
    assert found.t[-1] == pytest.approx(2.0)
    assert np.all(np.diff(found.t) > 0)


def test_a_recipe_s_card_reads_the_log_it_makes(tmp_path: Path) -> None:
    path = tmp_path / "card.toml"
    path.write_text(HEAD + RECIPE, encoding="utf-8")
    card = load_card(path)
    assert {name: spec.unit for name, spec in card.signals.items()} == {
        "t": "s",
        "r": "m",
        "y": "m",
        "F": "N",
        "u": "V",
    }


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ('{ kind = "ramps", amplitude = 0.1, rate = 0.02 }', Ramps(0.1, 0.02)),
        ('{ kind = "random_steps", amplitude = 0.1, dwell_s = 2 }', RandomSteps(0.1, 2.0)),
        (
            '{ kind = "multisine", amplitude = 0.1, low_hz = 0.1, high_hz = 3, lines = 9 }',
            Multisine(0.1, 0.1, 3.0, 9),
        ),
        (
            '{ kind = "sum", parts = [{ kind = "ramps", amplitude = 1, rate = 1 }] }',
            Sum((Ramps(1.0, 1.0),)),
        ),
    ],
)
def test_every_reference(tmp_path: Path, text: str, value: object) -> None:
    old = '{ kind = "steps", levels = [0.0, 0.1], dwell_s = 0.5 }'
    assert recipe(tmp_path, RECIPE.replace(old, text)).reference == value


@pytest.mark.parametrize(
    ("text", "value"),
    [
        (
            '{ kind = "PID", k_R = 9, T_d = 0.1, T_i = 1, eps = 0.2 }',
            RecipePID(kind="PID", k_R=9.0, T_d=0.1, T_i=1.0, eps=0.2),
        ),
        (
            '{ kind = "RST", R = [1, 2], S = [1], T = [3] }',
            RecipeRST(kind="RST", R=(1.0, 2.0), S=(1.0,), T=(3.0,)),
        ),
    ],
)
def test_every_position_controller(tmp_path: Path, text: str, value: object) -> None:
    old = '{ kind = "PD", k_d = 200.0, T_d = 0.1, eps = 0.2 }'
    loop = recipe(tmp_path, RECIPE.replace(old, text)).loop
    assert loop is not None
    assert loop.position == value


@pytest.mark.parametrize(
    ("written", "key", "values"),
    [
        (
            'stribeck = { F_s = "4 N", v_s = "30 mm/s" }',
            "stribeck",
            {"F_s": 4.0, "v_s": 0.03, "asymmetry": 0.0, "delta": 2.0},
        ),
        ('input_delay = { tau = "12 ms" }', "input_delay", {"tau": 0.012}),
        (
            'load_dependent_friction = { mu = "10 %", asymmetry = -0.1 }',
            "load_dependent_friction",
            {"mu": 0.1, "asymmetry": -0.1},
        ),
        (
            'nonlinear_viscous = { k = "0.1 N (s/mm)**2", n = "2" }',
            "nonlinear_viscous",
            {"k": 1e5, "n": 2.0, "asymmetry": 0.0},
        ),
    ],
)
def test_effects_are_written_in_any_unit(
    tmp_path: Path, written: str, key: str, values: dict[str, float]
) -> None:
    (one,) = recipe(tmp_path, RECIPE.replace("spring = { k = 3.0 }", written)).plant.effects
    assert one.key == key
    assert one.values == pytest.approx(values, rel=1e-12)


def test_a_rotary_recipe_writes_its_effects_in_rad_and_newton_metres(tmp_path: Path) -> None:
    turning = HEAD.replace('kind = "force"', 'kind = "force"\nmotion = "rotary"')
    path = tmp_path / "card.toml"
    for unit, needed in (("N m/rad", None), ("N/m", "another kind than 'N m/rad'")):
        text = RECIPE.replace("k = 3.0", f'k = "3 {unit}"')
        path.write_text(turning + text, encoding="utf-8")
        if needed is None:
            found = load_card(path).recipe
            assert found is not None
            assert found.plant.effects[0].values == {"k": 3.0, "k_3": 0.0}
        else:
            with pytest.raises(BadCard, match=needed):
                load_card(path)


def test_a_log_s_card_needs_no_effect_of_its_recipe(tmp_path: Path) -> None:
    path = tmp_path / "card.toml"
    path.write_text(HEAD + RECIPE.replace("spring", "magnet"), encoding="utf-8")
    with pytest.raises(BadCard, match="--effects FOLDER"):
        load_card(path)
    found = load_card(path, with_recipe=False)
    assert found.recipe is None
    assert set(found.signals) == {"t", "r", "y", "F", "u"}


def test_open_loop_by_command_and_motor(tmp_path: Path) -> None:
    lines = [line for line in RECIPE.splitlines() if not line.startswith(("loop", "actuator"))]
    text = "\n".join([*lines, 'drive = "command"', "motor = { k_a = 35.15 }"])
    found = recipe(tmp_path, text)
    assert found.loop is None
    assert found.drive == "command"
    assert found.plant.actuator == Motor(35.15)


def test_a_compensator_knows_the_plant_s_friction_or_another(tmp_path: Path) -> None:
    nine = "m = 2, F_cp = 10, F_cn = 11, F_vp = 1, F_vn = 1, dv_p = 0.1, dv_n = -0.1, F_sp = 20"
    end, other = "T_i = 0.05 } }", f"friction = {{ {nine}, F_sn = -21 }}"
    for given, wanted in (
        ("e_T = 0.003", None),
        (f"N_c = 3, e_T = 0.003, {other}", -21.0),
    ):
        asked = f"T_i = 0.05 }}, compensator = {{ {given} }} }}"
        found = recipe(tmp_path, RECIPE.replace(end, asked))
        assert found.loop is not None
        beside = found.loop.compensator
        assert isinstance(beside, RecipeCompensator) and beside.e_T == 0.003
        assert beside.N_c == (2.0 if wanted is None else 3.0)
        assert (beside.friction and beside.friction.F_sn) == wanted


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("noise_F", "noise_f", "[recipe] unknown key 'noise_f'; did you mean 'noise_F'?"),
        ("T_d", "t_d", "unknown key 't_d'; did you mean 'T_d'?"),
        ("dwell_s", "dwell", "unknown key 'dwell'; did you mean 'dwell_s'?"),
        ('"steps"', '"step"', "'step'"),
        ("F_sn = -23", "F_sn = 23", "F_sn = 23 N, must be negative"),
        ("m = 1,", "m = 0,", "m = 0 kg, must be > 0"),
        ("actuator = { k1 = 19530.0, k2 = 10405.0 }", "", "one of 'actuator' and 'motor'"),
        ("seed = 7", 'drive = "command"', "needs no 'loop'"),
        (", force = { k_i = 0.02, T_i = 0.05 }", "", "needs loop.force with an actuator"),
        ("T_i = 0.05 } }", "T_i = 0.05 }, compensator = { e_T = 0 } }", "compensator.e_T] 0"),
        ("T_i = 0.05 } }", "T_i = 0.05 }, compensator = { e_T = 1, N_c = 1 } }", "N_c] 1"),
        ("h_s = 1e-3", "h_s = 0", "[recipe.h_s] 0: "),
        ("duration_s = 2.0", "duration_s = 1e-4", "makes 0.1 samples, 100 to 1e+08 needed"),
        ("duration_s = 2.0", "duration_s = 1e15", "makes 1e+18 samples"),
        (
            'kind = "steps", levels = [0.0, 0.1], dwell_s = 0.5',
            'kind = "sum", parts = [{ kind = "multisine", amplitude = 1, low_hz = 1, '
            "high_hz = 600 }]",
            "high_hz = 600 is not below half the sampling rate (500 Hz",
        ),
        ("h_s = 1e-3", "h_s = true", "[recipe] h_s needs a value, not true or false"),
        ("levels = [0.0, 0.1]", "levels = 0.1", "[recipe.reference.steps.levels] 0.1: a list"),
        ("spring", "sprung", "[recipe] effects: unknown effect 'sprung'; did you mean 'spring'?"),
        ("{ k = 3.0 }", "{ K = 3.0 }", "spring: unknown parameter 'K'; did you mean 'k'?"),
        ("{ k = 3.0 }", "{}", "effects: spring has no 'k' [N/m]"),
        ("{ k = 3.0 }", "3.0", "[recipe.effects.spring] 3.0: a table"),
        ("{ k = 3.0 }", "{ k = true }", "spring.k = True: a number in 'N/m' or a text"),
        ("{ k = 3.0 }", "{ k = [1] }", "spring.k = [1]: a number in 'N/m' or a text"),
        ("{ k = 3.0 }", "{ k = nan }", "effect 'spring': k = nan N/m, must lie in"),
        ("{ k = 3.0 }", '{ k = "3 N" }', "spring.k: unit 'N' is of another kind than 'N/m'"),
        ("{ k = 3.0 }", '{ k = "3 N/q" }', "spring.k: unit 'N/q' is unknown"),
        (
            "{ k = 3.0 }",
            '{ k = "stiff" }',
            "spring.k = 'stiff': a number needed, or one with a unit as 'N/m'",
        ),
        ("{ k = 3.0 }", "{ k = -1e99 }", "k = -1e+99 N/m, must lie in"),
    ],
)
def test_contradictions_are_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "card.toml"
    path.write_text(HEAD + RECIPE.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(BadCard) as caught:
        load_card(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
