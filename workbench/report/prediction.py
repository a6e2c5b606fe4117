"""A prediction in words and as a picture."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from design.machine.readable import Display
from design.measured.predicted_logs import Predicted
from identification.thresholds import FAR_LESS
from workbench.report.chart import Chart, Colour, Line, LineStyle, Panel
from workbench.report.next_steps import after_predict
from workbench.report.view import Section, View, notes, view
from workbench.steps.predict import prediction_frame

if TYPE_CHECKING:
    import pandas as pd

Columns = tuple[tuple[str, Colour, str], ...]
POSITION_COLUMNS: Columns = (
    ("position_measured", "measured", "measured"),
    ("position_simulated", "model", "simulated"),
)
FORCE_COLUMNS: Columns = (
    ("force_applied", "measured", "applied"),
    ("force_predicted", "model", "predicted: inverse model"),
    ("force_simulated", "other", "simulated"),
)


def error_lines(found: Predicted, display: Display) -> list[str]:
    """How far the model lies from the log, a line each."""
    summary = found.summary
    by = "the command" if summary["drive"] == "command" else "the applied force"
    window = summary["window"]
    start = "free run" if window is None else f"restarted every {window} s"
    lines = []
    if summary["position_rms"] is not None:
        rms = display.length_text(summary["position_rms"])
        lines.append(f"position ({start}, driven by {by}): error {rms} rms")
    if summary["run_refused"] is not None:
        lines.append(f"position: {summary['run_refused']}")
    off, none = summary["force_predicted_rms"], summary["force_applied_rms"]
    if off is not None:
        noise = ", the acceleration's noise in it" if found.inertia else ""
        steady = summary.get("force_steady_rms")
        if steady is not None and steady < FAR_LESS * off:
            noise = f", {display.force_text(steady)} off starts and stops{noise}"
        worse = f": worse than none, whose error is the force, {display.force_text(none)} rms"
        lines.append(
            f"force, inverse model: error {display.force_text(off)} rms while sliding{noise}"
            f"{worse if off > none else ''}"
        )
    if summary["force_simulated_rms"] is not None:
        rms = display.force_text(summary["force_simulated_rms"])
        lines.append(f"force, simulated: error {rms} rms")
    return lines


@view.register
def _(found: Predicted, display: Display, log: str) -> View:
    """How far a model lies from a log."""
    first, *more = error_lines(found, display) or ["nothing of this log can be compared"]
    remarks = found.summary["remarks"]

    def sections() -> list[Section]:
        lines = [*more, *(f"note: {one}" for one in remarks)]
        drawn = Section("Over time", prediction_chart(found, display))
        return [drawn, Section("In words", lines)] if lines else [drawn]

    return View(
        "Prediction",
        first,
        [*more, notes(remarks, (Path(log).name,))],
        {"prediction.csv": lambda: csv_text(prediction_frame(found.runs), 10)},
        sections,
        lambda: prediction_chart(found, display),
        step=after_predict("LOG", "CARD", one_way=found.one_way),
        has_page=False,
        lead=first.rstrip(".") + ".",
        content=lambda: found.summary,
    )


def csv_text(frame: "pd.DataFrame", digits: int) -> str:
    """A table with a time `t` [s] as CSV, its numbers with so many digits, the time with as many
    decimals as its steps need: stamps count from 1970."""
    t = np.asarray(frame["t"])
    steps = np.abs(np.diff(t))
    finest = float(np.min(steps[steps > 0.0], initial=1.0))
    known = 15 - int(np.ceil(np.log10(max(float(np.max(np.abs(t))), 1.0))))  # of a double
    decimals = min(known, digits - 5 - int(np.floor(np.log10(finest))))
    times = [f"{x:.{decimals}f}".rstrip("0").rstrip(".") for x in t]
    whole = frame.assign(t=times)
    return str(whole.to_csv(index=False, float_format=f"%.{digits}g", lineterminator="\n"))


def prediction_chart(found: Predicted, display: Display) -> Chart:
    """Position and force of the log and of the model over time, run after run."""
    gap = np.array([np.nan])
    t = np.concatenate([np.append(run.t, run.t[-1:]) for run in found.runs])
    panels = []
    for name, (unit, factor), columns in (
        ("position", display.shown("position"), POSITION_COLUMNS),
        ("force", display.shown("force"), FORCE_COLUMNS),
    ):
        lines = []
        for key, colour, said in columns:
            every = [np.append(getattr(run, key), gap) for run in found.runs]
            values = factor * np.concatenate(every)
            if np.any(np.isfinite(values)):
                style: LineStyle = "line" if colour == "measured" else "dashed"
                lines.append(Line(said, t, values, colour, style))
        panels.append(Panel("time [s]", f"{name} [{unit}]", lines))
        if len(lines) > 1:
            measured, model = lines[:2]
            off = Line(f"{measured.name} less {model.name}", t, measured.y - model.y)
            panels.append(Panel("time [s]", f"error [{unit}]", [off]))
    what = "measured and predicted position and force over time"
    return Chart("prediction", what, panels, caption="Nothing is fitted on this log.")
