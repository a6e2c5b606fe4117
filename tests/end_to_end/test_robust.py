"""`design --robust` as a user calls it: its files, its drift from the registry, its refusals."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from design.machine.documents import design_document, model_document
from tests.chain import TABLES, designed, model_of
from workbench.cli import main
from workbench.output import dumps

pytestmark = pytest.mark.slow

FRICTION = TABLES["paper_table2"]
QUICK = ("--draws", "20", "--poles", "12,1")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder with two models of a motor, between which F_cp rose by a tenth."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("WORKBENCH_REGISTRY", raising=False)
    for number, rise in enumerate((1.0, 1.1), 1):
        model = model_of(replace(FRICTION, F_cp=rise * FRICTION.F_cp), k_a=35.0)
        Path(f"model{number}.json").write_text(dumps(model_document(model)), encoding="utf-8")
        made = dumps(design_document(designed(model)))
        Path(f"design{number}.json").write_text(made, encoding="utf-8")
    return tmp_path


def done(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 0) -> Any:
    """What a command prints as JSON."""
    capsys.readouterr()
    assert main([*arguments, "--json"]) == status
    return json.loads(capsys.readouterr().out)


@pytest.mark.method
@pytest.mark.slow
def test_its_files_serve_validate_and_export(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = done(capsys, "design", "model1.json", "--robust", *QUICK, "--out", "made")
    assert found["passed"] and found["schema"] == "robust/1"
    files = sorted(path.name for path in Path("made").iterdir())
    assert files == ["design.json", "report.html", "robust.json"]
    assert json.loads(Path("made/design.json").read_text("utf-8")) == found["design"]
    assert main(["validate", "model1.json", "made/design.json"]) == 0
    assert main(["export", "made/design.json", "--to", "c", "--out", "code"]) == 0


@pytest.mark.method
def test_a_machines_drift_so_far_widens_the_draws(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for n in (1, 2):
        files = (f"model{n}.json", f"design{n}.json")
        why = ("--promote", "--reason", "a test", "--by", "tester")
        assert main(["registry", "add", "bench", *files, *why]) == 0
    found = done(capsys, "design", "model2.json", "--robust", *QUICK, "--machine", "bench")
    assert found["drift"] == {"F_cp": pytest.approx(0.0953, rel=1e-2)}


@pytest.mark.method
def test_what_no_loop_keeps_ends_with_the_run_to_make(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ("design", "model1.json", "--robust", *QUICK, "--tracking", "1e-9")
    found = done(capsys, *arguments, status=1)
    assert found["recommended"] == "none"
    assert found["next"].startswith("workbench experiment")


@pytest.mark.parametrize(
    "option", [("--draws", "50"), ("--staircase", "1e-4"), ("--seed", "1"), ("--machine", "bench")]
)
def test_options_of_its_own_need_it(
    here: Path, capsys: pytest.CaptureFixture[str], option: tuple[str, str]
) -> None:
    assert main(["design", "model1.json", *option]) == 2
    said = capsys.readouterr().err
    assert f"{option[0]} has no meaning without --robust" in said
    assert not Path("runs").exists()


def test_a_machine_that_the_registry_has_not_is_named(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    why = ("--reason", "a test", "--by", "tester")
    assert main(["registry", "add", "bench", "model1.json", "design1.json", *why]) == 0
    capsys.readouterr()
    assert main(["design", "model1.json", "--robust", "--machine", "other"]) == 2
    assert "other" in capsys.readouterr().err
