"""The FMU: valid by fmpy, compiled from its source, and the simulation's commands in fmpy."""

import shutil
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from fmpy import extract, simulate_fmu
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu

from design.generated.exported import exported
from tests.workbench.export.designs import START, case, simulated
from workbench.export.fmu import fmu_file

N = 3000


def packed(name: str, folder: Path, *, compensated: bool = True) -> Path:
    ((file, content),) = fmu_file(exported(case(name).design, compensated=compensated)).items()
    (folder / file).write_bytes(content)
    return folder / file


@pytest.fixture
def compiled(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Path]:
    """The FMU of a case, unpacked, with its library."""
    if shutil.which("gcc") is None:
        pytest.skip("no gcc on PATH")
    folder = Path(extract(packed(request.param, tmp_path), unzipdir=tmp_path / "fmu"))
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build")
    yield folder


@pytest.mark.parametrize("name", ["limited", "paper_table2", "emps"])
@pytest.mark.parametrize("compensated", [True, False])
def test_it_is_valid(name: str, compensated: bool, tmp_path: Path) -> None:
    assert validate_fmu(str(packed(name, tmp_path, compensated=compensated))) == []


@pytest.mark.slow
@pytest.mark.parametrize("compiled", ["limited", "paper_table2", "emps"], indirect=True)
@pytest.mark.parametrize("part", [1, 2])
def test_it_gives_the_simulations_commands(
    compiled: Path, part: int, request: pytest.FixtureRequest
) -> None:
    name = request.node.callspec.params["compiled"]
    one, what = case(name), exported(case(name).design, compensated=True)
    run, inputs = simulated(one, what, N)
    h = what.loop.h
    signals = np.zeros(N, dtype=[("time", float)] + [(s.name, float) for s in what.program.inputs])
    signals["time"] = h * np.arange(N)
    for signal, column in zip(what.program.inputs, inputs.T, strict=True):
        signals[signal.name] = column
    found = simulate_fmu(
        str(compiled), start_time=0.0, stop_time=N * h, step_size=h / part,
        output_interval=h / part, input=signals, output=["u", "v"], start_values={"y": START},
    )  # fmt: skip
    # What a step over sample k leaves is the command of sample k.
    assert np.array_equal(found["u"][1::part][:N], run.u)
    assert np.array_equal(found["v"][1::part][:N], run.velocity)


@pytest.mark.slow
@pytest.mark.parametrize("compiled", ["limited"], indirect=True)
def test_it_refuses_a_foreign_description(compiled: Path) -> None:
    description = compiled / "modelDescription.xml"
    text = description.read_text()
    at = text.index('instantiationToken="') + len('instantiationToken="')
    description.write_text(text[:at] + "x" + text[at + 1 :])
    with pytest.raises(Exception, match=r"(?i)instantiate"):
        simulate_fmu(str(compiled), stop_time=0.01)


def test_the_same_design_gives_the_same_bytes(tmp_path: Path) -> None:
    first = packed("emps", tmp_path).read_bytes()
    assert packed("emps", tmp_path).read_bytes() == first
    with zipfile.ZipFile(tmp_path / "known.fmu") as archive:
        assert sorted(archive.namelist()) == [
            "modelDescription.xml", "sources/buildDescription.xml", "sources/fmu.c",
            "sources/known.c", "sources/known.h",
        ]  # fmt: skip
