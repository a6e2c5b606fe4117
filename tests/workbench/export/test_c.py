"""The exported C against the simulation, in every bit."""

import ctypes
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.exported import BUILDS
from design.generated.c import c_files
from design.generated.exported import Exported, Precision, exported
from identification.arrays import Array
from tests.workbench.export.designs import NAMES, START, case, simulated
from workbench.export.filled import filled

MANY, FEWER = 1_000_000, 100_000
MILLION = ("limited", "emps")  # benchmarks/exported.py takes as many steps of every shipped set
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror")
DRIVER = """
#include "{name}.h"
void drive(long n, {name}_real y_0, const {name}_real *in, {name}_real *out);
int tested(void);
void drive(long n, {name}_real y_0, const {name}_real *in, {name}_real *out)
{{
    {name}_state s;
    long k;
    {name}_reset(&s, y_0);
    for (k = 0; k < n; ++k) {{
        out[k] = {name}_step(&s, {given});
    }}
}}
int tested(void) {{ return {name}_self_test(); }}
"""


def library(what: Exported, folder: Path, build: str) -> ctypes.CDLL:
    """The controller with a driver, compiled; skipped where there is no such compiler."""
    command = BUILDS[build]
    if shutil.which(command[0]) is None:
        pytest.skip(f"no {command[0]} on PATH")
    name, count = what.program.name, len(what.program.inputs)
    for file, text in c_files(what, filled).items():
        (folder / file).write_text(text)
    given = ", ".join(f"in[{count} * k + {at}]" for at in range(count))
    (folder / "driver.c").write_text(DRIVER.format(name=name, given=given))
    target = folder / f"{build.replace(' ', '')}.so"
    sources = [str(folder / f"{name}.c"), str(folder / "driver.c")]
    # gcc says of the pragma that it does not know what the other one is for.
    known = ["-Wno-unknown-pragmas"]
    subprocess.run(
        [*command, *STRICT, *known, "-shared", "-fPIC", *sources, "-o", str(target)], check=True
    )
    return ctypes.CDLL(str(target))


def driven(code: ctypes.CDLL, inputs: Array) -> Array:
    """What the compiled code gives for the inputs (n, k)."""
    out = np.empty(len(inputs))
    code.drive(
        ctypes.c_long(len(inputs)),
        ctypes.c_double(START),
        inputs.ctypes.data_as(ctypes.c_void_p),
        out.ctypes.data_as(ctypes.c_void_p),
    )
    return out


@pytest.mark.slow
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("controller", ["rst", "pid"])
@pytest.mark.parametrize("compensated", [True, False])
def test_its_steps_are_the_simulations_in_every_bit(
    compiler: str, name: str, controller: str, compensated: bool, tmp_path: Path
) -> None:
    one = case(name)
    what = exported(one.design, controller, compensated=compensated)
    run, inputs = simulated(one, what, MANY if name in MILLION else FEWER)
    assert np.ptp(run.u) > 0.1
    for build in (one for one in BUILDS if one.startswith(compiler)):
        found = driven(library(what, tmp_path, build), inputs)
        assert np.array_equal(found.view(np.int64), run.u.view(np.int64)), build


@pytest.mark.slow
def test_a_compensator_of_the_excess_alone_is_the_same_program(tmp_path: Path) -> None:
    one = case("paper_table3")
    own = replace(one.design.compensator, e_T=3e-4, N_c=1.05, excess=True)
    design = replace(one.design, compensator=own)
    what = exported(design, "rst", compensated=True)
    assert "F_cp, F_cn 0" in " ".join(what.remarks)
    run, inputs = simulated(one, what, FEWER)
    found = driven(library(what, tmp_path, "gcc -O2"), inputs)
    assert np.array_equal(found.view(np.int64), run.u.view(np.int64))
    whole = exported(one.design, "rst", compensated=True)
    assert not np.array_equal(simulated(one, whole, FEWER)[0].u, run.u)


@pytest.mark.slow
def test_a_limited_command_reaches_its_limit() -> None:
    one = case("limited")
    run, _ = simulated(one, exported(one.design, "rst", compensated=True), 20_000)
    assert np.max(np.abs(run.u)) == 0.2


