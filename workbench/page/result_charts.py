"""What came of a log, as charts that zoom: before and after, and against what explains it."""

import numpy as np

from identification.arrays import Array
from identification.tracing.result import Residual
from workbench.cards.parameter_units import shown
from workbench.documents.model import Model
from workbench.report.chart import Band, Chart, Colour, Line, Panel
from workbench.report.figures import evenly_spread
from workbench.report.trace_pictures import (
    EQUATION_TITLES,
    LEVELS,
    Picture,
    axis_label,
    by_direction,
    pictures,
    running_median,
)
from workbench.steps.identify_sources import Identified
from workbench.steps.predict import fitted_run
from workbench.steps.trace import Traced

SHOWN_DOTS = 3000
MOST_PICTURES = 3
SHOWN_PART = 0.995  # of the points, that the axes hold


def identify_charts(model: Model, found: Identified) -> list[Chart]:
    """Position measured and simulated, and what is left, beside the sensor's noise."""
    log, units = found.sources[0].log, shown(model.rotary)
    run = fitted_run(model, log, 0)
    if run is None:
        return []
    t = log["t"] - log["t"][0]
    position = Panel(
        "", f"position [{units.position}]",
        [Line("measured", t, log["y"], "measured"), Line("simulated", t, run.y, "model", "dashed")],
    )  # fmt: skip
    noise = 2.0 * model.fit.noise_y
    left = Panel(
        "time [s]", f"left [{units.position}]",
        [Line("measured less simulated", t, log["y"] - run.y, "model")],
        bands=[Band("±2σ of the sensor", -noise, noise)], height=170,
    )  # fmt: skip
    return [Chart("fit", "position measured and simulated, and what is left", [position, left])]


def trace_charts(found: Traced) -> list[Chart]:
    """The residual against each signal that explains it, before and after."""
    rotary = found.model.rotary
    return [
        _against(picture, rotary, k)
        for k, picture in enumerate(pictures(found.trace)[:MOST_PICTURES])
    ]


def _against(picture: Picture, rotary: bool, number: int) -> Chart:
    residual, x = picture.residual, picture.residual.signals[picture.signal]
    unit = {"actuator": f"{shown(rotary).force}/s", "position": shown(rotary).position}.get(
        residual.equation, shown(rotary).force
    )
    top = float(np.quantile(np.abs(picture.without), SHOWN_PART)) * 1.1
    noise = 2.0 * float(np.median(residual.noise))
    values = [(picture.without, "before" if picture.how == "before" else picture.how)]
    if not np.array_equal(picture.without, residual.after):
        values.append((residual.after, "after"))
    panels = [
        Panel(
            axis_label(picture.signal, rotary), f"residual [{unit}]",
            _lines(residual, x, left, "before" if k == 0 and len(values) > 1 else "model"),
            title=name, bands=[Band("±2σ of the sensors", -noise, noise)], y_range=(-top, top),
        )
        for k, (left, name) in enumerate(values)
    ]  # fmt: skip
    signal = axis_label(picture.signal, rotary).split(" [")[0]
    said = f"residual of the {EQUATION_TITLES[residual.equation]} against {signal}"
    return Chart(f"against-{number}", f"{said}, before and after", panels, columns=2)


def _lines(residual: Residual, x: Array, left: Array, colour: Colour) -> list[Line]:
    """Dots, and their running median in each direction of motion."""
    keep = evenly_spread(len(x), SHOWN_DOTS)
    out = [Line("residual", x[keep], left[keep], colour, "dots")]
    for way, (at, _) in by_direction(residual).items():
        place, median = running_median(x[at], left[at], LEVELS)
        known = np.isfinite(place)
        out.append(
            Line(way, place[known], median[known], "other" if way.endswith("−") else "reference",
                 "bold")
        )  # fmt: skip
    return out
