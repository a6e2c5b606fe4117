"""A position of a log that has its speed alone: the sum of that, as a card's `summed` says."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.columns.axes import as_position
from identification.columns.column import Column
from identification.columns.log_columns import Columns
from identification.columns.motion_guess import USUAL, likeliest
from identification.columns.pairs import follows
from identification.columns.roles import WORK_GIVES_SIGN, Roles, known_roles
from identification.columns.ways import HEADER_SAYS
from identification.columns.weights import EXPLAINED, NO_FRICTION, said
from identification.signals.relations import lead
from identification.signals.summed import summed
from identification.thresholds import HALF

BY_THE_MINUTE = {"rpm": 60.0, "m/min": 60.0, "mm/min": 60.0}  # s, of units of speeds


def with_position(
    columns: Columns, signals: Sequence[Column], only: Column | None
) -> tuple[Columns, Column] | None:
    """The columns with the sum of a speed, which is then the position, in place of the speeds among
    these signals; None where none is a speed, or another column may be the position.

    only: the speed that somebody asked for.
    """
    speeds = [one for one in signals if one.header.speed and one.header.purpose != "reference"]
    if not speeds or (only or speeds[0]) not in speeds or any(said(x, "y") >= 0.0 for x in signals):
        return None
    own = only or min(speeds, key=lambda one: (one.axis, one.raw.number))
    return _summed(columns, signals, own)


def without_names(
    columns: Columns, signals: Sequence[Column], known: Roles | None
) -> tuple[Columns, Roles] | None:
    """The columns of a log in which none of these signals is called a position with the sum of one
    that may be a speed as the position, and the roles then, where that leaves far less of a drive
    than what is known, which has no speed beside it."""
    left = 1.0 if known is None else 1.0 - known.law.share
    nameless = left < 1.0 - EXPLAINED and not signals[0].raw.header
    moves = known is not None and ("v" in known.columns or nameless)
    if moves or any(said(one, "y") >= HEADER_SAYS for one in signals):
        return None
    found = list[tuple[Columns, Roles]]()
    for own in (one for one in signals if one.header.speed or not one.header.means):
        whole, y = _summed(columns, signals, own)
        roles = known_roles(whole.signals, y)
        least = max(EXPLAINED, 1.0 - HALF * left)
        if not roles or (roles.law.friction or 0.0) < NO_FRICTION:
            continue  # of a set point, which goes as it does, there is none
        if roles.law.share > least and abs(roles.law.work) > WORK_GIVES_SIGN:
            found.append((whole, roles))
    return max(found, key=lambda one: one[1].law.share, default=None)


def _summed(columns: Columns, signals: Sequence[Column], own: Column) -> tuple[Columns, Column]:
    """The columns with the sum of one's own over time instead of it, without other speeds and what
    asks for it; and that sum."""
    asked = [one for one in signals if one.header.purpose == "reference"]
    asks = [x for x in asked if "force" not in x.header.means and follows(lead(x.x, own.x))]
    kept = [one for one in signals if one is not own and one not in asks and not one.header.speed]
    unit, clock = own.header.unit, columns.clock.header.unit
    factor = columns.notation.factor
    usual, _ = likeliest("period", columns.step, USUAL["t"], "linear", factor)
    second = factor(clock.card if clock and clock.quantity == "time" else usual)
    h = columns.step * columns.grid * second / BY_THE_MINUTE.get(unit.plain if unit else "", 1.0)
    x = summed(own.x, np.full(len(own.x), h))
    position = replace(own, header=as_position(own.header), x=x, summed=True)
    return replace(columns, signals=(*kept, position)), position
