"""A simulated log in the columns and units of its card."""

from identification.arrays import Array
from identification.errors import BadCard
from identification.log import Log
from workbench.cards.card import Card


def as_columns(log: Log, card: Card) -> dict[str, Array]:
    """The log's signals by the card's columns and in its units, as `read_log` reads them back.

    Raises BadCard where the card names a signal that the simulation does not make.
    """
    out: dict[str, Array] = {}
    for name, spec in card.signals.items():
        if name not in log:
            raise BadCard(
                f"{card.path}: signals.{name} is not simulated (there is:"
                f" {', '.join(log.signals)}); take it out of the recipe's card"
            )
        try:
            factor, shift = spec.scale(name, card.rig())
        except BadCard as error:
            raise BadCard(f"{card.path}: {error}") from None
        out[str(spec.column)] = (log[name] - shift) / factor + spec.offset
    return out
