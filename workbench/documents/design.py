"""The design of one machine: controllers, margins, compensator; and design.json, which holds it.

Here values are plain SI numbers; in the file every parameter has its unit.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from design.compensator import Compensator
from design.drive_law import DriveLaw, drive_law
from design.filters import CompensatorFilters
from design.margins import Margins
from design.pid import PIDGains
from design.rst import RST
from identification.errors import BadModel, BadSpecification
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES, Karnopp
from workbench.cards.parameter_units import converted, friction_units, in_unit, shown
from workbench.cards.units import Motion
from workbench.documents.contradictions import refuse_apart, refuse_unequal
from workbench.documents.drive import (
    Command,
    CommandFile,
    DriveUnits,
    FiltersFile,
    ForceLoop,
    ForceLoopFile,
    LawFile,
    Output,
    Present,
    PresentFile,
    command_file,
    command_of,
    filters_file,
    filters_of,
    force_file,
    force_of,
    law_file,
    law_of,
    number,
    positive,
    present_file,
    present_of,
)
from workbench.documents.model import plain, used
from workbench.documents.reading import read_result

DESIGN_SCHEMA = "design/2"
From = Literal["physical", "arx"]
Recommended = Literal["rst", "pid", "none"]


@dataclass(frozen=True)
class Linear:
    """The sampled plant a design rests on, force reference [N] to position [m], and why this one.

    m [kg], F_v [N s/m] are None for an ARX plant.
    """

    source: From
    why: str
    A: tuple[float, ...]
    B: tuple[float, ...]
    h: float
    m: Estimate | None
    F_v: Estimate | None


@dataclass(frozen=True)
class MarginValues:
    """Margins of a loop as results carry them; worst_modulus over the parameters' intervals.

    None: no limit of that kind; worst_modulus None: unstable for some parameters inside them.
    """

    modulus: float
    gain_up: float | None
    gain_down: float | None
    phase_deg: float | None
    delay_s: float | None
    delay_samples: float | None
    S_yp_max_db: float
    S_up_max_db: float | None
    worst_modulus: float | None


@dataclass(frozen=True)
class Controller:
    """S F_ref = T r - R y, polynomials in z^-1, run every h [s].

    dominant: (w_n [rad/s], zeta); auxiliary: poles z as (re, im). rate: the reference is moved at
    most at this speed [m/s], None for any; lag [s] and overshoot [-] as `design.tracking` has
    them. missed: goals not kept. gains: of a PID in parallel form. W: its anti-windup as
    `design.drive_law` has it, None in older files.
    """

    R: tuple[float, ...]
    S: tuple[float, ...]
    T: tuple[float, ...]
    h: float
    dominant: tuple[float, float]
    auxiliary: tuple[tuple[float, float], ...]
    margins: MarginValues
    rate: float | None
    lag: float
    overshoot: float
    missed: tuple[str, ...]
    gains: PIDGains | None = None
    note: str | None = None
    W: tuple[float, ...] | None = None

    @property
    def rst(self) -> RST:
        """The controller for the loop."""
        return RST(np.array(self.R), np.array(self.S), np.array(self.T), self.h)

    def law(self, command: Command) -> DriveLaw:
        """The controller in the drive's own terms.

        Without a W, as in older files: above a force loop an integrator forgets in 1/w_n what was
        not carried out, else the whole controller forgets it at once.
        """
        per = command.force_per_command
        forget = 1.0 / self.dominant[0] if per is None else 0.0
        return drive_law(self.rst, forget, 1.0 if per is None else per, self.W)


@dataclass(frozen=True)
class CompensatorValues:
    """Parameters of the compensator (4): N_c [-], e_T [m], the nine as the model has them.

    filters: around it, and their period [s]; None in older files.
    """

    N_c: float
    e_T: float
    friction: Mapping[str, Estimate]
    filters: CompensatorFilters | None = None
    h: float | None = None

    def __post_init__(self) -> None:
        for name in NAMES:
            if name not in self.friction:
                raise BadModel(f"[compensator.friction] has no {name!r}; all nine are needed")
        _ = self.value

    @property
    def assumed(self) -> tuple[str, ...]:
        """Names of the nine that no log told."""
        return tuple(name for name in NAMES if self.friction[name].value is None)

    @property
    def value(self) -> Compensator:
        """The compensator for the loop."""
        friction = Karnopp(**{name: used(self.friction[name]) for name in NAMES})
        return Compensator(friction, self.N_c, self.e_T)


@dataclass(frozen=True)
class Recommendation:
    """Which controller, with or without the compensator, and why, in one line with numbers."""

    controller: Recommended
    compensator: bool
    why: str


@dataclass(frozen=True)
class Design:
    """Controllers of one machine; one may be None with its reason in `refused`.

    recommended: the controller that keeps every goal, "none" where none does. command: what the
    drive takes, present: the controller that it has now, recommendation: the same with its reason;
    None in older files. read: what to say of its file, a line for each value in another unit than
    ours.
    """

    card: str
    motion: Motion
    plant: Linear
    force: ForceLoop | None
    rst: Controller | None
    pid: Controller | None
    refused: Mapping[str, str]
    recommended: Recommended
    compensator: CompensatorValues
    remarks: tuple[str, ...]
    versions: Mapping[str, str]
    command: Command | None = None
    present: Present | None = None
    recommendation: Recommendation | None = None
    read: tuple[str, ...] = field(default=(), compare=False)

    @property
    def controllers(self) -> dict[str, Controller]:
        """The controllers that exist, by name."""
        return {k: c for k, c in (("rst", self.rst), ("pid", self.pid)) if c is not None}

    @property
    def output(self) -> Output:
        """What its laws give: the command, or the reference of the force loop."""
        return "command" if self.force is None else "force"


def margin_values(found: Margins, worst: float | None) -> MarginValues:
    """The margins as results carry them."""
    return MarginValues(
        modulus=found.modulus,
        gain_up=found.gain_up,
        gain_down=found.gain_down,
        phase_deg=found.phase_deg,
        delay_s=found.delay_s,
        delay_samples=None if found.delay_s is None else found.delay_s / found.h,
        S_yp_max_db=found.S_yp_max_db,
        S_up_max_db=found.S_up_max_db,
        worst_modulus=worst,
    )


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
class _GainsFile:
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
class _ControllerFile:
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
    gains: _GainsFile | None = None
    note: str | None = None
    law: LawFile | None = None


@dataclass(frozen=True)
class _CompensatorFile:
    N_c: Estimate
    e_T: Estimate
    friction: Mapping[str, Estimate]
    filters: FiltersFile | None = None


@dataclass(frozen=True)
class _DesignFile:
    """`Design` as design.json has it: every parameter with its unit and, if known, its spread."""

    card: str
    motion: Motion
    plant: _LinearFile
    force: ForceLoopFile | None
    rst: _ControllerFile | None
    pid: _ControllerFile | None
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
class _Units:
    """Units of design.json's parameters on a machine of this motion and command."""

    length: str
    speed: str
    stiffness: str
    friction: Mapping[str, str]
    drive: DriveUnits

    @classmethod
    def of(cls, motion: Motion, command: str | None) -> "_Units":
        units = shown(motion == "rotary")
        drive = DriveUnits(motion, command or "V")
        return cls(units.position, units.velocity, units.stiffness, friction_units(motion), drive)


