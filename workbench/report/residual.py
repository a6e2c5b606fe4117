"""Section: what the model leaves of every log, beside the sensors' noise."""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array
from identification.log import Log
from identification.model.inverse_model import SURE_SLIDING
from identification.signals.differentiate import differentiate
from identification.simulation.free_run import FreeRun
from workbench.cards.readable import times, units_of
from workbench.documents.model import Model
from workbench.logs.sources import Source
from workbench.report.chart import Band, Chart, Line, Panel, chart_html
from workbench.report.chart_figure import SHOWN_SHARE, evenly_spread
from workbench.report.fit import InARow, in_a_row
from workbench.report.friction import friction_data
from workbench.report.model_tables import left_of
from workbench.report.page import Section

NOISE_BAND = "±2σ of the sensor's noise"


def residual(model: Model, sources: Sequence[Source], runs: Sequence[FreeRun | None]) -> Section:
    """Position's and force's residual over time, with the noise that a perfect model leaves."""
    chart = residual_chart(model, sources, runs)
    return Section("What the model leaves", chart_html(chart, _caption(model)))


def residual_chart(
    model: Model, sources: Sequence[Source], runs: Sequence[FreeRun | None]
) -> Chart:
    """The chart of `residual`."""
    row, panels = in_a_row(sources), []
    unit, factor = units_of(model.rotary).position
    known = [run for run in runs if run]
    if len(known) == len(sources):
        off = [one.log["y"] - run.y for one, run in zip(sources, known, strict=True)]
        noise = 2 * factor * model.fit.noise_y
        panels.append(
            Panel(
                row.label, f"position [{unit}]",
                [Line("measured less simulated", row.t, factor * row.joined(off))],
                bands=[Band(NOISE_BAND, -noise, noise)], marks=row.marks,
            )
        )  # fmt: skip
    panels.append(_force_panel(model, sources, known, row))
    what = "residual of position and force over time, with the band of the sensors' noise"
    return Chart("residual", what, panels, parts=row.parts if len(sources) > 1 else ())


def _force_panel(
    model: Model, sources: Sequence[Source], runs: Sequence[FreeRun], row: InARow
) -> Panel:
    """The force less that of the actuator's run, or of the equation of motion while sliding."""
    label = f"force [{units_of(model.rotary).force.name}]"
    if len(runs) == len(sources) and model.rig.kind != "motor" and model.fit.drive == "command":
        noise = 2 * model.fit.noise_F
        off = [one.log["F"] - run.F for one, run in zip(sources, runs, strict=True)]
        lines = [Line("measured less simulated", row.t, row.joined(off))]
        bands = [Band(NOISE_BAND, -noise, noise)]
        return Panel(row.label, label, lines, bands=bands, marks=row.marks)
    found = [_force_residual(model, one.log) for one in sources]
    starts = [part.low for part in row.parts]
    t = np.concatenate([begin + own for begin, (own, _) in zip(starts, found, strict=True)])
    left = np.concatenate([one for _, one in found])
    chosen = evenly_spread(len(t))
    name = "applied force less the equation of motion's, while sliding"
    return Panel(
        row.label, label, [Line(name, t[chosen], left[chosen], style="dots")], marks=row.marks,
        y_range=_most_of(left), x_range=(float(row.t[0]), float(row.t[-1])),
    )  # fmt: skip


def _most_of(values: Array) -> tuple[float, float] | None:
    """Range that holds all but the rarest values."""
    if not len(values):
        return None
    top = 1.3 * max(float(np.quantile(np.abs(values), SHOWN_SHARE)), 1e-300)
    return -top, top


def _force_residual(model: Model, log: Log) -> tuple[Array, Array]:
    """Times and friction data less Karnopp curve on sliding samples."""
    motion = differentiate(log["y"], log.h)
    data, p = friction_data(model, log), model.karnopp
    at = (log["t"] - log["t"][0])[motion.edge : len(log) - motion.edge]
    fast = np.abs(data.v) > SURE_SLIDING * motion.v_noise
    slides = fast & ((data.v > p.dv_p) | (data.v < p.dv_n))
    curve = np.where(data.v > 0, p.F_cp + p.F_vp * data.v, -p.F_cn + p.F_vn * data.v)
    return at[slides], (data.F_f - curve)[slides]


def _caption(model: Model) -> str:
    if model.by_equation:
        return "No free run follows these logs: this is what the equation of motion leaves."
    if model.fit.adequate:
        how = times(float(np.sqrt(model.fit.chi_square)))
        return f"What is left is {how} the sensors' noise: nothing is missing."
    return (
        f"What is left is {left_of(model)}: the machine has an effect that the model has not, or"
        " another structure. The command `workbench trace` finds which."
    )
