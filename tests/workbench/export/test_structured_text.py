"""Structured Text: parsed by a grammar of the standard, translated and run."""

import numpy as np
import pytest

from design.generated.exported import Precision, exported
from design.generated.structured_text import st_file, st_syntax
from design.program_run import ProgramRun
from tests.workbench.export.designs import NAMES, case, simulated
from tests.workbench.export.structured_text_runner import Blocks
from workbench.export.filled import filled


def blocks(name: str, precision: Precision = "double", controller: str = "rst") -> Blocks:
    (source,) = st_file(
        exported(case(name).design, controller, compensated=True, precision=precision), filled
    ).values()
    return Blocks(source)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("controller", ["rst", "pid"])
def test_the_block_gives_what_the_simulation_gave(name: str, controller: str) -> None:
    one = case(name)
    what = exported(one.design, controller, compensated=True)
    run, inputs = simulated(one, what, 4000)
    block = blocks(name, controller=controller).made(f"FB_{what.program.name}")
    names = [{"r": "r_ref"}.get(signal.name, signal.name) for signal in what.program.inputs]
    found = []
    for row in inputs.tolist():
        block(**dict(zip(names, row, strict=True)))
        found.append(block.values["u"])
    assert np.max(np.abs(np.array(found) - run.u)) < 1e-9 * np.max(np.abs(run.u))


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("name", NAMES)
def test_the_block_passes_its_own_test(name: str, precision: Precision) -> None:
    found = blocks(name, precision)
    test = found.made(next(one for one in found.by_name if one.endswith("_test")))
    test()
    assert test.values["passed"]
    assert test.values["worst"] < 1e-6


def test_its_own_test_finds_a_changed_constant() -> None:
    what = exported(case("limited").design, compensated=True)
    (source,) = st_file(what, filled).values()
    line = next(one for one in source.splitlines() if "F_sp : LREAL" in one)
    changed = source.replace(line, "F_sp : LREAL := 20.8;")
    test = Blocks(changed).made(f"FB_{what.program.name}_test")
    test()
    assert not test.values["passed"]


def test_a_reset_begins_anew() -> None:
    what = exported(case("limited").design, "rst", compensated=True)
    name = f"FB_{what.program.name}"
    block = blocks("limited").made(name)
    anew = ProgramRun(what.program, 0.02)
    for k in range(40):
        block(r_ref=0.1, y=0.001 * k, F_e=0.0)
    for k in range(40):
        block(r_ref=0.05, y=0.02, F_e=1.0, reset=k == 0)
        assert block.values["u"] == anew.step(0.05, 0.02, 1.0)


@pytest.mark.parametrize(
    ("value", "said"),
    [(1.0, "1.0"), (1e-05, "1.0E-5"), (-2.5e-30, "-2.5E-30"), (1e22, "1.0E22"), (0.1, "0.1")],
)
def test_numbers_are_real_literals(value: float, said: str) -> None:
    assert st_syntax("double").number(value) == said


@pytest.mark.slow
@pytest.mark.parametrize(
    ("machine", "controller", "scheduled", "samples"),
    [
        ("cascade", "p-pi", None, 3000),
        ("schedule", "pid", True, 4000),
        ("schedule", "p-pi", True, 4000),
    ],
)
def test_the_block_of_a_cascade_or_schedule_gives_what_the_simulation_gave(
    machine: str, controller: str, scheduled: bool | None, samples: int
) -> None:
    one = case(machine)
    what = exported(one.design, controller, scheduled=scheduled)
    run, inputs = simulated(one, what, samples)
    (source,) = st_file(what, filled).values()
    block = Blocks(source).made(f"FB_{what.program.name}")
    found = []
    for r, y in inputs.tolist():
        block(r_ref=r, y=y)
        found.append(block.values["u"])
    assert np.max(np.abs(np.array(found) - run.u)) < 1e-9 * np.max(np.abs(run.u))
