"""`workbench trace` on logs of a machine whose effect no card declares."""

import json
from pathlib import Path

import pytest

from workbench.cli import main
from workbench.documents.result_files import read_model
from workbench.logs.sources import card_path


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two logs of the demo's machine, 20 s each, of different steps and noise."""
    folder = tmp_path_factory.mktemp("shop")
    text = card_path("demo").read_text(encoding="utf-8").replace("60.0", "20.0")
    (folder / "card.toml").write_text(text, encoding="utf-8")
    for name, seed in (("train", "4"), ("test", "104")):
        command = ["simulate", str(folder / "card.toml"), "--seed", seed]
        assert main([*command, "--out", str(folder / name)]) == 0
        (folder / name / "demo.csv").rename(folder / f"{name}.csv")
    return folder


@pytest.mark.slow
def test_the_effect_is_found_and_written(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    train, test, card = (str(shop / name) for name in ("train.csv", "test.csv", "card.toml"))
    out = tmp_path / "trace"
    capsys.readouterr()
    assert main(["trace", train, "--test", test, "--card", card, "--out", str(out), "--json"]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    found = json.loads(shown.out)
    assert {path.name for path in out.iterdir()} == {"trace.json", "model.json", "report.html"}
    assert json.loads((out / "trace.json").read_text(encoding="utf-8")).items() <= found.items()
    assert found["verdict"] == "effect"
    (effect,) = found["effects"]
    assert effect["key"] == "stribeck"
    assert effect["params"]["F_s"]["value"] == pytest.approx(3.5, rel=0.02)
    before, after = (found[when]["test"]["force_rms"] for when in ("before", "after"))
    assert after < 1.5 * found["noise_floor"]["force_rms"] < 0.3 * before
    assert [log["file"] for log in found["log"] + found["test_log"]] == ["train.csv", "test.csv"]
    model = read_model(out / "model.json")
    assert [acting.key for acting in model.acting] == ["stribeck"]
    assert main(["predict", str(out / "model.json"), test, "--card", card, "--out", str(out)]) == 0


def test_bad_input_is_one_line_and_writes_nothing(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    train, card, out = str(shop / "train.csv"), str(shop / "card.toml"), tmp_path / "out"
    (tmp_path / "copy.csv").write_bytes((shop / "train.csv").read_bytes())
    capsys.readouterr()
    for arguments, needed in (
        ([train, "--test", str(tmp_path / "copy.csv")], "copy.csv: the same bytes as the training"),
        ([train, "--test", train], "train.csv: the same bytes as the training log train.csv"),
        ([train, "--test", "no.csv"], "no such file"),
        ([], "no log to train on is named"),
        ([train, "--effects", str(tmp_path / "none")], "no such folder"),
    ):
        assert main(["trace", *arguments, "--card", card, "--out", str(out)]) == 2
        shown = capsys.readouterr()
        assert shown.out == "" and len(shown.err.splitlines()) == 1
        assert needed in shown.err
        assert not out.exists()
