"""A design in its loop on a machine: what `design.servo` needs, put together from results."""

from dataclasses import dataclass, replace

import numpy as np

from design.closed_loop.linear_loop import command_of
from design.compensator import Compensator
from design.drive_law import DriveLaw
from design.feed_forward import FeedForward
from design.filters import filters_at
from design.loop import LoopNoise
from design.loop_signals import OfForce, pressures
from design.machine.design import Controller, Design, Structure
from design.machine.drive import ForceLoop, Present
from design.machine.model import Model, used
from design.schedule import Schedule
from design.servo import Compensation, SecondMass, Servo, ServoRun, simulate_servo
from identification.arrays import Array
from identification.effects._base import Acting
from identification.errors import BadModel
from identification.log import Rig
from identification.model.plant import Actuator, Motor, Plant


@dataclass(frozen=True)
class DrivenLoop:
    """A law in the loop that it closes: what stands between the sensors and the machine.

    force: the loop below it, None where its output is the command. rate: the reference is moved at
    most at this speed [m/s], and with this acceleration [m/s^2]. limit: of the command, in its
    unit. compensation: of friction, or a feed-forward. k_a: by which its force becomes a command;
    None: the motor's own. direct: an actuator takes the law's output.
    """

    law: DriveLaw
    force: ForceLoop | None = None
    rate: float | None = None
    limit: float | None = None
    compensation: Compensation | FeedForward | None = None
    k_a: float | None = None
    direct: bool = False
    acceleration: float | None = None
    schedule: Schedule | None = None

    @property
    def h(self) -> float:
        """The period of the loop's samples [s]."""
        return self.force.h if self.force else self.law.h

    @property
    def servo(self) -> Servo:
        """The loop as `simulate_servo` and `design.controller_program` take it."""
        return Servo(
            self.law.rst,
            None if self.force is None else self.force.pi,
            friction=self.compensation,
            control_limit=self.limit,
            W=self.law.W,
            k_a=self.k_a,
            direct=self.direct,
            rate=self.rate,
            acceleration=self.acceleration,
            schedule=self.schedule,
        )


def driven_loop(
    machine: Model, found: Design, one: Controller, compensator: Compensator | None = None
) -> DrivenLoop:
    """A design's controller as its drive runs it; of an older file as it is run on the machine."""
    command = found.command or command_of(machine, found.force)
    filters = found.compensator.filters or filters_at(one.h)
    beside = None if compensator is None else Compensation(compensator, filters)
    return DrivenLoop(
        law=one.law(command),
        force=found.force,
        rate=one.rate,
        limit=command.limit,
        compensation=one.feed_forward if beside is None else beside,
        k_a=command.force_per_command,
        acceleration=one.acceleration,
    )


def scheduled_loop(model: Model, found: Design, name: Structure) -> DrivenLoop:
    """A controller of a design with its schedule, as its drive runs it."""
    assert found.schedule is not None
    one = found.controllers[name]
    command = found.command or command_of(model, found.force)
    table = found.schedule.of(name, one, command)
    return replace(driven_loop(model, found, one), schedule=table)


def present_loop(machine: Model, now: Present) -> DrivenLoop:
    """The controller that the machine has now, as its drive runs it.

    Where no command is logged its force loop is not known to the model, and gives what is asked.
    Raises BadModel where the controller gives a command of which the logs do not identify the
    force.
    """
    drive = machine.simulated.actuator
    force = now.force if isinstance(drive, Actuator) else None
    command = command_of(machine, force)
    if drive is None and now.output == "command" and machine.rig.command_unit != command.unit:
        raise BadModel(
            f"it gives a command in {machine.rig.command_unit}, and no log shows what force that"
            " makes; log the command"
        )
    return DrivenLoop(now.law, force, now.rate, command.limit, direct=now.output == "command")


def run_driven(
    machine: Model, loop: DrivenLoop, r: Array, rng: np.random.Generator | None
) -> ServoRun:
    """One reference r [m], (n,) every loop.h, through the loop; with the machine's noise by rng.

    The controller sees it moved at its own rate; the run has it as given. A machine without an
    actuator takes the law's output as its force. Raises BadModel where there is a force loop and
    nothing for it to drive, or the other way round.
    """
    plant = replace(machine.simulated, effects=in_the_loop(machine))
    return run_plant(machine, plant, loop, r, rng)


def run_plant(
    machine: Model, plant: Plant, loop: DrivenLoop, r: Array, rng: np.random.Generator | None
) -> ServoRun:
    """`run_driven` of a plant in place of the machine's own, on the same rig."""
    noise = None
    if rng is not None:
        noise = LoopNoise.draw(len(r), machine.fit.noise_y, machine.fit.noise_F, rng)
    direct = isinstance(plant.actuator, Actuator) and loop.direct
    if isinstance(plant.actuator, Actuator):
        if loop.force is None and not direct:
            raise BadModel("the machine has an actuator, the design no force loop for it")
    elif loop.force is not None:
        raise BadModel("the design has a force loop, the machine no actuator for it")
    return simulate_servo(
        plant if plant.actuator else replace(plant, actuator=Motor(1.0)),
        replace(loop.servo, direct=direct, control_limit=limit_on(machine, loop)),
        r,
        loop.h,
        noise=noise,
        start=(float(r[0]), 0.0, 0.0),
        signals=chambers(machine.rig),
        load=load_of(machine),
    )


def load_of(machine: Model) -> SecondMass | None:
    """The load that swings behind the machine's body; None where it shows none.

    Of a mass that the log does not identify, its share of the mass that simulations use.
    """
    two = machine.resonance
    if two is None:
        return None
    f_r, f_a = used(two["frequency"]), used(two["anti_resonance"])
    mass = machine.karnopp.m * (1.0 - (f_a / f_r) ** 2)
    return SecondMass.of(f_r, f_a, used(two["damping"]), mass) if mass > 0.0 else None


def limit_on(machine: Model, loop: DrivenLoop) -> float | None:
    """The limit of the command of a loop on a machine: the law's, and that of the machine's drive.

    A machine without an actuator takes a force, of which a limit of its command says nothing.
    """
    own = None if machine.simulated.actuator is None else machine.rig.control_limit
    return min((one for one in (loop.limit, own) if one is not None), default=None)


def in_the_loop(machine: Model) -> tuple[Acting, ...]:
    """The machine's effects that its simulated loop has: those whose signals it makes."""
    made = chambers(machine.rig)
    return tuple(one for one in machine.acting if set(one.effect.signals) <= set(made))


def effects_left_out(machine: Model) -> str | None:
    """Remark on the machine's effects that its simulated loop has not; None where it has all."""
    inside = {one.key for one in in_the_loop(machine)}
    missing = [one.key for one in machine.acting if one.key not in inside]
    if not missing:
        return None
    return f"simulated without the model's effects {', '.join(missing)}"


def chambers(rig: Rig) -> dict[str, OfForce]:
    """Chamber pressures of an electro-pneumatic rig, their mean half the supply's."""
    if rig.kind != "electro-pneumatic" or not (rig.area_p and rig.area_n and rig.supply_pressure):
        return {}
    supply = rig.supply_pressure
    return pressures(rig.area_p, rig.area_n, 0.5 * supply, supply) if supply > 0 else {}
