"""A design in its loop on a machine: what `design.loop` needs, put together from results."""

from dataclasses import replace

import numpy as np

from design.compensator import Compensator
from design.filters import filters_at
from design.loop import ForcePI, LoopNoise, LoopRun
from design.loop_signals import OfForce, pressures
from design.rst import RST
from design.servo import Compensation, Servo, simulate_servo
from identification.arrays import Array
from identification.effects._base import Acting
from identification.errors import BadModel
from identification.log import Rig
from identification.model.plant import Actuator, Motor, Plant
from workbench.documents.design import Controller, Design
from workbench.documents.model import Model


def run_loop(
    machine: Model,
    found: Design,
    one: Controller,
    r: Array,
    rng: np.random.Generator,
    compensator: Compensator | None = None,
) -> LoopRun:
    """One reference r [m], (n,) at `loop_period`, through the loop, with the machine's noise.

    The controller sees it moved at its own rate; the run has it as given. A machine without an
    actuator takes the force reference as its force, and the rig's limit of the command [V] says
    nothing of it. The compensator runs with the position controller, behind `filters_at`. Raises
    BadModel where the design has a force loop and the machine nothing for it to drive, or the other
    way round.
    """
    plant = replace(machine.simulated, effects=in_the_loop(machine))
    servo, whole = _servo(plant, found, one)
    limit = None if plant.actuator is None else machine.rig.control_limit
    if compensator is not None:
        servo = replace(servo, friction=Compensation(compensator, filters_at(one.h)))
    return simulate_servo(
        whole,
        replace(servo, control_limit=limit, rate=one.rate),
        r,
        loop_period(found),
        noise=LoopNoise.draw(len(r), machine.fit.noise_y, machine.fit.noise_F, rng),
        start=(float(r[0]), 0.0, 0.0),
        signals=_chambers(machine.rig),
    )


def _servo(plant: Plant, found: Design, one: Controller) -> tuple[Servo, Plant]:
    """The design's loops for this plant, and the plant that they drive."""
    if isinstance(plant.actuator, Actuator):
        if found.force is None:
            raise BadModel("the machine has an actuator, the design no force loop for it")
        force = ForcePI(found.force.k_i, found.force.T_i)
        return Servo(one.rst, force, anti_windup=1.0 / one.dominant[0]), plant
    if found.force is not None:
        raise BadModel("the design has a force loop, the machine no actuator for it")
    motor = plant.actuator or Motor(1.0)
    rst = one.rst
    volts = RST(rst.R / motor.k_a, rst.S, rst.T / motor.k_a, rst.h)
    return Servo(volts, None, anti_windup=0.0), replace(plant, actuator=motor)


def in_the_loop(machine: Model) -> tuple[Acting, ...]:
    """The machine's effects that its simulated loop has: those whose signals it makes."""
    made = _chambers(machine.rig)
    return tuple(one for one in machine.acting if set(one.effect.signals) <= set(made))


def effects_left_out(machine: Model) -> str | None:
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
