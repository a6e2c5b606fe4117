"""`registry`, `reidentify` and `watch` as a user calls them, in an empty folder."""

import json
import sqlite3
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from design.machine.documents import design_document, model_document
from identification.model.plant import Actuator
from tests.chain import CARD, TABLES, designed, model_of
from tests.workbench.jobs.listener import listening
from workbench.cli import main
from workbench.output import dumps

pytestmark = pytest.mark.slow

ACTUATOR = Actuator(19530.0, 10405.0)
WHY = ["--reason", "a test", "--by", "tester"]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in, with two models and their designs."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("WORKBENCH_REGISTRY", raising=False)
    for number, table in enumerate(("paper_table1", "paper_table2"), 1):
        model = model_of(TABLES[table], ACTUATOR)
        Path(f"model{number}.json").write_text(dumps(model_document(model)), encoding="utf-8")
        made = dumps(design_document(designed(model)))
        Path(f"design{number}.json").write_text(made, encoding="utf-8")
    return tmp_path


def done(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 0) -> Any:
    """What a command prints as JSON."""
    capsys.readouterr()
    assert main([*arguments, "--json"]) == status
    return json.loads(capsys.readouterr().out)


def refused(capsys: pytest.CaptureFixture[str], arguments: Sequence[str], status: int = 2) -> str:
    """The one line on standard error of a command that ends with `status`."""
    capsys.readouterr()
    assert main(list(arguments)) == status
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1
    return shown.err


def filled(capsys: pytest.CaptureFixture[str]) -> None:
    """Two versions of one machine, the second active."""
    for n in (1, 2):
        files = [f"model{n}.json", f"design{n}.json"]
        found = done(capsys, "registry", "add", "bench", *files, "--promote", *WHY)
        assert found["number"] == n


@pytest.mark.parametrize("name", ["list", "show", "diff", "add", "promote", "rollback", "retry"])
def test_every_subcommand_has_help_with_an_example(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["registry", name, "--help"]) == 0
    shown = capsys.readouterr().out
    assert f"Example: workbench registry {name}" in shown
    assert "--json" in shown and "--registry" in shown


