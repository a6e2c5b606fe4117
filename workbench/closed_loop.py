"""A design in its loop on a machine: what `design.loop` needs, put together from results."""

from dataclasses import replace

import numpy as np

from design.effect_loop import simulate_effect_loop
from design.loop import ForcePI, LoopNoise, LoopRun, simulate_loop
from design.loop_signals import OfForce, pressures
from design.rst import RST
from design.tracking import rate_limited
from design.two_rate import simulate_two_rate
from identification.arrays import Array, frozen
from identification.effects._base import Acting
from identification.errors import BadModel
from identification.log import Rig
from identification.plant import Actuator, Motor
from workbench.design_values import Controller, Design
from workbench.model import Model


def run_loop(
    machine: Model, found: Design, one: Controller, r: Array, rng: np.random.Generator
) -> LoopRun:
    """One reference r [m], (n,) at `loop_period`, through the loop, with the machine's noise.

    The controller sees it moved at its own rate; the run has it as given. A machine without an
    actuator takes the force reference as its force, and the rig's limit of the command [V] says
    nothing of it. Raises BadModel where the design has a force loop and the machine nothing for it
    to drive, or the other way round.
    """
    moved = rate_limited(r, one.rate, loop_period(found))
    run = _run(machine, found, one, moved, rng)
    return replace(run, r=frozen(r))


def _run(
    machine: Model, found: Design, one: Controller, r: Array, rng: np.random.Generator
) -> LoopRun:
    plant = replace(machine.simulated, effects=in_the_loop(machine))
    limit = None if plant.actuator is None else machine.rig.control_limit
    noise = LoopNoise.draw(len(r), machine.fit.noise_y, machine.fit.noise_F, rng)
    start = (float(r[0]), 0.0, 0.0)
    if isinstance(plant.actuator, Actuator):
        if found.force is None:
            raise BadModel("the machine has an actuator, the design no force loop for it")
        force = ForcePI(found.force.k_i, found.force.T_i)
        if plant.effects:
            return simulate_effect_loop(
                plant, one.rst, force, r, found.force.h,
                noise=noise, control_limit=limit, start=start, signals=_chambers(machine.rig),
            )  # fmt: skip
        return simulate_two_rate(
            plant, one.rst, force, r, found.force.h, noise=noise, control_limit=limit, y_0=r[0]
        )
    if found.force is not None:
        raise BadModel("the design has a force loop, the machine no actuator for it")
    motor = plant.actuator or Motor(1.0)
    rst = one.rst
    volts = RST(rst.R / motor.k_a, rst.S, rst.T / motor.k_a, rst.h)
    whole = replace(plant, actuator=motor)
    if plant.effects:
        return simulate_effect_loop(
            whole, volts, None, r, one.h, noise=noise, control_limit=limit, start=start,
            signals=_chambers(machine.rig),
        )  # fmt: skip
    return simulate_loop(
        whole, volts, None, r, one.h, noise=noise, control_limit=limit, start=start
    )


def in_the_loop(machine: Model) -> tuple[Acting, ...]:
    """The machine's effects that its simulated loop has: those whose signals it makes."""
    made = _chambers(machine.rig)
    return tuple(one for one in machine.acting if set(one.effect.signals) <= set(made))


def left_out(machine: Model) -> str | None:
    """Remark on the machine's effects that its simulated loop has not; None where it has all."""
    inside = {one.key for one in in_the_loop(machine)}
    missing = [one.key for one in machine.acting if one.key not in inside]
    if not missing:
        return None
    return f"simulated without the model's effects {', '.join(missing)}"


def _chambers(rig: Rig) -> dict[str, OfForce]:
    """Chamber pressures of an electro-pneumatic rig, their mean half the supply's."""
    if rig.kind != "electro-pneumatic" or not (rig.area_p and rig.area_n and rig.supply_pressure):
        return {}
    supply = rig.supply_pressure
    return pressures(rig.area_p, rig.area_n, 0.5 * supply, supply) if supply > 0 else {}


def loop_period(found: Design) -> float:
    """The period of the loop's samples [s]."""
    return found.force.h if found.force else found.plant.h
