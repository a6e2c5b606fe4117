"""The measured sets through the commands, by the shipped cards' names."""

import json
from pathlib import Path

import pytest

from workbench.cli import main
from workbench.logs.sources import card_path

pytestmark = pytest.mark.slow


@pytest.fixture
def data(workbench_data: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("WORKBENCH_DATA", str(workbench_data))
    return workbench_data


def read(path: Path) -> dict[str, object]:
    found = json.loads(path.read_text(encoding="utf-8"))
    assert isinstance(found, dict)
    return found


def test_emps_from_the_log_to_a_validated_loop(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert data.is_dir()
    model = str(tmp_path / "id/model.json")
    for arguments in (
        ["identify", "DATA_EMPS.mat", "--card", "emps", "--out", str(tmp_path / "id")],
        ["design", model, "--out", str(tmp_path / "d")],
        ["validate", model, str(tmp_path / "d/design.json"), "--out", str(tmp_path / "v")],
    ):
        assert main(arguments) == 0
    capsys.readouterr()
    predict = ["predict", model, "DATA_EMPS_PULSES.mat", "--card", "emps"]
    assert main([*predict, "--json", "--out", str(tmp_path / "p")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["position_rms"] < 6e-3  # 9.3 mm by the published model; friction was higher then
    report = (tmp_path / "id/report.html").read_text(encoding="utf-8")
    assert "given by the card" in report


def test_prescribed_motion_gives_friction_but_no_design(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert data.is_dir()
    log, out = "O-ring257_5bar.csv", tmp_path / "id"
    assert main(["identify", log, "--card", "pneumatic_seals", "--out", str(out)]) == 0
    model = read(out / "model.json")
    friction = model["friction"]
    assert isinstance(friction, dict)
    assert friction["m"]["value"] is None and friction["m"]["reason"]
    assert friction["F_cp"]["value"] is not None
    capsys.readouterr()
    assert main(["design", str(out / "model.json"), "--out", str(tmp_path / "d")]) == 1
    assert "prescribed" in capsys.readouterr().err
    assert not (tmp_path / "d").exists()


@pytest.mark.method
def test_a_friction_of_the_wrong_sign_is_not_reported(data: Path, tmp_path: Path) -> None:
    logs = [str(data / "pneumatic_seals" / f"PK_{bar}bar.csv") for bar in (1, 5, 7)]
    card, out = tmp_path / "card.toml", tmp_path / "id"
    text = card_path("pneumatic_seals").read_text(encoding="utf-8")
    card.write_text(text.replace("4.908739e-4", "5.187477e-4"), encoding="utf-8")  # a wrong bore
    assert main(["identify", *logs, "--card", str(card), "--out", str(out)]) == 0
    friction = read(out / "model.json")["friction"]
    assert isinstance(friction, dict)
    assert friction["F_cp"]["value"] is None  # a constant force is beside the seal's friction
    assert "wrong sign" in friction["F_cp"]["reason"]
    assert friction["F_cp"]["assumed"] >= 0.0


@pytest.mark.method
def test_a_rig_that_leads_the_body_is_fitted_on_its_force(data: Path, tmp_path: Path) -> None:
    assert data.is_dir()
    out = tmp_path / "id"
    logs = [f"O-ring257_{bar}bar.csv" for bar in (1, 5, 7)]
    assert main(["identify", *logs, "--card", "pneumatic_seals", "--out", str(out)]) == 0
    model = read(out / "model.json")
    friction = model["friction"]
    assert isinstance(friction, dict)
    # One way friction falls with speed; either way it is the mean over the strokes.
    assert 6.0 < friction["F_cp"]["value"] < 9.0
    assert 4.0 < friction["F_cn"]["assumed"] < 6.0  # three pressures, so too wide to be given
    assert friction["F_vp"]["value"] is None
    assert friction["F_vp"]["assumed"] == 0.0
    falling = model["falling"]
    assert isinstance(falling, dict) and falling["F_vp"]["value"] < -300.0
    assert 11.0 < falling["F_cp"]["value"] < 15.0  # at rest
    assert "falls with speed" in friction["F_vp"]["reason"]
    assert "constant friction predicts as much" in friction["F_vn"]["reason"]


def test_a_servo_without_a_force_is_refused(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert data.is_dir()
    log, out = "2026-01-15_10h28m10.json", tmp_path / "id"
    assert main(["identify", log, "--card", "xl330_servo", "--out", str(out)]) == 2
    assert "force_per_command" in capsys.readouterr().err
    assert not out.exists()
