"""Models to make tables of: linear and rotary, with and without effects, and one of each lack."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from design.machine.effect_values import effect_units, known_effect
from design.machine.model import Model
from identification.model.estimates import Estimate
from identification.model.karnopp import ROTARY_UNITS, Karnopp
from tests.chain import TABLES, model_of

STRIBECK = {"stribeck": {"F_s": 6.0, "v_s": 0.02, "asymmetry": 0.3}}
COGGING = {
    "cogging": {"a": 0.3, "b": -0.4, "period": 0.024, "a_2": 0.1, "b_2": 0.05},
    "cogging_2": {"a": 0.2, "b": 0.1, "period": 0.008},
}
PLAY = {"backlash": {"width": 2.4e-4}}
PLACE = {
    "constant_force": {"F_0": -3.0},
    "spring": {"k": 40.0, "k_3": 2000.0},
    "gravity": {"a": 1.0, "b": 0.5, "turn": 0.05},
}
ROTARY = Karnopp(2e-3, 0.05, 0.065, 1e-3, 1.2e-3, 0.1, -0.1, 0.09, -0.1)


def linear(effects: Mapping[str, Mapping[str, float]] | None = None, **changed: Any) -> Model:
    """The paper's second rig at up to 0.3 m/s, with these effects in the open (a motor's force)."""
    model = model_of(TABLES["paper_table2"], k_a=35.15)
    return _finished(model, effects or {}, 0.3, changed)


def rotary(effects: Mapping[str, Mapping[str, float]] | None = None, **changed: Any) -> Model:
    """A small motor at up to 60 rad/s, with these effects."""
    model = model_of(ROTARY, k_a=0.4)
    friction = {name: replace(one, unit=ROTARY_UNITS[name]) for name, one in model.friction.items()}
    drive = {"k_a": Estimate(0.4, "N m/V")}
    rig = replace(model.rig, motion="rotary")
    turned = replace(model, rig=rig, friction=friction, actuator=drive)
    return _finished(turned, effects or {}, 60.0, changed)


def lost(model: Model, *names: str) -> Model:
    """The model of logs that do not tell these of its nine parameters."""
    friction = {
        name: Estimate(None, one.unit, reason="no slow run; add one", assumed=one.value)
        if name in names
        else one
        for name, one in model.friction.items()
    }
    return replace(model, friction=friction)


def _finished(
    model: Model, effects: Mapping[str, Mapping[str, float]], speed: float, changed: Any
) -> Model:
    found = {}
    for key, values in effects.items():
        effect = known_effect(key, model.library)
        units = effect_units(effect, model.rig.motion, model.rig.command_unit)
        every = effect.acting(values).values
        found[key] = {name: Estimate(value, units[name]) for name, value in every.items()}
    entry = replace(model.log[0], speed=speed)
    return replace(model, log=(entry,), effects=found, **changed)
