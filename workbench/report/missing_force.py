"""Section of a trace: the force that the model lacks, with its band, over time before and after."""

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from identification.arrays import Array
from identification.estimation.latent_force import LatentForces
from identification.model.estimates import NORMAL_95
from identification.tracing.result import MissingForce, Trace
from workbench.cards.readable import units_of
from workbench.report.chart import Area, Chart, Colour, Line, Mark, Panel, parts_of
from workbench.report.chart_figure import SHOWN_SHARE
from workbench.report.view import Section

Which = Literal["training", "test"]
POINTS_OVER_TIME = 4000  # of each line
LEAST_RANGE = 0.02  # of the Coulomb level, that the axis holds on either side


def missing_over_time(
    found: Trace, rotary: bool, logs: Sequence[str], which: Which = "training"
) -> list[Section]:
    """The force that the model lacks over time; none where no body slides.

    logs: names of those that it is of, `which` they are.
    """
    if found.missing_force is None:
        return []
    chart = missing_chart(found, found.missing_force, rotary, logs, which)
    return [Section("Force that the model lacks", chart)]


def missing_chart(
    found: Trace, force: MissingForce, rotary: bool, logs: Sequence[str], which: Which = "training"
) -> Chart:
    """The chart of `missing_over_time`."""
    caption = (
        "Applied force less modelled, smoothed, as the measured position shows it, with its 95 %"
        " band. Where the body rests or turns, friction takes whatever is applied: the band is"
        " wide there."
    )
    drawn: list[tuple[LatentForces, str, Colour]] = [(force.after, "model", "model")]
    if force.lessened:
        drawn = [(force.before, "before", "before"), (force.after, "after", "model")]
    lines, areas = zip(*(force_line(*one) for one in drawn), strict=True)
    level = max(found.plant.friction.F_cp, found.plant.friction.F_cn)
    starts = _begins(force.after)
    ends = [
        begin + float(one.t[-1] - one.t[0])
        for begin, one in zip(starts, force.after.logs, strict=True)
    ]
    panel = Panel(
        f"time, {which} logs in a row [s]" if len(starts) > 1 else f"time of the {which} log [s]",
        f"force that is missing [{units_of(rotary).force.name}]", lines, areas=areas,
        marks=[Mark(at, "x") for at in starts[1:]],
        y_range=range_of(force.before, level),
    )  # fmt: skip
    parts = parts_of(logs, starts, ends)
    what = "force that the model lacks against time, with its 95 % band"
    return Chart("trace-missing-force", what, [panel], parts=parts, caption=caption)


def force_line(of: LatentForces, name: str, colour: Colour) -> tuple[Line, Area]:
    """The force of all logs in a row, applied less modelled, and its 95 % band."""
    t, middle, wide = (np.concatenate(parts) for parts in zip(*_in_a_row(of), strict=True))
    band = Area(f"{name}, 95 % band", t, middle - wide, middle + wide, colour)
    return Line(name, t, middle, colour), band


def _in_a_row(of: LatentForces) -> Iterator[tuple[Array, Array, Array]]:
    """Time [s], force and half its band [N] of each log, thinned; applied less modelled."""
    step = max(1, sum(len(one.t) for one in of.logs) // POINTS_OVER_TIME)
    for begin, one in zip(_begins(of), of.logs, strict=True):
        parts = begin + one.t - one.t[0], -one.force, NORMAL_95 * one.sd
        t, force, wide = (part[::step] for part in parts)
        # A NaN parts what belongs to two logs.
        yield np.append(t, parts[0][-1]), np.append(force, np.nan), np.append(wide, np.nan)


def _begins(of: LatentForces) -> list[float]:
    """Where each log begins in a row of them [s], two samples apart as in `in_a_row`."""
    lengths = [float(one.t[-1] - one.t[0] + 2.0 * (one.t[1] - one.t[0])) for one in of.logs]
    return [0.0, *np.cumsum(lengths[:-1]).tolist()]


def range_of(of: LatentForces, level: float) -> tuple[float, float]:
    """Range that holds nearly all of the force while the body slides; level [N]: of Coulomb."""
    slid = np.concatenate([np.abs(one.force[one.slides]) for one in of.logs])
    largest = float(np.quantile(slid, SHOWN_SHARE)) if len(slid) else 0.0
    top = 1.3 * max(largest, LEAST_RANGE * level, 1e-300)
    return -top, top