@pytest.mark.slow
@pytest.mark.parametrize("build", BUILDS)
@pytest.mark.parametrize("precision", ["double", "single"])
@pytest.mark.parametrize("name", ["limited", "emps"])
def test_the_code_passes_its_own_test(
    build: str, precision: Precision, name: str, tmp_path: Path
) -> None:
    what = exported(case(name).design, compensated=True, precision=precision)
    assert library(what, tmp_path, build).tested() == 0


@pytest.mark.parametrize("precision", ["double", "single"])
def test_its_own_test_finds_a_changed_constant(precision: Precision, tmp_path: Path) -> None:
    what = exported(case("limited").design, compensated=True, precision=precision)
    assert library(what, tmp_path, "gcc -O0").tested() == 0
    source = tmp_path / f"{what.program.name}.c"
    text = source.read_text()
    line = next(one for one in text.splitlines() if " F_sp = " in one)
    source.write_text(text.replace(line, line.replace(" = ", " = 1.0000003f * ")))
    target = tmp_path / "changed.so"
    subprocess.run(
        ["gcc", "-shared", "-fPIC", str(source), str(tmp_path / "driver.c"), "-o", str(target)],
        check=True,
    )
    assert ctypes.CDLL(str(target)).tested() > 0


@pytest.mark.parametrize("lost", [np.nan, np.inf])
def test_a_lost_sample_is_taken_as_it_last_was(lost: float, tmp_path: Path) -> None:
    what = exported(case("limited").design, compensated=True)
    inputs = what.test.inputs[:400].copy()
    inputs[100] = inputs[99]
    code = library(what, tmp_path, "gcc -O2")
    repaired = driven(code, inputs)
    for at in range(inputs.shape[1]):
        holed = inputs.copy()
        holed[100, at] = lost
        assert np.array_equal(driven(code, holed), repaired)
    holed[0] = lost  # before any good one: at rest where it was begun
    assert np.all(np.isfinite(driven(code, holed)))
    header = " ".join(c_files(what, filled)[f"{what.program.name}.h"].replace(" * ", "").split())
    assert "An input that is infinite or no number (NaN: a lost sample) is taken as it" in header


def test_what_is_nowhere_read_is_not_in_the_code(tmp_path: Path) -> None:
    design = case("emps").design  # a motor, whose force only the friction of sliding asks for
    own = replace(design.compensator, excess=True)
    what = exported(replace(design, compensator=own), compensated=True)
    assert library(what, tmp_path, "gcc -O2").tested() == 0  # it compiles with -Werror


def test_it_needs_no_header_and_allocates_nothing(tmp_path: Path) -> None:
    files = c_files(exported(case("limited").design, compensated=True), filled)
    for text in files.values():
        included = [line for line in text.splitlines() if line.startswith("#include")]
        assert all("<" not in line for line in included)
        assert "alloc" not in text.replace("Nothing is allocated", "")


@pytest.mark.slow
def test_c_plus_plus_takes_the_header(tmp_path: Path) -> None:
    if shutil.which("g++") is None:
        pytest.skip("no g++ on PATH")
    what = exported(case("emps").design, compensated=True)
    for file, text in c_files(what, filled).items():
        (tmp_path / file).write_text(text)
    (tmp_path / "main.cpp").write_text(f'#include "{what.program.name}.h"\n')
    subprocess.run(
        ["g++", "-Wall", "-Werror", "-fsyntax-only", str(tmp_path / "main.cpp")], check=True
    )


@pytest.mark.slow
@pytest.mark.parametrize("build", list(BUILDS))
def test_the_code_of_a_cascade_gives_the_simulation_in_every_bit(
    build: str, tmp_path: Path
) -> None:
    one = case("cascade")
    what = exported(one.design, "p-pi")
    run, inputs = simulated(one, what, 20_000)
    code = library(what, tmp_path, build)
    assert code.tested() == 0
    assert np.array_equal(driven(code, inputs), run.u)


@pytest.mark.slow
@pytest.mark.parametrize("build", list(BUILDS))
@pytest.mark.parametrize("controller", ["pid", "p-pi"])
def test_the_code_of_a_schedule_gives_the_simulation_in_every_bit(
    build: str, controller: str, tmp_path: Path
) -> None:
    one = case("schedule")
    what = exported(one.design, controller, scheduled=True)
    run, inputs = simulated(one, what, FEWER)
    code = library(what, tmp_path, build)
    np.testing.assert_array_equal(driven(code, inputs), run.u)
    assert code.tested() == 0
