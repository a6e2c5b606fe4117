"""A proposal after its log was read by it: why that fails, and what is hardly identifiable from the
log."""

import tomllib
from dataclasses import replace
from pathlib import Path

from identification.errors import UserError
from identification.signals.renewal import RENEWED_AT
from workbench.cards.card import card_from
from workbench.logs.runs import read_runs
from workbench.steps.first_card.proposal import Proposal
from workbench.steps.first_card.written import written
from workbench.steps.hardly_identifiable import hardly_identifiable

CARD_NAME = Path("the card")


def checked_proposal(of: Proposal) -> Proposal:
    """The proposal with what doctor will say of it first: `refused`, and `hardly` identifiable."""
    try:
        card = card_from(tomllib.loads(written(of)), CARD_NAME)
        found = read_runs(of.path, card)
        rig = card.rig(of.path.name)
        lines = hardly_identifiable(found.runs, rig)
    except UserError as error:
        return replace(of, refused=str(error))
    before = f"{of.path.name}: "
    renewed = [one.removeprefix(before) for one in found.remarks if RENEWED_AT in one]
    return replace(of, hardly=tuple(dict.fromkeys([*lines, *renewed])))
