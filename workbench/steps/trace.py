"""The logs that a trace is made of, by their card."""

from collections.abc import Sequence

from identification.errors import BadLog
from workbench.cards.card import load_card
from workbench.logs.sources import card_path


def named_logs(
    logs: Sequence[str], tests: Sequence[str], card_name: str
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the training and the test logs: those given, or without any the card's split.

    Raises BadCard; BadLog where neither the command nor the card names a training log.
    """
    if logs:
        return tuple(logs), tuple(tests)
    card = load_card(card_path(card_name), with_recipe=False)
    train = card.split.get("train", ())
    if not train:
        raise BadLog(
            f"{card.name}: no log to train on is named, and the card has no [split] train = [...];"
            " name a LOG"
        )
    return train, tuple(tests) or card.split.get("test", ())
