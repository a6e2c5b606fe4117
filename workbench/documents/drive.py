"""What a drive runs, as results hold it: its command, the difference equation, a force loop, and
the controller that a machine has now.

Here values are plain numbers in SI and in the unit of the command; the file's dataclasses have
every parameter with its unit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from design.drive_law import DriveLaw
from design.filters import CompensatorFilters, sampled
from identification.errors import BadModel, BadSpecification
from identification.model.estimates import Estimate
from identification.model.plant import over
from identification.signals.filters import Filter, slope_filter
from workbench.cards.parameter_units import Shown, in_unit, shown
from workbench.cards.units import Motion

Output = Literal["command", "force"]
NO_LIMIT = "the card gives no control_limit"


@dataclass(frozen=True)
class ForceLoop:
    """C_F = k_i (1 + h z^-1/(T_i (1 - z^-1))), k_i [V/N], T_i [s], run every h [s]."""

    k_i: float
    T_i: float
    h: float


@dataclass(frozen=True)
class Command:
    """What the drive takes: its unit, and the limit of its size in that unit, None for none.

    force_per_command: a motor's k_a [N per unit], 1 where the drive takes a force, None where an
    actuator stands between.
    """

    unit: str
    limit: float | None
    force_per_command: float | None


@dataclass(frozen=True)
class Present:
    """The controller that the machine has now, as its card names it, and the law that it runs.

    output: "command", or "force", the reference of its force loop. rate: of the reference [m/s].
    """

    kind: str
    gains: Mapping[str, Estimate]
    output: Output
    law: DriveLaw
    force: ForceLoop | None = None
    rate: float | None = None


@dataclass(frozen=True)
class LawFile:
    """`DriveLaw` as a result has it; input: the unit of r and y; limit: of the output."""

    output: Output
    unit: str
    input: str
    h: Estimate
    R: tuple[float, ...]
    S: tuple[float, ...]
    T: tuple[float, ...]
    W: tuple[float, ...]
    limit: Estimate | None
    equation: tuple[str, ...] = ()


@dataclass(frozen=True)
class ForceLoopFile:
    """`ForceLoop` as a result has it; limit: of the command."""

    k_i: Estimate
    T_i: Estimate
    h: Estimate
    limit: Estimate | None = None
    equation: tuple[str, ...] = ()


@dataclass(frozen=True)
class CommandFile:
    """`Command` as a result has it."""

    unit: str
    limit: Estimate | None
    force_per_command: Estimate | None


@dataclass(frozen=True)
class PresentFile:
    """`Present` as a result has it."""

    kind: str
    gains: Mapping[str, Estimate]
    law: LawFile
    force: ForceLoopFile | None = None
    reference_rate: Estimate | None = None


@dataclass(frozen=True)
class FilterFile:
    """A filter b(z^-1)/a(z^-1), a[0] = 1."""

    b: tuple[float, ...]
    a: tuple[float, ...]


@dataclass(frozen=True)
class FiltersFile:
    """The compensator's filters of figure 4 and its velocity (5), every h.

    A: of the position whose slope the velocity is, B: of the position in r - y, C: of F_comp;
    slope: from the positions behind A to the velocity.
    """

    A: FilterFile
    B: FilterFile
    C: FilterFile
    slope: tuple[float, ...]
    h: Estimate


def law_file(law: DriveLaw, output: Output, limit: float | None, units: Shown) -> LawFile:
    """The law as a result writes it; limit: of the command."""
    unit, bounded = getattr(units, output), output == "command" and limit is not None
    return LawFile(
        output=output,
        unit=unit,
        input=units.position,
        h=Estimate(law.h, "s"),
        R=law.R,
        S=law.S,
        T=law.T,
        W=law.W,
        limit=Estimate(limit, unit) if bounded else None,
        equation=tuple(equation_lines(law, output, limit, units)),
    )


def law_of(written: LawFile, units: Shown, where: str) -> DriveLaw:
    """The law of a file; raises BadModel where it is none, or in other units."""
    for key, unit, ours in (
        ("unit", written.unit, getattr(units, written.output)),
        ("input", written.input, units.position),
    ):
        if unit != ours:
            raise BadModel(f"[{where}] {key} = {unit!r}, {ours!r} needed; run the command again")
    h = positive(written.h, "s", f"{where}.h")
    try:
        return DriveLaw(written.R, written.S, written.T, written.W, h)
    except BadSpecification as error:
        raise BadModel(f"[{where}] {error}") from None


def force_file(force: ForceLoop, limit: float | None, units: Shown) -> ForceLoopFile:
    """The force loop as a result writes it; limit: of the command."""
    return ForceLoopFile(
        Estimate(force.k_i, units.force_gain),
        Estimate(force.T_i, "s"),
        Estimate(force.h, "s"),
        None if limit is None else Estimate(limit, units.command),
        tuple(force_lines(force, limit, units)),
    )


def force_of(found: ForceLoopFile, units: Shown, where: str) -> ForceLoop:
    """The force loop of a file; raises BadModel where it is none."""
    return ForceLoop(
        number(found.k_i, units.force_gain, f"{where}.k_i"),
        positive(found.T_i, "s", f"{where}.T_i"),
        positive(found.h, "s", f"{where}.h"),
    )


def command_file(found: Command, units: Shown) -> CommandFile:
    """The command as a result writes it."""
    per, limit = found.force_per_command, found.limit
    return CommandFile(
        found.unit,
        Estimate(limit, found.unit, reason=NO_LIMIT if limit is None else None),
        None if per is None else Estimate(per, over(units.force, found.unit)),
    )


def command_of(written: CommandFile, motion: Motion) -> Command:
    """The command of a file; raises BadModel where a number is of another kind."""
    unit, limit, per = written.unit, written.limit, written.force_per_command
    units = shown(motion == "rotary", unit)
    bounded = limit is not None and limit.value is not None
    return Command(
        unit,
        positive(limit, unit, "command.limit") if limit is not None and bounded else None,
        None if per is None else number(per, over(units.force, unit), "command.force_per_command"),
    )


def present_file(found: Present, limit: float | None, units: Shown) -> PresentFile:
    """The machine's own controller as a result writes it; limit: of the command."""
    return PresentFile(
        kind=found.kind,
        gains=found.gains,
        law=law_file(found.law, found.output, limit, units),
        force=None if found.force is None else force_file(found.force, limit, units),
        reference_rate=None if found.rate is None else Estimate(found.rate, units.velocity),
    )


