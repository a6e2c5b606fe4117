"""A card proposed for a log in a file that no card describes, and answered on."""

from pathlib import Path

from design.first_card import answers
from design.first_card.proposal import Proposal, SignalGuess, proposal_for
from identification.log import Motion
from workbench.cards.units import Scale, column_scale, over_time
from workbench.logs.notation import NOTATION
from workbench.logs.unknown import read_unknown


def proposed(path: Path, name: str | None = None, axis: str | None = None) -> Proposal:
    """The card that fits the log in the file best; name: of the card, by default the file's.

    axis: the one of several in the file, or the header of a position. Raises BadLog, one line,
    where no clock is found, no such axis, or no column that moves as a driven body.
    """
    return proposal_for(read_unknown(path), name or path.stem, NOTATION, axis)


def with_signal(of: Proposal, name: str, answer: str) -> Proposal:
    """The proposal after an answer on one of its signals, as `answers.with_signal` takes it."""
    return answers.with_signal(of, name, answer, NOTATION.unit, _scaled)


def _scaled(one: SignalGuess, motion: Motion) -> Scale:
    """What makes the signal of its column; raises BadCard where unit and gain do not."""
    unit = over_time(one.unit, one.name) if one.summed else one.unit
    return column_scale(unit, one.gain, one.name, motion)
