"""The controller of a card as the law that its drive runs."""

from dataclasses import replace

from design.machine.controller import present
from design.machine.drive import Present
from design.machine.model import Model
from identification.errors import BadCard, BadSpecification
from identification.log import Rig
from workbench.cards.card import Card, load_card
from workbench.logs.sources import card_path


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
