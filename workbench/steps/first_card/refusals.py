"""Logs of which no card is proposed, each with its reason; and the columns of one axis."""

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from identification.errors import BadLog
from identification.signals.relations import FEWEST_MOVING, lead, moving
from identification.thresholds import OF_ACCOUNT, TWICE
from workbench.cards.headers import words_of
from workbench.steps.first_card.column import Column
from workbench.steps.first_card.columns import NEARLY_ALIKE, PHASE_CURRENT, Columns
from workbench.steps.first_card.roles import Roles
from workbench.steps.first_card.weights import SURE, said, together

FOLLOWED = 0.95  # likeness of a position and its reference in a log without a drive
NO_DRIVE = 0.0  # log-odds of a force by its header, of what may be a reference at most
SAID_SO = 2.0  # log-odds of a command by its header, from which it is no force rather


def no_body(columns: Columns) -> BadLog:
    """The one line for a log of which no column moves as a body that is driven."""
    phases = [o.shown for o in columns.read if columns.left_out.get(o.raw.number) == PHASE_CURRENT]
    if phases:
        return BadLog(
            f"{columns.log.path}: columns {', '.join(phases)} are the three phase currents of a"
            " motor (their sum is 0), of which none is its force, and no other drive is logged; log"
            " the current that makes the torque too (the drive's q current), or add a column of it"
            " by Park's transform with the electrical angle"
        )
    pair = _followed(columns.signals)
    if pair is not None and (told := _hardly_moves(pair, columns.signals)):
        return BadLog(f"{columns.log.path}: {told}")
    if pair is not None:
        return BadLog(
            f"{columns.log.path}: column {pair[0].shown} follows its reference {pair[1].shown}, and"
            " no force and no command of the motor is logged; log its current, torque or force too:"
            " reference and position alone identify no friction"
        )
    unsigned = f"; {told}" if (told := without_sign(columns.signals)) else ""
    there = ", ".join(one.shown for one in columns.signals) or "none"
    left_out = "; ".join(
        f"left out: column {one.shown}: {why}"
        for one in columns.read if (why := columns.left_out.get(one.raw.number))
    )  # fmt: skip
    return BadLog(
        f"{columns.log.path}: no column moves as a body that another one drives (tried: {there}"
        f"{'; ' if left_out else ''}{left_out}){unsigned}; a position is"
        " needed that goes both ways, and"
        " beside it a force, two pressures or a motor's command; or write the card by hand"
        " (manual: The card, key by key)"
    )


def without_sign(signals: Sequence[Column]) -> str:
    """What is said of a command without a sign beside a column that goes back and forth."""
    for one, y in permutations(signals, 2):
        if said(one, "u") >= SAID_SO and np.min(one.x) >= 0.0 and y.way_gone > TWICE:
            return (
                f"{one.shown} is never negative, though {y.shown} goes both ways: where the motor"
                " pushes both ways its direction is missing, so log the command with its sign"
            )
    return ""


def _followed(signals: Sequence[Column]) -> tuple[Column, Column] | None:
    """A position and the reference that it follows; None where there are no such two."""
    for y, r in permutations(signals, 2):
        other = max(said(r, "F"), said(r, "p")) <= NO_DRIVE and r.header.purpose != "model"
        other &= not r.header.speed
        if said(y, "y") >= SAID_SO and other and lead(r.x, y.x).likeness > FOLLOWED:
            return y, r
    return None


def _hardly_moves(pair: Sequence[Column], signals: Sequence[Column]) -> str:
    """Why a drive that is logged is not known beside a position and its reference: too few rows in
    which the body moves; empty where no header speaks of a drive, or enough moves."""
    y = pair[0]
    drives = [one for one in signals if max(said(one, "F"), said(one, "u")) >= SAID_SO]
    drives = sorted((one for one in drives if one not in pair), key=lambda one: -together(y, one))
    rows = 0 if y.motion is None else int(np.sum(moving(y.motion)))
    if not drives or rows >= FEWEST_MOVING:
        return ""
    return (
        f"column {y.shown} moves in {rows} of its {len(y.x)} rows, too few to see whether"
        f" {drives[0].shown} drives it (at least {FEWEST_MOVING} needed); log more strokes, or more"
        " rows of each"
    )


