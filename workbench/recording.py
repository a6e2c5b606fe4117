"""Recipe -> log and truth: what a machine would have logged, and what only its maker knows."""

from dataclasses import asdict
from typing import Any

import numpy as np

from design.pid import pd_to_rst, pid_to_rst
from design.rst import RST
from identification.errors import BadCard
from identification.excitation import reference_signal
from identification.karnopp import NAMES, UNITS
from identification.log import Log
from identification.plant import Actuator, Motor
from identification.simulate import free_run
from workbench import recipe as recipes
from workbench.closed_loop import ForcePI, Noise, simulate_loop
from workbench.recipe import Recipe

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
        rng,
        noise=Noise(recipe.noise_y, recipe.noise_F),
        limit=recipe.loop.control_limit,
    )
    return Log(name, {"t": recipe.t, "r": run.r, "y": run.y_m, "F": run.F_m, "u": run.u})


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
    """The recipe's position controller as RST at the recipe's period."""
    assert recipe.loop is not None
    match recipe.loop.position:
        case recipes.PD(k_d, T_d, eps):
            return pd_to_rst(k_d, T_d, eps, recipe.h)
        case recipes.PID(k_R, T_d, T_i, eps):
            return pid_to_rst(k_R, T_i, T_d, eps, recipe.h)
        case recipes.RST(R, S, T):
            return RST(np.array(R), np.array(S), np.array(T), recipe.h)


def _open_loop(name: str, recipe: Recipe, u: Any, rng: np.random.Generator) -> Log:
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
