"""Recipe -> log and truth: what a machine would have logged, and what only its maker knows."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from design.closed_loop.driven_loop import DrivenLoop
from design.compensator import Compensator
from design.effect_loop import simulate_effect_loop
from design.filters import filters_at
from design.force_pi import ForcePI
from design.loop import Cascade, LoopNoise, LoopRun, simulate_loop
from design.loop_signals import OfForce, pressures
from design.machine.codec import written
from design.machine.controller import CardController, present, rst_of
from design.machine.documents import around_of
from design.machine.drive import Present
from design.machine.effect_values import exact
from design.machine.plain import as_number
from design.machine.readable import Display
from design.measured.predict import lacking_signals
from design.rst import RST
from design.servo import Compensation, simulate_servo
from design.simulated.recipe import Recipe
from identification.arrays import Array
from identification.errors import BadCard, BadModel, BadSpecification
from identification.log import Log, Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from identification.model.plant import Actuator, Motor, actuator_units
from identification.signals.check import ABSURD
from identification.signals.excitation import reference_signal
from identification.simulation.free_run import FreeRun, free_run

MOST_PASSES = 30  # of an open loop in which friction follows pressures, and they the force
CONVERGED_CHANGE = 1e-9  # relative change of the force from which it has settled
Chambers = dict[str, OfForce]


def record(
    name: str,
    recipe: Recipe,
    seed: int | None = None,
    rig: Rig | None = None,
    controller: CardController | None = None,
) -> Log:
    """The log of a recipe, sensors' noise included; `seed` instead of the recipe's where given.

    rig: where it is electro-pneumatic, the chambers' pressures are logged too. controller: that of
    the card, which runs the machine where the recipe names no position controller. Raises BadCard
    where an effect needs a signal that is not simulated, or where the machine runs away.
    """
    rng = np.random.default_rng(recipe.seed if seed is None else seed)
    chambers = _chambers(name, recipe, rig)
    for key, missing in lacking_signals(recipe.plant.effects, chambers):
        raise BadCard(
            f"{name}: effect {key!r} acts by {missing}, which this recipe does not simulate;"
            ' pressures need a rig of kind = "electro-pneumatic", other signals a log of a machine'
        )
    try:
        if recipe.by_card:
            run = _by_card(recipe, controller, rig, rng, chambers)
        else:
            reference = reference_signal(recipe.reference, recipe.t, rng)
            drive = _open_loop if recipe.drive == "command" else _in_loop
            run = drive(recipe, reference, rng, chambers)
    except (BadModel, BadCard) as error:
        raise BadCard(f"{name}: {error}") from None
    every = (len(run.t) - 1) // (len(recipe.t) - 1)  # a card's controller may run faster
    logged = {"r": run.r, "y": run.y_measured, "F": run.F_measured, "u": run.u}
    signals = {"t": recipe.t, **{key: values[::every] for key, values in logged.items()}}
    log = Log(name, signals | _logged_pressures(name, recipe, chambers, run.F[::every], rng))
    lost = np.flatnonzero(~(np.abs(log["y"]) < ABSURD))
    if lost.size:
        raise BadCard(
            f"{name}: the simulated machine runs away after {log['t'][lost[0]]:.3g} s; weaken the"
            " controller in [recipe.loop], or the command"
        )
    return log


def _in_loop(
    recipe: Recipe, reference: Array, rng: np.random.Generator, chambers: Chambers
) -> LoopRun:
    """The reference as that of the recipe's position loop."""
    loop = recipe.loop
    assert loop is not None
    force = ForcePI(loop.force.k_i, loop.force.T_i) if loop.force else None
    noise = LoopNoise.draw(len(reference), recipe.noise_y, recipe.noise_F, rng)
    cascade = Cascade(_position(recipe), force, loop.control_limit_v)
    parts = (recipe.plant, cascade, reference, recipe.h)
    beside = _compensation(recipe, recipe.h)
    if recipe.plant.effects or beside:
        return simulate_effect_loop(*parts, noise=noise, signals=chambers, friction=beside)
    return simulate_loop(*parts, noise=noise)


def _by_card(
    recipe: Recipe, controller: CardController | None, rig: Rig | None,
    rng: np.random.Generator, chambers: Chambers,
) -> LoopRun:  # fmt: skip
    """The reference as that of the card's own controller, at the controller's clock."""
    if controller is None or rig is None:
        raise BadCard("no position controller; give recipe.loop.position, or add [controller]")
    loop = _loop_of_card(recipe, controller, rig)
    n = (len(recipe.t) - 1) * round(recipe.h / loop.h) + 1
    r = reference_signal(recipe.reference, loop.h * np.arange(n, dtype=np.float64), rng)
    noise = LoopNoise.draw(n, recipe.noise_y, recipe.noise_F, rng)
    start = (float(r[0]), 0.0, 0.0)
    return simulate_servo(
        recipe.plant, loop.servo, r, loop.h, noise=noise, start=start, signals=chambers
    )


def _open_loop(recipe: Recipe, u: Array, rng: np.random.Generator, chambers: Chambers) -> LoopRun:
    """The reference as the command, no loop around the plant."""
    run = _open_run(recipe, u, chambers)
    noise = rng.standard_normal((2, len(u)))
    y, F = run.shown + recipe.noise_y * noise[0], run.F + recipe.noise_F * noise[1]
    return LoopRun(recipe.t, np.zeros(len(u)), run.y, run.v, run.F, y, F, u, run.mode)


