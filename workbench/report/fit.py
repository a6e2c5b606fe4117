"""Sections: measured and simulated position and force over time, all logs, and what the model
leaves beside the sensors' noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.estimation.latent_force import LatentForces
from identification.model.inverse_model import Smoothing
from identification.model.karnopp import Karnopp
from identification.simulation.free_run import FreeRun
from workbench.cards.readable import force, times, units_of
from workbench.documents.model import Model
from workbench.logs.sources import Source
from workbench.report.chart import Band, Chart, Line, Mark, Panel, Part
from workbench.report.missing_force import force_line, range_of
from workbench.report.model_tables import left_of, run_coupling
from workbench.report.view import Section
from workbench.steps.predict import FORCE_WINDOW, in_windows
from workbench.steps.predicted_force import force_by_model

NOISE_BAND = "±2σ of the sensor's noise"


@dataclass(frozen=True, eq=False)
class InARow:
    """Time of all logs in a row [s], with an empty sample between two of them."""

    t: Array
    parts: tuple[Part, ...]

    def joined(self, values: Sequence[Array]) -> Array:
        """Values of every log as one column of `t`'s length; NaN between the logs."""
        gap = np.array([np.nan])
        pieces = [piece for one in values for piece in (np.asarray(one, dtype=np.float64), gap)]
        return np.concatenate(pieces[:-1])

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
    return InARow(np.concatenate(times), tuple(parts))


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


def fit_chart(model: Model, sources: Sequence[Source], runs: Sequence[FreeRun | None]) -> Chart:
    """Position and force of every log, measured and by the model."""
    units, row = units_of(model.rotary), in_a_row(sources)
    pairs = list(zip(sources, runs, strict=True))
    position = [run.y if run else np.full(len(one.log), np.nan) for one, run in pairs]
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
    return Chart("fit", what, panels, parts=(*logs, lively), caption=_fit_caption(model))


def _force(model: Model, source: Source, run: FreeRun | None) -> Array:
    """Force by the model: simulated where an actuator gives it, else what the motion needs."""
    if model.fit.drive == "force" or model.rig.kind == "motor" or run is None:
        how = Smoothing(held=model.rig.kind == "motor")
        return force_by_model(model, source.log, how)
    return run.F


def _fit_caption(model: Model) -> str:
    inverse = " The model's force is that of the inverse model: what this motion needs."
    if model.by_equation:
        return f"No free run follows these logs, so no position is simulated.{inverse}"
    if model.fit.drive == "command":
        anew = "from the start of the log; it never sees the measured position"
        if in_windows(model):
            anew = f"anew from the measured state every {FORCE_WINDOW:g} s"
        return (
            f"The model is driven by the logged command alone, {anew}."
            f"{inverse if model.rig.kind == 'motor' else ''}"
        )
    return (
        f"The model is driven by the measured force, {run_coupling(model)}: a free run on a"
        f" measured force drifts at every stop.{inverse}"
    )


def residual(
    model: Model, sources: Sequence[Source], runs: Sequence[FreeRun | None],
    missing: LatentForces | None, friction: Karnopp,
) -> list[Section]:  # fmt: skip
    """Position's and force's residual over time, with the noise that a perfect model leaves; none
    where neither is known. friction: of the runs."""
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
    panel = _force_panel(model, sources, known, row, missing)
    panels += [panel] if panel else []
    what = "residual of position and force over time, with the band of the sensors' noise"
    parts = row.parts if len(sources) > 1 else ()
    caption = f"{_residual_caption(model)}{_own_limits(model, friction)}"
    chart = Chart("residual", what, panels, parts=parts, caption=caption)
    return [Section("What the model leaves", chart)] if panels else []


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


def _own_limits(model: Model, friction: Karnopp) -> str:
    """What to say of a run whose stick limits are not those of the model."""
    own, used = (friction.F_sp, friction.F_sn), (model.karnopp.F_sp, model.karnopp.F_sn)
    if model.by_equation or np.allclose(own, used):
        return ""
    first, second = (force(one, model.rotary) for one in own)
    return (
        f" The run has its own stick limits, {first} and {second}; the table's stand midway to the"
        " force at the breakaways."
    )


def _residual_caption(model: Model) -> str:
    if model.by_equation:
        return (
            "No free run follows these logs: this is the force that the model lacks, smoothed, with"
            " its 95 % band, which is wide where the body rests."
        )
    if model.fit.adequate:
        how = times(float(np.sqrt(model.fit.chi_square)))
        if not in_windows(model):
            return f"What is left of the run is {how} the sensors' noise."
        return (
            f"What is left of the run is {how} what the noise of all signals makes of it: in each"
            f" window of {FORCE_WINDOW:g} s the error of the state from which it begins adds up, so"
            " that it is wider than the band of the position sensor alone."
        )
    return (
        f"What is left is {left_of(model)}: the machine has an effect that the model has not, or"
        " another structure. The command `workbench trace` finds which."
    )