@pytest.mark.slow
def test_add_promote_and_roll_back(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    filled(capsys)
    (machine,) = done(capsys, "registry", "list")["machines"]
    assert (machine["name"], machine["in_force"]["number"]) == ("bench", 2)
    assert done(capsys, "registry", "rollback", "bench", *WHY)["number"] == 1
    assert done(capsys, "registry", "promote", "bench", "2", *WHY)["kind"] == "promoted"
    shown = done(capsys, "registry", "show", "bench")
    assert [(d["kind"], d["number"]) for d in shown["decisions"]] == [
        ("added", 1),
        ("promoted", 1),
        ("added", 2),
        ("promoted", 2),
        ("rolled_back", 1),
        ("promoted", 2),
    ]
    assert {d["reason"] for d in shown["decisions"]} == {"a test"}
    assert {d["made_by"] for d in shown["decisions"]} == {"tester"}


@pytest.mark.slow
def test_diff_shows_both_sides(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    filled(capsys)
    found = done(capsys, "registry", "diff", "bench")
    lines = {line["name"]: line for line in found["parameters"]}
    mass = lines["m"]
    assert (mass["unit"], mass["before"]["value"], mass["after"]["value"]) == ("kg", 1.0, 3.5)
    assert mass["change"] == pytest.approx(2.5)
    assert mass["apart"] is True
    assert lines["k1"]["apart"] is False
    assert lines["F_cp"]["before"]["low"] == pytest.approx(12.0 * 0.998)
    assert lines["rst.dominant.w_n"]["unit"] == "rad/s"
    assert found["parameters"] != done(capsys, "registry", "diff", "bench", "2", "1")["parameters"]
    assert main(["registry", "diff", "bench", "1", "2"]) == 0
    shown = capsys.readouterr().out
    assert "version 1" in shown and "+250 %" in shown and "N s/m" in shown


@pytest.mark.slow
def test_show_writes_the_files_of_a_version(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    filled(capsys)
    assert main(["registry", "show", "bench", "1", "--out", "old"]) == 0
    for kind in ("model", "design"):
        written = json.loads((here / "old" / f"{kind}.json").read_text(encoding="utf-8"))
        assert written == json.loads((here / f"{kind}1.json").read_text(encoding="utf-8"))
    assert main(["validate", "old/model.json", "old/design.json", "--out", "v"]) in (0, 1)


def test_what_is_wrong_is_said_in_one_line(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "no such file" in refused(capsys, ["registry", "list"])
    missing = ["registry", "add", "bench", "none.json", *WHY]
    assert "none.json: no such file" in refused(capsys, missing)
    swapped = ["registry", "add", "bench", "design1.json", "model1.json", *WHY]
    assert "'model/1' needed" in refused(capsys, swapped)
    assert not (here / "registry.db").exists()
    filled(capsys)
    assert "no machine 'bnch'" in refused(capsys, ["registry", "show", "bnch"])
    assert "no version 3" in refused(capsys, ["registry", "diff", "bench", "1", "3"])
    assert "is active already" in refused(capsys, ["registry", "promote", "bench", "2", *WHY])
    assert "--reason" in refused(capsys, ["registry", "rollback", "bench"])
    empty = ["registry", "rollback", "bench", "--reason", " "]
    assert "--reason is empty" in refused(capsys, empty)
    away = ["registry", "list", "--registry", "postgresql://u:secret@127.0.0.1:9/x"]
    line = refused(capsys, away)
    assert "secret" not in line and "127.0.0.1" in line


@pytest.mark.slow
def test_reidentify_from_nothing_to_a_new_version(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = CARD.replace("duration_s = 6.0", "duration_s = 10.0")
    logs = here / "machines" / "a" / "logs"
    logs.mkdir(parents=True)
    (logs.parent / "card.toml").write_text(card, encoding="utf-8")
    new = card.replace("F_cp = 12.0", "F_cp = 16.0").replace("F_sp = 20.6", "F_sp = 26.0")
    new = new.replace("F_vp = 300.0", "F_vp = 380.0")
    for name, text in (("1", card), ("2", new)):
        Path(f"{name}.toml").write_text(text, encoding="utf-8")
        assert main(["simulate", f"{name}.toml", "--seed", name, "--out", name]) == 0
    (here / "1" / "short.csv").rename(logs / "1.csv")
    pass_ = ["reidentify", "machines", "--settle", "0", "--metrics", "m.prom"]
    assert done(capsys, *pass_)["without_model"] == ["a"]
    (first,) = done(capsys, *pass_, "--first", status=1)["outcomes"]
    assert (first["verdict"], first["number"]) == ("promoted", None)
    (here / "2" / "short.csv").rename(logs / "2.csv")
    (logs / "3.csv").write_text("t,y\n0,0\n", encoding="utf-8")
    found = done(capsys, *pass_, status=1)["outcomes"]
    assert [one["verdict"] for one in found] == ["promoted", "set_aside"]
    assert "F_cp 12 -> 16 N" in found[0]["reason"]
    assert done(capsys, *pass_)["outcomes"] == []
    text = (here / "m.prom").read_text(encoding="utf-8")
    assert 'servo_workbench_version_in_force{machine="a"} 3.0' in text  # 2 is the refused one
    assert done(capsys, "registry", "retry", "a", *WHY)["logs"] == ["3.csv"]
    assert [o["verdict"] for o in done(capsys, *pass_, status=1)["outcomes"]] == ["set_aside"]


def test_a_wrong_card_stops_its_machine_only(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a", "b"):
        logs = here / "machines" / name / "logs"
        logs.mkdir(parents=True)
        (logs / "1.csv").write_text("t,y\n0,0\n", encoding="utf-8")
        done(capsys, "registry", "add", name, "model1.json", "--promote", *WHY)
    (here / "machines" / "a" / "card.toml").write_text("[card", encoding="utf-8")
    (here / "machines" / "b" / "card.toml").write_text(CARD, encoding="utf-8")
    capsys.readouterr()
    assert main(["reidentify", "machines", "--settle", "0"]) == 2
    shown = capsys.readouterr()
    assert "error: a: " in shown.err.splitlines()[-1] and "is not TOML" in shown.err
    assert "excluded" in shown.out


def test_alarms_that_are_not_taken_are_reported(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("Pr\u00fcfstand", "b"):
        logs = here / "machines" / name / "logs"
        logs.mkdir(parents=True)
        (logs / "1.csv").write_text("t,y\n0,0\n", encoding="utf-8")
        (logs.parent / "card.toml").write_text(CARD, encoding="utf-8")
        done(capsys, "registry", "add", name, "model1.json", "--promote", *WHY)
    with listening() as listener:
        listener.by_machine = {"b": 403}
        address = f"http://me:geheim@127.0.0.1:{listener.server_port}/geheim?token=geheim"
        pass_ = ["reidentify", "machines", "--settle", "0", "--webhook", address, "--json"]
        for sent, judged in ((1, 2), (0, 0)):
            assert main([*pass_, "--debug"]) == 2
            shown = capsys.readouterr()
            found = json.loads(shown.out)
            assert (found["alarms"]["sent"], found["alarms"]["waiting"]) == (sent, 1)
            assert len(found["outcomes"]) == judged
            assert shown.err.splitlines()[-1].startswith("error: --webhook: 1 alarm not taken")
            assert "geheim" not in shown.err + shown.out
        assert [one["machine"] for one in listener.taken] == ["Pr\u00fcfstand"]
    assert done(capsys, "reidentify", "machines", "--settle", "0")["alarms"] is None


def test_bad_places_and_options_of_jobs(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "machines: no such folder" in refused(capsys, ["reidentify", "machines"])
    (here / "machines").mkdir()
    line = refused(capsys, ["reidentify", "machines", "--webhook", "example.org"])
    assert "http://... or https://... needed" in line
    line = refused(capsys, ["reidentify", "machines", "--margin", "2"])
    assert "--margin" in line
    (here / "notes.db").write_text("text, no database\n" * 100, encoding="utf-8")
    line = refused(capsys, ["reidentify", "machines", "--registry", "notes.db"])
    assert "not a database" in line
    with sqlite3.connect(here / "other.db") as other:
        other.execute("CREATE TABLE machine (x)")
    other.close()
    line = refused(capsys, ["reidentify", "machines", "--registry", "other.db"])
    assert "holds a table 'machine' of something else" in line
    capsys.readouterr()
    assert main(["watch", "machines", "--cron", "often"]) == 2
    assert "five fields needed" in capsys.readouterr().err.splitlines()[-1]
