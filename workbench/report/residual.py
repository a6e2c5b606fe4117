"""Section: what the model leaves of every log, beside the sensors' noise."""

from collections.abc import Sequence

import numpy as np

from identification.estimation.latent_force import LatentForces
from identification.simulation.free_run import FreeRun
from workbench.cards.readable import times, units_of
from workbench.documents.model import Model
from workbench.logs.sources import Source
from workbench.report.chart import Band, Chart, Line, Panel, chart_html
from workbench.report.fit import InARow, in_a_row
from workbench.report.missing_force import force_line, range_of
from workbench.report.model_tables import left_of
from workbench.report.view import Section

NOISE_BAND = "±2σ of the sensor's noise"


def residual(
    model: Model, sources: Sequence[Source], runs: Sequence[FreeRun | None],
    missing: LatentForces | None,
) -> list[Section]:  # fmt: skip
    """Position's and force's residual over time, with the noise that a perfect model leaves; none
    where neither is known."""
    chart = residual_chart(model, sources, runs, missing)
    drawn = chart_html(chart, _caption(model))
    return [Section("What the model leaves", drawn)] if chart.panels else []


def residual_chart(
    model: Model, sources: Sequence[Source], runs: Sequence[FreeRun | None],
    missing: LatentForces | None,
) -> Chart:  # fmt: skip
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
    force = _force_panel(model, sources, known, row, missing)
    panels += [force] if force else []
    what = "residual of position and force over time, with the band of the sensors' noise"
    return Chart("residual", what, panels, parts=row.parts if len(sources) > 1 else ())


def _force_panel(
    model: Model, sources: Sequence[Source], runs: Sequence[FreeRun], row: InARow,
    missing: LatentForces | None,
) -> Panel | None:  # fmt: skip
    """The force less that of the actuator's run, or the force that the model lacks, with its band;
    None where neither is known."""
    label = f"force [{units_of(model.rotary).force.name}]"
    if len(runs) == len(sources) and model.rig.kind != "motor" and model.fit.drive == "command":
        noise = 2 * model.fit.noise_F
        off = [one.log["F"] - run.F for one, run in zip(sources, runs, strict=True)]
        lines = [Line("measured less simulated", row.t, row.joined(off))]
        bands = [Band(NOISE_BAND, -noise, noise)]
        return Panel(row.label, label, lines, bands=bands, marks=row.marks)
    if missing is None:
        return None
    line, band = force_line(missing, "applied less modelled", "model")
    level = max(model.karnopp.F_cp, model.karnopp.F_cn)
    return Panel(
        row.label, label, [line], areas=[band], marks=row.marks, y_range=range_of(missing, level),
        x_range=(float(row.t[0]), float(row.t[-1])),
    )  # fmt: skip


def _caption(model: Model) -> str:
    if model.by_equation:
        return (
            "No free run follows these logs: this is the force that the model lacks, smoothed, with"
            " its 95 % band, which is wide where the body rests."
        )
    if model.fit.adequate:
        how = times(float(np.sqrt(model.fit.chi_square)))
        return f"What is left of the run is {how} the sensors' noise."
    return (
        f"What is left is {left_of(model)}: the machine has an effect that the model has not, or"
        " another structure. The command `workbench trace` finds which."
    )
