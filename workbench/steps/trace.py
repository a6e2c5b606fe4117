"""The logs that a trace is made of, by their card."""

from collections.abc import Sequence
from dataclasses import replace

from design.identified.trace_logs import Traced, trace_logs
from identification.effects._library import Library
from identification.errors import BadLog
from identification.progress import KeepGoing, Progress, quiet, without_end
from workbench.cards.card import load_card
from workbench.logs.sources import Sources, card_path
from workbench.steps.present import present_of_card


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


def trace_sources(
    train: Sources, test: Sources | None, library: Library, seed: int = 0,
    on_progress: Progress = quiet, *, keep_going: KeepGoing = without_end,
) -> Traced:  # fmt: skip
    """The trace of the machine that the sources are of, with the controller of its card.

    keep_going: whether it is to go on. Raises as `trace_logs` does, and BadCard where the
    controller does not fit the rig.
    """
    found = trace_logs(
        train.logs, test.logs if test else None, library, seed, on_progress, keep_going=keep_going
    )
    now = present_of_card(train.card, train.rig, found.model.period)
    return replace(found, model=replace(found.model, controller=now))
