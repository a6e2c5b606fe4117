"""The drift command and what lies behind it: active model, stored stream, report, refusals."""

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from design.machine.active_model import active_model
from design.machine.documents import model_document
from design.machine.model import ParameterCorrelation
from design.measured.drift_of_logs import Drifted, Stream
from design.measured.drift_of_logs import Tested as OneRun
from identification.drift.drift_result import DriftTest, Shift, Statistic
from identification.drift.drift_test import DriftSettings
from identification.drift.mewma import fresh_state
from identification.drift.reference_model import OwnLogs
from identification.errors import BadModel
from identification.model.karnopp import NAMES
from tests.chain import CARD, TABLES, identified, model_of
from tests.reported import broken_in
from workbench.cli import main
from workbench.documents.result_files import read_model
from workbench.output import dumps
from workbench.report.drift import drift_sentence, reason_sentence
from workbench.steps.drift import model_key, read_stream


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a card, three logs of one machine, one of it changed, and the first's model."""
    folder = tmp_path_factory.mktemp("shop")
    (folder / "card.toml").write_text(CARD, encoding="utf-8")
    changed = CARD.replace("F_cp = 12.0", "F_cp = 15.0")
    (folder / "changed.toml").write_text(changed, encoding="utf-8")
    for card, seed, name in (("card", 5, "a"), ("card", 6, "b"), ("changed", 7, "c")):
        arguments = ["simulate", str(folder / f"{card}.toml"), "--seed", str(seed)]
        assert main([*arguments, "--out", str(folder / "made")]) == 0
        (folder / "made/short.csv").rename(folder / f"{name}.csv")
    identify = ["identify", str(folder / "a.csv"), "--card", str(folder / "card.toml")]
    assert main([*identify, "--out", str(folder / "model")]) == 0
    return folder


def run(shop: Path, out: Path, logs: str, *more: str) -> int:
    named = [str(shop / f"{name}.csv") for name in logs]
    model, card = str(shop / "model/model.json"), str(shop / "card.toml")
    return main(["drift", model, *named, "--card", card, "--out", str(out), *more])


@pytest.mark.slow
def test_no_drift_is_status_0_and_a_report(shop: Path, tmp_path: Path) -> None:
    assert run(shop, tmp_path / "d", "b") == 0
    found = json.loads((tmp_path / "d/drift.json").read_text(encoding="utf-8"))
    assert found["verdict"] == "none"
    (log,) = found["log"]
    assert set(NAMES) <= set(log["parameters"])
    after = log["parameters"]["F_cp"]["after"]
    assert after["low"] < 12.0 < after["high"]
    assert set(after) == {"value", "unit", "sd", "low", "high"}
    assert list(broken_in(found)) == []
    report = (tmp_path / "d/report.html").read_text(encoding="utf-8")
    assert '<figure class="chart"' in report and "No drift" in report


