"""A proposed card on a terminal: a line a signal and a value, what is sure, and why."""

from pathlib import Path

from design.first_card.proposal import Proposal, SignalGuess
from design.first_card.rig_guess import RigGuess
from workbench.output import next_step
from workbench.screen import Row, Screen, listed, screen, tabled

MOST_LEFT_OUT = 5  # columns that one screen names


def proposal_screen(of: Proposal, card: Path) -> Screen:
    """What the card says, what is hardly identifiable from the log, what is left out, and what to
    do next."""
    rows = [*map(_signal_row, of.signals), *map(_rig_row, of.rig)]
    guesses = [row[0] for row in rows if row[3] == "guess"]
    looked = f"check the guesses in it: {', '.join(guesses)}" if guesses else "all is sure"
    refused = f"With this card the log cannot be read yet: {of.refused}"
    left_out = (f"left out: {shown} ({why})" for shown, why in of.unused.items())
    return screen(
        f"Card proposed: rig of kind {of.kind}, {of.motion}; {looked}.",
        next_step(f"workbench doctor {of.log} --card {card}"),
        *([refused] if of.refused else []),
        listed(f"hardly identifiable: {line}" for line in of.hardly),
        tabled(("", "column or value", "unit", "", "why"), rows, right=()),
        listed(f"note: {line}" for line in of.remarks),
        listed(left_out, MOST_LEFT_OUT),
        f"written: {card}",
    )


def _signal_row(one: SignalGuess) -> Row:
    unit = one.unit if one.gain is None else f"{one.unit}, gain {one.gain}"
    return one.name, one.shown, unit, *_judged(one)


def _rig_row(one: RigGuess) -> Row:
    value = "to be filled in" if one.value is None else f"{one.value}"
    return one.key, value, one.unit, *_judged(one)


def _judged(one: SignalGuess | RigGuess) -> tuple[str, str]:
    """How sure a line is, and why; of a guess also what it would be otherwise."""
    if one.sure:
        return "sure", one.why
    return "guess", f"{one.why}; else {one.rival}" if one.rival else one.why
