"""model.json: everything survives the way there and back; every wrong file is one line."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from identification.errors import BadModel
from identification.karnopp import Karnopp
from identification.plant import Actuator, Motor
from identification.result import Estimate
from tests.chain import EMPS, TABLES, identified, model_of
from workbench.model import Model, model_document, read_model
from workbench.output import dumps

ACTUATOR = Actuator(19530.0, 10405.0)


def written(folder: Path, document: Any) -> Path:
    path = folder / "model.json"
    path.write_text(document if isinstance(document, str) else dumps(document), encoding="utf-8")
    return path


def refused(folder: Path, document: Any) -> str:
    path = written(folder, document)
    with pytest.raises(BadModel) as caught:
        read_model(path)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert "\n" not in text
    return text


@pytest.fixture
def document() -> dict[str, Any]:
    found = json.loads(dumps(model_document(model_of(TABLES["paper_table1"], ACTUATOR))))
    assert isinstance(found, dict)
    return found


def test_an_identified_model_comes_back_as_it_was(tmp_path: Path) -> None:
    model = identified().model
    found = read_model(written(tmp_path, model_document(model)))
    assert model_document(found) == model_document(model)
    assert found.simulated == model.simulated
    assert found.plant is not None and model.plant is not None
    assert found.plant.A == model.plant.A
    assert found.log[0].start == model.log[0].start


def test_a_motor_comes_back(tmp_path: Path) -> None:
    model = model_of(EMPS, k_a=35.15)
    assert read_model(written(tmp_path, model_document(model))).simulated.actuator == Motor(35.15)


def test_a_parameter_that_is_not_identified_says_why_and_what_stands_in(tmp_path: Path) -> None:
    model = model_of(TABLES["paper_table1"], ACTUATOR)
    blank = Estimate(None, "N", reason="no breakaway", assumed=20.0)
    model = replace(model, friction={**model.friction, "F_sp": blank})
    document = model_document(model)
    assert document["friction"]["F_sp"] == {
        "value": None,
        "unit": "N",
        "sd": None,
        "low": None,
        "high": None,
        "reason": "no breakaway",
        "assumed": 20.0,
    }
    found = read_model(written(tmp_path, document))
    assert found.assumed == ("F_sp",)
    assert found.karnopp.F_sp == 20.0


def test_a_known_parameter_has_the_keys_of_the_contract(document: dict[str, Any]) -> None:
    assert set(document["friction"]["m"]) == {"value", "unit", "sd", "low", "high"}
    assert next(iter(document)) == "schema"
    keys = {"card", "log", "friction", "effects", "plant", "actuator", "fit", "versions"}
    assert keys <= set(document)


@pytest.mark.parametrize(
    ("change", "needed"),
    [
        ({"frictions": {}}, "unknown key 'frictions'; did you mean 'friction'?"),
        ({"schema": "model/2"}, "schema 'model/2', 'model/1' needed"),
        ({"schema": None}, "no 'schema'"),
        ({"card": 3}, "[card] 3"),
        ({"effects": {"spring": {"k": "stiff"}}}, "effects.spring.k"),
        ({"effects": {"spring": {"k": 5.0}}}, "[effects] spring cannot be simulated yet"),
    ],
)
def test_wrong_keys_and_values(
    tmp_path: Path, document: dict[str, Any], change: dict[str, Any], needed: str
) -> None:
    assert needed in refused(tmp_path, {**document, **change})


def test_a_missing_key_is_named(tmp_path: Path, document: dict[str, Any]) -> None:
    del document["fit"]["noise_y"]
    assert "[fit] has no 'noise_y'" in refused(tmp_path, document)


def test_a_missing_parameter_is_named(tmp_path: Path, document: dict[str, Any]) -> None:
    del document["friction"]["F_vn"]
    assert "[friction] has no 'F_vn'" in refused(tmp_path, document)


def test_an_unknown_parameter_comes_with_the_nearest(
    tmp_path: Path, document: dict[str, Any]
) -> None:
    document["friction"]["F_vm"] = document["friction"]["F_vn"]
    assert "unknown key 'F_vm'; did you mean" in refused(tmp_path, document)


def test_an_unknown_key_in_depth_is_placed(tmp_path: Path, document: dict[str, Any]) -> None:
    document["friction"]["m"]["valu"] = 3.0
    text = refused(tmp_path, document)
    assert "[friction.m] unknown key 'valu'; did you mean 'value'?" in text
    del document["friction"]["m"]["valu"]
    document["log"][0]["starts"] = 1
    assert "[log.0] unknown key 'starts'; did you mean 'start'?" in refused(tmp_path, document)


def test_null_needs_a_reason_and_a_stand_in(tmp_path: Path, document: dict[str, Any]) -> None:
    document["friction"]["m"] = {"value": None, "unit": "kg", "sd": None}
    assert "[friction.m] is null; it needs a 'reason'" in refused(tmp_path, document)


def test_a_wrong_sign_is_refused(tmp_path: Path, document: dict[str, Any]) -> None:
    document["friction"]["dv_n"]["value"] = 0.04
    assert "dv_n = 0.04" in refused(tmp_path, document)


def test_an_interval_the_wrong_way_round(tmp_path: Path, document: dict[str, Any]) -> None:
    document["friction"]["m"]["low"] = 5.0
    assert "[friction.m] low = 5 lies above high" in refused(tmp_path, document)


@pytest.mark.parametrize(
    ("text", "needed"),
    [
        ("", "is not JSON"),
        ("{", "is not JSON"),
        ("[]", "a JSON object needed"),
        ('{"schema": "model/1", "card": NaN}', "holds NaN"),
        ('{"schema": "model/1", "card": 1e999}', "holds 1e999"),
        ("[" * 100_000, "nested too deeply"),
    ],
)
def test_a_file_that_is_no_model(tmp_path: Path, text: str, needed: str) -> None:
    assert needed in refused(tmp_path, text)


def test_no_file_a_folder_and_bytes(tmp_path: Path) -> None:
    with pytest.raises(BadModel, match="no such file"):
        read_model(tmp_path / "none.json")
    with pytest.raises(BadModel, match="is a directory"):
        read_model(tmp_path)
    (tmp_path / "b.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadModel, match="not UTF-8"):
        read_model(tmp_path / "b.json")


def test_a_model_needs_k1_and_k2_or_k_a() -> None:
    model = model_of(TABLES["paper_table1"], ACTUATOR)
    assert model.actuator is not None
    with pytest.raises(BadModel, match="'k1' and 'k2', or 'k_a'"):
        replace(model, actuator={"k1": model.actuator["k1"]})


def test_travel_is_that_of_all_logs() -> None:
    model: Model = model_of(Karnopp(1, 1, 1, 1, 1, 0.1, -0.1, 2, -2), ACTUATOR)
    wide = replace(model.log[0], travel=(-0.3, 0.05))
    assert replace(model, log=(model.log[0], wide)).travel == (-0.3, 0.1)