def _open_run(recipe: Recipe, u: Array, chambers: Chambers) -> FreeRun:
    """The run by command; where friction follows the pressures, repeated until both agree.

    Raises BadModel where they do not.
    """
    actuator = recipe.plant.actuator
    assert isinstance(actuator, Motor | Actuator)
    force = actuator.k_a * u if isinstance(actuator, Motor) else np.zeros(len(u))
    blank = Log("recipe", {"t": recipe.t, "y": np.zeros(len(u)), "u": u, "F": force})
    start = (0.0, 0.0, float(force[0]))
    circular = any(name in chambers for one in recipe.plant.effects for name in one.effect.signals)
    for _ in range(MOST_PASSES):
        known = blank.with_signals(**{name: of(force) for name, of in chambers.items()})
        run = free_run(recipe.plant, known, start, "command")
        change = float(np.max(np.abs(run.F - force)))
        if not circular or change <= CONVERGED_CHANGE * float(np.max(np.abs(run.F))):
            return run
        force = run.F
    raise BadModel(
        f"pressures and friction do not agree after {MOST_PASSES} passes (the force still changes"
        f" by {change:.3g} N); close the loop, or weaken the effect of the pressures"
    )


def _chambers(name: str, recipe: Recipe, rig: Rig | None) -> Chambers:
    """Pressures that an electro-pneumatic rig has under a force; none for any other."""
    if rig is None or rig.kind != "electro-pneumatic" or not (rig.area_p and rig.area_n):
        return {}
    supply = rig.supply_pressure or 0.0
    mean = recipe.mean_pressure or 0.5 * supply
    if not mean > 0:
        raise BadCard(
            f"{name}: the chambers' mean pressure is not known (supply_pressure_pa = {supply:g});"
            " add mean_pressure_pa to [recipe]"
        )
    return pressures(rig.area_p, rig.area_n, mean, supply)


def _logged_pressures(
    name: str, recipe: Recipe, chambers: Chambers, F: Array, rng: np.random.Generator
) -> dict[str, Array]:
    """The pressures along the force F [N], with noise; raises BadCard where one is below 0."""
    out: dict[str, Array] = {}
    for key, of in chambers.items():
        true = np.asarray(of(F))
        if np.min(true) < 0:
            raise BadCard(
                f"{name}: {key} falls to {np.min(true):.4g} Pa, at least 0 needed; raise"
                " mean_pressure_pa in [recipe], or ask for less force"
            )
        out[key] = true + recipe.noise_p * rng.standard_normal(len(F))
    return out


def truth(
    name: str,
    recipe: Recipe,
    seed: int | None = None,
    *,
    rig: Rig | None = None,
    controller: Present | None = None,
) -> dict[str, Any]:
    """What the log does not hold: parameters, effects, loop, noise and seed.

    A parameter is as in every result, without an interval: what a recipe sets is known exactly.
    controller: that of the card, as results have it, where it runs the machine.
    """
    motion, command = (rig.motion, rig.command_unit) if rig else ("linear", "V")
    friction, actuator = Display(motion).friction, actuator_units(motion, command)
    drive = asdict(recipe.plant.actuator) if recipe.plant.actuator else {}
    known = {
        "schema": "truth/1",
        "card": name,
        "friction": {
            n: as_number(Estimate(getattr(recipe.plant.friction, n), friction[n])) for n in NAMES
        },
        "actuator": {n: as_number(Estimate(v, actuator[n])) for n, v in drive.items()} or None,
        "effects": {
            one.key: {n: as_number(e) for n, e in exact(one, motion, command).items()}
            for one in recipe.plant.effects
        },
        "noise": {"y": recipe.noise_y, "F": recipe.noise_F, "p": recipe.noise_p},
        "seed": recipe.seed if seed is None else seed,
        "duration_s": recipe.duration,
        "h_s": recipe.h,
        "loop": None,
    }
    if recipe.loop:
        loop = recipe.loop.model_dump(exclude={"position": {"kind"}})
        known["loop"] = {"control_limit": loop.pop("control_limit_v"), **loop}
    if controller and rig and recipe.by_card:
        known["controller"] = written(controller, around_of(rig))
    return known


def _position(recipe: Recipe) -> RST:
    """The recipe's position controller as RST at the recipe's period; volts for a motor."""
    assert recipe.loop is not None and recipe.loop.position is not None
    position = recipe.loop.position
    found = rst_of(position.kind, position.model_dump(exclude={"kind"}), recipe.h)
    actuator = recipe.plant.actuator
    if isinstance(actuator, Motor):
        return RST(found.R / actuator.k_a, found.S, found.T / actuator.k_a, recipe.h)
    return found


CLOCKS_ALIKE = 1e-6  # of a sample, by which clocks may differ


def _loop_of_card(recipe: Recipe, given: CardController, rig: Rig) -> DrivenLoop:
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
        compensation=_compensation(recipe, now.law.h),
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


def _compensation(recipe: Recipe, h: float) -> Compensation | None:
    """The recipe's compensator behind the filters that a design has at the period h [s]."""
    asked = recipe.loop.compensator if recipe.loop else None
    if asked is None:
        return None
    known = asked.friction.value if asked.friction else recipe.plant.friction
    return Compensation(Compensator(known, asked.N_c, asked.e_T), filters_at(h))
