"""`workbench init`: a log -> a first card for it."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from workbench import options
from workbench.output import emit, progress, write_whole
from workbench.screen import JSON, is_given
from workbench.signature import argument, option

if TYPE_CHECKING:
    from design.first_card.proposal import Proposal

CARD = "card.toml"


@options.command(
    json="Print the result as JSON; ask nothing.",
    epilog="Example: workbench init run1.csv --out bench-a/card.toml",
)
def command(
    log: Path = argument(),
    out: Path | None = option(
        "The card, or a folder for it.  [default: card.toml]", metavar="FILE"
    ),
    name: str | None = option("Name of the machine.  [default: that of the log]"),
    axis: str | None = option("Which of several axes or joints in the log.", metavar="NAME"),
    force: bool = option("Replace a card that is there."),
    yes: bool = option("Ask nothing; take the guesses."),
) -> None:  # fmt: skip
    """Propose a card for a log that has none: which column is what, in which unit, and the rig.

    It uses the headers, and how the columns depend on each other: a force accelerates the body and
    is balanced by friction, a reference is ahead of the position, a speed is its derivative, what
    comes out of a limiter acts. On a terminal it asks about each guess; else the card is written
    with a remark on each line, "sure" or "guess", why, and what it would be otherwise; and with
    what is hardly identifiable from the log. Of several axes --axis names the one. A card that is
    there is replaced only with --force or your yes.
    """
    from workbench.report.first_card import proposal_screen
    from workbench.steps.first_card.proposal import proposed
    from workbench.steps.first_card.written import checked_proposal, written

    card = out or Path(CARD)
    if card.is_dir() or not (card.suffix or card.exists()):  # a folder that may not be there yet
        card = card / CARD
    asking = not (yes or is_given(JSON)) and sys.stdin.isatty() and sys.stdout.isatty()
    _refuse_existing(card, force, asking)
    with progress("looking"):
        found = proposed(log, name, axis)
    if asking and axis is None and len(found.axes) > 1:
        choice = click.Choice(found.axes, case_sensitive=False)
        own = found.axis or found.axes[0]
        said = click.prompt("Several axes in this log; the card is of", type=choice, default=own)
        found = proposed(log, name, str(said))
    if asking:
        found = _asked(found)
    with progress("reading"):
        found = checked_proposal(found)
    write_whole(card, written(found, asked=asking), "--out")
    emit({**found.as_json(), "out": card}, lambda: proposal_screen(found, card))


def _refuse_existing(card: Path, force: bool, asking: bool) -> None:
    """Raises a usage error where a card is there and nobody allows that it is replaced."""
    if force or not card.exists():
        return
    if asking and click.confirm(f"{card} is there; replace it?", default=False):
        return
    raise click.UsageError(
        f"{card} is there and would be replaced; name another file with --out, or give --force."
    )


def _asked(of: "Proposal") -> "Proposal":
    """The proposal after questions on its guesses; Enter takes one as it is."""
    click.echo(
        f"rig: {of.kind}, {of.motion}; columns: {', '.join(one.shown for one in of.columns)}"
    )
    click.echo("For each guess: Enter if it is right, '+' for the other, else a column, a unit, or"
               " both ('x3 mm'); '-' leaves it out.")  # fmt: skip
    for key in ("kind", "motion"):  # the columns hang on the one, the units on the other
        if any(guess.key == key and not guess.sure for guess in of.rig):
            of = _asked_rig(of, key)
    keys = [guess.key for guess in of.rig if not guess.sure]
    for name in [one.name for one in of.signals if not one.sure]:
        of = _asked_signal(of, name)
    for key in (key for key in keys if key not in ("kind", "motion")):
        of = _asked_rig(of, key)
    return of


def _asked_signal(of: "Proposal", name: str) -> "Proposal":
    """The proposal after a question on one of its signals, asked until the answer can be one."""
    from workbench.steps.first_card.proposal import with_signal

    one = of.signal(name)
    assert one is not None
    gain = "" if one.gain is None else f", gain {one.gain}"
    said = f"{name}: column {one.shown} in {one.unit}{gain} ({one.why}{_other(one.rival)})"
    return _answered(said, lambda answer: with_signal(of, name, answer))


def _asked_rig(of: "Proposal", key: str) -> "Proposal":
    """The proposal after a question on a value of its rig, asked until the answer can be one."""
    from design.first_card.answers import with_rig

    guess = next(one for one in of.rig if one.key == key)
    value = "nothing" if guess.value is None else guess.value
    unit = f" {guess.unit}" if guess.value is not None and guess.unit else ""
    said = f"{key}: {value}{unit} ({guess.why}{_other(guess.rival)})"
    return _answered(said, lambda answer: with_rig(of, key, answer))


def _answered(said: str, changed: "Callable[[str], Proposal]") -> "Proposal":
    """The proposal changed by the first answer that can be one."""
    from design.first_card.answers import BadAnswer

    while True:
        try:
            return changed(click.prompt(said, default="", show_default=False))
        except BadAnswer as error:
            click.echo(f"  {error}", err=True)


def _other(rival: str) -> str:
    return f"; + for {rival}" if rival else ""
