"""A short simulated machine and a model of it, made once a process."""

from dataclasses import replace
from typing import Any

import numpy as np

from design.controllers.design import design
from design.identified.identify_logs import Identified, identify_logs
from design.machine.design import Design
from design.machine.model import FitSummary, LogEntry, Model
from design.machine.source import Source
from design.simulated.recipe import Recipe
from design.simulated.record import record
from identification.errors import BadCard
from identification.log import Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES, UNITS, Karnopp
from identification.model.plant import Actuator
from tests.made import made_once
from workbench.cards.card import Card, load_card
from workbench.logs.sources import Sources, card_path

CARD = """
[card]
name = "short"
[rig]
kind = "force"
[recipe]
duration_s = 6.0
h_s = 2e-3
seed = 5
noise_F = 1e-2
noise_y = 1e-5
actuator = { k1 = 19530.0, k2 = 10405.0 }
[recipe.friction]
m = 1.0
F_cp = 12.0
F_cn = 15.0
F_vp = 300.0
F_vn = 200.0
dv_p = 0.04
dv_n = -0.04
F_sp = 20.6
F_sn = -23.0
[recipe.reference]
kind = "sum"
parts = [
    { kind = "random_steps", amplitude = 0.05, dwell_s = 0.5 },
    { kind = "multisine", amplitude = 0.02, low_hz = 0.2, high_hz = 5.0, lines = 20 },
]
[recipe.loop]
position = { kind = "PID", k_R = 1754.0, T_d = 0.018, T_i = 0.072, eps = 0.2 }
force = { k_i = 0.02, T_i = 0.05 }
"""
TABLES = {
    "paper_table1": Karnopp(1.0, 12.0, 15.0, 300.0, 200.0, 0.04, -0.04, 20.6, -23.0),
    "paper_table2": Karnopp(3.5, 16.97, 18.13, 289.0, 287.4, 0.009, -0.01, 20.76, -21.8),
    "paper_table3": Karnopp(6.5, 12.54, 7.35, 147.01, 113.05, 0.015, -0.02, 24.03, -10.18),
}
EMPS = Karnopp(95.1, 23.5, 17.2, 203.5, 203.5, 0.001, -0.001, 25.0, -19.0)


def short_recipe(duration: float = 6.0) -> tuple[Card, Recipe]:
    """The rich shipped recipe of table 1, cut short and sampled at 2 ms."""
    card = load_card(card_path("paper_table1_rich"))
    if card.recipe is None:
        raise BadCard("paper_table1_rich lost its recipe")
    return card, replace(card.recipe, duration=duration, h=2e-3, seed=5)


@made_once
def identified() -> Identified:
    """The model of the short recipe, by the whole of identification."""
    card, recipe = short_recipe()
    log = record("short", recipe)
    source = Source(log, "short.csv", "0" * 64, len(log))
    return identify_logs(Sources(card, card.rig(), (source,), ("a remark",)).logs)


def designed(model: Model, *given: Any, **asked: Any) -> Design:
    """`workbench.steps.design.design` of the model, made once for what is asked."""
    return _designed(model, model.read, *given, **asked)


@made_once
def _designed(model: Model, _read: tuple[str, ...], *given: Any, **asked: Any) -> Design:
    """By the model and what is said of its file, which is no part of its `repr`."""
    return design(model, *given, **asked)


def model_of(
    p: Karnopp, actuator: Actuator | None = None, *, k_a: float | None = None, spread: float = 1e-3
) -> Model:
    """A model of known parameters, each with an interval of +- 2 `spread`, without any log."""
    if actuator:
        drive = {"k1": _known(actuator.k1, "N/(V s)"), "k2": _known(actuator.k2, "N/m")}
    elif k_a:
        drive = {"k_a": _known(k_a, "N/V")}
    entry = LogEntry(
        file="a.csv",
        sha256="0" * 64,
        rows=1000,
        start=(0.0, 0.0, 0.0),
        travel=(-0.1, 0.1),
        force_peak=200.0,
        duration=1.0,
        h=1e-3,
        position_rms=1e-5,
        force_rms=None,
        chi_square=1.0,
    )
    return Model(
        card="known",
        rig=Rig("force" if actuator else "motor", force_per_command=k_a),
        friction={name: _known(getattr(p, name), UNITS[name], spread) for name in NAMES},
        actuator=drive if actuator or k_a else None,
        plant=None,
        plant_reason="none was fitted",
        fit=FitSummary("command", 0.0, 1e-5, 1e-2, 1.0, True, 1, 0.01, 0.1, ()),
        log=(entry,),
        versions={"numpy": np.__version__},
    )


def _known(value: float, unit: str, spread: float = 1e-3) -> Estimate:
    sd = abs(value) * spread
    return Estimate(value, unit, sd, value - 2 * sd, value + 2 * sd)
