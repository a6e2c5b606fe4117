"""`workbench effects` as a user calls it: the library listed, an own file checked."""

import json
from pathlib import Path

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant
from identification.simulation.free_run import free_run
from workbench.cards.own_effects import library
from workbench.cli import main

COIL = '''"""A coil that warms up by its own current gives less force for the same voltage."""

import math

from identification.effects._base import Effect, Param


def value(t, y, v, F, u, d, z, c, f, s, p):
    """u/(1 + a z): the resistance grows with the heat z [V^2]."""
    return u / (1.0 + p[0] * z)


def evolve(dt, t, y, v, F, u, d, z, c, f, s, p):
    """The heat follows u^2 with the time constant tau."""
    return u * u + (z - u * u) * math.exp(-dt / p[1])


EFFECT = Effect(
    key="coil_heating",
    meaning="a coil warms up by its current and gives less force for the same command",
    equation="u/(1 + a*z)",
    source="first-order heating, 2026",
    acts="command",
    params=(
        Param("a", "1/V**2", 0.0, 1e3, 0.02, "relative rise of resistance by heat"),
        Param("tau", "s", 0.1, 1e4, 20.0, "time constant of the heating"),
    ),
    value=value,
    depends_on=("u",),
    evolve=evolve,
    state_unit="V**2",
)
'''


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with one effect of the user's own."""
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "coil_heating.py").write_text(COIL, encoding="utf-8")
    return tmp_path / "own"


def test_the_library_is_listed_with_units_and_sources(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["effects", "list", "--verbose", "--effects", str(folder)]) == 0
    shown = capsys.readouterr().out
    for effect in built_in().values():
        assert f"{effect.key}: " in shown
        assert all(f"{p.name} [{p.unit}]: " in shown for p in effect.params)
    assert "coil_heating: a coil warms up" in shown
    assert main(["effects", "list", "stribeck", "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    assert found["equation"] == built_in()["stribeck"].equation
    assert found["parameters"][1]["unit"] == "m/s"
    assert "1994" in found["source"]
    assert main(["effects", "list", "stribek"]) == 2
    assert "did you mean 'stribeck'?" in capsys.readouterr().err


@pytest.mark.slow
def test_an_own_effect_is_checked(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects", "check", str(folder)]) == 0
    assert "coil_heating: holds to all" in capsys.readouterr().out
    path = folder / "coil_heating.py"
    path.write_text(COIL.replace('"u/(1 + a*z)"', '"u/(1 - a*z)"'), encoding="utf-8")
    assert main(["effects", "check", str(folder), "--json"]) == 1
    (broken,) = json.loads(capsys.readouterr().out)["effects"].values()
    assert broken["holds"] is False
    ((check, said),) = broken["broken"].items()
    assert check == "equation, Python and compiled kernel agree"
    assert "the equation gives" in said
    path.write_text(COIL.replace('state_unit="V**2"', 'state_unit="V"'), encoding="utf-8")
    assert main(["effects", "check", str(folder)]) == 1
    shown = capsys.readouterr().out
    assert "units do not multiply out to V" in " ".join(shown.split())
    last = " ".join(shown.replace("\\\n", " ").split())  # folded where the folder's name is long
    assert last.endswith(f"workbench effects check {folder}")
    assert main(["effects", "check", str(folder / "none")]) == 2
    assert "no such folder" in capsys.readouterr().err


def test_the_state_of_what_acts_on_the_command_goes_on_with_it(folder: Path) -> None:
    coil = library([folder])["coil_heating"].acting({"a": 0.05, "tau": 3.0})
    h, n = 1e-3, 4000
    t = h * np.arange(n, dtype=np.float64)
    u = 4.0 * np.sign(np.sin(2 * np.pi * 0.8 * t + 0.1))
    log = Log("made", {"t": t, "y": 0.0 * t, "u": u})
    friction = Karnopp(2.0, 6.0, 6.0, 20.0, 20.0, 1e-3, -1e-3, 8.0, -8.0)
    found = free_run(Plant(friction, Motor(10.0), (coil,)), log, (0.0, 0.0, 0.0), "command")
    heat, force = 0.0, np.empty(n)
    for k in range(n):
        force[k] = 10.0 * u[k] / (1.0 + 0.05 * heat)
        heat = u[k] ** 2 + (heat - u[k] ** 2) * np.exp(-h / 3.0)
    np.testing.assert_allclose(found.F[1:], force[1:], rtol=1e-12)
