"""design.json: a design as it is written, every parameter with its unit."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from design.cascade import CascadeGains
from design.pid import PIDGains
from design.schedule import Over
from design.series_filters import FilterKind, SeriesFilter
from identification.model.estimates import Estimate
from workbench.cards.parameter_units import friction_units, shown
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
    DriveUnits,
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
from workbench.documents.plain import plain

DESIGN_SCHEMA = "design/2"


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
class GainsFile:
    k_R: Estimate
    T_i: Estimate
    T_d: Estimate
    eps: Estimate
    b: Estimate
    c: Estimate


@dataclass(frozen=True)
class CascadeFile:
    """`CascadeGains` as a result has them, and k_p in the unit of the drive's command."""

    k_v: Estimate
    k_p: Estimate
    T_n: Estimate
    eps: Estimate
    v_ff: Estimate
    k_p_command: Estimate | None = None


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
class FeedForwardFile:
    """`FeedForward` as a result has it."""

    F_cp: Estimate
    F_cn: Estimate
    F_vp: Estimate
    F_vn: Estimate
    band: Estimate
    m: Estimate
    most: Estimate


@dataclass(frozen=True)
class _DominantFile:
    w_n: Estimate
    zeta: Estimate


@dataclass(frozen=True)
class ControllerFile:
    R: tuple[float, ...]
    S: tuple[float, ...]
    T: tuple[float, ...]
    h: Estimate
    dominant: _DominantFile
    auxiliary: tuple[tuple[float, float], ...]
    reference_rate: Estimate
    reference_lag: Estimate
    margins: MarginValues
    overshoot: float
    missed: tuple[str, ...]
    gains: GainsFile | None = None
    note: str | None = None
    law: LawFile | None = None
    cascade: CascadeFile | None = None
    filter: SeriesFile | None = None
    feed_forward: FeedForwardFile | None = None
    reference_acceleration: Estimate | None = None


@dataclass(frozen=True)
class ScheduledFile:
    """`ScheduledController` as a result has it."""

    points: tuple[ControllerFile, ...]
    recommended: bool
    why: str


@dataclass(frozen=True)
class SchedulePoint:
    """Where a row of a schedule holds, and the friction that a P-PI feeds forward there."""

    at: Estimate
    F_cp: Estimate
    F_cn: Estimate
    F_vp: Estimate
    F_vn: Estimate


@dataclass(frozen=True)
class ScheduleFile:
    """`GainSchedule` as a result has it."""

    over: Over
    points: tuple[SchedulePoint, ...]
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


@dataclass(frozen=True)
class FileUnits:
    """Units of design.json's parameters on a machine of this motion and command."""

    length: str
    speed: str
    stiffness: str
    friction: Mapping[str, str]
    drive: DriveUnits

    @classmethod
    def of(cls, motion: Motion, command: str | None) -> "FileUnits":
        units = shown(motion == "rotary")
        drive = DriveUnits(motion, command or "V")
        return cls(units.position, units.velocity, units.stiffness, friction_units(motion), drive)


def design_document(found: Design) -> dict[str, Any]:
    """The design as design.json writes it, the schema first, every parameter with its unit."""
    document: dict[str, Any] = plain(as_file(found, units_of(found)))
    return {"schema": document.pop("schema"), **document}


