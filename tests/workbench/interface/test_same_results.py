"""The functions of Python give, letter for letter, what the commands write."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import workbench as wb
from tests.chain import CARD
from workbench.cli import main
from workbench.interface.models import Result
from workbench.output import dumps

pytestmark = pytest.mark.slow

LOGS = ("day1.csv", "day2.csv")
BESIDE = ("report.html", "model.json", "response.csv")  # the document of a command
PULL = '''"""A magnet."""

from identification.effects._base import Effect, Param


def value(t, y, v, F, u, d, z, c, f, s, p):
    """-k y."""
    return -p[0] * y


EFFECT = Effect(
    key="pull", meaning="a magnet", equation="-k*y", source="our bench", acts="force",
    params=(Param("k", "N/m", 0.0, 1e6, 40.0, "its stiffness", linear=True),),
    value=value, depends_on=("y",),
)
'''


@dataclass(frozen=True)
class Bench:
    """A folder with a card, two logs, and what the commands made of them."""

    folder: Path

    def path(self, name: str) -> str:
        return str(self.folder / name)

    def frame(self, name: str) -> pd.DataFrame:
        return pd.read_csv(self.folder / name)

    def ran(self, out: str, *arguments: str) -> Path:
        """The folder that a command has written, by its status 0 or 1."""
        assert main([*arguments, "--out", self.path(out)]) in (0, 1)
        return self.folder / out


@pytest.fixture(scope="session")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    found = Bench(tmp_path_factory.mktemp("bench"))
    (found.folder / "card.toml").write_text(CARD, "utf-8")
    for seed, name in enumerate(LOGS):
        made = wb.simulate(found.path("card.toml"), seed=seed)
        made.frame.to_csv(found.folder / name, index=False, float_format="%.12g")
    found.ran("model", "identify", found.path("day1.csv"), "--card", found.path("card.toml"))
    found.ran("design", "design", found.path("model/model.json"))
    return found


@pytest.fixture(scope="session")
def model(bench: Bench) -> Any:
    return wb.identify(bench.path("day1.csv"), bench.path("card.toml"))


def the_same(found: Result, folder: Path, tmp_path: Path) -> None:
    """Asserts that the result's JSON and all its files are those of the command."""
    out = found.save(tmp_path / "saved")
    names = sorted(path.name for path in folder.iterdir())
    assert sorted(path.name for path in out.iterdir()) == names
    for name in names:
        assert (out / name).read_text("utf-8") == (folder / name).read_text("utf-8"), name
    (main_file,) = [name for name in names if name not in BESIDE] or [names[0]]
    if main_file.endswith(".json"):
        assert found.to_json() + "\n" == (folder / main_file).read_text("utf-8")


@pytest.mark.slow
def test_identify(bench: Bench, model: Any, tmp_path: Path) -> None:
    the_same(model, bench.folder / "model", tmp_path)


def test_identify_of_a_table(bench: Bench, model: Any) -> None:
    frame = bench.frame("day1.csv")
    frame.attrs["name"] = "day1.csv"
    found = json.loads(wb.identify(frame, bench.path("card.toml")).to_json())
    expected = json.loads(model.to_json())
    found["log"][0]["sha256"] = expected["log"][0]["sha256"]
    assert found == expected


def test_identify_by_keywords_in_other_units(bench: Bench, model: Any) -> None:
    frame = bench.frame("day1.csv")
    named = pd.DataFrame(
        {
            "Zeit [ms]": 1e3 * frame["t"],
            "Weg [mm]": 1e3 * frame["y"],
            "Kraft": frame["F"],
            "u": frame["u"],
            "r": frame["r"],
        }
    )
    signals = {"t": "Zeit [ms]", "y": "Weg [mm]", "F": ("Kraft", "N"), "u": "u", "r": "r"}
    found = wb.identify(named, rig="force", signals=signals)
    for name, one in model.model.friction.items():
        # Of other units the last bits differ, and with them where a search ends.
        assert found.model.friction[name].value == pytest.approx(one.value, rel=1e-4), name


