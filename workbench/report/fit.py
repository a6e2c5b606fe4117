"""Section: measured and simulated position and force over time, all logs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.model.inverse_model import Smoothing
from identification.simulation.free_run import FreeRun
from workbench.cards.readable import units_of
from workbench.documents.model import Model
from workbench.logs.sources import Source
from workbench.report.chart import Chart, Line, Mark, Panel, Part, chart_html
from workbench.report.model_tables import run_coupling
from workbench.report.view import Section
from workbench.steps.predicted_force import force_by_model


@dataclass(frozen=True, eq=False)
class InARow:
    """Time of all logs in a row [s], with an empty sample between two of them."""

    t: Array
    lengths: tuple[int, ...]
    parts: tuple[Part, ...]

    def joined(self, values: Sequence[Array]) -> Array:
        """Values of every log as one column of `t`'s length; NaN between the logs."""
        gap = np.array([np.nan])
        pieces = [piece for one in values for piece in (np.asarray(one, dtype=np.float64), gap)]
        return np.concatenate(pieces[:-1])

    def none(self) -> list[Array]:
        """No values, for every log."""
        return [np.full(n, np.nan) for n in self.lengths]

    @property
    def marks(self) -> tuple[Mark, ...]:
        """Where each log but the first begins."""
        return tuple(Mark(part.low, "x") for part in self.parts[1:])

    @property
    def label(self) -> str:
        """Name of the axis."""
        return "time [s]" if len(self.parts) == 1 else "time, logs in a row [s]"


def in_a_row(sources: Sequence[Source]) -> InARow:
    """The logs of the sources, each from where the one before it ended."""
    begin, times, parts = 0.0, [], []
    for number, source in enumerate(sources):
        t = begin + source.log["t"] - source.log["t"][0]
        times.append(t)
        name = source.file if len(sources) == 1 else f"{number + 1}: {source.file}"
        parts.append(Part(name, float(t[0]), float(t[-1])))
        begin = float(t[-1]) + 2 * source.log.h
        if number + 1 < len(sources):
            times.append(np.array([float(t[-1]) + source.log.h]))
    lengths = tuple(len(source.log) for source in sources)
    return InARow(np.concatenate(times), lengths, tuple(parts))


def liveliest(y: Array, share: float = 0.12) -> slice:
    """The stretch of a log, that share of it, in which the position moves most."""
    size = max(50, round(share * len(y)))
    if len(y) <= size:
        return slice(0, len(y))
    # Blocks keep the noise of a fast log from counting as motion.
    block = max(1, size // 50)
    coarse = y[::block]
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(coarse)))])
    wide = max(2, size // block)
    gain = way[wide:] - way[:-wide]
    start = int(np.argmax(gain)) * block if gain.size else 0
    return slice(start, min(start + size, len(y)))


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
            lines.append(Line("model", row.t, factor * row.joined(modelled), style="dashed"))
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
        f"The model is driven by the measured force, {run_coupling(model)}: a free run on a"
        f" measured force drifts at every stop.{inverse}"
    )
