"""A proposal as the text of a card, each line with what is sure of it and why; and what reading its
log by it shows."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from design.first_card.proposal import Proposal, SignalGuess
from design.identified.hardly_identifiable import hardly_identifiable
from identification.errors import UserError
from identification.signals.renewal import RENEWED_AT, RENEWED_EVERY
from workbench.cards.card import card_from, load_card
from workbench.cards.card_text import Line, card_text, toml
from workbench.logs.runs import read_runs

LEGEND = (
    '"sure" and "guess" say how well a line follows from the log; check each guess before you use',
    "the card. Every key is explained in the manual: The card, key by key.",
)


def written(of: Proposal, *, asked: bool = False) -> str:
    """The card's text; asked: somebody has confirmed it on a terminal."""
    by = ", confirmed on a terminal" if asked else ""
    head = (f"Written by workbench init from {Path(of.log).name}{by}.", *LEGEND)
    tables: dict[str, Sequence[Line]] = {
        "card": [Line("name", of.name)],
        "rig": [
            Line(
                one.key,
                one.value,
                _remark(one.sure, f"{one.unit}: {one.why}".lstrip(": "), one.rival),
            )
            for one in of.rig
        ],
        "signals": [_signal_line(one) for one in of.signals],
    }
    if of.layout:
        tables["file"] = [Line(key, value) for key, value in of.layout.items()]
    left_out = [f"left out: column {shown}: {why}" for shown, why in of.unused.items()]
    return card_text(head, tables, [*of.hardly, *of.remarks, *left_out, *_extra(of)])


def _signal_line(one: SignalGuess) -> Line:
    value: Mapping[str, object] = {"column": one.column, "unit": one.unit}
    if one.gain is not None:
        value = {**value, "gain": one.gain}
    if one.bits is not None:
        value = {**value, "bits": one.bits, "signed": True}
    if one.summed:
        value = {**value, "summed": True}
    named = isinstance(one.column, int) and not one.shown.startswith("number")
    why = f"{one.shown}: {one.why}" if named else one.why
    return Line(one.name, value, _remark(one.sure, why, one.rival))


def _remark(sure: bool, why: str, rival: str) -> str:
    other = "" if sure or not rival else f"; else {rival}"
    return f"{'sure' if sure else 'guess'}: {why}{other}"


def _extra(of: Proposal) -> list[str]:
    """The table with what else was measured, to be taken in by whoever knows what it is."""
    if not of.extra:
        return []
    rows = [f"{name} = {toml({'column': key, 'unit': '1'})}" for name, key in of.extra.items()]
    said = "take the # from the next lines away, and trace tries whether the rest depends on them:"
    return [said, "[signals.extra]", *rows]


def refusal(log: Path, card: Path) -> str:
    """Why the log cannot be read by the card, in one line; empty where it can."""
    try:
        read_runs(log, load_card(card))
    except UserError as error:
        return str(error)
    return ""


CARD_NAME = Path("the card")


def checked_proposal(of: Proposal) -> Proposal:
    """The proposal with what doctor will say of it first: `refused`, and `hardly` identifiable."""
    try:
        card = card_from(tomllib.loads(written(of)), CARD_NAME)
        found = read_runs(Path(of.log), card)
        rig = card.rig(Path(of.log).name)
        lines = hardly_identifiable(found.runs, rig)
    except UserError as error:
        return replace(of, refused=str(error))
    before = f"{Path(of.log).name}: "
    renewed = [
        one.removeprefix(before)
        for one in found.remarks
        if RENEWED_AT in one or RENEWED_EVERY in one
    ]
    return replace(of, hardly=tuple(dict.fromkeys([*lines, *renewed])))
