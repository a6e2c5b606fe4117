"""Documents whose unit was changed: the contradiction is refused, the rest is said in results."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from design.controllers.design import design
from design.machine.documents import design_document, model_document
from identification.errors import BadModel
from identification.model.estimates import Estimate
from identification.model.plant import Actuator
from tests.chain import EMPS, TABLES, identified, model_of
from workbench.cli import main
from workbench.documents.result_files import read_design, read_model
from workbench.output import dumps

pytestmark = pytest.mark.slow

Document = dict[str, Any]
NUMBERS = ("value", "sd", "low", "high")


@cache
def texts() -> tuple[str, str]:
    """An identified model and its design."""
    model = identified().model
    return dumps(model_document(model)), dumps(design_document(design(model)))


def model_file(folder: Path, change: Callable[[Document], None]) -> Path:
    document = json.loads(texts()[0])
    change(document)
    path = folder / "model.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def design_file(folder: Path, change: Callable[[Document], None] = lambda _: None) -> Path:
    document = json.loads(texts()[1])
    change(document)
    path = folder / "design.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def in_grams(document: Document) -> None:
    """The mass properly in grams."""
    mass = document["friction"]["m"]
    mass |= {key: 1e3 * mass[key] for key in NUMBERS} | {"unit": "g"}


def unit_of(table: str, name: str, unit: str) -> Callable[[Document], None]:
    def change(document: Document) -> None:
        document[table][name]["unit"] = unit

    return change


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "unit", "why"),
    [
        ("m", "g", "but with the noise of its logs it is at least"),
        ("m", "Gg", "could not bring it to their speed"),
        ("F_cp", "kN", "F_cn is"),
        ("F_cn", "mN", "F_cp is"),
        ("F_vp", "kN s/m", "F_vn is"),
        ("F_vn", "N s/km", "F_vp is"),
        ("dv_p", "mm/s", "dv_n is"),
        ("F_sp", "kN", "F_sn is"),
        ("F_sn", "mN", "F_sp is"),
    ],
)
def test_a_unit_changed_alone_contradicts_the_model(
    tmp_path: Path, name: str, unit: str, why: str
) -> None:
    with pytest.raises(BadModel) as caught:
        read_model(model_file(tmp_path, unit_of("friction", name, unit)))
    text = str(caught.value)
    assert f"[friction.{name}] " in text
    assert unit in text
    assert why in text
    assert "if only the unit was changed, write" in text
    assert "\n" not in text


@pytest.mark.slow
def test_all_forces_in_kilonewton_are_beyond_the_logs(tmp_path: Path) -> None:
    def change(document: Document) -> None:
        for name in ("F_cp", "F_cn", "F_sp", "F_sn"):
            document["friction"][name]["unit"] = "kN"

    with pytest.raises(BadModel, match="the largest force of its logs is"):
        read_model(model_file(tmp_path, change))


def test_a_motor_s_constant_is_that_of_its_rig(tmp_path: Path) -> None:
    model = model_of(EMPS, k_a=35.15)
    model = replace(model, rig=replace(model.rig, force_per_command=35.15))
    document = json.loads(dumps(model_document(model)))
    path = tmp_path / "model.json"
    document["actuator"]["k_a"]["unit"] = "kN/V"
    path.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(BadModel, match=r"\[actuator.k_a\] 35.15 kN/V cannot be: force_per_command"):
        read_model(path)
    document["actuator"]["k_a"] |= {"value": 35.15e-3}
    path.write_text(json.dumps(document), encoding="utf-8")
    assert len(read_model(path).read) == 1


@pytest.mark.slow
def test_a_converted_value_is_read_and_said(tmp_path: Path) -> None:
    found = read_model(model_file(tmp_path, in_grams))
    plain = identified().model
    assert found.karnopp.m == pytest.approx(plain.karnopp.m)
    (line,) = found.read
    assert line.startswith("[friction.m] is written in 'g', where our commands write 'kg': read as")
    assert "kg, 1/1000 of the number that stands there" in line
    assert "read" not in model_document(found)


def test_another_spelling_of_the_unit_is_not_worth_a_word(tmp_path: Path) -> None:
    found = read_model(model_file(tmp_path, unit_of("friction", "F_vp", "N*s/m")))
    assert found.read == ()


def test_a_posterior_s_units_are_read_too(tmp_path: Path) -> None:
    one = {"value": 3500.0, "unit": "g", "sd": 1.0, "low": 3400.0, "high": 3600.0}

    def change(document: Document) -> None:
        document["posterior"] = {"verdict": "sampled", "parameters": {"m": one}}

    found = read_model(model_file(tmp_path, change))
    assert found.posterior is not None
    assert found.posterior["parameters"]["m"] == pytest.approx(
        {"value": 3.5, "unit": "kg", "sd": 1e-3, "low": 3.4, "high": 3.6}
    )
    assert found.read[0].startswith("[posterior.parameters.m] is written in 'g'")
    for unit, said in (("N", "unit 'N' is of another kind than 'kg'"), (None, "run 'workbench")):
        one["unit"] = unit
        if unit is None:
            del one["unit"]
        with pytest.raises(BadModel, match=r"\[posterior.parameters") as caught:
            read_model(model_file(tmp_path, change))
        assert said in str(caught.value)


@pytest.mark.parametrize(
    ("place", "unit", "beside"),
    [
        (("plant", "m"), "g", "[compensator.friction.m] is"),
        (("plant", "h"), "ms", "[rst.h] is"),
        (("rst", "h"), "ms", "[plant.h] is"),
        (("compensator", "friction", "m"), "g", "[plant.m] is"),
        (("compensator", "friction", "F_cp"), "kN", "F_cn is"),
    ],
)
def test_a_unit_changed_alone_contradicts_the_design(
    tmp_path: Path, place: tuple[str, ...], unit: str, beside: str
) -> None:
    def change(document: Document) -> None:
        for key in place:
            document = document[key]
        document["unit"] = unit

    with pytest.raises(BadModel) as caught:
        read_design(design_file(tmp_path, change))
    assert beside in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_design_s_converted_values_are_said(tmp_path: Path) -> None:
    def change(document: Document) -> None:
        document["compensator"]["e_T"]["unit"] = "mm"
        document["rst"]["reference_lag"]["unit"] = "min"

    e_T, lag = sorted(read_design(design_file(tmp_path, change)).read)
    assert e_T.startswith("[compensator.e_T] is written in 'mm'")
    assert "60 of the number" in lag


def run(capsys: pytest.CaptureFixture[str], *words: str | Path) -> tuple[int, str, str]:
    """Exit status of a command, and what it shows on standard output and error."""
    capsys.readouterr()
    status = main([str(word) for word in words])
    shown = capsys.readouterr()
    return status, shown.out, shown.err


@pytest.mark.slow
def test_every_command_says_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = model_file(tmp_path, in_grams)
    log, card = tmp_path / "run.csv", tmp_path / "card.toml"
    made = identified().sources[0].log
    card.write_text(CARD, encoding="utf-8")
    rows = zip(made["t"], made["y"], made["F"], made["u"], strict=True)
    log.write_text("t,y,F,u\n" + "\n".join(",".join(map(repr, map(float, r))) for r in rows))
    controller = design_file(tmp_path)
    for words in (
        ("design", model, "--out", tmp_path / "d"),
        ("validate", model, controller, "--out", tmp_path / "v"),
        ("predict", model, log, "--card", card, "--out", tmp_path / "p"),
        ("drift", model, log, "--card", card, "--out", tmp_path / "x"),
        ("registry", "add", "bench", model, controller, "--reason", "first", "--registry",
         tmp_path / "r.db"),
    ):  # fmt: skip
        status, text, _ = run(capsys, *words)
        assert status in (0, 1), words
        assert "[friction.m] is written in 'g'" in " ".join(text.split()), words
        document = json.loads(run(capsys, *words, "--json")[1])
        assert any("[friction.m] is written in 'g'" in line for line in document["remarks"]), words


def test_every_command_refuses_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = model_file(tmp_path, unit_of("friction", "m", "g"))
    for words in (
        ("design", model),
        ("validate", model, design_file(tmp_path)),
        ("predict", model, "run.csv", "--card", "demo"),
        ("drift", model, "run.csv", "--card", "demo"),
        ("registry", "add", "bench", model, "--reason", "first"),
    ):
        status, _, said = run(capsys, *words)
        assert status == 2, words
        assert "[friction.m]" in said
        assert said.count("\n") == 1


def test_null_with_an_assumed_value_in_another_unit_is_said(tmp_path: Path) -> None:
    model = model_of(TABLES["paper_table2"], Actuator(19530.0, 10405.0))
    blank = Estimate(None, "kN", reason="no breakaway", assumed=0.02)
    document = json.loads(dumps(model_document(model)))
    document["friction"]["F_sp"] = json.loads(dumps(blank))
    path = tmp_path / "model.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    assert "read as 20 N, 1000 of the number" in read_model(path).read[0]


CARD = """[card]
name = "made"
[rig]
kind = "force"
[signals]
t = { column = "t", unit = "s" }
y = { column = "y", unit = "m" }
F = { column = "F", unit = "N" }
u = { column = "u", unit = "V" }
"""
