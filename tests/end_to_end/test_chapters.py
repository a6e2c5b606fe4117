"""`workbench trace` on the measured sets, by the splits of the shipped cards."""

import json
from pathlib import Path
from typing import Any

import pytest

from workbench.cards.card import load_card
from workbench.cli import main
from workbench.logs.sources import card_path


@pytest.fixture
def data(workbench_data: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("WORKBENCH_DATA", str(workbench_data))
    return workbench_data


def split_of(card: str, data: Path) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Training and held-out logs of a card; skips where one is absent."""
    split = load_card(card_path(card), with_recipe=False).split
    for name in (*split["train"], *split["test"]):
        if not (data / card / name).is_file():
            pytest.skip(f"no measured data: {name} is not in {data / card}")
    return split["train"], split["test"]


def traced(arguments: list[str], out: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """What `workbench trace --json` prints."""
    capsys.readouterr()
    assert main(["trace", *arguments, "--out", str(out), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert isinstance(found, dict)
    return found


@pytest.mark.method
def test_seals_friction_grows_with_pressure(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    train, test = split_of("pneumatic_seals", data)
    assert test[0] == "O-ring257_3bar.csv"  # a pressure that no training log has
    arguments = [*train, "--test", test[0], "--card", "pneumatic_seals"]
    found = traced(arguments, tmp_path / "trace", capsys)
    first = found["effects"][0]
    assert first["key"] == "pressure_dependent_friction"
    assert 0 < first["params"]["mu_n"]["low"] < first["params"]["mu_n"]["value"]
    assert first["params"]["mu_p"]["value"] is None  # the other chamber is open
    for error in ("force_rms", "force_relative"):  # an effect by F may shrink the first alone
        before, after = (found[when]["test"][error] for when in ("before", "after"))
        assert after <= 0.4 * before


@pytest.mark.method
@pytest.mark.parametrize(
    ("seal", "share", "signal"), [("O-ring", 1.1, "reversal"), ("X-ring257", 0.4, "p_n")]
)
def test_what_another_seal_leaves_after_pressure_is_reported(
    seal: str,
    share: float,
    signal: str,
    data: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    logs = [f"{seal}_{bar}bar.csv" for bar in (1, 5, 7, 3)]
    for name in logs:
        if not (data / "pneumatic_seals" / name).is_file():
            pytest.skip(f"no measured data: {name} is not in {data / 'pneumatic_seals'}")
    arguments = [*logs[:3], "--test", logs[3], "--card", "pneumatic_seals"]
    found = traced(arguments, tmp_path / "trace", capsys)
    assert (found["verdict"], found["unknown"]["depends_on"][0]) == ("unknown", signal)
    first = found["effects"][0]
    assert first["key"] == "pressure_dependent_friction"
    assert first["params"]["mu_p"]["value"] is None  # the other chamber is open
    # At 3 bar constant friction is hardly off for the O-ring once its laser's spikes are gone.
    before, after = (found[when]["test"]["force_rms"] for when in ("before", "after"))
    assert after <= share * before


@pytest.mark.method
def test_emps_held_out_errors_do_not_rise(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    split_of("emps", data)
    found = traced(["--card", "emps"], tmp_path / "trace", capsys)
    assert [log["file"] for log in found["test_log"]] == ["DATA_EMPS_PULSES.mat"]
    before, after = found["before"]["test"], found["after"]["test"]
    for error in ("force_rms", "position_rms"):
        assert after[error] <= before[error]


@pytest.mark.method
def test_a_seismic_bearing_gives_way_before_it_slides(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    split_of("friction_backlash", data)
    found = traced(["--card", "friction_backlash"], tmp_path / "trace", capsys)
    assert [one["key"] for one in found["effects"]][:1] == ["presliding"]
    for error in ("force_rms", "force_relative"):
        before, after = (found[when]["test"][error] for when in ("before", "after"))
        assert after <= 0.85 * before


@pytest.mark.method
def test_a_pendulum_on_a_servo_has_its_gravity(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    split_of("xl330_servo", data)
    text = card_path("xl330_servo").read_text(encoding="utf-8")
    card = tmp_path / "card.toml"  # the torque in parts of that at full command
    card.write_text(text.replace("[rig]\n", "[rig]\nforce_per_command = 1.0\n"), encoding="utf-8")
    found = traced(["--card", str(card)], tmp_path / "trace", capsys)
    gravity = found["gravity"]
    assert gravity is not None and gravity["a"]["value"] == pytest.approx(0.76, rel=0.3)
    assert "spring" not in {one["key"] for one in found["effects"]}


@pytest.mark.slow
def test_a_training_log_is_no_test(
    data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (name,), _ = split_of("emps", data)
    out = tmp_path / "trace"
    capsys.readouterr()
    assert main(["trace", name, "--test", name, "--card", "emps", "--out", str(out)]) == 2
    shown = capsys.readouterr()
    assert "the same bytes as the training log" in shown.err
    assert len(shown.err.splitlines()) == 1 and not out.exists()
