"""What is exported: a design's controller as a program, with the vector that tests it."""

import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from typing import Any, Literal

import numpy as np

from design.closed_loop.driven_loop import DrivenLoop
from design.controller_program import ProgramUnits, controller_program
from design.controllers.cascade import filter_words
from design.feed_forward import FeedForward
from design.filters import filters_at
from design.machine.design import Design, Structure
from design.program import (
    Assign,
    Choice,
    Constant,
    Element,
    Expression,
    Program,
    Repeat,
    Statement,
    Variable,
    flat,
    parts,
)
from design.program_run import SelfTest, self_test
from design.servo import Compensation
from identification.errors import BadModel

Precision = Literal["double", "single"]
REAL: Mapping[Precision, type[np.floating[Any]]] = {"double": np.float64, "single": np.float32}
BEFORE_DIGIT = "servo_"  # before a name that begins with no letter
LONGEST_NAME = 31  # characters that every linker and PLC distinguishes
DESIGN_AGAIN = "run 'workbench design' again"


@dataclass(frozen=True)
class Exported:
    """A controller as its machine runs it.

    remarks: what to know of it, a line each; design: the values behind the program.
    """

    program: Program
    loop: DrivenLoop
    design: Design
    controller: str
    remarks: tuple[str, ...]
    precision: Precision = "double"

    @cached_property
    def test(self) -> SelfTest:
        """Inputs and outputs of a machine that rounds to the precision."""
        values = self.design.compensator.value
        return self_test(self.program, values.friction, values.e_T, REAL[self.precision])


def exported(
    found: Design, controller: str | None = None, *, compensated: bool | None = None,
    scheduled: bool | None = None, precision: Precision = "double", name: str | None = None,
) -> Exported:  # fmt: skip
    """The controller of the design, by default the recommended one, as a program.

    controller: "rst", "pid", "p-pi" or "present". compensated: with the friction compensator, by
    default as recommended, and beside all others but the present one and a P-PI. scheduled: with
    its gain schedule, by default where that is recommended. Raises BadModel where the design has no
    such controller or schedule, recommends none, or is of a version that does not say what the
    drive runs.
    """
    chosen, choice = controller or found.recommended, found.recommendation
    if chosen == "none":
        have = ", ".join(found.controllers)
        raise BadModel(f"the design recommends no controller; choose one by --controller ({have})")
    loop = _with_schedule(found, chosen, _loop_of(found, chosen), scheduled)
    if compensated is None:
        compensated = chosen not in ("present", "p-pi")
        if choice is not None and choice.controller == chosen:
            compensated = choice.compensator
        compensated = compensated and loop.schedule is None
    if compensated and isinstance(loop.compensation, FeedForward):
        raise BadModel("a P-PI cascade feeds friction forward, and takes no compensator beside it")
    if compensated:
        if loop.direct:
            raise BadModel("a command without a force loop takes no compensator beside it")
        filters = found.compensator.filters or filters_at(loop.law.h)
        loop = replace(loop, compensation=Compensation(found.compensator.value, filters))
    assert found.command is not None
    units = found.display
    own = ProgramUnits(units.position, units.force, found.command.unit)
    program = _without_unread(
        controller_program(identifier(name or found.card), loop.servo, loop.h, own, loop.k_a or 0.0)
    )
    return Exported(program, loop, found, chosen, _remarks(found, chosen, loop), precision)


def _without_unread(program: Program) -> Program:
    """The program without locals that are set and nowhere read, and constants that only these
    had."""
    kept = program.statements
    while True:
        parts_read = (part for one in flat(kept) for part in _parts_of(one))
        read = {program.output.name, *(p.name for p in parts_read if isinstance(p, Variable))}
        unread = {one.name for one in program.locals} - read
        less = tuple(
            one for one in kept
            if not (isinstance(one, Assign) and getattr(one.target, "name", "") in unread)
        )  # fmt: skip
        if less == kept:
            break
        kept = less
    named = {
        part.name for one in flat(kept) for part in _parts_of(one) if isinstance(part, Constant)
    }
    return replace(
        program, statements=kept,
        locals=tuple(one for one in program.locals if one.name not in unread),
        constants=tuple(one for one in program.constants if one.name in named),
    )  # fmt: skip


def _parts_of(one: Statement) -> Iterator[Expression]:
    """What a statement reads, and what it counts by."""
    match one:
        case Assign(target, value):
            yield from parts(value)
            if isinstance(target, Element):
                yield from parts(target.index)
        case Choice(condition):
            yield from parts(condition)
        case Repeat(index):
            yield index