def design_document(found: Design) -> dict[str, Any]:
    """The design as design.json writes it, the schema first, every parameter with its unit."""
    document: dict[str, Any] = plain(_as_file(found, _units_of(found)))
    return {"schema": document.pop("schema"), **document}


def _units_of(found: "Design | _DesignFile") -> _Units:
    return _Units.of(found.motion, found.command.unit if found.command else None)


def read_design(path: Path) -> Design:
    """The design in the file `path`, in SI; raises BadModel in one line where it is none."""
    written = read_result(path, _DesignFile, DESIGN_SCHEMA)
    units = _units_of(written)
    try:
        found = _from_file(written, units)
        _refuse_other_laws(written, found, units)
        pairs = tuple(_pairs(written, _as_file(found, units), ""))
        _refuse_changed_units(pairs, found)
    except (BadModel, BadSpecification) as error:
        raise BadModel(f"{path}: {error}") from None
    if not found.controllers:
        raise BadModel(f"{path}: holds no controller; run 'workbench design' again")
    said = (converted(one, ours, f"[{where}]") for where, one, ours in pairs)
    return replace(found, read=tuple(line for line in said if line))


def _pairs(written: object, ours: object, where: str) -> Iterator[tuple[str, Estimate, Estimate]]:
    """Every parameter of a file as it is written and in our units, with its place."""
    if isinstance(written, Estimate) and isinstance(ours, Estimate):
        yield where, written, ours
    elif isinstance(written, Mapping) and isinstance(ours, Mapping):
        for key, one in written.items():
            yield from _pairs(one, ours[key], f"{where}.{key}")
    elif is_dataclass(written):
        for each in fields(written):
            place = f"{where}.{each.name}" if where else each.name
            yield from _pairs(getattr(written, each.name), getattr(ours, each.name), place)


