"""The controller of a card as the law that its drive runs."""

from dataclasses import replace

from design.machine.model import Model
from identification.errors import BadCard
from workbench.cards.card import load_card, present_of_card
from workbench.logs.sources import card_path


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
