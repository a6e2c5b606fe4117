"""Recipe -> log and truth: what a machine would have logged, and what only its maker knows."""

from dataclasses import asdict
from typing import Any

import numpy as np

from design.loop import ForcePI, LoopNoise, simulate_loop
from design.pid import pd_to_rst, pid_to_rst
from design.rst import RST
from identification.arrays import Array
from identification.errors import BadCard
from identification.excitation import reference_signal
from identification.karnopp import NAMES, UNITS
from identification.log import Log
from identification.plant import Actuator, Motor
from identification.simulate import free_run
from workbench import recipe as recipes
from workbench.card import Card
from workbench.recipe import Recipe
from workbench.units import scale

COLUMNS = ("t", "r", "y", "F", "u")


def record(name: str, recipe: Recipe, seed: int | None = None) -> Log:
    """The log of a recipe, sensors' noise included; `seed` instead of the recipe's where given.

    Raises BadCard where the recipe asks for an effect that no simulation knows yet.
    """
    if recipe.plant.effects:
        raise BadCard(
            f"{name}: effects {', '.join(recipe.plant.effects)} cannot be simulated yet; take"
            " [recipe.effects] out of the card, or choose a recipe without"
        )
    rng = np.random.default_rng(recipe.seed if seed is None else seed)
    reference = reference_signal(recipe.reference, recipe.t, rng)
    if recipe.loop is None:
        return _open_loop(name, recipe, reference, rng)
    run = simulate_loop(
        recipe.plant,
        _position(recipe),
        ForcePI(recipe.loop.force.k_i, recipe.loop.force.T_i) if recipe.loop.force else None,
        reference,
        recipe.h,
        noise=LoopNoise.draw(len(reference), recipe.noise_y, recipe.noise_F, rng),
        control_limit=recipe.loop.control_limit,
    )
    signals = {"r": run.r, "y": run.y_measured, "F": run.F_measured, "u": run.u}
    return Log(name, {"t": recipe.t, **signals})


def as_columns(log: Log, card: Card) -> dict[str, Array]:
    """The log's signals by the card's columns and in its units, as `read_log` reads them back.

    Raises BadCard where the card names a signal that the simulation does not make.
    """
    out: dict[str, Array] = {}
    for name, spec in card.signals.items():
        if name not in log:
            raise BadCard(
                f"{card.path}: signals.{name} is not simulated (there is: {', '.join(COLUMNS)});"
                " take it out of the recipe's card"
            )
        factor, shift = scale(spec.unit, name, card.rig().motion)
        values = (log[name] - shift) / factor
        out[str(spec.column)] = spec.gain * values + spec.offset
    return out


def truth(name: str, recipe: Recipe, seed: int | None = None) -> dict[str, Any]:
    """What the log does not hold: parameters, effects, loop, noise and seed."""
    friction = recipe.plant.friction
    actuator = recipe.plant.actuator
    return {
        "schema": "truth/1",
        "card": name,
        "friction": {n: {"value": getattr(friction, n), "unit": UNITS[n]} for n in NAMES},
        "actuator": asdict(actuator) if actuator else None,
        "effects": recipe.plant.effects,
        "noise": {"y": recipe.noise_y, "F": recipe.noise_F},
        "seed": recipe.seed if seed is None else seed,
        "duration_s": recipe.duration,
        "h_s": recipe.h,
        "loop": asdict(recipe.loop) if recipe.loop else None,
    }


def _position(recipe: Recipe) -> RST:
    """The recipe's position controller as RST at the recipe's period; volts for a motor."""
    assert recipe.loop is not None
    match recipe.loop.position:
        case recipes.PD(k_d, T_d, eps):
            found = pd_to_rst(k_d, T_d, eps, recipe.h)
        case recipes.PID(k_R, T_d, T_i, eps):
            found = pid_to_rst(k_R, T_i, T_d, eps, recipe.h)
        case recipes.RST(R, S, T):
            found = RST(np.array(R), np.array(S), np.array(T), recipe.h)
    actuator = recipe.plant.actuator
    if isinstance(actuator, Motor):
        return RST(found.R / actuator.k_a, found.S, found.T / actuator.k_a, recipe.h)
    return found


def _open_loop(name: str, recipe: Recipe, u: Array, rng: np.random.Generator) -> Log:
    """The reference as the command, no loop around the plant."""
    match recipe.plant.actuator:
        case Motor(k_a):
            force = k_a * u
        case _:
            force = np.zeros(len(u))
    assert isinstance(recipe.plant.actuator, Motor | Actuator)
    blank = Log(name, {"t": recipe.t, "y": np.zeros(len(u)), "u": u, "F": force})
    run = free_run(recipe.plant, blank, (0.0, 0.0, float(force[0])), "command")
    noise = rng.standard_normal((2, len(u)))
    return Log(
        name,
        {
            "t": recipe.t,
            "r": np.zeros(len(u)),
            "y": run.y + recipe.noise_y * noise[0],
            "F": run.F + recipe.noise_F * noise[1],
            "u": u,
        },
    )
