"""A design in its loop on a machine: what `design.loop` needs, put together from results; the
controller of a card as the law that its drive runs; and the plants that the machine may be, drawn
by what is not sure."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from design.compensator import Compensator
from design.drive_law import DriveLaw, drive_law
from design.feed_forward import FeedForward
from design.filters import filters_at
from design.loop import ForcePI, LoopNoise
from design.loop_signals import OfForce, pressures
from design.machine.active_model import active_model
from design.machine.design import Controller, Design, Structure
from design.machine.drive import ForceLoop, Present
from design.machine.model import Model, used
from design.pid import pd_to_rst, pid_to_rst
from design.present import cascade_to_rst
from design.rst import RST
from design.schedule import Schedule
from design.servo import Compensation, SecondMass, Servo, ServoRun, simulate_servo
from identification.arrays import Array
from identification.effects._base import Acting
from identification.errors import BadCard, BadModel, BadSpecification
from identification.estimation.windowed_run.parameters import plant_with
from identification.log import Rig
from identification.model.plant import Actuator, Motor, Plant
from workbench.cards.card import Card, load_card
from workbench.cards.controller import CardController, Kind
from workbench.logs.sources import card_path
from workbench.steps.linear_loop import command_of


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
            None if self.force is None else ForcePI(self.force.k_i, self.force.T_i),
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


NO_BAND_SHARE = 1e-3  # of the logs' speed: a band that none has
USUAL_BAND_SHARE = 0.03  # the same of a usual one
UNIDENTIFIED_SPREAD = 0.3  # log of a value that no log identifies, one sigma


def in_loop(model: Model) -> Plant:
    """The plant as its simulated loop has it; a band that is next to none is taken for one that no
    log identifies, whatever its interval."""
    plant = replace(model.simulated, effects=in_the_loop(model))
    lost = lost_bands(model)
    return plant_with(plant, tuple(lost), np.array(list(lost.values()))) if lost else plant


def lost_bands(model: Model) -> dict[str, float]:
    """Bands narrower than a thousandth of the logs' speed, with what is assumed in their place."""
    speed, nine = model.speed or 0.0, model.karnopp
    return {
        name: sign * USUAL_BAND_SHARE * speed
        for name, band, sign in (("dv_p", nine.dv_p, 1.0), ("dv_n", nine.dv_n, -1.0))
        if abs(band) < NO_BAND_SHARE * speed
    }


def drawn_plants(model: Model, rng: np.random.Generator, count: int) -> tuple[Plant, ...]:
    """Plants drawn from the errors of the model's parameters; those that no log identifies within a
    third of what is assumed."""
    known = active_model(model, "")
    plant = in_loop(model)
    drawn = rng.multivariate_normal(
        known.values, known.covariance, count, check_valid="ignore", method="svd"
    )
    every = {**model.friction, **(model.actuator or {})}
    assumed = {
        name: used(one)
        for name, one in every.items()
        if name in known.untold and name != "k_a" and used(one) != 0.0
    } | lost_bands(model)
    free = np.exp(UNIDENTIFIED_SPREAD * rng.standard_normal((count, len(assumed))))
    names = (*known.names, *assumed)
    sets = np.hstack([drawn, free * np.array(list(assumed.values()))])
    last = {name: i for i, name in enumerate(names)}  # what is assumed replaces what was lost
    effects = {one.key for one in plant.effects}
    indices = [i for n, i in last.items() if "." not in n or n.split(".")[0] in effects]
    return tuple(plant_with(plant, [names[i] for i in indices], row[indices]) for row in sets)


LAWS: Mapping[Kind, Callable[..., RST]] = {
    "PD": pd_to_rst,
    "PID": pid_to_rst,
    "P-PI": cascade_to_rst,
}


def present_of_card(card: Card, rig: Rig, h: float) -> Present | None:
    """What model.json holds of the card's controller; h [s]: period of the logs.

    None where the card names none. Raises BadCard where it is none, or does not fit the rig.
    """
    if card.controller is None:
        return None
    try:
        return present(card.controller, rig, h)
    except (BadCard, BadSpecification) as error:
        raise BadCard(f"{card.path}: controller: {error}") from None


def with_card(model: Model, name: str | None) -> Model:
    """The model with the controller of another card in place of its own; as it is without a card.

    Raises BadCard where the card names none, or its command is in another unit.
    """
    if name is None:
        return model
    card = load_card(card_path(name), with_recipe=False)
    own, unit = card.rig().command_unit, model.rig.command_unit
    if own != unit:
        raise BadCard(
            f"{card.path}: its command is in {own!r}, that of the model in {unit!r}; give the card"
            " of the model's machine"
        )
    found = present_of_card(card, model.rig, model.period)
    if found is None:
        raise BadCard(f"{card.path}: has no [controller]; add the one that the machine has now")
    return replace(model, controller=found)


def present(given: CardController, rig: Rig, h: float) -> Present:
    """The controller as the law that the drive runs every h [s], or at its own period.

    One that gives a motor's force is the law of its command. Raises BadSpecification where it is no
    controller, BadCard where it gives a force that the card does not make of a command.
    """
    h = given.period or h
    output, per = given.output, 1.0
    if output == "force" and rig.kind == "motor":
        if not rig.force_per_command:
            raise BadCard('output = "force" needs the force_per_command of the motor')
        output, per = "command", rig.force_per_command
    gains = {name: one.value or 0.0 for name, one in given.gains.items()}
    law = drive_law(rst_of(given.kind, {**gains, **given.polynomials}, h), given.forget, per)
    force = None
    if given.force is not None:
        fast = given.force.period or h
        if abs(round(h / fast) * fast - h) > 1e-6 * h or fast > h:
            raise BadCard(f"force.period_s = {fast:g} s must divide the period of {h:g} s")
        force = ForceLoop(given.force.k_i, given.force.T_i, h / round(h / fast))
    return Present(given.kind, given.gains, output, law, force, given.rate)


def rst_of(kind: Kind, numbers: Mapping[str, Any], h: float) -> RST:
    """The law of a kind every h [s], by its gains in SI, or by an RST's coefficients."""
    if kind == "RST":
        R, S, T = (np.array(numbers[key]) for key in "RST")
        return RST(R, S, T, h)
    return LAWS[kind](**numbers, h=h)
