"""The controller of a card as the law that its drive runs."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from design.drive_law import drive_law
from design.machine.drive import ForceLoop, Present
from design.machine.model import Model
from design.pid import pd_to_rst, pid_to_rst
from design.present import cascade_to_rst
from design.rst import RST
from identification.errors import BadCard, BadSpecification
from identification.log import Rig
from workbench.cards.card import Card, load_card
from workbench.cards.controller import CardController, Kind
from workbench.logs.sources import card_path

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