@pytest.mark.slow
def test_trace(bench: Bench, tmp_path: Path) -> None:
    names = [bench.path(name) for name in LOGS]
    arguments = ("trace", names[0], "--test", names[1], "--card", bench.path("card.toml"))
    folder = bench.ran("trace", *arguments)
    found = wb.trace(names[0], names[1], bench.path("card.toml"))
    the_same(found, folder, tmp_path)
    assert (found.verdict, found.effects) == ("none", ())
    shown_well(found, "Nothing is missing")
    rest = found.residuals
    assert {"t", "v", "y", "before", "after", "noise"} <= set(rest)
    assert 0.3 < float(np.std(rest["before"] / rest["noise"])) < 3.0


@pytest.mark.slow
def test_design(bench: Bench, model: Any, tmp_path: Path) -> None:
    for given in (model, model.model, bench.path("model/model.json")):
        found = wb.design(given)
        assert found.to_json() + "\n" == (bench.folder / "design/design.json").read_text("utf-8")
    the_same(found, bench.folder / "design", tmp_path)
    asked = bench.ran("asked", "design", bench.path("model/model.json"), "--poles", "15,1")
    the_same(wb.design(model, poles=(15.0, 1.0)), asked, tmp_path / "asked")
    shown_well(found, " recommended, position loop every")


@pytest.mark.method
def test_robust_design(bench: Bench, model: Any, tmp_path: Path) -> None:
    arguments = ("design", bench.path("model/model.json"), "--robust", "--draws", "20")
    folder = bench.ran("robust", *arguments, "--poles", "15,1", "--seed", "4")
    found = wb.robust_design(model, wb.RobustAsked(draws=20, seed=4), poles=(15.0, 1.0))
    out = found.save(tmp_path / "saved")
    for name in ("design.json", "robust.json", "report.html"):
        assert (out / name).read_text("utf-8") == (folder / name).read_text("utf-8"), name
    assert len(found.frame) == 20
    assert found.passed == json.loads(found.to_json())["passed"]
    assert wb.validate(model, found.design).found.passed
    shown_well(found, "machines drawn")


@pytest.mark.slow
def test_validate(bench: Bench, model: Any, tmp_path: Path) -> None:
    paths = (bench.path("model/model.json"), bench.path("design/design.json"))
    folder = bench.ran("validation", "validate", *paths)
    found = wb.validate(model, wb.design(model))
    the_same(found, folder, tmp_path)
    assert found.to_json() == wb.validate(*paths).to_json()
    assert found.passed == json.loads(found.to_json())["passed"]
    shown_well(found, " in simulation")
    strict = wb.validate(model, wb.design(model), limits=wb.Limits(standstill=1e-9))
    assert not strict.passed


@pytest.mark.method
def test_experiment(bench: Bench, model: Any, tmp_path: Path) -> None:
    design = bench.path("design/design.json")
    arguments = (bench.path("model/model.json"), "--design", design, "--time", "6")
    folder = bench.ran("next", "experiment", *arguments, "--budget", "0.001", "--seed", "3")
    wanted = wb.Wanted(seconds=6.0, seed=3)
    found = wb.experiment(bench.path("model/model.json"), design=design, wanted=wanted, budget=1e-3)
    out = found.save(tmp_path / "saved")
    for name in ("reference.csv", "experiment.json", "report.html"):
        assert (out / name).read_text("utf-8") == (folder / name).read_text("utf-8"), name
    assert found.frame["r"].to_numpy() == pytest.approx(found.found.r)
    shown_well(found, "parameters identifiable from a run of")


