"""The exported C of every design on the shipped sets against the simulation, and its time.

Run: python benchmarks/exported.py [CARD ...]. Needs gcc or clang, takes both where they are there;
measured sets are taken where WORKBENCH_DATA holds them.

Prints, for every design that `workbench design` makes of a card's training logs, in how many of a
million steps of the simulated loop the command of the exported C differs in any bit, by compiler;
the time of a step; and what a step needs in operations, of which a Cortex-M4F's cycles follow.
"""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

import numpy as np

from design.closed_loop.driven_loop import run_driven
from design.controller_program import ProgramUnits, controller_program
from design.controllers.design import design
from design.drive_law import drive_law
from design.generated.c import c_files
from design.generated.exported import Exported, Precision, exported
from design.identified.identify_logs import identify_logs
from design.machine.design import Design
from design.machine.model import Model
from design.machine.source import Source
from design.polynomial import from_roots
from design.program import (
    Assign,
    Choice,
    Element,
    Expression,
    Operation,
    Program,
    Repeat,
    Statement,
    Variable,
    parts,
)
from design.rst import RST
from design.simulated.record import record
from identification.arrays import Array
from identification.errors import UserError
from workbench.cards.card import load_card
from workbench.export.filled import filled
from workbench.logs.sources import DATA_VARIABLE, Sources, card_path, read_sources

STEPS = 1_000_000
DWELL = 2.0  # s between the reference's steps
ROUNDS = 5
# The dialect of each compiler and the machine's own instructions: multiply and add in one among
# them, which the source has to forbid by itself.
BUILDS = {
    "gcc -O0": ("gcc", "-std=c99", "-O0"),
    "gcc -O2": ("gcc", "-O2", "-march=native"),
    "clang -O0": ("clang", "-std=c99", "-O0"),
    "clang -O2": ("clang", "-O2", "-march=native"),
}
DRIVER = """
#include "{name}.h"
void drive(long n, {name}_real y_0, const {name}_real *in, {name}_real *out);
void drive(long n, {name}_real y_0, const {name}_real *in, {name}_real *out)
{{
    {name}_state s;
    long k;
    {name}_reset(&s, y_0);
    for (k = 0; k < n; ++k) {{
        out[k] = {name}_step(&s, {given});
    }}
}}
"""
CARDS = (
    "demo", "paper_table1", "paper_table1_rich", "paper_table2", "paper_table3", "emps",
    "friction_backlash", "pneumatic_seals", "xl330_servo",
)  # fmt: skip
# Cycles of a Cortex-M4F: its manual (ARM DDI 0439) for what the FPU does in single precision with
# operands loaded and results stored (2 each, 1 where they follow another); for double precision
# what gcc's library takes, rounded up (it has no double in hardware).
SINGLE_CYCLES = {"+": 1, "-": 1, "*": 1, "/": 14, "compare": 4, "move": 2, "load": 2, "branch": 3}
DOUBLE_CYCLES = {
    "+": 80, "-": 80, "*": 70, "/": 350, "compare": 50, "move": 4, "load": 3, "branch": 3,
}  # fmt: skip
CLOCK = 168e6  # Hz
NUMBERS = count()
# An RST of order 4 with an integrator, for the time of its step.
ORDER_4 = RST(
    R=1800.0 * from_roots([0.97, 0.9, 0.4, 0.1]),
    S=from_roots([1.0, 0.5, 0.3, 0.2]),
    T=1800.0 * from_roots([0.97, 0.9, 0.4, 0.1]),
    h=1e-3,
)


@dataclass(frozen=True)
class Made:
    """A design with its machine."""

    card: str
    model: Model
    design: Design


def made(cards: Sequence[str]) -> Iterator[Made]:
    """The designs of the cards' training logs; the reason is printed where there is none."""
    for card in cards:
        try:
            model = identify_logs(sources_of(card).logs).model
            yield Made(card, model, design(model))
        except UserError as error:
            print(f"{card}: no design: {error}")