def _refuse_changed_units(pairs: tuple[tuple[str, Estimate, Estimate], ...], found: Design) -> None:
    """Raises BadModel where a value in another unit is not what the file says in other places."""
    at = {where: (one, ours) for where, one, ours in pairs}
    start = "compensator.friction."
    nine = {w.removeprefix(start): both for w, both in at.items() if w.startswith(start)}
    refuse_apart(
        {name: both[0] for name, both in nine.items()},
        {name: both[1] for name, both in nine.items()},
        f"[{start}",
    )
    if "plant.m" in at:
        (one, ours), (other, same) = at["plant.m"], nine["m"]
        refuse_unequal("[plant.m]", one, ours, used(same), f"[{start}m]")
        refuse_unequal(f"[{start}m]", other, same, used(ours), "[plant.m]")
    for name in found.controllers:
        (one, ours), (other, same) = at[f"{name}.h"], at["plant.h"]
        refuse_unequal(f"[{name}.h]", one, ours, used(same), "[plant.h]")
        refuse_unequal("[plant.h]", other, same, used(ours), f"[{name}.h]")


def _refuse_other_laws(written: _DesignFile, found: Design, units: _Units) -> None:
    """Raises BadModel where a law is not the controller beside it."""
    for name, one in (("rst", written.rst), ("pid", written.pid)):
        if one is None or one.law is None:
            continue
        if found.command is None:
            raise BadModel(f"[{name}.law] needs [command]; run 'workbench design' again")
        law = law_of(one.law, units.drive, f"{name}.law")
        ours = found.controllers[name].law(found.command)
        for key in "RST":
            mine, other = getattr(ours, key), getattr(law, key)
            if len(mine) != len(other) or not np.allclose(mine, other, rtol=1e-9, atol=0.0):
                raise BadModel(
                    f"[{name}.law] {key} is not [{name}] {key} in the unit of the command; run"
                    " 'workbench design' again"
                )


def _as_file(found: Design, units: _Units) -> _DesignFile:
    p, c, drive = found.plant, found.compensator, units.drive
    limit = found.command.limit if found.command else None

    def controller(one: Controller | None) -> _ControllerFile | None:
        return None if one is None else _controller_file(one, found.command, found.output, units)

    return _DesignFile(
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
        ),
        remarks=found.remarks,
        versions=found.versions,
        command=None if found.command is None else command_file(found.command, drive),
        present=None if found.present is None else present_file(found.present, limit, drive),
        recommendation=found.recommendation,
    )


