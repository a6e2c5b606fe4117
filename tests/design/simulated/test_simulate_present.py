"""A recipe whose machine runs the card's own controller: the run that `validate` simulates."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from design.closed_loop.driven_loop import present_loop, run_driven
from design.machine.model import Model
from design.simulated.record import record
from identification.errors import BadCard
from identification.log import Log
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES, UNITS
from identification.model.plant import Motor
from identification.signals.excitation import reference_signal
from tests.chain import model_of
from workbench.cards.card import Card, load_card, present_of_card
from workbench.cli import main

PLANT = """
[recipe.friction]
m = 3.5
F_cp = 16.97
F_cn = 18.13
F_vp = 289.0
F_vn = 287.4
dv_p = 0.009
dv_n = -0.01
F_sp = 20.76
F_sn = -21.8
[recipe.reference]
kind = "random_steps"
amplitude = 0.05
dwell_s = 0.7
"""
RECIPE = "duration_s = 3.0\nh_s = 1e-3\nseed = 4\nnoise_y = 1e-5\nnoise_F = 0.02\n"
MOTOR = (
    '[rig]\nkind = "motor"\nforce_per_command = 35.0\ncontrol_limit = "5 V"\n',
    "motor = { k_a = 35.0 }\n",
)
VALVE = (
    '[rig]\nkind = "force"\ncontrol_limit = 5.0\n',
    "actuator = { k1 = 19530.0, k2 = 10405.0 }\n",
)
PD = 'kind = "PD"\nk_d = "0.06 V/mm"\nT_d = "12 ms"\neps = 1e-3\n'
PID = 'kind = "PID"\nk_R = 1754.0\nT_d = 0.018\nT_i = 0.072\neps = 0.02\n'
P_PI = 'kind = "P-PI"\nk_v = "20 1/s"\nk_p = "3 V s/m"\nT_i = "40 ms"\nv_ff = 0.5\n'
RST = 'kind = "RST"\nR = [600.0, -580.0]\nS = [1.0, -0.4]\nT = [20.0]\n'
FORCE = "force = { k_i = 0.02, T_i = 0.05 }\n"
AROUND = {
    "PD of a motor": (MOTOR, PD),
    "P-PI of a motor, its reference moved slowly": (MOTOR, P_PI + 'reference_rate = "0.2 m/s"\n'),
    "RST of a motor": (MOTOR, RST + "anti_windup_s = 0.02\n"),
    "PID that gives a motor's force": (MOTOR, PID + 'output = "force"\n'),
    "PID above a force loop": (VALVE, PID + FORCE),
    "a drive that is faster than its log": (VALVE, PID + FORCE + "period_s = 5e-4\n"),
    "a fast force loop": (VALVE, PID + "force = { k_i = 0.01, T_i = 0.05, period_s = 5e-4 }\n"),
    "PD onto the valve": (VALVE, 'kind = "PD"\nk_d = 8.0\nT_d = 0.01\neps = 0.002\n'),
}


def card_of(
    folder: Path, kind: tuple[str, str], controller: str, loop: str = "", recipe: str = RECIPE
) -> Card:
    rig, drive = kind
    text = f'[card]\nname = "own"\n{rig}[recipe]\n{recipe}{drive}{PLANT}{loop}'
    path = folder / "card.toml"
    path.write_text(f"{text}[controller]\n{controller}" if controller else text, encoding="utf-8")
    return load_card(path)


def machine_of(card: Card) -> Model:
    """The recipe's machine as a model that knows it exactly, with the card's controller."""
    recipe = card.recipe
    assert recipe is not None and recipe.plant.actuator is not None
    drive = recipe.plant.actuator
    made = model_of(
        recipe.plant.friction,
        None if isinstance(drive, Motor) else drive,
        k_a=drive.k_a if isinstance(drive, Motor) else None,
    )
    now = present_of_card(card, card.rig(), recipe.h)
    exact = {name: Estimate(getattr(recipe.plant.friction, name), UNITS[name]) for name in NAMES}
    noise = replace(made.fit, noise_y=recipe.noise_y, noise_F=recipe.noise_F)
    return replace(made, rig=card.rig(), friction=exact, controller=now, fit=noise)


@pytest.mark.parametrize("name", AROUND)
def test_it_is_the_run_of_validate(name: str, tmp_path: Path) -> None:
    card = card_of(tmp_path, *AROUND[name])
    recipe = card.recipe
    assert recipe is not None and recipe.by_card
    log = record(card.name, recipe, None, card.rig(), card.controller)
    machine = machine_of(card)
    now = machine.controller
    assert now is not None
    loop = present_loop(machine, now)
    every = round(recipe.h / loop.h)
    rng = np.random.default_rng(recipe.seed)
    t = loop.h * np.arange((len(recipe.t) - 1) * every + 1, dtype=np.float64)
    r = reference_signal(recipe.reference, t, rng)
    run = run_driven(machine, loop, r, rng)
    assert (every, len(log)) == (2 if "fast" in name else 1, 3001)
    for key, found in (("y", run.y_measured), ("F", run.F_measured), ("u", run.u), ("r", run.r)):
        np.testing.assert_array_equal(log[key], found[::every], err_msg=key)
    assert np.ptp(log["y"]) > 0.02


def test_the_compensator_may_stand_beside_it(tmp_path: Path) -> None:
    with_it = "[recipe.loop]\ncompensator = { N_c = 2.0, e_T = 0.003 }\ncontrol_limit_v = 4.0\n"
    rest = {}
    for name, loop in (("without", ""), ("with", with_it)):
        card = card_of(tmp_path, VALVE, PID.replace("PID", "PD").replace("k_R", "k_d").replace(
            "T_i = 0.072\n", "") + FORCE, loop)  # fmt: skip
        assert card.recipe is not None
        log = record(card.name, card.recipe, None, card.rig(), card.controller)
        rest[name] = at_rest(log)
        assert np.max(np.abs(log["u"])) <= (4.0 if loop else 5.0)
    assert rest["with"] < 0.5 * rest["without"]


def at_rest(log: Log) -> float:
    """Largest error at the end of a step [m]."""
    ends = np.flatnonzero(np.diff(log["r"])) - 1
    return float(np.max(np.abs(log["r"] - log["y"])[ends]))


def test_a_position_of_the_recipe_comes_first(tmp_path: Path) -> None:
    loop = '[recipe.loop]\nposition = { kind = "PD", k_d = 3000.0, T_d = 0.02, eps = 0.002 }\n'
    both, alone = (card_of(tmp_path, MOTOR, one, loop) for one in (PD, ""))
    logs = []
    for card in (both, alone):
        assert card.recipe is not None and not card.recipe.by_card
        logs.append(record("own", card.recipe, None, card.rig(), card.controller))
    np.testing.assert_array_equal(logs[0]["y"], logs[1]["y"])


@pytest.mark.parametrize(
    ("kind", "controller", "loop", "said"),
    [
        (VALVE, "", "", "position where drive"),
        (VALVE, PID + 'output = "force"\n', "", "an actuator takes no force"),
        (VALVE, PID + FORCE + "period_s = 7e-4\n", "", "must divide h_s = 0.001 s"),
        (VALVE, PID + FORCE + "period_s = 0.01\n", "", "must divide h_s = 0.001 s"),
        (VALVE, PD, "[recipe.loop]\ncompensator = { e_T = 0.003 }\n", "gives the valve's command"),
        (
            VALVE,
            PID + FORCE,
            "[recipe.loop]\nforce = { k_i = 1.0, T_i = 1.0 }\n",
            "above loop.force",
        ),
    ],
)
def test_what_does_not_fit_is_refused(
    kind: tuple[str, str], controller: str, loop: str, said: str, tmp_path: Path
) -> None:
    with pytest.raises(BadCard, match=said) as refused:
        card = card_of(tmp_path, kind, controller, loop)
        assert card.recipe is not None
        record(card.name, card.recipe, None, card.rig(), card.controller)
    assert len(str(refused.value).splitlines()) == 1


def test_the_command_writes_its_log_and_its_truth(
    tmp_path: Path,
) -> None:
    card = card_of(tmp_path, MOTOR, P_PI)
    assert main(["simulate", str(card.path), "--out", str(tmp_path / "o")]) == 0
    known = json.loads((tmp_path / "o/truth.json").read_text("utf-8"))
    assert known["loop"] is None
    assert known["controller"]["kind"] == "P-PI"
    gain = known["controller"]["gains"]["k_v"]
    assert (gain["value"], gain["unit"]) == (20.0, "1/s")
    assert (tmp_path / "o/own.csv").read_text("utf-8").count("\n") == 3002
