"""A clock of a log that has the time from row to row alone, and a position of one that has its
speed: each the sum of that column, as a card's `summed` says."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.signals.even_clock import LONGEST_GAP
from workbench.cards.headers import WrittenUnit
from workbench.logs.summed import summed
from workbench.steps.first_card.columns import Column, Columns
from workbench.steps.first_card.sizes import USUAL, factor, likeliest
from workbench.steps.first_card.weights import said

OF_TURNS = {"rpm": ("turn", 60.0)}  # what a speed sums up to, and in how many seconds by one of it
A_MINUTE = 60.0


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
    unit = columns.clock.header.unit
    usual = unit.card if unit and unit.quantity == "time" else ""
    usual = usual or likeliest("period", columns.step, USUAL["t"], "linear")[0]
    position = _summed(own, columns.step * columns.grid * factor(usual))
    kept = [one for one in signals if not one.header.speed]
    return replace(columns, signals=(*kept, position)), position


def _summed(one: Column, h: float) -> Column:
    """The sum of a speed over rows that are h [s] apart, as a position."""
    unit, seconds = one.header.unit, 1.0
    if unit is not None and unit.quantity == "velocity":
        card, _, per = unit.card.partition("/")
        card, seconds = OF_TURNS.get(card, (card, A_MINUTE if per == "min" else 1.0))
        unit = WrittenUnit(card, "position", unit.rotary)
    header = replace(one.header, unit=unit, means={"position": one.header.means["velocity"]}
                     if "velocity" in one.header.means else {"position": 1.0})  # fmt: skip
    return replace(one, header=header, x=summed(one.x, np.full(len(one.x), h / seconds)), summed=True)