def _gains_file(gains: PIDGains, units: _Units) -> _GainsFile:
    return _GainsFile(
        **{name: Estimate(getattr(gains, name), unit) for name, unit in _gain_units(units)}
    )


def _controller_file(
    one: Controller, command: Command | None, output: Output, units: _Units
) -> _ControllerFile:
    w_n, zeta = one.dominant
    reason = None if one.rate is not None else "no limit of force or command to keep"
    return _ControllerFile(
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


def _gain_units(units: _Units) -> list[tuple[str, str]]:
    times = [(name, "s") for name in ("T_i", "T_d", "eps")]
    return [("k_R", units.stiffness), *times, ("b", "1"), ("c", "1")]


def _from_file(found: _DesignFile, units: _Units) -> Design:
    p, c, drive = found.plant, found.compensator, units.drive
    mass, viscous = units.friction["m"], units.friction["F_vp"]
    return Design(
        card=found.card,
        motion=found.motion,
        plant=Linear(
            p.source,
            p.why,
            p.A,
            p.B,
            positive(p.h, "s", "plant.h"),
            None if p.m is None else in_unit(p.m, mass, "[plant.m]"),
            None if p.F_v is None else in_unit(p.F_v, viscous, "[plant.F_v]"),
        ),
        force=None if found.force is None else force_of(found.force, drive, "force"),
        rst=None if found.rst is None else _controller(found.rst, units, "rst"),
        pid=None if found.pid is None else _controller(found.pid, units, "pid"),
        refused=found.refused,
        recommended=found.recommended,
        compensator=CompensatorValues(
            number(c.N_c, "1", "compensator.N_c"),
            number(c.e_T, units.length, "compensator.e_T"),
            {name: _nine(e, name, units) for name, e in c.friction.items()},
            None if c.filters is None else filters_of(c.filters),
            None if c.filters is None else positive(c.filters.h, "s", "compensator.filters.h"),
        ),
        remarks=found.remarks,
        versions=found.versions,
        command=None if found.command is None else command_of(found.command, found.motion),
        present=None if found.present is None else present_of(found.present, drive, "present"),
        recommendation=found.recommendation,
    )


def _controller(one: _ControllerFile, units: _Units, where: str) -> Controller:
    dominant, rate = one.dominant, one.reference_rate
    if rate.value is None and not rate.reason:
        raise BadModel(f"[{where}.reference_rate] is null; it needs a 'reason'")
    at = f"{where}.reference_rate"
    return Controller(
        R=one.R,
        S=one.S,
        T=one.T,
        h=positive(one.h, "s", f"{where}.h"),
        dominant=(
            positive(dominant.w_n, "rad/s", f"{where}.dominant.w_n"),
            positive(dominant.zeta, "1", f"{where}.dominant.zeta"),
        ),
        auxiliary=one.auxiliary,
        margins=one.margins,
        rate=None if rate.value is None else positive(rate, units.speed, at),
        lag=number(one.reference_lag, "s", f"{where}.reference_lag"),
        overshoot=one.overshoot,
        missed=one.missed,
        gains=None if one.gains is None else _gains(one.gains, units, f"{where}.gains"),
        note=one.note,
        W=None if one.law is None else one.law.W,
    )


def _gains(found: _GainsFile, units: _Units, where: str) -> PIDGains:
    values = {
        name: number(getattr(found, name), unit, f"{where}.{name}")
        for name, unit in _gain_units(units)
    }
    return PIDGains(**values)


def _nine(found: Estimate, name: str, units: _Units) -> Estimate:
    where = f"[compensator.friction.{name}]"
    if name not in units.friction:
        raise BadModel(f"{where} is none of the nine: {', '.join(units.friction)}")
    if found.value is None and (not found.reason or found.assumed is None):
        raise BadModel(f"{where} is null; it needs a 'reason' and the value 'assumed' instead")
    return in_unit(found, units.friction[name], where)
