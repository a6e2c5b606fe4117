"""design.json: a design as it is written, every parameter with its unit."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from design.pid import PIDGains
from identification.model.estimates import Estimate
from workbench.cards.parameter_units import friction_units, shown
from workbench.cards.units import Motion
from workbench.documents.design import (
    Controller,
    Design,
    From,
    MarginValues,
    Recommendation,
    Recommended,
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


@dataclass(frozen=True)
class GainsFile:
    k_R: Estimate
    T_i: Estimate
    T_d: Estimate
    eps: Estimate
    b: Estimate
    c: Estimate


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
        plant=_LinearFile(p.source, p.why, p.A, p.B, Estimate(p.h, "s"), p.m, p.F_v),
        force=None if found.force is None else force_file(found.force, limit, drive),
        rst=controller(found.rst),
        pid=controller(found.pid),
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
    )


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
    )


def gain_units(units: FileUnits) -> list[tuple[str, str]]:
    times = [(name, "s") for name in ("T_i", "T_d", "eps")]
    return [("k_R", units.stiffness), *times, ("b", "1"), ("c", "1")]