def test_what_could_not_have_been_seen_is_status_0_and_loud(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert run(shop, tmp_path / "d", "b", "--variation", "5", "--verbose") == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert shown.startswith("INCONCLUSIVE, which is no all-clear: b.csv: no alarm, but a change of")
    assert "minimum detectable change: none; inconclusive: m (" in shown
    found = json.loads((tmp_path / "d/drift.json").read_text(encoding="utf-8"))
    assert found["verdict"] == found["log"][0]["verdict"] == "not_judged"
    assert found["settings"]["to_be_seen"] == pytest.approx(0.10)
    assert found["log"][0]["could_have_seen"]["F_cp"] > 0.05
    assert set(NAMES) <= set(found["log"][0]["parameters"])


def test_an_older_log_is_no_comfort_for_a_newer_one_that_could_see_nothing() -> None:
    state = fresh_state("k", ())
    blank = DriftTest("none", state)
    tested = replace(blank, single=Statistic(0.0, 1.0, 1.0, 1))
    silent = replace(blank, verdict="not_judged")
    coarse = replace(tested, verdict="not_judged")
    model = identified().model
    source = identified().sources[0]
    for tests, verdict in (
        ((tested, coarse), "not_judged"),
        ((coarse, tested), "none"),
        ((tested, silent), "none"),
        ((silent,), "not_judged"),
    ):
        runs = tuple(OneRun(source, one, False) for one in tests)
        found = Drifted(model, "k", DriftSettings(), runs, Stream(state, ()), ())
        assert found.verdict == verdict


def test_a_change_has_the_number_that_the_table_has() -> None:
    def shift(change: float) -> Shift:
        after = 16.0 * (1.0 + change)
        return Shift("F_cp", "N", 16.0, 0.1, after, 0.1, after, after, change, 0.01, 0.0)

    one = Statistic(20.0, 12.0, 1e-6, 1)
    state, source = fresh_state("k", ()), identified().sources[0]
    by_log = DriftTest(
        "drift", state, moved=(shift(0.105),), shifts={"F_cp": shift(0.105)}, single=one, mean=one,
        found_by="log",
    )  # fmt: skip
    by_mean = replace(by_log, moved=(shift(0.103),), found_by="mean")
    for test, said in (
        (by_log, "F_cp +10.5 % ("),
        (by_mean, "F_cp +10.3 % (+8.34 % to +12.3 %), by the mean over"),
    ):
        runs = (OneRun(source, test, False),)
        found = Drifted(identified().model, "k", DriftSettings(), runs, Stream(state, ()), ())
        assert said in drift_sentence(found)
    assert reason_sentence(by_log, 0.1) == "moved: F_cp 16 -> 17.68 N"


def test_the_model_file_carries_its_own_logs_and_older_ones_keep_their_key(tmp_path: Path) -> None:
    model = identified().model
    own = OwnLogs(("m", "F_cp"), (0.01, None), (1.0, 2.0), (3.0, 4.0))
    path = tmp_path / "model.json"
    path.write_text(dumps(model_document(replace(model, own_logs=own))), encoding="utf-8")
    read = read_model(path)
    assert read.own_logs == own
    assert active_model(read, "k").own_logs == own
    document = model_document(replace(model, own_logs=None))
    del document["own_logs"], document["bad_samples"]  # as before there were any
    path.write_text(dumps(document), encoding="utf-8")
    assert model_key(read_model(path)) == hashlib.sha256(dumps(document).encode()).hexdigest()


@pytest.mark.slow
def test_drift_is_status_1_and_names_the_parameter(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert run(shop, tmp_path / "d", "bc", "--json") == 1
    found = json.loads(capsys.readouterr().out)
    assert [log["verdict"] for log in found["log"]] == ["none", "drift"]
    (moved,) = found["log"][1]["moved"]
    assert moved["name"] == "F_cp"
    assert moved["change"]["low"] < 0.25 < moved["change"]["high"]
    assert found["next"].startswith("workbench identify ") and "c.csv" in found["next"]


@pytest.mark.slow
def test_the_state_carries_the_test_and_counts_no_log_twice(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = tmp_path / "state.json"
    assert run(shop, tmp_path / "d", "a", "--state", str(state)) == 0
    assert run(shop, tmp_path / "d", "b", "--state", str(state)) == 0
    once = state.read_text(encoding="utf-8")
    stream = read_stream(state)
    assert stream is not None
    assert [one.file for one in stream.seen] == ["a.csv", "b.csv"]
    assert stream.state.logs == 2
    capsys.readouterr()
    assert run(shop, tmp_path / "d", "b", "--state", str(state)) == 0
    assert "taken in before" in " ".join(capsys.readouterr().out.split())
    assert state.read_text(encoding="utf-8") == once
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


@pytest.mark.slow
def test_a_verdict_does_not_hang_on_the_command_it_came_in(shop: Path, tmp_path: Path) -> None:
    assert run(shop, tmp_path / "one", "b") == 0
    assert run(shop, tmp_path / "two", "ab") == 0
    one = json.loads((tmp_path / "one/drift.json").read_text(encoding="utf-8"))
    two = json.loads((tmp_path / "two/drift.json").read_text(encoding="utf-8"))
    alone, second = one["log"][0], two["log"][1]
    assert alone["chi_square"] == second["chi_square"]
    for name, shift in alone["parameters"].items():
        assert shift["after"]["value"] == second["parameters"][name]["after"]["value"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "is not JSON"),
        ('{"schema": "model/1"}', "'drift_stream/1' needed"),
        ('{"schema": "drift_stream/1", "seen": [], "state": {"model": "x"}}', "has no 'names'"),
    ],
)
def test_a_bad_state_is_one_line_and_status_2(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, said: str
) -> None:
    state = tmp_path / "state.json"
    state.write_text(text, encoding="utf-8")
    capsys.readouterr()
    assert run(shop, tmp_path / "d", "b", "--state", str(state)) == 2
    shown = capsys.readouterr()
    assert shown.out == "" and len(shown.err.splitlines()) == 1
    assert said in shown.err
    assert state.read_text(encoding="utf-8") == text
    assert not (tmp_path / "d").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--margin", "120"], "margin"),
        (["--run-length", "2"], "run_length"),
        (["--state", "."], "is a directory"),
    ],
)
def test_wrong_options_are_one_line_and_status_2(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    capsys.readouterr()
    assert run(shop, tmp_path / "d", "b", *arguments) == 2
    shown = capsys.readouterr()
    assert len(shown.err.splitlines()) == 1 and said in shown.err


@pytest.mark.slow
def test_a_state_of_another_model_is_said_and_left_aside(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    state = tmp_path / "state.json"
    assert run(shop, tmp_path / "d", "a", "--state", str(state)) == 0
    document = json.loads(state.read_text(encoding="utf-8"))
    document["state"]["model"] = "another"
    state.write_text(dumps(document), encoding="utf-8")
    capsys.readouterr()
    assert run(shop, tmp_path / "d", "b", "--state", str(state)) == 0
    assert "of another model" in " ".join(capsys.readouterr().out.split())
    stream = read_stream(state)
    assert stream is not None and stream.state.logs == 1


def test_a_model_of_another_kind_of_rig_is_refused(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    motor = tmp_path / "motor.json"
    model = model_of(TABLES["paper_table2"], k_a=20.0)
    motor.write_text(dumps(model_document(model)), encoding="utf-8")
    capsys.readouterr()
    arguments = ["drift", str(motor), str(shop / "b.csv"), "--card", str(shop / "card.toml")]
    assert main([*arguments, "--out", str(tmp_path / "d")]) == 2
    assert "give the model and the card of one machine" in capsys.readouterr().err


def test_the_model_file_keeps_the_covariance_of_the_fit(tmp_path: Path) -> None:
    found = identified()
    path = tmp_path / "model.json"
    path.write_text(dumps(model_document(found.model)), encoding="utf-8")
    model = read_model(path)
    known = active_model(model, model_key(model))
    assert known.names == found.fit.free
    off = found.fit.covariance[0, 1] / np.sqrt(
        found.fit.covariance[0, 0] * found.fit.covariance[1, 1]
    )
    mine = known.covariance[0, 1] / np.sqrt(known.covariance[0, 0] * known.covariance[1, 1])
    assert abs(off) > 0.01
    assert mine == pytest.approx(off)
    assert model_key(model) == model_key(found.model)
    assert known.fastest > 0.05


def test_an_older_model_file_without_a_correlation_is_read() -> None:
    model = replace(identified().model, correlation=None)
    known = active_model(model, "k")
    assert known.covariance == pytest.approx(np.diag(np.diag(known.covariance)))


def test_a_correlation_that_is_none_is_refused() -> None:
    with pytest.raises(BadModel, match="square"):
        ParameterCorrelation(("m", "F_cp"), ((1.0,), (1.0,)))
    with pytest.raises(BadModel, match="-1 to 1"):
        ParameterCorrelation(("m", "F_cp"), ((1.0, 2.0), (2.0, 1.0)))


@pytest.mark.slow
def test_a_slip_of_unit_is_called_so_and_not_drift(
    shop: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    slipped = pd.read_csv(shop / "b.csv")
    slipped["y"] *= 10.0
    slipped.to_csv(shop / "z.csv", index=False)
    assert run(shop, tmp_path / "d", "z") == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "In z.csv: no wear but a slip of unit or scale" in said
    assert "every length by the factor 10 (the unit of the position 1/10" in said
    assert "workbench doctor" in said