def of_axis(columns: Columns, axis: str | None) -> tuple[Sequence[Column], Column | None]:
    """The columns that belong to an axis, and the one that is to be its position, if any."""
    if axis is None:
        return columns.signals, None
    name = axis.strip().casefold()
    called = words_of(name)
    places = [one.axis for one in columns.signals if one.axis and _has(one, called)]
    own = {name} & set(columns.axes) or set(places)
    if len(own) == 1:
        (name,) = own
        return [one for one in columns.signals if one.axis in ("", name)], None
    named = [one for one in columns.signals if one.raw.header.strip().casefold() == name]
    if len(named) == 1:
        return columns.signals, named[0]
    there = ", ".join(columns.axes) or "its headers name one alone"
    raise BadLog(
        f"{columns.log.path}: no axis {axis!r} (axes: {there}); give one of them, or the header of"
        " a position"
    )


def _has(one: Column, words: Sequence[str]) -> bool:
    """Whether a header has these words one after the other."""
    text = f" {' '.join(words_of(one.raw.header))} "
    return bool(words) and f" {' '.join(words)} " in text


def refuse_undriven(columns: Columns, roles: Roles, share: float) -> None:
    """Raises BadLog where a command is always 0 and the current is what the motor makes that the
    body turns: the velocity alone (share), against it."""
    if not roles.columns["u"].current or roles.signs["u"] > 0.0:
        return
    for one in columns.read:
        if columns.left_out.get(one.raw.number) == "is always 0" and said(one, "u") >= SAID_SO:
            raise BadLog(
                f"{columns.log.path}: nothing drives: the command {one.shown} is always 0, and"
                f" {roles.columns['u'].shown} is the velocity alone ({share:.0%}), against it, as"
                " of a motor that the body turns, whose braking is no friction; log a run with a"
                " command"
            )


def refuse_sign_bits(columns: Columns, roles: Roles) -> None:
    """Raises BadLog where a signal's sign is a bit of its own, which no card can undo."""
    for one in roles.columns.values():
        found = one.register
        if found is None or found.sign_bit is None:
            continue
        top = 2**found.sign_bit
        raise BadLog(
            f"{columns.log.path}: column {one.shown} jumps by {top} (data row {found.row}) where it"
            f" passes 0: sign and magnitude, bit {found.sign_bit} is the sign ({top} + n means -n);"
            f" write x where x < {top}, else {top} - x, and give that log"
        )


def refuse_error(columns: Columns, roles: Roles) -> None:
    """Raises BadLog where what may be the position is made of a following error, as the terms of a
    controller are: the error, its sum and its change."""
    y = roles.columns["y"]
    for one in columns.read if said(y, "y") < SAID_SO else ():
        e, x = one.values, y.values
        if one.header.purpose != "error" or len(e) != len(x) or not np.all(np.isfinite(e * x)):
            continue
        of_error = np.column_stack([e, np.cumsum(e), np.gradient(e), np.ones(len(e))])
        left = x - of_error @ np.linalg.lstsq(of_error, x)[0]
        reached = abs(float(np.corrcoef(e, x)[0, 1])) > NEARLY_ALIKE  # of a reference at rest
        if np.var(left) < OF_ACCOUNT**2 * np.var(x) and not reached:
            raise BadLog(
                f"{columns.log.path}: no position: {y.shown} is made of the error {one.shown}, as"
                " the terms of a controller are, and error and output alone identify no friction;"
                " log the position too"
            )


def refuse_resting(columns: Columns, roles: Roles) -> None:
    """Raises BadLog where a position by its header stands still, and another column is none."""
    y = roles.columns["y"]
    for one in columns.read:
        why = columns.left_out.get(one.raw.number, "")
        if why.startswith("is always") and said(one, "y") >= max(SURE, said(y, "y") + 1.0):
            raise BadLog(
                f"{columns.log.path}: column {one.shown}, the position by its header, {why}; motion"
                " needed: check the sensor, or leave the column out"
            )
