"""design.json: a design as it is written, every parameter with its unit."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from design.cascade import CascadeGains
from design.feed_forward import FeedForward
from design.pid import PIDGains
from design.schedule import Over
from design.series_filters import FilterKind, SeriesFilter
from identification.model.estimates import Estimate
from workbench.cards.parameter_units import Shown, shown
from workbench.cards.units import Motion
from workbench.documents.design import (
    Controller,
    Design,
    From,
    GainSchedule,
    MarginValues,
    Recommendation,
    Recommended,
    Structure,
)
from workbench.documents.drive import (
    Command,
    CommandFile,
    FiltersFile,
    ForceLoopFile,
    LawFile,
    Output,
    PresentFile,
    command_file,
    filters_file,
    force_file,
    law_file,
    present_file,
)
from workbench.documents.reading import plain

DESIGN_SCHEMA = "design/2"
# A value's numbers by name, each with its unit; None: it has no such number.
Numbers = Mapping[str, Estimate | None]
# The unit of each, or the name of one that hangs on the machine, as `Shown.by_name` has it.
FRICTION_AHEAD = {"F_cp": "force", "F_cn": "force", "F_vp": "viscous", "F_vn": "viscous"}
UNITS_OF: Mapping[type, Mapping[str, str]] = {
    PIDGains: {"k_R": "stiffness", "T_i": "s", "T_d": "s", "eps": "s", "b": "1", "c": "1"},
    CascadeGains: {"k_v": "1/s", "k_p": "damping", "T_n": "s", "eps": "s", "v_ff": "1"},
    FeedForward: {**FRICTION_AHEAD, "band": "velocity", "m": "mass", "most": "force"},
}
POLE_UNITS = {"w_n": "rad/s", "zeta": "1"}


@dataclass(frozen=True)
class _LinearFile:
    source: From
    why: str
    A: tuple[float, ...]
    B: tuple[float, ...]
    h: Estimate
    m: Estimate | None
    F_v: Estimate | None
    resonance: Mapping[str, Estimate] | None = None


@dataclass(frozen=True)
class SeriesFile:
    """`SeriesFilter` as a result has it, its width at -3 dB and depth, and b/a in z^-1."""

    kind: FilterKind
    frequency: Estimate
    numerator: Estimate
    denominator: Estimate
    width: Estimate
    depth_db: float | None
    b: tuple[float, ...]
    a: tuple[float, ...]


@dataclass(frozen=True)
class ControllerFile:
    R: tuple[float, ...]
    S: tuple[float, ...]
    T: tuple[float, ...]
    h: Estimate
    dominant: Numbers
    auxiliary: tuple[tuple[float, float], ...]
    reference_rate: Estimate
    reference_lag: Estimate
    margins: MarginValues
    overshoot: float
    missed: tuple[str, ...]
    gains: Numbers | None = None
    note: str | None = None
    law: LawFile | None = None
    cascade: Numbers | None = None
    filter: SeriesFile | None = None
    feed_forward: Numbers | None = None
    reference_acceleration: Estimate | None = None


@dataclass(frozen=True)
class ScheduledFile:
    """`ScheduledController` as a result has it."""

    points: tuple[ControllerFile, ...]
    recommended: bool
    why: str


@dataclass(frozen=True)
class ScheduleFile:
    """`GainSchedule` as a result has it."""

    over: Over
    points: tuple[Numbers, ...]
    pid: ScheduledFile | None = None
    p_pi: ScheduledFile | None = None


@dataclass(frozen=True)
class _CompensatorFile:
    N_c: Estimate
    e_T: Estimate
    friction: Mapping[str, Estimate]
    filters: FiltersFile | None = None
    excess: bool = False


@dataclass(frozen=True)
class DesignFile:
    """`Design` as design.json has it: every parameter with its unit and, if known, its spread."""

    card: str
    motion: Motion
    plant: _LinearFile
    force: ForceLoopFile | None
    rst: ControllerFile | None
    pid: ControllerFile | None
    refused: Mapping[str, str]
    recommended: Recommended
    compensator: _CompensatorFile
    remarks: tuple[str, ...]
    versions: Mapping[str, str]
    command: CommandFile | None = None
    present: PresentFile | None = None
    recommendation: Recommendation | None = None
    p_pi: ControllerFile | None = None
    schedule: ScheduleFile | None = None
    schema: Literal["design/2"] = "design/2"


def design_document(found: Design) -> dict[str, Any]:
    """The design as design.json writes it, the schema first, every parameter with its unit."""
    document: dict[str, Any] = plain(as_file(found, units_of(found)))
    return {"schema": document.pop("schema"), **document}


def design_digest(found: Design) -> str:
    """By what a validation names the design that it is of: the SHA-256 of its content."""
    text = json.dumps(design_document(found), sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def units_of(found: Design | DesignFile) -> Shown:
    """Units of a design's numbers."""
    return shown(found.motion == "rotary", found.command.unit if found.command else "V")


