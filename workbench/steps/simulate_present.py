"""The log of a recipe whose machine runs the controller of its card, as `validate` simulates it."""

from dataclasses import replace

import numpy as np

from design.compensator import Compensator
from design.filters import filters_at
from design.loop import LoopNoise
from design.loop_signals import OfForce
from design.servo import Compensation, ServoRun
from identification.errors import BadCard, BadSpecification
from identification.log import Rig
from identification.model.plant import Actuator, Motor
from identification.signals.excitation import reference_signal
from workbench.cards.controller import CardController
from workbench.cards.recipe import Recipe
from workbench.steps.closed_loop import DrivenLoop, servo_run
from workbench.steps.present import present

CLOCKS_ALIKE = 1e-6  # of a sample, by which clocks may differ


def recipe_loop(recipe: Recipe, given: CardController, rig: Rig) -> DrivenLoop:
    """The card's controller around the recipe's machine, with the recipe's compensator and limit.

    Raises BadCard where it is none, or does not fit the machine or the clock of the log.
    """
    drive, asked = recipe.plant.actuator, recipe.loop
    if isinstance(drive, Motor):
        per = rig.force_per_command or drive.k_a
        rig = replace(rig, kind="motor", force_per_command=per)
    try:
        now = present(given, rig, recipe.h)
    except BadSpecification as error:
        raise BadCard(str(error)) from None
    if isinstance(drive, Actuator) and now.output == "force" and now.force is None:
        raise BadCard('an actuator takes no force; add controller.force, or output = "command"')
    if isinstance(drive, Motor) and now.force is not None:
        raise BadCard("a motor has no force loop; leave controller.force out")
    limits = (rig.control_limit, asked.control_limit_v if asked else None)
    loop = DrivenLoop(
        law=now.law,
        force=now.force,
        rate=now.rate,
        limit=min((one for one in limits if one is not None), default=None),
        compensation=compensation(recipe, now.law.h),
        direct=isinstance(drive, Actuator) and now.output == "command",
    )
    if loop.direct and loop.compensation is not None:
        raise BadCard(
            "recipe.loop.compensator adds a force, and the controller gives the valve's command;"
            ' give it output = "force" and a force loop'
        )
    samples = recipe.h / loop.h
    if round(samples) < 1 or abs(samples - round(samples)) > CLOCKS_ALIKE * samples:
        raise BadCard(
            f"controller: it runs every {loop.h:g} s, which must divide h_s = {recipe.h:g} s of the"
            " recipe's log"
        )
    return loop


def compensation(recipe: Recipe, h: float) -> Compensation | None:
    """The recipe's compensator behind the filters that a design has at the period h [s]."""
    asked = recipe.loop.compensator if recipe.loop else None
    if asked is None:
        return None
    known = asked.friction.value if asked.friction else recipe.plant.friction
    return Compensation(Compensator(known, asked.N_c, asked.e_T), filters_at(h))


def run_present(
    recipe: Recipe, loop: DrivenLoop, rng: np.random.Generator, chambers: dict[str, OfForce]
) -> tuple[ServoRun, slice]:
    """The run at the loop's own clock, with the recipe's noise, and the samples that are logged."""
    every = round(recipe.h / loop.h)
    n = (len(recipe.t) - 1) * every + 1
    r = reference_signal(recipe.reference, loop.h * np.arange(n, dtype=np.float64), rng)
    noise = LoopNoise.draw(n, recipe.noise_y, recipe.noise_F, rng)
    run = servo_run(recipe.plant, loop, loop.limit, r, noise, chambers)
    return run, slice(None, None, every)