def test_predict(bench: Bench, model: Any, tmp_path: Path) -> None:
    arguments = ("predict", bench.path("model/model.json"), bench.path("day2.csv"))
    card = ("--card", bench.path("card.toml"), "--window", "1")
    folder = bench.ran("prediction", *arguments, *card)
    found = wb.predict(model, bench.path("day2.csv"), window=1.0)
    the_same(found, folder, tmp_path)
    printed = json.loads(found.to_json())
    assert printed["position_rms"] == pytest.approx(1.4e-5, rel=0.3)  # the sensor's 1e-5 twice
    assert list(found.frame) == (folder / "prediction.csv").read_text().split("\n")[0].split(",")
    shown_well(found, "position (restarted every 1.0 s")
    of_table = wb.predict(model, bench.frame("day2.csv"), window=1.0)
    np.testing.assert_array_equal(of_table.frame.to_numpy(), found.frame.to_numpy())


@pytest.mark.slow
def test_axis_test(bench: Bench, tmp_path: Path) -> None:
    log, card = bench.path("day2.csv"), bench.path("card.toml")
    folder = bench.ran("axis", "axis-test", log, "--card", card)
    found = wb.axis_test(log, card)
    assert found.to_json() + "\n" == (folder / "axis_test.json").read_text("utf-8")
    assert found.report() == (folder / "report.html").read_text("utf-8")
    assert found.light == "yellow" and "no limits to test against" in found.reasons[0]
    shown_well(found, "YELLOW")


@pytest.mark.slow
def test_response(bench: Bench, model: Any, tmp_path: Path) -> None:
    arguments = ("response", bench.path("day1.csv"), bench.path("day2.csv"))
    given = ("--card", bench.path("card.toml"), "--model", bench.path("model/model.json"))
    folder = bench.ran("response", *arguments, *given)
    logs = [bench.path(name) for name in LOGS]
    found = wb.response(logs, bench.path("card.toml"), model=bench.path("model/model.json"))
    the_same(found, folder, tmp_path)
    assert list(found.frame) == (folder / "response.csv").read_text().split("\n")[0].split(",")
    shown_well(found, "The plant is identified from")


@pytest.mark.slow
def test_drift(bench: Bench, model: Any, tmp_path: Path) -> None:
    path = bench.path("model/model.json")
    arguments = ("drift", path, bench.path("day2.csv"), "--card", bench.path("card.toml"))
    folder = bench.ran("drift", *arguments, "--state", bench.path("state.json"))
    state = tmp_path / "state.json"
    found = wb.drift(path, bench.path("day2.csv"), bench.path("card.toml"), state=state)
    the_same(found, folder, tmp_path)
    assert state.read_text("utf-8") == (bench.folder / "state.json").read_text("utf-8")
    assert found.verdict == "none"
    again = wb.drift(model, bench.path("day2.csv"), state=state)
    assert "taken in before" in repr(again)
    shown_well(found, "No drift")


def test_simulate(bench: Bench, tmp_path: Path) -> None:
    folder = bench.ran("log", "simulate", bench.path("card.toml"), "--seed", "3")
    found = wb.simulate(bench.path("card.toml"), seed=3)
    written = found.frame.to_csv(index=False, float_format="%.12g")
    assert written == (folder / "short.csv").read_text("utf-8")
    assert found.to_json() + "\n" == (folder / "truth.json").read_text("utf-8")
    assert repr(found).startswith("short: 3001 samples every 0.002 s, seed 3")
    assert "<table" in found._repr_html_()


def test_read_logs(bench: Bench) -> None:
    (found,) = wb.read_logs(bench.path("day1.csv"), bench.path("card.toml"))
    raw = bench.frame("day1.csv")
    assert list(found) == list(raw) and found.attrs["name"] == "day1.csv"
    np.testing.assert_allclose(found.to_numpy(), raw.to_numpy(), rtol=0.0, atol=1e-9)
    mm = raw.assign(y=1e3 * raw["y"]).rename(columns={"y": "y [mm]"})
    (again,) = wb.read_logs(mm, rig="force")
    np.testing.assert_allclose(again["y"], found["y"], rtol=0.0, atol=1e-12)


