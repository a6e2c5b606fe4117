"""A clock of a log that has the time from row to row alone, and a position of one that has its
speed: each the sum of that column, as a card's `summed` says."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from workbench.logs.summed import summed
from workbench.steps.first_card.axes import as_position
from workbench.steps.first_card.columns import Column, Columns
from workbench.steps.first_card.sizes import USUAL, factor, likeliest
from workbench.steps.first_card.weights import said

BY_THE_MINUTE = ("rpm", "m/min", "mm/min")  # units of speeds
A_MINUTE = 60.0  # s


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
    a_minute = one.header.unit is not None and one.header.unit.card in BY_THE_MINUTE
    x = summed(one.x, np.full(len(one.x), h / (A_MINUTE if a_minute else 1.0)))
    return replace(one, header=as_position(one.header), x=x, summed=True)
