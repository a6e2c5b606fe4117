"""A rig of kind = "velocity" from its log to a loop in simulation, by the command line."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.identification.velocity.made import TRUE, command, made
from workbench.cli import main

CARD = """
[card]
name = "digger"
[rig]
kind = "velocity"
control_limit = 6.0
[signals]
t = { column = "time", unit = "s" }
y = { column = "position", unit = "mm" }
u = { column = "valve", unit = "V" }
"""


def write(path: Path, log: Any) -> None:
    columns = {"time": log["t"], "position": 1e3 * log["y"], "valve": log["u"]}
    pd.DataFrame(columns).to_csv(path, index=False, float_format="%.9g")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Logs, their card, a model and a design."""
    home = tmp_path_factory.mktemp("digger")
    (home / "card.toml").write_text(CARD)
    motor = CARD.replace('"velocity"', '"motor"\nforce_per_command = 1.0')
    (home / "motor.toml").write_text(motor)
    write(home / "a.csv", made(80, h=0.02))
    write(home / "curved.csv", made(81, replace(TRUE, curve_p=0.25, curve_n=0.25), h=0.02))
    one_way = np.abs(command(np.random.default_rng(82), 0.02, 30.0))
    write(home / "one_way.csv", made(82, u=one_way, h=0.02))
    assert run(home, "identify", "a.csv", "--card", "card.toml", "--out", "m") == 0
    assert run(home, "design", "m/model.json", "--out", "d") == 0
    return home


def run(home: Path, name: str, *words: str) -> int:
    """Exit status of a command whose words that name files are of the folder."""
    named = [
        str(home / word) if word in OUT or Path(word).suffix in FILES else word for word in words
    ]
    return main([name, *named])


FILES = (".csv", ".toml", ".json")
OUT = ("m", "d", "x", "v", "p", "t")


def read(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.read_text()))


def test_identify(folder: Path) -> None:
    model = read(folder / "m" / "model.json")
    assert (model["schema"], model["kind"]) == ("velocity-model/1", "velocity")
    for name in ("g_p", "g_n", "d_p", "d_n"):
        one = model["valve"][name]
        assert one["low"] < one["value"] < one["high"]
        assert one["value"] == pytest.approx(getattr(TRUE, name), rel=0.03)
    assert model["valve"]["g_p"]["unit"] == "m/(s V)"
    assert model["fit"]["position_rms_2s"] < 1e-3
    assert "six valve parameters" in (folder / "m" / "report.html").read_text("utf-8")


def test_trace(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(folder, "trace", "curved.csv", "--card", "card.toml", "--out", "t") == 0
    assert "Missing: the gain changes with the size of the command" in capsys.readouterr().out
    assert read(folder / "t" / "trace.json")["effects"][0]["key"] == "curved_gain"
    page = (folder / "t" / "report.html").read_text("utf-8")
    assert page.count('<th scope="col">rival</th>') == 1 and "───" not in page
    model = read(folder / "t" / "model.json")
    assert model["effects"]["curved_gain"]["curve_p"]["value"] == pytest.approx(0.25, abs=0.05)
    words = ("t/model.json", "curved.csv", "--card", "card.toml", "--window", "2", "--out", "p")
    assert run(folder, "predict", *words) == 0
    assert "within 0." in capsys.readouterr().out
    columns = pd.read_csv(folder / "p" / "prediction.csv").columns
    assert list(columns) == ["t", "position_measured", "position_simulated"]


def test_a_prediction_begins_as_the_fit_does(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A log whose first command has not acted yet: the body stands where it is read as moving."""
    log = made(83, h=0.02)
    late, u = 10, np.full(len(log["t"]), 4.0)
    u[late:] = log["u"][:-late]
    y = np.concatenate([np.full(late, log["y"][0]), log["y"][:-late]])
    write(folder / "late.csv", {"t": log["t"], "y": y, "u": u})
    words = ("m/model.json", "late.csv", "--card", "card.toml", "--out", "p")
    assert run(folder, "predict", *words) == 0
    assert "from 1 s on, since commands from before the log act" in capsys.readouterr().out
    found = pd.read_csv(folder / "p" / "prediction.csv")
    assert found["position_simulated"].isna().sum() == 50
    off = 1e3 * (found["position_measured"] - found["position_simulated"]).dropna()
    assert abs(off.iloc[0]) < 1e-6 and np.abs(off[:50]).max() < 2.0  # mm


def test_the_design_passes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    design = read(folder / "d" / "design.json")
    assert design["law"] == "PI" and design["margins"]["phase_deg"] > 30.0
    assert run(folder, "validate", "m/model.json", "d/design.json", "--out", "v") == 0
    assert "Passed" in capsys.readouterr().out
    asked = ("m/model.json", "d/design.json", "--modulus", "0.9", "--out", "x")
    assert run(folder, "validate", *asked) == 1
    said = capsys.readouterr().out
    assert "Not passed" in said and "workbench design" in said


def test_doctor_speaks_of_the_valve(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(folder, "doctor", "one_way.csv", "--card", "card.toml") == 0
    said = capsys.readouterr().out
    assert "4 of the six numbers of the valve" in said and "F_c" not in said


def test_one_direction_carries_no_design(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(folder, "identify", "one_way.csv", "--card", "card.toml", "--out", "x") == 0
    assert "no command in the negative direction" in capsys.readouterr().out
    assert run(folder, "design", "x/model.json", "--out", "p") == 1
    assert "g_n is not identified" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("drift", "m/model.json", "a.csv", "--card", "card.toml"), "this is not offered"),
        (("experiment", "m/model.json"), "this is not offered"),
        (("export", "d/design.json", "--to", "c"), "this is not offered"),
        (("simulate", "card.toml"), "has no friction"),
        (("predict", "m/model.json", "a.csv", "--card", "motor.toml"), '"velocity" needed here'),
        (
            ("predict", "m/model.json", "a.csv", "--card", "card.toml", "--drive", "force"),
            "--drive",
        ),
        (("identify", "a.csv", "--card", "card.toml", "--posterior"), "--posterior has no meaning"),
        (("design", "m/model.json", "--robust"), "--robust has no meaning"),
        (("validate", "m/model.json", "m/model.json"), "velocity-design/1"),
        (("trace", "a.csv", "--test", "a.csv", "--card", "card.toml"), "the same bytes"),
    ],
)
def test_what_is_not_offered_is_one_line(
    folder: Path, words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(folder, *words) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.strip().splitlines()) == 1


def test_a_number_of_forces_has_no_place_in_its_card(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "wrong.toml").write_text(CARD.replace("control_limit = 6.0", "area_p_m2 = 1e-3"))
    assert run(folder, "identify", "a.csv", "--card", "wrong.toml") == 2
    assert "knows no force; leave 'area_p_m2' out" in capsys.readouterr().err


@pytest.mark.method
def test_the_kind_that_a_log_looks_like(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(folder, "identify", "a.csv", "--card", "motor.toml", "--out", "x")
    assert 'the log looks like kind = "velocity"' in "".join(capsys.readouterr()).replace("\n", " ")