def _with_schedule(
    found: Design, chosen: str, loop: DrivenLoop, scheduled: bool | None
) -> DrivenLoop:
    """The loop with the gain schedule of its controller, where that is asked or recommended."""
    table, one, own = found.schedule, found.controllers.get(chosen), found.scheduled(chosen)
    if scheduled is None:
        scheduled = own is not None and own.recommended
    if not scheduled:
        return loop
    if table is None or own is None or one is None or found.command is None:
        raise BadModel(
            f"the design has no gain schedule of {chosen!r}: workbench design MODEL --schedule"
        )
    structure: Structure = "pid" if chosen == "pid" else "p-pi"
    return replace(loop, schedule=table.of(structure, one, found.command))


def _loop_of(found: Design, chosen: str) -> DrivenLoop:
    """The chosen controller without the compensator."""
    if found.command is None:
        raise BadModel(f"the design does not say what the drive takes; {DESIGN_AGAIN}")
    limit, k_a = found.command.limit, found.command.force_per_command
    if chosen == "present":
        if found.present is None:
            raise BadModel(
                "the design has no present controller; name it in the card's [controller]"
            )
        now, direct = found.present, found.present.output == "command" and k_a is None
        return DrivenLoop(now.law, now.force, now.rate, limit, None, k_a, direct)
    one = found.controllers.get(chosen)
    if one is None:
        again = f"workbench design MODEL --structure {chosen} makes one"
        reason = found.refused.get(chosen, again)
        raise BadModel(f"the design has no controller {chosen!r}: {reason}")
    return DrivenLoop(
        one.law(found.command), found.force, one.rate, limit, one.feed_forward, k_a,
        acceleration=one.acceleration,
    )  # fmt: skip


def _remarks(found: Design, chosen: str, loop: DrivenLoop) -> tuple[str, ...]:
    """What to know before it runs on a machine."""
    out = []
    assert found.command is not None
    if chosen not in (found.recommended, "present"):
        out.append(f"the design recommends {found.recommended!r}, not this controller")
    choice = found.recommendation
    if (one := found.p_pi) is not None and chosen == "p-pi" and one.series is not None:
        out.append(f"R, S and T hold the {filter_words(one.series)}")
    beside = isinstance(loop.compensation, Compensation)
    if choice is not None and choice.controller == chosen and choice.compensator != beside:
        how = "with" if choice.compensator else "without"
        out.append(f"the design recommends it {how} the compensator")
    if beside and found.compensator.excess:
        out.append(
            "compensator: F_sp and F_sn are what breakaway needs beyond sliding, F_cp, F_cn 0"
        )
    if loop.schedule is not None and (own := found.scheduled(chosen)):
        over = f"scheduled over the {loop.schedule.over}, {len(loop.schedule.at)} points"
        out.append(f"{over}: {own.why}")
    if found.command.limit is None:
        out.append("no limit of the command is known: it is not clipped")
    if beside and found.compensator.assumed:
        names = ", ".join(found.compensator.assumed)
        out.append(f"compensator: assumed, not identified: {names}")
    return tuple(out)


def identifier(name: str) -> str:
    """A name as an identifier of C and of IEC 61131-3: no doubled or outer "_", no leading digit.

    Raises BadModel where nothing is left of it.
    """
    found = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")[:LONGEST_NAME].rstrip("_")
    if not found:
        raise BadModel(f"the name {name!r} has no letter or digit; give one by --name")
    return found if found[0].isalpha() else BEFORE_DIGIT + found


WIDEST = 96  # characters of a line of numbers
KEPT_BLANK = "\0"  # a blank within a value, at which no line ends


def rows(values: Iterable[str]) -> list[str]:
    """Values with commas between them, in lines."""
    whole = ", ".join(value.replace(" ", KEPT_BLANK) for value in values)
    lines = textwrap.wrap(whole, WIDEST, break_long_words=False, break_on_hyphens=False)
    return [line.replace(KEPT_BLANK, " ") for line in lines]


def title_of(what: Exported) -> str:
    """One line that says what a file is."""
    kind = {"rst": "RST", "pid": "PID", "p-pi": "P-PI", "present": "present"}[what.controller]
    beside = " with friction compensator" if what.loop.compensation else ""
    if isinstance(what.loop.compensation, FeedForward):
        beside = " with feed-forward of acceleration and friction"
    return f"{what.design.card}: {kind} controller{beside}"


def heading_of(what: Exported) -> dict[str, Any]:
    """What every file says of a controller."""
    program = what.program
    return {"title": title_of(what), "lead": lead_of(what), "name": program.name, "h": program.h}


def lead_of(what: Exported) -> Sequence[str]:
    """What to know of a file, in lines."""
    program = what.program
    turns = (
        f", its position controller at every {program.ratio}th call" if program.ratio > 1 else ""
    )
    return (
        f"Made by servo-workbench {version('servo-workbench')} from a design of this machine.",
        f"Runs every {program.h:.12g} s{turns}.",
        "Letters are the paper's: r reference, y position, F_e force on the body, u command;",
        "R, S, T polynomials in z^-1; v velocity, e_y error; F_c, F_s, dv of Karnopp's friction.",
        *what.remarks,
    )