def sources_of(name: str) -> Sources:
    """A recipe's log, or the training logs of a measured set."""
    card = load_card(card_path(name))
    if card.recipe is not None:
        log = record(name, card.recipe)
        return Sources(card, card.rig(), (Source(log, f"{name}.csv", "0" * 64, len(log)),), ())
    folder = Path(os.environ.get(DATA_VARIABLE, "")) / name
    if not folder.is_dir():
        raise UserError(f"{DATA_VARIABLE} has no folder {name}")
    return read_sources([str(folder / file) for file in card.split["train"]], name)


def simulated(one: Made, what: Exported) -> tuple[Array, Array, float]:
    """The command of a million simulated steps, what the code is given (n, k), and the start."""
    rng = np.random.default_rng(1)
    low, high = one.model.travel
    h, size = what.loop.h, high - low
    dwell = max(1, round(DWELL / h))
    r = np.repeat(rng.uniform(-0.25, 0.25, STEPS // dwell + 1) * size, dwell)[:STEPS]
    r = r + 0.05 * size * np.sin(3.0 * h * np.arange(STEPS))
    run = run_driven(one.model, what.loop, r, rng)
    columns = {"r": r, "y": run.y_measured, "F_e": run.F_measured}
    inputs = np.stack([columns[signal.name] for signal in what.program.inputs], axis=1)
    return run.u, np.ascontiguousarray(inputs), float(r[0])


def library(what: Exported, folder: Path, build: str) -> ctypes.CDLL:
    """The exported code with a driver, compiled."""
    name, width = what.program.name, len(what.program.inputs)
    for file, text in c_files(what, filled).items():
        (folder / file).write_text(text)
    given = ", ".join(f"in[{width} * k + {at}]" for at in range(width))
    (folder / "driver.c").write_text(DRIVER.format(name=name, given=given))
    target = folder / f"{next(NUMBERS)}.so"  # a library of a name once loaded is not loaded again
    sources = [str(folder / f"{name}.c"), str(folder / "driver.c")]
    command = [*BUILDS[build], "-shared", "-fPIC", *sources, "-o", str(target)]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(target))


def driven(code: ctypes.CDLL, inputs: Array, y_0: float) -> tuple[Array, float]:
    """What the code gives for the inputs (n, k), and the shortest time of a step [ns]."""
    out, shortest = np.empty(len(inputs), dtype=inputs.dtype), np.inf
    real = ctypes.c_float if inputs.dtype == np.float32 else ctypes.c_double
    for _ in range(ROUNDS):
        begin = time.thread_time_ns()
        code.drive(
            ctypes.c_long(len(inputs)),
            real(y_0),
            inputs.ctypes.data_as(ctypes.c_void_p),
            out.ctypes.data_as(ctypes.c_void_p),
        )
        shortest = min(shortest, (time.thread_time_ns() - begin) / len(inputs))
    return out, shortest


def compared(one: Made, builds: Sequence[str], folder: Path) -> Iterator[str]:
    """A line for every controller of a design, with the compensator and without."""
    chosen = [*one.design.controllers, *(["present"] if one.design.present else [])]
    for controller in chosen:
        for compensated in (True, False):
            what = exported(one.design, controller, compensated=compensated)
            u, inputs, y_0 = simulated(one, what)
            cells, fastest = [], np.inf
            for build in builds:
                found, shortest = driven(library(what, folder, build), inputs, y_0)
                cells.append(f"{np.count_nonzero(found.view(np.int64) != u.view(np.int64)):10d}")
                fastest = min(fastest, shortest)
            kind = controller + (" + compensator" if compensated else "")
            degree = len(what.loop.law.S) - 1
            yield (
                f"{one.card:18} {kind:22} {degree:6d} {what.program.ratio:5d}"
                f" {np.max(np.abs(u)):8.3g} {what.program.output.unit:3}"
                f" {' '.join(cells)} {fastest:8.1f}"
            )


def order_four(one: Made, precision: Precision) -> Exported:
    """`ORDER_4` above the design's force loop, beside its compensator, all at one rate."""
    what = exported(one.design, "rst", compensated=True, precision=precision)
    assert what.loop.force is not None
    force = replace(what.loop.force, h=ORDER_4.h)
    loop = replace(what.loop, law=drive_law(ORDER_4, 0.1), force=force, limit=5.0)
    program = controller_program("order_4", loop.servo, loop.h, ProgramUnits())
    return replace(what, program=program, loop=loop)


def operations(statements: Iterable[Statement]) -> Counter[str]:
    """Operations of a step along its dearest path, by kind."""
    total: Counter[str] = Counter()
    for one in statements:
        match one:
            case Assign(target, value):
                total += counted(value)
                total["move"] += 1
                if isinstance(target, Element):
                    total += counted(target.index)
            case Choice(condition, then, otherwise):
                ways = [operations(way) for way in (then, otherwise)]
                total += counted(condition) + max(ways, key=lambda way: cycles(way, DOUBLE_CYCLES))
                total["branch"] += 1
            case Repeat(_, rounds, body):
                inside = operations(body)
                total += Counter({kind: rounds * number for kind, number in inside.items()})
                total["branch"] += rounds
    return total


def counted(value: Expression) -> Counter[str]:
    """Operations in an expression, and what it reads; indices are addresses, no arithmetic."""
    found: Counter[str] = Counter()
    skipped = {id(inner) for one in parts(value) if isinstance(one, Element)
               for inner in parts(one.index)}  # fmt: skip
    for one in parts(value):
        if id(one) in skipped:
            continue
        if isinstance(one, Operation):
            kind = one.operator
            if kind in ("min", "max", "abs", "<", "<=", ">", ">=", "==", "!="):
                found["compare"] += 1
            elif kind in ("+", "-", "*", "/"):
                found[kind] += 1
        elif isinstance(one, Element | Variable) or hasattr(one, "name"):
            found["load"] += 1
    return found


def cycles(needed: Counter[str], each: dict[str, int]) -> int:
    """Cycles of these operations."""
    return sum(each[kind] * number for kind, number in needed.items())


def timed(one: Made, folder: Path, build: str) -> None:
    """Print the time of a step of order 4 here, its operations, and a Cortex-M4F's time."""
    rng = np.random.default_rng(2)
    print(f"\none step, RST of order 4 with force loop and compensator ({build})")
    program: Program | None = None
    both: tuple[Precision, ...] = ("double", "single")
    for precision in both:
        what = order_four(one, precision)
        program = what.program
        inputs = 0.01 * rng.standard_normal((STEPS, len(program.inputs)))
        inputs[:, 1] = 0.05 * np.sin(1e-3 * np.arange(STEPS))
        kind = np.float32 if precision == "single" else np.float64
        _, shortest = driven(library(what, folder, build), inputs.astype(kind), 0.0)
        print(f"{precision:8} {shortest:6.1f} ns here")
    assert program is not None
    needed = operations(program.statements)
    print("operations on the dearest path: " + ", ".join(f"{n} {k}" for k, n in needed.items()))
    for name, each in (("single", SINGLE_CYCLES), ("double", DOUBLE_CYCLES)):
        number = cycles(needed, each)
        print(
            f"Cortex-M4F at 168 MHz, {name}: about {number} cycles, {1e6 * number / CLOCK:.1f} us"
        )


def main(cards: Sequence[str]) -> None:
    """Print the table."""
    builds = [build for build, command in BUILDS.items() if shutil.which(command[0])]
    print(f"steps of {STEPS} whose command differs in any bit from the simulation's")
    heads = " ".join(f"{build:>10}" for build in builds)
    print(f"{'card':18} {'controller':22} {'degree':>6} {'ratio':>5} {'largest u':>12} {heads}"
          "  ns/step")  # fmt: skip
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        every = []
        for one in made(cards):
            every.append(one)
            for line in compared(one, builds, folder):
                print(line, flush=True)
        above = [one for one in every if one.design.force is not None]
        if above and builds:
            timed(above[0], folder, "gcc -O2" if "gcc -O2" in builds else builds[-1])


if __name__ == "__main__":
    main(sys.argv[1:] or CARDS)
