"""Every command in a folder of its own: what it writes, prints, refuses, and its exit status."""

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from design.asked import Limits
from design.controllers.validate import validate
from design.identified.trace_logs import Traced, trace_logs
from identification.effects import spring as spring_module
from tests.chain import CARD
from workbench.cli import COMMANDS, main
from workbench.steps import demo as demonstration

WITHOUT_FILES = (
    "reidentify",
    "watch",
    "effects",
    "serve",
    "work",
    "token",
)  # they write to the registry, or nothing


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with card, log, model and design, each made by its command."""
    folder = tmp_path_factory.mktemp("shop")
    (folder / "card.toml").write_text(CARD, encoding="utf-8")
    card = str(folder / "card.toml")
    for arguments in (
        ["simulate", card, "--out", str(folder / "log")],
        ["identify", str(folder / "log/short.csv"), "--card", card, "--out", str(folder / "id")],
        ["design", str(folder / "id/model.json"), "--out", str(folder / "design")],
    ):
        assert main(arguments) == 0
    return folder


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def as_json(capsys: pytest.CaptureFixture[str], arguments: Sequence[str], status: int = 0) -> Any:
    capsys.readouterr()
    assert main([*arguments, "--json"]) == status
    shown = capsys.readouterr()
    assert shown.err == ""
    return json.loads(shown.out)


def refusal(capsys: pytest.CaptureFixture[str], arguments: Sequence[str], status: int) -> str:
    """The one line on standard error of a command that ends with `status`.

    Of a refusal (1) a second one says what to type next.
    """
    capsys.readouterr()
    assert main(list(arguments)) == status
    shown = capsys.readouterr()
    assert shown.out == ""
    line, *then = shown.err.splitlines()
    assert [one.partition(" (")[0] for one in then] == ["next"] * (status == 1)
    return line


@pytest.mark.parametrize("command", list(COMMANDS))
def test_help_has_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, "--help"]) == 0
    shown = capsys.readouterr().out
    assert f"Example: workbench {command}" in shown
    assert "--json" in shown
    assert "--out" in shown or command in WITHOUT_FILES


def test_simulate_writes_log_and_truth(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert files(shop / "log") == {"short.csv", "truth.json"}
    assert "F_sp" not in (shop / "log/short.csv").read_text(encoding="utf-8")
    known = json.loads((shop / "log/truth.json").read_text(encoding="utf-8"))
    assert known["friction"]["F_sp"]["value"] == 20.6
    out = str(tmp_path / "s")
    card = str(shop / "card.toml")
    found = as_json(capsys, ["simulate", card, "--seed", "9", "--format", "parquet", "--out", out])
    assert found["seed"] == 9
    assert files(tmp_path / "s") == {"short.parquet", "truth.json"}


def test_identify_writes_model_and_report(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert files(shop / "id") == {"model.json", "report.html"}
    model = json.loads((shop / "id/model.json").read_text(encoding="utf-8"))
    assert model["friction"]["m"]["value"] == pytest.approx(1.0, rel=5e-3)
    assert len(model["log"][0]["sha256"]) == 64
    card, log, out = str(shop / "card.toml"), str(shop / "log/short.csv"), str(shop / "id2")
    found = as_json(
        capsys, ["identify", log, "--card", card, "--orders", "3,2,1", "--seed", "4", "--out", out]
    )
    assert (found["plant"]["na"], found["plant"]["nb"], found["plant"]["nk"]) == (3, 2, 1)
    assert found["out"] == out


def test_predict_writes_the_columns_of_the_contract(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card, log = str(shop / "card.toml"), str(shop / "log/short.csv")
    model, out = str(shop / "id/model.json"), str(tmp_path / "p")
    found = as_json(capsys, ["predict", model, log, "--card", card, "--out", out])
    assert found["position_rms"] < 5e-4
    assert found["run_refused"] is None
    with (tmp_path / "p/prediction.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0] == [
        "t",
        "force_applied",
        "force_predicted",
        "force_simulated",
        "position_measured",
        "position_simulated",
    ]
    assert len(rows) == 3002
    by_force = ["predict", model, log, "--card", card, "--drive", "force", "--window", "0.5"]
    assert as_json(capsys, [*by_force, "--out", out])["drive"] == "force"


def test_response_writes_curves_and_margins(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card, log, out = str(shop / "card.toml"), str(shop / "log/short.csv"), str(tmp_path / "r")
    command = ["response", log, "--card", card, "--out", out]
    found = as_json(capsys, [*command, "--model", str(shop / "id/model.json")])
    assert files(tmp_path / "r") == {"response.json", "response.csv", "report.html"}
    assert found["friction"] == {"taken_out": True, "reason": None}
    assert found["instrument"] == "r" and found["plant"]["unit"] == "m/N"
    with (tmp_path / "r/response.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == found["frequencies"]
    seen = [float(row["plant_coherence"]) for row in rows if row["plant_magnitude_db"]]
    assert seen and min(seen) >= 0.5
    left = as_json(capsys, [*command, "--friction-left-in"])
    assert left["friction"] == {"taken_out": False, "reason": "asked for"}
    assert "Plant" in (tmp_path / "r/report.html").read_text(encoding="utf-8")


def test_response_identifies_where_no_model_is_given(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card, log, out = str(shop / "card.toml"), str(shop / "log/short.csv"), str(tmp_path / "r")
    given = ["response", log, "--card", card, "--out", out]
    alone = as_json(capsys, given)
    with_model = as_json(capsys, [*given, "--model", str(shop / "id/model.json")])
    assert alone["friction"]["taken_out"]
    assert alone["plant"]["seen_hz"] == with_model["plant"]["seen_hz"]


def test_response_refuses_what_shows_nothing_and_bad_options(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card, log, out = str(shop / "card.toml"), str(shop / "log/short.csv"), str(tmp_path / "r")
    model = str(shop / "id/model.json")
    rows = (shop / "log/short.csv").read_text("utf-8").splitlines()
    (tmp_path / "brief.csv").write_text("\n".join(rows[:200]), "utf-8")
    for name, more, status, said in (
        (log, ("--lowest", "0.01"), 2, "stretches of 600 s needed"),
        (str(tmp_path / "brief.csv"), (), 1, "log longer"),
        (str(tmp_path / "none.csv"), (), 2, "none.csv"),
    ):
        given = ["response", name, "--card", card, "--model", model, "--out", out, *more]
        assert said in refusal(capsys, given, status)
        assert not (tmp_path / "r").exists()
    assert "--lowest" in refusal(capsys, ["response", log, "--card", card, "--lowest", "0"], 2)
    assert "turned" in refusal(capsys, ["response", log, "--card", card, "--model", "turned"], 2)


def test_predict_by_a_model_without_a_mass_gives_the_force_and_refuses_the_run(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Status 0: a run by an assumed mass may end kilometres off, but the force is predicted."""
    card, log = str(shop / "card.toml"), str(shop / "log/short.csv")
    model = json.loads((shop / "id/model.json").read_text(encoding="utf-8"))
    blank = {"value": None, "unit": "kg", "reason": "log faster motion", "assumed": 1e-9}
    model["friction"]["m"] = blank
    (tmp_path / "model.json").write_text(json.dumps(model), encoding="utf-8")
    command = ["predict", str(tmp_path / "model.json"), log, "--card", card]
    for drive in ([], ["--drive", "force"], ["--drive", "command", "--window", "0.5"]):
        found = as_json(capsys, [*command, *drive, "--out", str(tmp_path / "p")])
        assert found["run_refused"].startswith("no free run: m not identified, which a")
        assert "(m: log faster motion)" in found["run_refused"]
        assert found["position_rms"] is None and found["force_simulated_rms"] is None
        assert found["force_predicted_rms"] > 0
        assert "force by assumed values of what is not identifiable: m" in found["remarks"]
    with (tmp_path / "p/prediction.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3001
    assert {row["position_simulated"] for row in rows} == {""}
    assert all(row["force_predicted"] for row in rows)
    assert main([*command, "--out", str(tmp_path / "p")]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("position: no free run: m not identified")
    assert "force, inverse model:" in shown


def test_effects_go_from_the_recipe_to_the_log_and_from_the_model_to_the_prediction(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "own").mkdir()
    spring = Path(spring_module.__file__ or "").read_text(encoding="utf-8")
    text = spring.replace('key="spring"', 'key="coil"')
    (tmp_path / "own/coil.py").write_text(text, encoding="utf-8")
    card = tmp_path / "card.toml"
    card.write_text(f'{CARD}[recipe.effects.coil]\nk = "1.5 N/mm"\n', encoding="utf-8")
    out, own = str(tmp_path / "log"), ["--effects", str(tmp_path / "own")]
    said = refusal(capsys, ["simulate", str(card), "--out", out], 2)
    assert "[recipe] effects: unknown effect 'coil'" in said
    as_json(capsys, ["simulate", str(card), *own, "--out", out])
    known = json.loads((tmp_path / "log/truth.json").read_text(encoding="utf-8"))
    coil = known["effects"]["coil"]
    bare = {"sd": None, "low": None, "high": None}
    assert coil["k"] == {"value": 1500.0, "unit": "N/m", **bare}
    assert coil["k_3"]["value"] == 0.0
    model = json.loads((shop / "id/model.json").read_text(encoding="utf-8"))
    model["effects"]["coil"] = coil
    (tmp_path / "model.json").write_text(json.dumps(model), encoding="utf-8")
    log = [str(tmp_path / "log/short.csv"), "--card", str(card), "--out", str(tmp_path / "p")]
    said = refusal(capsys, ["predict", str(tmp_path / "model.json"), *log], 2)
    assert "model.json: [effects] unknown effect 'coil'" in said and "--effects FOLDER" in said
    plain = as_json(capsys, ["predict", str(shop / "id/model.json"), *log])
    whole = as_json(capsys, ["predict", str(tmp_path / "model.json"), *log, *own])
    assert whole["next"].endswith(f" --effects {own[1]}") and "--effects" not in plain["next"]
    assert whole["position_rms"] < 0.05 * plain["position_rms"]
    assert whole["force_predicted_rms"] < 0.5 * plain["force_predicted_rms"]


def test_a_shipped_recipe_with_an_effect_is_simulated(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = as_json(capsys, ["simulate", "demo", "--out", str(tmp_path / "d")])
    assert (found["samples"], found["seed"]) == (30001, 4)
    known = json.loads((tmp_path / "d/truth.json").read_text(encoding="utf-8"))
    assert known["effects"]["stribeck"]["F_s"]["value"] == 3.5
    assert "stribeck" not in (tmp_path / "d/demo.csv").read_text(encoding="utf-8")


def test_design_writes_controllers(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert files(shop / "design") == {"design.json", "report.html"}
    model, out = str(shop / "id/model.json"), str(tmp_path / "d")
    asked = ["--poles", "15,0.9", "--auxiliary", "0.5,0.3+0.1j,0.3-0.1j"]
    found = as_json(capsys, ["design", model, *asked, "--out", out], status=1)
    assert found["rst"]["missed"]
    assert {name: one["value"] for name, one in found["rst"]["dominant"].items()} == {
        "w_n": 15.0,
        "zeta": 0.9,
    }
    assert found["rst"]["auxiliary"] == [[0.5, 0.0], [0.3, 0.1], [0.3, -0.1]]
    assert (
        as_json(capsys, ["design", model, "--from", "arx", "--out", out])["plant"]["source"]
        == "arx"
    )
    assert as_json(capsys, ["design", model, "--no-integrator", "--out", out])["pid"] is None


def test_a_design_that_misses_its_goals_is_written_and_not_recommended(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["design", str(shop / "id/model.json"), "--out", str(tmp_path / "d")]
    asked = [*command, "--poles", "300,0.7"]
    found = as_json(capsys, asked, status=1)
    assert found["recommended"] == "none"
    assert files(tmp_path / "d") == {"design.json", "report.html"}
    assert any("modulus margin" in line for line in found["rst"]["missed"])
    assert main(asked) == 1
    shown = capsys.readouterr().out
    assert "No controller meets every goal" in shown and "RST misses: modulus margin" in shown
    last = " ".join(shown.split())  # folded where the folder's name is long
    assert last.endswith(f"): workbench design {shop / 'id/model.json'}")
    strict = as_json(capsys, [*command, "--poles", "15,0.9", "--modulus", "0.99"], status=1)
    assert strict["recommended"] == "none"
    assert any("at least 0.99 asked" in line for line in strict["rst"]["missed"])


def test_export_writes_code(shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    design, out = str(shop / "design/design.json"), tmp_path / "e"
    every = ["c", "st", "plcopen", "fmu", "json", "mat"]
    command = ["export", design, "--name", "Achse 1", "--out", str(out)]
    found = as_json(capsys, [*command, *(word for one in every for word in ("--to", one))])
    wanted = {f"Achse_1.{kind}" for kind in ("h", "c", "st", "xml", "fmu", "json", "mat")}
    assert files(out) == set(found["files"]) == wanted
    assert found["name"] == "Achse_1"
    advised = json.loads(Path(design).read_text())["recommendation"]
    assert (found["controller"], found["compensator"]) == (
        advised["controller"],
        advised["compensator"],
    )
    assert [one["name"] for one in found["inputs"]] == ["r", "y", "F_e"]
    assert found["h"] == json.loads(Path(design).read_text())["force"]["h"]["value"]
    assert main([*command, "--to", "c", "--controller", "pid", "--no-compensator"]) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("short: PID controller\n")
    assert "Achse_1.c" in shown and "Achse_1_self_test" in shown
    for arguments, said in (
        (["--to", "c", "--controller", "present"], "no present controller"),
        (["--to", "mat", "--precision", "single"], "--precision single is for c, st, plcopen"),
        (["--to", "c", "--name", "--"], "no letter or digit"),
        (["--to", "pascal"], "'pascal' is not one of"),
        ([], "Missing option '--to'"),
    ):
        assert said in refusal(capsys, ["export", design, *arguments], 2)


def test_export_writes_the_tables_of_a_model(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, design, out = str(shop / "id/model.json"), str(shop / "design/design.json"), tmp_path
    command = ["export", model, "--name", "X", "--out", str(out / "e")]
    asked = ["--rated", "2.4 N m", "--per-turn", "10 mm"]
    found = as_json(capsys, [*command, "--to", "friction-table", "--to", "c", *asked])
    assert files(out / "e") == {one["file"] for one in found["files"]}
    assert {one["control"] for one in found["files"]} == {None, "twincat", "sinumerik", "linuxcnc"}
    assert all(one["error"] < 0.01 for one in found["files"])
    (cost, *_) = [
        one
        for each in found["files"]
        for one in each["costs"]
        if one["what"].startswith("asymmetry")
    ]
    assert cost["unit"] == "N" and cost["value"] > 1.0
    assert found["left_out"] == []
    assert main([*command, "--to", "csv"]) == 0
    assert "X_friction.csv" in capsys.readouterr().out
    for file, arguments, said in (
        (model, ["--to", "backlash"], "the model has no backlash"),
        (model, ["--to", "cogging-table"], "the model has no cogging"),
        (model, ["--to", "friction-table", "--control", "codesys"], "no friction table"),
        (model, ["--to", "friction-table", "--control", "fanuc"], "'fanuc' is not one of"),
        (model, ["--to", "friction-table", "--rated", "2 kg"], "of another kind"),
        (model, ["--to", "friction-table", "--precision", "single"], "--precision has no meaning"),
        (model, ["--to", "friction-table", "--to", "fmu"], "--to fmu of a design"),
        (model, ["--to", "fmu"], "'design/2' needed"),
        (design, ["--to", "friction-table"], "'model/1' needed"),
        (design, ["--to", "c", "--speed", "3"], "--speed has no meaning"),
    ):
        assert said in refusal(capsys, ["export", file, *arguments], 2), said


def test_axis_test_has_the_status_of_its_light(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, out = str(shop / "log/short.csv"), str(tmp_path / "a")
    card = tmp_path / "card.toml"
    text = (shop / "card.toml").read_text(encoding="utf-8")
    for limits, light, status in (
        ("[11.0, 13.0]", "green", 0),
        ('["5 N", "6 N"]', "red", 1),
        (None, "yellow", 1),
    ):
        wanted = "" if limits is None else f"\n[limits]\nF_cp = {limits}\n"
        card.write_text(text + wanted, encoding="utf-8")
        found = as_json(capsys, ["axis-test", log, "--card", str(card), "--out", out], status)
        assert found["light"] == light and files(tmp_path / "a") == {
            "axis_test.json",
            "report.html",
        }
        assert json.loads((tmp_path / "a/axis_test.json").read_text())["light"] == light
        assert ("next" in found) is (status == 1)
    assert main(["axis-test", log, "--card", str(card), "--out", out]) == 1
    assert capsys.readouterr().out.startswith("YELLOW: no limits to test against")
    card.write_text(text + "\n[limits]\nF_cp = [6.0, 5.0]\n", encoding="utf-8")
    for arguments, said in (
        ([log, "--card", str(card)], "the lower limit first needed"),
        (["none.csv", "--card", str(shop / "card.toml")], "none.csv"),
        ([log, "--card", str(shop / "card.toml"), "--machine", "x"], "give --registry too"),
        ([log, "--card", str(shop / "card.toml"), "--registry", out], "registry"),
    ):
        assert said in refusal(capsys, ["axis-test", *arguments], 2), said


def test_validate_passes_and_fails_with_its_status(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, design = str(shop / "id/model.json"), str(shop / "design/design.json")
    command = ["validate", model, design, "--out", str(tmp_path / "v")]
    assert as_json(capsys, command)["passed"] is True
    assert files(tmp_path / "v") == {"validation.json", "report.html"}
    for limit in (["--standstill", "1e-7"], ["--overshoot", "1e-7"], ["--force", "0.1"]):
        assert as_json(capsys, [*command, *limit], status=1)["passed"] is False
    both = as_json(capsys, [*command, "--plant", model])
    assert set(both["figures"]["rst"]) == {"model", "plant"}


def test_a_table_is_shown_without_json(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["design", str(shop / "id/model.json"), "--out", str(tmp_path / "d")]) == 0
    shown = capsys.readouterr()
    assert "modulus margin" in shown.out and "RST" in shown.out
    assert shown.err == ""


def test_wrong_input_is_one_line_and_writes_nothing(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card, log = str(shop / "card.toml"), str(shop / "log/short.csv")
    model, design = str(shop / "id/model.json"), str(shop / "design/design.json")
    out = tmp_path / "out"
    (tmp_path / "flat.csv").write_text(
        "t,r,y,F,u\n" + "\n".join(f"{k * 0.001},0,0.5,1,0" for k in range(300)), encoding="utf-8"
    )
    turns = CARD.replace('kind = "force"', 'kind = "force"\nmotion = "rotary"', 1)
    (tmp_path / "turns.toml").write_text(turns, encoding="utf-8")
    (tmp_path / "bad.json").write_text('{"schema": "model/1"}', encoding="utf-8")
    cases = (
        (["identify", "no.csv", "--card", card], "no such file"),
        (["identify", log, "--card", "papper_table1"], "did you mean 'paper_table1'"),
        (["identify", log, log, "--card", card], "given twice"),
        (["identify", str(tmp_path / "flat.csv"), "--card", card], "constant"),
        (["identify", log, "--card", card, "--orders", "3,2"], "na,nb,nk needed"),
        (["identify", log, "--card", card, "--design-period", "1e-4"], "sampled every"),
        (["identify", log, "--card", card, "--design-period", "1e6"], "ask for at most 0.3"),
        (["identify", log, "--card", card, "--design-period", "1e300"], "ask for at most 0.3"),
        (["identify", "--card", card], "Missing argument"),
        (["identify", log, "--card", card, "--card", "emps"], "--card is given 2 times"),
        (["predict", model, log, "--card", str(tmp_path / "turns.toml")], "of a linear machine"),
        (["predict", model, "no.csv", "--card", card], "no such file"),
        (["predict", log, log, "--card", card], "is not JSON"),
        (["predict", model, log, "--card", card, "--window", "1e-9"], "window"),
        (["design", design], "schema 'design/2', 'model/1' needed"),
        (["design", str(tmp_path / "bad.json")], "has no 'card'"),
        (["design", model, "--design-period", "1e6"], "ask for at most 0.3"),
        (["design", model, "--design-period", "1e-12"], "ask for at least 0.0001"),
        (["design", model, "--poles", "15"], "w_n,zeta needed"),
        (["design", model, "--poles", "15,-1"], "damping"),
        (["design", model, "--auxiliary", "1.5"], "not stable"),
        (["design", model, "--auxiliary", "0.5,x"], "values of z needed"),
        (["validate", model, model], "schema 'model/1', 'design/2' needed"),
        (["validate", str(tmp_path / "none.json"), design], "no such file"),
        (["simulate", "emps"], "has no [recipe]"),
        (["simulate", card, "--effects", str(tmp_path / "none")], "none: no such folder"),
        (["predict", model, log, "--card", card, "--effects", log], "short.csv: is a file"),
    )
    for arguments, needed in cases:
        assert needed in refusal(capsys, [*arguments, "--out", str(out)], 2), arguments
        assert not out.exists(), arguments
    assert not any(path.name.endswith(".part") for path in tmp_path.iterdir())


@pytest.mark.parametrize("value", ["0", "-1", "inf", "nan", "x"])
def test_options_that_are_no_finite_positive_number_are_refused(
    shop: Path, capsys: pytest.CaptureFixture[str], value: str
) -> None:
    card, log = str(shop / "card.toml"), str(shop / "log/short.csv")
    model, design = str(shop / "id/model.json"), str(shop / "design/design.json")
    cases = {
        ("identify", log, "--card", card): ("--design-period",),
        ("predict", model, log, "--card", card): ("--window",),
        ("design", model): ("--design-period", "--modulus", "--delay"),
        ("validate", model, design): (
            *("--modulus", "--delay", "--standstill", "--tracking"),
            *("--overshoot", "--force"),
        ),
    }
    for command, options in cases.items():
        for option in options:
            assert option in refusal(capsys, [*command, option, value], 2)


def test_a_motor_is_not_fitted_by_force(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    signals = "".join(
        f'{name} = {{ column = "{name}", unit = "{unit}" }}\n'
        for name, unit in (("t", "s"), ("y", "m"), ("u", "V"))
    )
    text = '[card]\nname = "m"\n[rig]\nkind = "motor"\nforce_per_command = 3.0\n[signals]\n'
    (tmp_path / "card.toml").write_text(text + signals, encoding="utf-8")
    command = ["identify", str(shop / "log/short.csv"), "--card", str(tmp_path / "card.toml")]
    said = refusal(capsys, [*command, "--drive", "force", "--out", str(tmp_path / "out")], 2)
    assert "--drive force: the rig is a motor" in said
    assert not (tmp_path / "out").exists()


def test_a_model_of_which_nothing_is_identified_is_written_and_is_a_refusal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Strokes of one speed, which one force opposes either way: the model predicts them alone."""
    t = 1e-2 * np.arange(4000, dtype=np.float64)
    back, rng = (t % 4.0) >= 2.0, np.random.default_rng(0)
    y = 1e-2 * np.cumsum(np.where(back, -1e-2, 1e-2)) + 2e-6 * rng.standard_normal(len(t))
    F = np.where(back, -8.0, 8.0) + 0.2 * rng.standard_normal(len(t))
    log, card = tmp_path / "strokes.csv", tmp_path / "card.toml"
    rows = np.column_stack([t, y, F])
    np.savetxt(log, rows, delimiter=",", header="t,y,F", comments="", fmt="%.9g")
    units = {"t": "s", "y": "m", "F": "N"}
    signals = "".join(f'{n} = {{ column = "{n}", unit = "{unit}" }}\n' for n, unit in units.items())
    card.write_text(f'[card]\nname = "rig"\n[rig]\nkind = "force"\n[signals]\n{signals}')
    out = tmp_path / "id"
    assert main(["identify", str(log), "--card", str(card), "--out", str(out), "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert all(one["value"] is None for one in found["friction"].values())
    assert found["next"].startswith("workbench doctor ") and (out / "model.json").is_file()


def test_a_model_without_a_plant_is_a_refusal(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = json.loads((shop / "id/model.json").read_text(encoding="utf-8"))
    mass = model["friction"]["m"]
    model["friction"]["m"] = {**mass, "value": None, "reason": "too slow", "assumed": 1.0}
    model["plant"], model["plant_reason"] = None, "not fitted"
    (tmp_path / "model.json").write_text(json.dumps(model), encoding="utf-8")
    out = tmp_path / "out"
    command = ["design", str(tmp_path / "model.json"), "--out", str(out)]
    text = refusal(capsys, command, 1)
    assert text.startswith("refused: no ARX plant")
    assert not out.exists()
    assert main([*command, "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == "refused"
    assert found["reason"].startswith("no ARX plant")
    assert found["next"].startswith("workbench doctor LOG --card CARD")


@pytest.fixture(scope="module")
def traced() -> list[Traced]:
    """What the demo's trace has found, once it has run."""
    return []


@pytest.mark.slow
def test_demo_runs_the_chain(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
    traced: list[Traced],
) -> None:  # fmt: skip
    def kept(*args: Any) -> Traced:
        traced.append(trace_logs(*args))
        return traced[0]

    monkeypatch.setattr(demonstration, "trace_logs", kept)
    found = as_json(capsys, ["demo", "--out", str(tmp_path / "demo")])
    assert found["passed"] is True
    assert found["worst_error"] < 5e-3
    assert found["verdict"] == "effect" and found["effects"] == ["stribeck"]
    names = {"model.json", "design.json", "validation.json", "truth.json", "trace.json"}
    assert names | {"report.html", "design.html", "validation.html"} <= files(tmp_path / "demo")


@pytest.mark.method
def test_a_demo_that_fails_says_so_by_its_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
    traced: list[Traced],
) -> None:  # fmt: skip
    def found(*args: Any) -> Traced:
        return traced[0] if traced else trace_logs(*args)

    def strict(*args: Any, **more: Any) -> Any:
        return validate(*args, **more, limits=Limits(standstill=1e-9))

    monkeypatch.setattr(demonstration, "trace_logs", found)  # the same log is not traced twice
    monkeypatch.setattr(demonstration, "validate", strict)
    shown = as_json(capsys, ["demo", "--out", str(tmp_path / "d")], status=1)
    assert shown["passed"] is False
    assert shown["reason"].startswith("RST on the model: error at standstill")