@pytest.mark.slow
def test_effects(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "pull.py").write_text(PULL, "utf-8")
    for keys in ((), ("stribeck", "pull")):
        capsys.readouterr()
        assert main(["effects", "list", *keys, "--effects", str(tmp_path), "--json"]) == 0
        printed = json.loads(capsys.readouterr().out)
        assert json.loads(dumps(wb.effects(*keys, folders=[tmp_path]))) == printed
        assert not keys or [one["key"] for one in printed] == list(keys)
    wrong = PULL.replace("-p[0] * y", "p[0] * y")
    for text, status in ((PULL, 0), (wrong, 1)):
        (tmp_path / "pull.py").write_text(text, "utf-8")
        assert main(["effects", "check", str(tmp_path), "--json"]) == status
        printed = json.loads(capsys.readouterr().out)
        printed.pop("next", None)
        assert wb.check_effects(tmp_path) == printed
        assert printed["effects"]["pull"]["holds"] is (status == 0)


def test_how_a_model_shows_itself(model: Any) -> None:
    shown_well(model, "95 % interval")
    assert list(model.parameters.index[:2]) == ["m", "F_cp"]
    assert model.parameters.loc["F_cp", "unit"] == "N"
    assert model.parameters.loc["F_cp", "value"] == model.model.friction["F_cp"].value


def shown_well(found: Result, words: str) -> None:
    """Asserts that a result says these words as text and HTML, and that it draws something."""
    assert words in repr(found)
    assert "written:" not in repr(found)
    html = found._repr_html_()
    assert html.startswith("<p><b>")
    assert words in html or "<table>" in html
    drawn = found.plot()
    assert any(axes.lines or axes.collections for axes in drawn.axes)
    assert all(axes.get_xlabel() or axes.get_ylabel() for axes in drawn.axes[-1:])


def fit(frame: pd.DataFrame, **given: Any) -> object:
    return wb.identify(frame, **given)


COLUMNS = {"t": "t", "y": "y", "F": "F"}
WRONG: list[tuple[dict[str, Any], str]] = [
    ({}, "no machine given"),
    ({"card": "card.toml", "rig": "force"}, "card, and rig or signals beside it"),
    ({"rig": "foce"}, r"\[rig.kind\] 'foce': input should be"),
    ({"rig": "electro-pneumatic"}, "needs 'area_p_m2'"),
    ({"rig": {"kind": "force", "aera_p": 1}}, "did you mean 'area_p_m2'"),
    ({"rig": {"kind": "force", "area_p": "3 bar"}}, "a unit such as m"),
    ({"rig": {"kind": "force", "area_p": "much"}}, "rig area_p = 'much': unit 'much' is unknown"),
    ({"rig": {"kind": "force", "area_p": ""}}, "rig area_p = '': gain is empty"),
    ({"rig": "force", "signals": {"t": "t"}}, "no column for the signal 'y'"),
    ({"rig": "force", "signals": {**COLUMNS, "F": "G"}}, "signals.F: no column 'G'"),
    ({"rig": "force", "signals": {**COLUMNS, "y": "y [bar]"}}, "unit 'bar' is not a length"),
]
UNFIT: list[tuple[Callable[[Any], object], str]] = [
    (lambda m: wb.identify([], rig="force"), "no log given"),
    (lambda m: wb.trace(), "no log given"),
    (lambda m: wb.design(3), "int found, a model needed"),  # type: ignore[arg-type]
    (lambda m: wb.identify(3, rig="force"), "int found, a log needed"),  # type: ignore[arg-type]
    (lambda m: wb.design(m, structures=["lqr"]), "structure 'lqr': rst, pid, p-pi"),  # type: ignore[list-item]
    (lambda m: wb.validate(m, m), "IdentifyResult found, a design needed"),
    (lambda m: wb.simulate("demo", effects="my_own"), "my_own: no such folder"),
    (lambda m: wb.validate(m, "nowhere.json"), "nowhere.json"),
    (lambda m: wb.design(m).to_control("lqr"), "no controller 'lqr'"),
    (lambda m: wb.simulate("emps"), r"has no \[recipe\]"),
    (lambda m: m.to_arviz(), "no posterior was sampled"),
]


