"""Section: measured and simulated position and force over time, all logs."""

from collections.abc import Sequence

from identification.arrays import Array
from identification.model.inverse_model import Smoothing
from identification.simulation.free_run import FreeRun
from workbench.cards.readable import units_of
from workbench.documents.model import Model
from workbench.logs.sources import Source
from workbench.report.chart import Chart, Line, Panel, Part, chart_html
from workbench.report.in_a_row import in_a_row, liveliest
from workbench.report.model_tables import held
from workbench.report.page import Section
from workbench.steps.predicted_force import force_by_model


def fit(model: Model, sources: Sequence[Source], runs: Sequence[FreeRun | None]) -> Section:
    """Position and force of every log, measured and by the model."""
    return Section("Fit over time", chart_html(fit_chart(model, sources, runs), _caption(model)))


def fit_chart(model: Model, sources: Sequence[Source], runs: Sequence[FreeRun | None]) -> Chart:
    """The chart of `fit`."""
    units, row = units_of(model.rotary), in_a_row(sources)
    pairs = list(zip(sources, runs, strict=True))
    position = [run.y if run else empty for (_, run), empty in zip(pairs, row.none(), strict=True)]
    columns = (
        ("position", units.position, "y", position),
        ("applied force", units.force, "F", [_force(model, *pair) for pair in pairs]),
    )
    panels = []
    for name, (unit, factor), signal, modelled in columns:
        measured = factor * row.joined([one.log[signal] for one in sources])
        lines = [Line("measured", row.t, measured, "measured")]
        if signal == "F" or any(runs):
            lines.append(Line("model", row.t, factor * row.joined(modelled), look="dashed"))
        panels.append(Panel(row.label, f"{name} [{unit}]", lines, marks=row.marks))
    part = liveliest(sources[0].log["y"])
    lively = Part("liveliest part", float(row.t[part.start]), float(row.t[part.stop - 1]))
    logs = row.parts if len(sources) > 1 else ()
    what = "measured and simulated position and applied force over time"
    return Chart("fit", what, panels, parts=(*logs, lively))


def _force(model: Model, source: Source, run: FreeRun | None) -> Array:
    """Force by the model: simulated where an actuator gives it, else what the motion needs."""
    if model.fit.drive == "force" or model.rig.kind == "motor" or run is None:
        how = Smoothing(held=model.rig.kind == "motor")
        return force_by_model(model, source.log, how)
    return run.F


def _caption(model: Model) -> str:
    inverse = " The model's force is that of the inverse model: what this motion needs."
    if model.by_equation:
        return f"No free run follows these logs, so no position is simulated.{inverse}"
    if model.fit.drive == "command":
        return (
            "The model is driven by the logged command alone, from the start of the log; it never"
            f" sees the measured position.{inverse if model.rig.kind == 'motor' else ''}"
        )
    return (
        f"The model is driven by the measured force, {held(model)}: a free run on a measured force"
        f" drifts at every stop.{inverse}"
    )
