"""`workbench fleet` as a user calls it, in an empty folder, on real processes."""

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from design.simulated.record import record
from tests.workbench.fleet.values import card_text
from workbench.cards.card import load_card
from workbench.cli import main
from workbench.steps.simulate import as_columns


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in, with the logs of two machines and one that is no Parquet."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("WORKBENCH_REGISTRY", raising=False)
    Path("logs").mkdir()
    Path("logs/card.toml").write_text(card_text(), encoding="utf-8")
    card = load_card(Path("logs/card.toml"))
    assert card.recipe is not None
    for number, name in enumerate(("a", "b")):
        Path("logs", name).mkdir()
        log = record(name, card.recipe, number, card.rig())
        pd.DataFrame(as_columns(log, card)).to_parquet(f"logs/{name}/1.parquet")
    Path("logs/c").mkdir()
    Path("logs/c/1.parquet").write_text("t,y\n0,0\n", encoding="utf-8")
    return tmp_path


def done(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 0) -> Any:
    """What a command prints as JSON."""
    capsys.readouterr()
    assert main([*arguments, "--json"]) == status
    return json.loads(capsys.readouterr().out)


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line on standard error of a command that is refused."""
    capsys.readouterr()
    assert main(list(arguments)) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1
    return shown.err


@pytest.mark.slow
def test_a_fleet_with_a_bad_log_and_then_again(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = done(capsys, "fleet", "logs", "--workers", "2", status=1)
    assert found["verdicts"] == {"identified": 2, "set_aside": 1}
    (bad,) = found["bad"]
    assert (bad["machine"], bad["verdict"]) == ("c", "set_aside")
    assert "c/1.parquet: is not a parquet file" in bad["reason"]
    table = pd.read_parquet("fleet/results").set_index("machine")
    assert table.loc[["a", "b"], "F_cp"].tolist() == pytest.approx([12.0, 12.0], rel=2e-2)
    assert json.loads(table.loc["a", "model"])["schema"] == "model/1"  # type: ignore[arg-type]
    state = done(capsys, "registry", "list")["machines"]
    assert [(one["name"], one["in_force"] is not None) for one in state] == [
        ("a", True),
        ("b", True),
        ("c", False),
    ]
    again = done(capsys, "fleet", "logs", "--workers", "1")
    assert (again["before"], again["verdicts"]) == (3, {})
    assert len(pd.read_parquet("fleet/results")) == 3


@pytest.mark.slow
def test_what_is_wrong_is_said_in_one_line(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "none: no logs" in refused(capsys, "fleet", "none")
    away = ["--cluster", "tcp://127.0.0.1:9", "--timeout", "1"]
    assert "--cluster tcp://127.0.0.1:9: not reached" in refused(capsys, "fleet", "logs", *away)
    line = refused(capsys, "fleet", "logs", "--card", "emsp")
    assert "did you mean 'emps'" in line
    line = refused(capsys, "fleet", "logs", "--workers", "1", *away)
    assert "leave one of both out" in line
    Path("file").touch()
    assert "is a file" in refused(capsys, "fleet", "logs", "--out", "file")
    Path("logs/card.toml").unlink()
    assert "give --card for all" in refused(capsys, "fleet", "logs", "--workers", "1")


def test_help_has_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fleet", "--help"]) == 0
    shown = capsys.readouterr().out
    assert "Example: workbench fleet" in shown and "--json" in shown and "--cluster" in shown
