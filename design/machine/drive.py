"""What a drive runs, as results hold it: its command, the difference equation, a force loop, and
the controller that a machine has now.

Values are plain numbers in SI and in the unit of the command; a file has each with its unit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from design.drive_law import DriveLaw
from design.force_pi import ForcePI
from design.machine.codec import PLACEHOLDER, Around, InUnit, Output, Parameter, Through
from design.machine.readable import Display
from identification.errors import BadModel, BadSpecification
from identification.model.estimates import Estimate


@dataclass(frozen=True)
class ForceLoop:
    """C_F = k_i (1 + h z^-1/(T_i (1 - z^-1))), k_i [V/N], T_i [s], run every h [s]."""

    k_i: Annotated[float, InUnit("force_gain")]
    T_i: Annotated[float, InUnit("s", above_0=True)]
    h: Annotated[float, InUnit("s", above_0=True)]

    @property
    def pi(self) -> ForcePI:
        """Its controller, of any period."""
        return ForcePI(self.k_i, self.T_i)


@dataclass(frozen=True)
class ForceLoopFile(ForceLoop):
    """`ForceLoop` as a result has it; limit: of the command."""

    limit: Annotated[float | None, InUnit("command", for_readers=True)] = None
    equation: tuple[str, ...] = ()


FORCE_LOOP_UNITS = Through(
    ForceLoopFile,
    lambda found, _info: ForceLoop(found.k_i, found.T_i, found.h),
    lambda one, around: ForceLoopFile(
        **vars(one), limit=around.limit,
        equation=tuple(force_lines(one, around.limit, around.units)),
    ),
)  # fmt: skip


@dataclass(frozen=True)
class LawFile:
    """`DriveLaw` as a result has it; input: the unit of r and y; limit: of the output."""

    output: Output
    unit: str
    input: str
    h: Annotated[float, InUnit("s", above_0=True)]
    R: tuple[float, ...]
    S: tuple[float, ...]
    T: tuple[float, ...]
    W: tuple[float, ...]
    limit: Annotated[float | None, InUnit("command", for_readers=True)]
    equation: tuple[str, ...] = ()


def law_file(law: DriveLaw, around: Around) -> LawFile:
    units, output = around.units, around.output
    limit = around.limit if output == "command" else None
    lines = equation_lines(law, output, around.limit, units)
    return LawFile(
        output, getattr(units, output), units.position, law.h, law.R, law.S, law.T, law.W, limit,
        tuple(lines),
    )  # fmt: skip


def law_of(found: LawFile, units: Display, where: str) -> DriveLaw:
    """The law of a file; raises BadModel where it is none, or in other units."""
    for key, unit, ours in (
        ("unit", found.unit, getattr(units, found.output)),
        ("input", found.input, units.position),
    ):
        if unit != ours:
            raise BadModel(f"[{where}] {key} = {unit!r}, {ours!r} needed; run the command again")
    try:
        return DriveLaw(found.R, found.S, found.T, found.W, found.h)
    except BadSpecification as error:
        raise BadModel(f"[{where}] {error}") from None


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
class PresentFile:
    """`Present` as a result has it."""

    kind: str
    gains: Mapping[str, Parameter]
    law: LawFile
    force: Annotated[ForceLoop | None, FORCE_LOOP_UNITS] = None
    reference_rate: Annotated[float | None, InUnit("velocity", above_0=True)] = None


def _present_file(one: Present, around: Around) -> PresentFile:
    law = law_file(one.law, around._replace(output=one.output))
    return PresentFile(one.kind, one.gains, law, one.force, one.rate)


def _present(found: PresentFile, info: Any) -> Present:
    law = law_of(found.law, info.context.units, f"{PLACEHOLDER}.law")
    rate, output = found.reference_rate, found.law.output
    return Present(found.kind, found.gains, output, law, found.force, rate)


PRESENT_LOOP = Through(PresentFile, _present, _present_file)


def equation_lines(law: DriveLaw, output: Output, limit: float | None, units: Display) -> list[str]:
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


def force_lines(force: ForceLoop, limit: float | None, units: Display) -> list[str]:
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