def design_digest(found: Design) -> str:
    """By what a validation names the design that it is of: the SHA-256 of its content."""
    text = json.dumps(design_document(found), sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def units_of(found: "Design | DesignFile") -> FileUnits:
    return FileUnits.of(found.motion, found.command.unit if found.command else None)


def as_file(found: Design, units: FileUnits) -> DesignFile:
    p, c, drive = found.plant, found.compensator, units.drive
    limit = found.command.limit if found.command else None

    def controller(one: Controller | None) -> ControllerFile | None:
        return None if one is None else _controller_file(one, found.command, found.output, units)

    return DesignFile(
        card=found.card,
        motion=found.motion,
        plant=_LinearFile(p.source, p.why, p.A, p.B, Estimate(p.h, "s"), p.m, p.F_v, p.resonance),
        force=None if found.force is None else force_file(found.force, limit, drive),
        rst=controller(found.rst),
        pid=controller(found.pid),
        p_pi=controller(found.p_pi),
        refused=found.refused,
        recommended=found.recommended,
        compensator=_CompensatorFile(
            Estimate(c.N_c, "1"),
            Estimate(c.e_T, units.length),
            c.friction,
            None if c.filters is None or c.h is None else filters_file(c.filters, c.h),
            c.excess,
        ),
        remarks=found.remarks,
        versions=found.versions,
        command=None if found.command is None else command_file(found.command, drive),
        present=None if found.present is None else present_file(found.present, limit, drive),
        recommendation=found.recommendation,
        schedule=None if found.schedule is None else _schedule_file(found, found.schedule, units),
    )


def _schedule_file(found: Design, table: GainSchedule, units: FileUnits) -> ScheduleFile:
    names = schedule_units(table.over, units)
    rows = [(at, *friction) for at, friction in zip(table.at, table.friction, strict=True)]

    def of(name: Structure) -> ScheduledFile | None:
        one = table.controllers.get(name)
        if one is None:
            return None
        points = [_controller_file(p, found.command, found.output, units) for p in one.points]
        return ScheduledFile(tuple(points), one.recommended, one.why)

    points = tuple(
        SchedulePoint(*(Estimate(v, unit) for v, (_, unit) in zip(row, names, strict=True)))
        for row in rows
    )
    return ScheduleFile(table.over, points, of("pid"), of("p-pi"))


def schedule_units(over: Over, units: FileUnits) -> list[tuple[str, str]]:
    """Names and units of a schedule's row."""
    force, friction = units.drive.force, units.friction
    at = {"place": units.length, "load": force, "direction": "1"}[over]
    viscous = [(name, friction[name]) for name in ("F_vp", "F_vn")]
    return [("at", at), ("F_cp", force), ("F_cn", force), *viscous]


def _gains_file(gains: PIDGains, units: FileUnits) -> GainsFile:
    return GainsFile(
        **{name: Estimate(getattr(gains, name), unit) for name, unit in gain_units(units)}
    )


def _controller_file(
    one: Controller, command: Command | None, output: Output, units: FileUnits
) -> ControllerFile:
    w_n, zeta = one.dominant
    reason = None if one.rate is not None else "no limit of force or command to keep"
    return ControllerFile(
        R=one.R,
        S=one.S,
        T=one.T,
        h=Estimate(one.h, "s"),
        dominant=_DominantFile(Estimate(w_n, "rad/s"), Estimate(zeta, "1")),
        auxiliary=one.auxiliary,
        reference_rate=Estimate(one.rate, units.speed, reason=reason),
        reference_lag=Estimate(one.lag, "s"),
        margins=one.margins,
        overshoot=one.overshoot,
        missed=one.missed,
        gains=None if one.gains is None else _gains_file(one.gains, units),
        note=one.note,
        law=law_file(one.law(command), output, command.limit, units.drive) if command else None,
        cascade=None if one.cascade is None else _cascade_file(one.cascade, command, units),
        filter=None if one.series is None else _series_file(one.series),
        feed_forward=None if one.feed_forward is None else FeedForwardFile(
            **{name: Estimate(getattr(one.feed_forward, name), unit)
               for name, unit in feed_forward_units(units)}
        ),
        reference_acceleration=None if one.acceleration is None else Estimate(
            one.acceleration, f"{units.length}/s^2"
        ),
    )  # fmt: skip


def _cascade_file(gains: CascadeGains, command: Command | None, units: FileUnits) -> CascadeFile:
    per = command.force_per_command if command else None
    values = {name: Estimate(getattr(gains, name), unit) for name, unit in cascade_units(units)}
    own = None
    if command and per and command.unit != units.drive.force:
        unit = f"{command.unit} s/{units.length}"
        own = Estimate(gains.k_p / per, unit)
    return CascadeFile(**values, k_p_command=own)


def _series_file(one: SeriesFilter) -> SeriesFile:
    made = one.filter
    return SeriesFile(
        one.kind, Estimate(one.frequency, "Hz"), Estimate(one.numerator, "1"),
        Estimate(one.denominator, "1"), Estimate(one.width, "Hz"), one.depth_db, made.b, made.a,
    )  # fmt: skip


def cascade_units(units: FileUnits) -> list[tuple[str, str]]:
    """Names and units of a cascade's gains."""
    per_speed = f"{units.drive.force} s/{units.length}"
    return [("k_v", "1/s"), ("k_p", per_speed), ("T_n", "s"), ("eps", "s"), ("v_ff", "1")]


def feed_forward_units(units: FileUnits) -> list[tuple[str, str]]:
    """Names and units of a feed-forward's numbers."""
    force, friction = units.drive.force, units.friction
    viscous = [(name, friction[name]) for name in ("F_vp", "F_vn")]
    return [
        ("F_cp", force), ("F_cn", force), *viscous, ("band", units.speed), ("m", friction["m"]),
        ("most", force),
    ]  # fmt: skip


def gain_units(units: FileUnits) -> list[tuple[str, str]]:
    times = [(name, "s") for name in ("T_i", "T_d", "eps")]
    return [("k_R", units.stiffness), *times, ("b", "1"), ("c", "1")]
