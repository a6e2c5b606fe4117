"""A design in its loop on a machine: what `design.loop` needs, put together from results."""

import numpy as np

from design.loop import ForcePI, LoopNoise, LoopRun, simulate_loop
from design.rst import RST
from design.two_rate import simulate_two_rate
from identification.arrays import Array
from identification.errors import BadModel
from identification.plant import Actuator, Motor
from workbench.design_values import Controller, Design
from workbench.model import Model


def run_loop(
    machine: Model, found: Design, one: Controller, r: Array, rng: np.random.Generator
) -> LoopRun:
    """One reference r [m], (n,) at `loop_period`, through the loop, with the machine's noise.

    A machine without an actuator takes the force reference as its force, and the rig's limit of
    the command [V] says nothing of it. Raises BadModel where
    the design has a force loop and the machine nothing for it to drive, or the other way round.
    """
    plant = machine.simulated
    limit = None if plant.actuator is None else machine.rig.control_limit
    noise = LoopNoise.draw(len(r), machine.fit.noise_y, machine.fit.noise_F, rng)
    if isinstance(plant.actuator, Actuator):
        if found.force is None:
            raise BadModel("the machine has an actuator, the design no force loop for it")
        force = ForcePI(found.force.k_i, found.force.T_i)
        return simulate_two_rate(
            plant, one.rst, force, r, found.force.h, noise=noise, control_limit=limit, y_0=r[0]
        )
    if found.force is not None:
        raise BadModel("the design has a force loop, the machine no actuator for it")
    motor = plant.actuator or Motor(1.0)
    rst = one.rst
    volts = RST(rst.R / motor.k_a, rst.S, rst.T / motor.k_a, rst.h)
    whole = type(plant)(plant.friction, motor, plant.effects)
    start = (float(r[0]), 0.0, 0.0)
    return simulate_loop(
        whole, volts, None, r, one.h, noise=noise, control_limit=limit, start=start
    )


def loop_period(found: Design) -> float:
    """The period of the loop's samples [s]."""
    return found.force.h if found.force else found.plant.h