def present_of(written: PresentFile, units: Shown, where: str) -> Present:
    """The machine's own controller of a file; raises BadModel where it is none."""
    rate = written.reference_rate
    return Present(
        kind=written.kind,
        gains=written.gains,
        output=written.law.output,
        law=law_of(written.law, units, f"{where}.law"),
        force=None if written.force is None else force_of(written.force, units, f"{where}.force"),
        rate=None if rate is None else positive(rate, units.velocity, f"{where}.reference_rate"),
    )


def filters_file(filters: CompensatorFilters, h: float) -> FiltersFile:
    """The compensator's filters as a result writes them; h [s]."""
    A, B, C = (FilterFile(f.b, f.a) for f in (filters.velocity, filters.error, filters.force))
    return FiltersFile(A, B, C, slope_filter(h, filters.N_d).b, Estimate(h, "s"))


def filters_of(written: FiltersFile) -> CompensatorFilters:
    """The compensator's filters of a file; raises BadModel where they are none."""
    h = positive(written.h, "s", "compensator.filters.h")
    A, B, C = (Filter(f.b, f.a) for f in (written.A, written.B, written.C))
    found = CompensatorFilters(A, B, C, len(written.slope))
    try:
        slope = slope_filter(h, found.N_d).b
        for one in (A, B, C):
            sampled(one)
    except BadSpecification as error:
        raise BadModel(f"[compensator.filters] {error}") from None
    if not np.allclose(slope, written.slope, rtol=1e-9):
        raise BadModel(
            f"[compensator.filters] slope = {written.slope}: the velocity (5) at h = {h:g} s needs"
            f" {slope}"
        )
    return found


def equation_lines(law: DriveLaw, output: Output, limit: float | None, units: Shown) -> list[str]:
    """The difference equation as it is programmed; k counts its samples.

    limit: of the command. F_comp, the compensator's force, is 0 without it.
    """
    terms = [
        *_terms(law.T, "r"),
        *_terms([-one for one in law.R], "y"),
        *_terms([0.0, *(w - s for w, s in zip(law.W[1:], law.S[1:], strict=True))], "c"),
        *_terms([0.0, *(-w for w in law.W[1:])], "c_free"),
    ]
    unit, length = getattr(units, output), units.position
    text = " ".join(terms).removeprefix("+ ") or "0"
    within = "" if limit is None else f", within +- {limit:.6g} {units.command}"
    first = [
        f"every {law.h:.6g} s, r and y in {length}, c in {unit}:",
        f"c_free[k] = {text}",
    ]
    if output == "command":
        part = "F_comp[k]" if unit == units.force else "F_comp[k]/k_a"
        return [*first, f"u[k] = c_free[k] + {part}{within}", f"c[k] = u[k] - {part}"]
    return [
        *first,
        "F_ref[k] = c_free[k] + F_comp[k], the reference of the force loop",
        "c[k] = c_free[k]; where the command is clipped, F[k] + (u[k] - I[k])/k_i - F_comp[k]",
    ]


def force_lines(force: ForceLoop, limit: float | None, units: Shown) -> list[str]:
    """The force loop as it is programmed; j counts its samples, limit: of the command."""
    within = "" if limit is None else f", within +- {limit:.6g} {units.command}"
    return [
        f"every {force.h:.6g} s, u in {units.command}: e[j] = F_ref - F[j]",
        f"u[j] = {force.k_i:.9g} e[j] + I[j]{within}",
        f"I[j+1] = I[j] + {force.k_i * force.h / force.T_i:.9g} e[j]; I rests while u is"
        " clipped and e would drive it further out",
    ]


def _terms(values: Sequence[float], name: str) -> list[str]:
    return [
        f"{'-' if value < 0 else '+'} {abs(value):.9g} {name}[k{f'-{back}' if back else ''}]"
        for back, value in enumerate(values)
        if value != 0.0
    ]


def number(found: Estimate, unit: str, where: str) -> float:
    """A chosen value in `unit`; raises BadModel where there is none, or in another kind of unit."""
    value = in_unit(found, unit, f"[{where}]").value
    if value is None:
        raise BadModel(f"[{where}] is null; a number in {unit!r} needed")
    return value


def positive(found: Estimate, unit: str, where: str) -> float:
    """As `number`, above 0."""
    value = number(found, unit, where)
    if not (value > 0 and np.isfinite(value)):
        raise BadModel(f"[{where}] {value:g} {unit}: must be > 0")
    return value