@pytest.mark.parametrize("axes", [("J1", "J2"), (1, 2)])
def test_rows_of_several_axes_in_turn_have_a_column_each(axes: tuple[Any, Any]) -> None:
    """As those of a file: it was said that the time repeats."""
    t, n = np.repeat(1e-3 * np.arange(2000), 2), 4000
    own = {"y": np.sin(np.arange(n)), "F": np.cos(np.arange(n))}
    frame = pd.DataFrame({"t": t, "axis": np.tile(axes, 2000), **own})
    with pytest.raises(wb.UserError, match=rf"there is: t, {axes[0]} y, {axes[1]} y, {axes[0]} F"):
        fit(frame, rig="force")


@pytest.mark.parametrize(("given", "words"), WRONG)
def test_a_machine_that_is_not_well_said(given: dict[str, Any], words: str, bench: Bench) -> None:
    with pytest.raises(wb.UserError, match=words) as caught:
        fit(bench.frame("day1.csv"), **given)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("call", "words"), UNFIT)
def test_what_cannot_be_done(call: Callable[[Any], object], words: str, model: Any) -> None:
    with pytest.raises(wb.UserError, match=words) as caught:
        call(model)
    assert len(str(caught.value).splitlines()) == 1


def test_units_of_the_machine(bench: Bench) -> None:
    from workbench.interface.inputs import sources

    rig = {
        "kind": "electro-pneumatic",
        "name": "bench-a",
        "area_p": "12.6 cm^2",
        "area_n": 10e-4,
        "supply_pressure": "5 bar",
        "control_limit": "5000 mV",
        "stroke": ("-150 mm", "0.15 m"),
    }
    frame = bench.frame("day1.csv")
    chambers: dict[str, Any] = {"p_p [bar]": 5.0 + frame["F"] / 252.0, "p_n [bar]": 5.0}
    found = sources(frame.assign(**chambers), None, rig, None)
    assert found.card.name == "bench-a"
    assert found.rig.area_p == pytest.approx(12.6e-4)
    assert found.rig.area_n == 10e-4
    assert found.rig.supply_pressure == pytest.approx(5e5)
    assert found.rig.control_limit == pytest.approx(5.0)
    assert found.rig.stroke == pytest.approx((-0.15, 0.15))
    np.testing.assert_allclose(found.runs[0].log["F"], 0.5 * frame["F"], atol=1e-6)


def test_an_index_of_times_is_the_clock(bench: Bench) -> None:
    from workbench.interface.inputs import sources

    frame = bench.frame("day1.csv").rename(columns={"t": "when"})
    frame["when"] = pd.Timestamp("2024-05-02") + pd.to_timedelta(frame["when"], unit="s")
    signals = {"t": "when", "y": "y", "F": "F"}
    by_index = sources(frame.set_index("when"), None, "force", signals)
    by_column = sources(frame, None, "force", signals)
    np.testing.assert_allclose(by_index.runs[0].log["t"], bench.frame("day1.csv")["t"], atol=1e-9)
    np.testing.assert_array_equal(by_index.runs[0].log["y"], by_column.runs[0].log["y"])
    assert by_index.runs[0].sha256 == by_column.runs[0].sha256


def test_missing_values_of_a_table_are_missing_samples(bench: Bench) -> None:
    from workbench.interface.inputs import sources

    frame = bench.frame("day1.csv").convert_dtypes()
    frame.loc[700, "y"] = pd.NA
    found = sources(frame, None, "force", None)
    assert [(one.signal, one.kind) for one in found.bad] == [("y", "missing")]


def test_several_tables_are_distinguished(bench: Bench) -> None:
    from workbench.interface.inputs import sources

    found = sources([bench.frame(name) for name in LOGS], None, "force", None)
    assert [run.file for run in found.runs] == ["DataFrame", "DataFrame 2"]
    with pytest.raises(wb.UserError, match="given twice"):
        named = [bench.frame(name) for name in LOGS]
        for one in named:
            one.attrs["name"] = "day"
        sources(named, None, "force", None)
