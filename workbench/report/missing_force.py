"""Section of a trace: the force that the model lacks, with its band, over time before and after."""

from collections.abc import Iterator, Sequence

import numpy as np

from identification.arrays import Array
from identification.estimation.latent_force import LatentForces
from identification.tracing.result import MissingForce, Trace
from workbench.cards.readable import units_of
from workbench.report.chart import Area, Chart, Colour, Line, Mark, Panel, Part, chart_html
from workbench.report.chart_figure import SHOWN_SHARE
from workbench.report.trace_words import share_of_friction
from workbench.report.view import Section

POINTS_OVER_TIME = 4000  # of each line
WIDE_95 = 1.96  # deviations on either side, of a 95 % band
LEAST_RANGE = 0.02  # of the Coulomb level, that the axis holds on either side


def missing_over_time(found: Trace, rotary: bool, logs: Sequence[str]) -> list[Section]:
    """The force that the model lacks over time; none where no body slides. logs: their names."""
    if found.missing_force is None:
        return []
    caption = (
        "Applied force less modelled, smoothed, as the measured position shows it, with its 95 %"
        " band. Where the body rests or turns, friction takes whatever is applied: the band is"
        " wide there."
    )
    if found.missing is not None:
        before, after = (share_of_friction(part) for part in found.missing)
        named = f"{before} of friction before, {after} after" if found.effects else after
        caption += f" Root mean square while it slides: {named}."
    chart = missing_chart(found, found.missing_force, rotary, logs)
    return [Section("Force that the model lacks", chart_html(chart, caption))]


def missing_chart(found: Trace, force: MissingForce, rotary: bool, logs: Sequence[str]) -> Chart:
    """The chart of `missing_over_time`."""
    unit = units_of(rotary).force
    drawn: list[tuple[LatentForces, str, Colour]] = [(force.after, "model", "model")]
    if found.effects:
        drawn = [(force.before, "before", "before"), (force.after, "after", "model")]
    parts = [force_lines(of, name, colour, unit.factor) for of, name, colour in drawn]
    lines, areas = ([each for part in own for each in part] for own in zip(*parts, strict=True))
    level = max(found.plant.friction.F_cp, found.plant.friction.F_cn)
    ends = np.cumsum([one.t[-1] - one.t[0] for one in force.after.logs])
    starts = [0.0, *ends[:-1].tolist()]
    names = logs if len(logs) == len(starts) > 1 else ()
    panel = Panel(
        "time, logs in a row [s]" if len(starts) > 1 else "time [s]",
        f"force that is missing [{unit.name}]", lines, areas=areas,
        marks=[Mark(at, "x") for at in starts[1:]],
        y_range=range_of(force.before, level, unit.factor),
    )  # fmt: skip
    named = [Part(*one) for one in zip(names, starts, ends.tolist(), strict=False)]
    what = "force that the model lacks against time, with its 95 % band"
    return Chart("trace-missing-force", what, [panel], parts=named)


def force_lines(
    of: LatentForces, name: str, colour: Colour, factor: float = 1.0
) -> tuple[list[Line], list[Area]]:
    """The force of all logs in a row, applied less modelled, times `factor`, and its 95 % band."""
    t, middle, wide = (np.concatenate(parts) for parts in zip(*_in_a_row(of), strict=True))
    low, high = factor * (middle - wide), factor * (middle + wide)
    line = Line(name, t, factor * middle, colour)
    return [line], [Area(f"{name}, 95 % band", t, low, high, colour)]


def _in_a_row(of: LatentForces) -> Iterator[tuple[Array, Array, Array]]:
    """Time [s], force and half its band [N] of each log, thinned; applied less modelled."""
    begin, step = 0.0, max(1, sum(len(one.t) for one in of.logs) // POINTS_OVER_TIME)
    for one in of.logs:
        t = begin + one.t - one.t[0]
        yield t[::step], -one.force[::step], WIDE_95 * one.sd[::step]
        begin = float(t[-1])


def range_of(of: LatentForces, level: float, factor: float = 1.0) -> tuple[float, float]:
    """Range that holds nearly all of the force while the body slides; level [N]: of Coulomb."""
    slid = np.concatenate([np.abs(one.force[one.slides]) for one in of.logs])
    largest = float(np.quantile(slid, SHOWN_SHARE)) if len(slid) else 0.0
    top = 1.3 * factor * max(largest, LEAST_RANGE * level, 1e-300)
    return -top, top
