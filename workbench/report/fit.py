"""Sections: measured and simulated position and force over time, all logs; what the model leaves
beside the sensors' noise; and the force that it lacks, with its band, before and after a trace."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from design.machine.model import Model
from design.machine.readable import Display, times
from design.machine.source import Source
from design.measured.predict import FORCE_WINDOW, force_by_model, in_windows
from identification.arrays import Array
from identification.estimation.latent_force import LatentForces
from identification.model.estimates import NORMAL_95
from identification.model.inverse_model import Smoothing
from identification.model.karnopp import Karnopp
from identification.signals.envelope import SHOWN_SHARE, liveliest
from identification.simulation.free_run import FreeRun
from identification.tracing.result import Trace
from workbench.report.chart import Area, Band, Chart, Colour, Line, Mark, Panel, Part, parts_of
from workbench.report.model_tables import left_of, run_coupling
from workbench.report.view import Section

NOISE_BAND = "±2σ of the sensor's noise"
Which = Literal["training", "test"]
POINTS_OVER_TIME = 4000  # of each line
LEAST_RANGE = 0.02  # of the Coulomb level, that the axis holds on either side


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


def fit_chart(model: Model, sources: Sequence[Source], runs: Sequence[FreeRun | None]) -> Chart:
    """Position and force of every log, measured and by the model."""
    display, row = model.display, in_a_row(sources)
    pairs = list(zip(sources, runs, strict=True))
    position = [run.y if run else np.full(len(one.log), np.nan) for one, run in pairs]
    columns = (
        ("position", display.shown("position"), "y", position),
        ("applied force", display.shown("force"), "F", [_force(model, *pair) for pair in pairs]),
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
        how = Smoothing(zoh=model.holds_force)
        return force_by_model(model, source.log, how)
    return run.F


def _fit_caption(model: Model) -> str:
    inverse = " The model's force is that of the inverse model: what this motion needs."
    if model.by_equation:
        return f"The equation of motion was fitted, so no position is simulated.{inverse}"
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
    unit, factor = model.display.shown("position")
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
    label = f"force [{model.display.force}]"
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
    first, second = map(model.display.force_text, own)
    return (
        f" The run has its own stick limits, {first} and {second}; the table's stand midway to the"
        " force at the breakaways."
    )


def _residual_caption(model: Model) -> str:
    if model.by_equation:
        return (
            "The equation of motion was fitted: this is the force that the model lacks, smoothed,"
            " with its 95 % band, which is wide where the body rests."
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


def missing_chart(
    found: Trace, display: Display, logs: Sequence[str], which: Which = "training"
) -> Chart:
    """The force that the model lacks over time, where a body slides.

    logs: names of those that it is of, `which` they are.
    """
    force = found.missing_force
    assert force is not None
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
        f"force that is missing [{display.force}]", lines, areas=areas,
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