def as_file(found: Design, units: Shown) -> DesignFile:
    p, c = found.plant, found.compensator
    limit = found.command.limit if found.command else None

    def controller(one: Controller | None) -> ControllerFile | None:
        return None if one is None else _controller_file(one, found.command, found.output, units)

    return DesignFile(
        card=found.card,
        motion=found.motion,
        plant=_LinearFile(p.source, p.why, p.A, p.B, Estimate(p.h, "s"), p.m, p.F_v, p.resonance),
        force=None if found.force is None else force_file(found.force, limit, units),
        rst=controller(found.rst),
        pid=controller(found.pid),
        p_pi=controller(found.p_pi),
        refused=found.refused,
        recommended=found.recommended,
        compensator=_CompensatorFile(
            Estimate(c.N_c, "1"),
            Estimate(c.e_T, units.position),
            c.friction,
            None if c.filters is None or c.h is None else filters_file(c.filters, c.h),
            c.excess,
        ),
        remarks=found.remarks,
        versions=found.versions,
        command=None if found.command is None else command_file(found.command, units),
        present=None if found.present is None else present_file(found.present, limit, units),
        recommendation=found.recommendation,
        schedule=None if found.schedule is None else _schedule_file(found, found.schedule, units),
    )


def _schedule_file(found: Design, table: GainSchedule, units: Shown) -> ScheduleFile:
    names = schedule_units(table.over, units)

    def of(name: Structure) -> ScheduledFile | None:
        one = table.controllers.get(name)
        if one is None:
            return None
        points = [_controller_file(p, found.command, found.output, units) for p in one.points]
        return ScheduledFile(tuple(points), one.recommended, one.why)

    points = tuple(
        _with_units(dict(zip(names, (at, *friction), strict=True)), names)
        for at, friction in zip(table.at, table.friction, strict=True)
    )
    return ScheduleFile(table.over, points, of("pid"), of("p-pi"))


def schedule_units(over: Over, units: Shown) -> dict[str, str]:
    """Units of a schedule's row by name."""
    at = {"place": "position", "load": "force", "direction": "1"}[over]
    return units.by_name({"at": at, **FRICTION_AHEAD})


def _with_units(values: Mapping[str, float], units: Mapping[str, str]) -> dict[str, Estimate]:
    return {name: Estimate(values[name], unit) for name, unit in units.items()}


def _numbers(value: object, units: Shown) -> dict[str, Estimate] | None:
    """A value of `UNITS_OF` as it is written; None for None."""
    if value is None:
        return None
    return _with_units(vars(value), units.by_name(UNITS_OF[type(value)]))


def _controller_file(
    one: Controller, command: Command | None, output: Output, units: Shown
) -> ControllerFile:
    reason = None if one.rate is not None else "no limit of force or command to keep"
    return ControllerFile(
        R=one.R,
        S=one.S,
        T=one.T,
        h=Estimate(one.h, "s"),
        dominant=_with_units(dict(zip(POLE_UNITS, one.dominant, strict=True)), POLE_UNITS),
        auxiliary=one.auxiliary,
        reference_rate=Estimate(one.rate, units.velocity, reason=reason),
        reference_lag=Estimate(one.lag, "s"),
        margins=one.margins,
        overshoot=one.overshoot,
        missed=one.missed,
        gains=_numbers(one.gains, units),
        note=one.note,
        law=law_file(one.law(command), output, command.limit, units) if command else None,
        cascade=None if one.cascade is None else _cascade_file(one.cascade, command, units),
        filter=None if one.series is None else _series_file(one.series),
        feed_forward=_numbers(one.feed_forward, units),
        reference_acceleration=None if one.acceleration is None else Estimate(
            one.acceleration, f"{units.position}/s^2"
        ),
    )  # fmt: skip


def _cascade_file(gains: CascadeGains, command: Command | None, units: Shown) -> Numbers:
    """Its gains, and k_p in the unit of the drive's command."""
    per = command.force_per_command if command else None
    own = None
    if command and per and command.unit != units.force:
        unit = f"{command.unit} s/{units.position}"
        own = Estimate(gains.k_p / per, unit)
    return {**(_numbers(gains, units) or {}), "k_p_command": own}


def _series_file(one: SeriesFilter) -> SeriesFile:
    made = one.filter
    return SeriesFile(
        one.kind, Estimate(one.frequency, "Hz"), Estimate(one.numerator, "1"),
        Estimate(one.denominator, "1"), Estimate(one.width, "Hz"), one.depth_db, made.b, made.a,
    )  # fmt: skip
