"""`init` and `doctor` through the command line: files, exit status, questions on a terminal."""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.bad_inputs.shop import CARDS
from workbench.cards.card import load_card
from workbench.cli import main


@pytest.fixture
def shop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a log, into which one has gone."""
    (tmp_path / "made.toml").write_text(CARDS["force"], "utf-8")
    assert main(["simulate", str(tmp_path / "made.toml"), "--out", str(tmp_path / "log")]) == 0
    (tmp_path / "log/force.csv").rename(tmp_path / "run.csv")
    (tmp_path / "notes.txt").write_text("Monday: changed the seal\nTuesday: run 7\n", "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 2) -> str:
    capsys.readouterr()
    assert main(list(arguments)) == status
    shown = capsys.readouterr()
    assert len(shown.err.splitlines()) == 1
    return shown.err


@pytest.mark.slow
def test_from_a_log_to_a_card_to_what_it_tells(
    shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init", "run.csv"]) == 0
    shown = capsys.readouterr().out
    assert "next: workbench doctor run.csv --card card.toml" in shown
    card = load_card(shop / "card.toml")
    assert {"t", "r", "y", "F", "u"} == set(card.signals)
    text = (shop / "card.toml").read_text("utf-8")
    assert "# sure: " in text and "# guess: " in text
    assert main(["doctor", "run.csv", "--card", "card.toml", "--out", "look"]) == 0
    assert {path.name for path in (shop / "look").iterdir()} == {"doctor.json", "doctor.png"}
    assert not list(shop.glob(".*.part"))
    capsys.readouterr()
    assert main(["doctor", "run.csv", "--card", "card.toml", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["told"]["m"]["can"] is True
    assert found["schema"] == "doctor/1"


def test_json_holds_what_the_card_says(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["init", "run.csv", "--json", "--out", "new/bench.toml", "--name", "bench"]) == 0
    found = json.loads(capsys.readouterr().out)
    card = tomllib.loads((shop / "new/bench.toml").read_text("utf-8"))
    assert card["card"]["name"] == found["card"] == "bench"
    assert found["signals"]["F"]["column"] == card["signals"]["F"]["column"] == "F"
    assert found["refused"] is None


def test_a_card_that_is_there_stays(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (shop / "card.toml").write_text("mine", "utf-8")
    assert "--force" in refusal(capsys, "init", "run.csv")
    assert (shop / "card.toml").read_text("utf-8") == "mine"
    assert main(["init", "run.csv", "--force"]) == 0
    assert (shop / "card.toml").read_text("utf-8") != "mine"


def test_a_folder_gets_the_card_though_it_is_not_there_yet(shop: Path) -> None:
    (shop / "bench").mkdir()
    for folder in ("bench", "new/"):
        assert main(["init", "run.csv", "--out", folder]) == 0
        assert (shop / folder / "card.toml").is_file()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["init", "nowhere.csv"], "no such file"),
        (["init", "notes.txt"], "notes.txt: row 2 ('Tuesday: run 7') has 3 fields"),
        (["init", "."], "is a directory"),
        (["init", "run.csv", "--out", "run.csv/card.toml"], "cannot be written"),
        (["doctor", "run.csv"], "workbench init run.csv"),
        (["doctor", "--card", "made.toml"], "LOG is missing"),
        (["doctor", "nowhere.csv", "--card", "made.toml"], "no such file"),
    ],
)
def test_each_wrong_line_is_refused_in_one(
    shop: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    before = {path.name for path in shop.rglob("*")}
    assert said in refusal(capsys, *arguments)
    assert {path.name for path in shop.rglob("*")} == before


def test_a_log_that_cannot_be_identified_ends_with_1(
    shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    turned = CARDS["force"].replace('"F", unit = "N"', '"F", gain = -1, unit = "N"')
    (shop / "made.toml").write_text(turned, "utf-8")
    capsys.readouterr()
    assert main(["doctor", "run.csv", "--card", "made.toml"]) == 1
    shown = capsys.readouterr().out
    assert "wrong sign" in " ".join(shown.split())
    then = "next (what the columns seem to be): workbench init run.csv --out made-new.toml"
    assert shown.splitlines()[-1] == then


def test_the_installation_and_a_registry_that_is_away(
    shop: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("WORKBENCH_DATA", raising=False)
    monkeypatch.delenv("WORKBENCH_REGISTRY", raising=False)
    capsys.readouterr()
    assert main(["doctor", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["registry"] is None and found["wrong"] == []
    assert main(["registry", "list", "--registry", "new.db"]) in (0, 2)
    capsys.readouterr()
    assert main(["doctor", "--registry", "away.db", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["registry"]["answers"] is False
    assert found["next"] == "workbench doctor --registry away.db"
    assert not (shop / "away.db").exists()
    url = "postgresql://me:secret@127.0.0.1:1/none"
    assert main(["doctor", "--registry", url]) == 1
    shown = capsys.readouterr()
    assert "secret" not in shown.out + shown.err


def on_a_terminal(answers: str, *arguments: str) -> tuple[int, str]:
    """Exit status and screen of the command line on a terminal of its own, with these answers."""
    import pty

    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "workbench", *arguments],
        stdin=theirs, stdout=theirs, stderr=theirs, close_fds=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    os.close(theirs)
    os.write(ours, answers.encode())
    shown = b""
    while True:
        try:
            part = os.read(ours, 4096)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        shown += part
    os.close(ours)
    return process.wait(), shown.decode("utf-8", "replace")


@pytest.mark.slow
def test_a_terminal_is_asked_about_each_guess(shop: Path) -> None:
    (shop / "card.toml").write_text("mine", "utf-8")
    status, shown = on_a_terminal("n\n", "init", "run.csv")
    assert status == 2
    assert (shop / "card.toml").read_text("utf-8") == "mine"
    status, shown = on_a_terminal("y\n\n\n\n\nfurlong\nkN\n\n\n\n\n", "init", "run.csv")
    assert status == 0, shown
    assert "neither a column nor a unit" in shown
    card = tomllib.loads((shop / "card.toml").read_text("utf-8"))
    assert card["signals"]["F"]["unit"] == "kN"
    assert "confirmed on a terminal" in (shop / "card.toml").read_text("utf-8")
