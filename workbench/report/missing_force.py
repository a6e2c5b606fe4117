"""Section of a trace: the force that the model lacks, with its band, over time before and after."""

from collections.abc import Iterator, Sequence

import numpy as np

from identification.arrays import Array
from identification.estimation.latent_force import LatentForces
from identification.tracing.result import MissingForce, Trace
from workbench.cards.readable import units_of
from workbench.report.chart import Area, Chart, Colour, Line, Mark, Panel, Part, chart_html
from workbench.report.chart_figure import SHOWN_SHARE
from workbench.report.page import Section
from workbench.report.trace_words import share_of_friction

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
    lines, areas = [], []
    for of, name, colour in drawn:
        t, middle, wide = (np.concatenate(parts) for parts in zip(*_in_a_row(of), strict=True))
        lines.append(Line(name, t, unit.factor * middle, colour))
        low, high = unit.factor * (middle - wide), unit.factor * (middle + wide)
        areas.append(Area(f"{name}, 95 % band", t, low, high, colour))
    ends = np.cumsum([one.t[-1] - one.t[0] for one in force.after.logs])
    starts = [0.0, *ends[:-1].tolist()]
    names = logs if len(logs) == len(starts) > 1 else ()
    panel = Panel(
        "time, logs in a row [s]" if len(starts) > 1 else "time [s]",
        f"force that is missing [{unit.name}]", lines, areas=areas,
        marks=[Mark(at, "x") for at in starts[1:]], y_range=_shown(found, force, unit.factor),
    )  # fmt: skip
    parts = [Part(*one) for one in zip(names, starts, ends.tolist(), strict=False)]
    what = "force that the model lacks against time, with its 95 % band"
    return Chart("trace-missing-force", what, [panel], parts=parts)


def _in_a_row(of: LatentForces) -> Iterator[tuple[Array, Array, Array]]:
    """Time [s], force and half its band [N] of each log, thinned; applied less modelled."""
    begin, step = 0.0, max(1, sum(len(one.t) for one in of.logs) // POINTS_OVER_TIME)
    for one in of.logs:
        t = begin + one.t - one.t[0]
        yield t[::step], -one.force[::step], WIDE_95 * one.sd[::step]
        begin = float(t[-1])


def _shown(found: Trace, force: MissingForce, factor: float) -> tuple[float, float]:
    """Range that holds all but the rarest of what is missing while the body slides."""
    level = max(found.plant.friction.F_cp, found.plant.friction.F_cn)
    largest = float(np.quantile(np.abs(force.sliding.before), SHOWN_SHARE))
    top = 1.3 * factor * max(largest, LEAST_RANGE * level, 1e-300)
    return -top, top
