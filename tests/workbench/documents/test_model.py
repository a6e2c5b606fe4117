"""model.json: everything survives the way there and back; every wrong file is one line."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from design.machine.documents import model_document
from design.machine.effect_values import effect_units, relabelled
from design.machine.model import Model
from identification.effects._library import built_in
from identification.errors import BadModel
from identification.model.estimates import Estimate
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor
from tests.chain import EMPS, TABLES, identified, model_of
from workbench.documents.result_files import read_model
from workbench.output import dumps

ACTUATOR = Actuator(19530.0, 10405.0)
SPRING = {"value": 5.0, "unit": "N/m", "sd": 0.1, "low": 4.8, "high": 5.2}


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


def test_effects_come_back_and_are_simulated(tmp_path: Path) -> None:
    stribeck = {
        "F_s": Estimate(4.0, "N", 0.1, 3.8, 4.2),
        "v_s": Estimate(None, "m/s", reason="too fast", assumed=0.03),
    }
    model = replace(model_of(TABLES["paper_table1"], ACTUATOR), effects={"stribeck": stribeck})
    document = model_document(model)
    assert document["effects"]["stribeck"]["F_s"] == {
        **{"value": 4.0, "unit": "N", "sd": 0.1, "low": 3.8, "high": 4.2}
    }
    found = read_model(written(tmp_path, document))
    assert model_document(found) == document
    (one,) = found.simulated.effects
    assert (one.key, one.p) == ("stribeck", (4.0, 0.03, 0.0, 2.0))


def test_effects_are_converted_when_read(tmp_path: Path, document: dict[str, Any]) -> None:
    v_s = {"value": 30.0, "unit": "mm/s", "sd": 1.0, "low": 28.0, "high": 32.0}
    power = {"value": 2.0, "unit": "N (s/mm)**n", "sd": None, "low": None, "high": None}
    bare = {"sd": None, "low": None, "high": None}
    document["effects"] = {
        "stribeck": {"F_s": {"value": 4e-3, "unit": "kN", **bare}, "v_s": v_s},
        "nonlinear_viscous": {"k": power, "n": {"value": 1.5, "unit": "1", **bare}},
    }
    found = read_model(written(tmp_path, document))
    stribeck, viscous = found.simulated.effects
    assert stribeck.values == pytest.approx(
        {"F_s": 4.0, "v_s": 0.03, "asymmetry": 0.0, "delta": 2.0}
    )
    assert viscous.values["k"] == pytest.approx(2.0 * 1e3**1.5)
    assert found.effects["nonlinear_viscous"]["k"].unit == "N (s/m)**n"
    assert found.effects["stribeck"]["v_s"].sd == pytest.approx(1e-3)


def test_a_rotary_machine_s_effects_have_rotary_units() -> None:
    library = built_in()
    units = {key: effect_units(library[key], "rotary") for key in library}
    assert units["spring"] == {"k": "N m/rad", "k_3": "N m/rad**3"}
    assert units["compliance"] == {"flexibility": "rad/(N m)"}
    assert units["warmup"]["b"] == "N m s/rad"
    assert units["nonlinear_viscous"]["k"] == "N m (s/rad)**n"
    assert units["position_dependent_friction"]["c2"] == "N m/rad**2"
    assert units["sensor_nonlinearity"] == {"a": "1/rad", "b": "1/rad**2"}
    assert units["end_cushion"]["y_p"] == "rad"
    assert units["input_delay"] == {"tau": "s"}
    given = {"k": Estimate(3.0, "N/m", 0.1)}
    assert relabelled(library["spring"], given, "rotary") == {"k": Estimate(3.0, "N m/rad", 0.1)}


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
        ({"schema": "model/2"}, "schema 'model/2', 'model/1' needed; give the model that"),
        ({"schema": None}, "no 'schema'"),
        ({"card": 3}, "[card] 3"),
        ({"effects": {"spring": {"k": "stiff"}}}, "effects.spring.k"),
        ({"effects": {"spring": {"k": 5.0}}}, "[effects.spring.k] 5.0: input should be an object"),
        ({"effects": {"spring": {"K": SPRING}}}, "spring: unknown parameter 'K'; did you mean 'k'"),
        ({"effects": {"sprung": {"k": SPRING}}}, "unknown effect 'sprung'; did you mean 'spring'?"),
        ({"effects": {"spring": {}}}, "[effects] spring has no 'k' [N/m]"),
        ({"effects": {"spring": {"k": {**SPRING, "unit": "N"}}}}, "[effects.spring.k] unit 'N' is"),
        ({"effects": {"spring": {"k": {**SPRING, "value": None}}}}, "[effects.spring.k] is null"),
        ({"effects": {"spring": {"k": {**SPRING, "low": 9.0}}}}, "[effects.spring.k] low = 9"),
        ({"effects": {"spring": {"k": {**SPRING, "value": -5e9}}}}, "must lie in [-1e+07, 1e+07]"),
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


@pytest.mark.parametrize(
    ("change", "needed"),
    [
        ({"log": []}, "[log] is empty; at least one run needed"),
        ({"log": [{"h": 0.0}]}, "[log] h = 0 s, must be > 0"),
        ({"log": [{"duration": -1.0}]}, "[log] duration = -1 s, must be > 0"),
        ({"fit": {"noise_y": -1e-5}}, "[fit] noise_y = -1e-05, must be 0 or more"),
    ],
)
def test_numbers_that_no_fit_has(
    tmp_path: Path, document: dict[str, Any], change: dict[str, Any], needed: str
) -> None:
    if change.get("log"):
        change = {"log": [{**document["log"][0], **change["log"][0]}]}
    elif "fit" in change:
        change = {"fit": {**document["fit"], **change["fit"]}}
    assert needed in refused(tmp_path, {**document, **change})


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


def test_units_are_converted_when_read(tmp_path: Path, document: dict[str, Any]) -> None:
    mass = dict(document["friction"]["m"])
    grams = {key: 1e3 * value for key, value in mass.items() if key != "unit"}
    document["friction"]["m"] = {**grams, "unit": "g"}
    gain = document["actuator"]["k1"]["value"]
    document["actuator"]["k1"] |= {"value": 1e-3 * gain, "unit": "kN/(V s)"}
    blank = {"value": None, "unit": "kN", "reason": "no breakaway", "assumed": 0.02}
    document["friction"]["F_sp"] = blank
    found = read_model(written(tmp_path, document))
    for key in ("value", "sd", "low", "high"):
        assert getattr(found.friction["m"], key) == pytest.approx(mass[key], rel=1e-12)
    assert found.friction["m"].unit == "kg"
    assert found.karnopp.F_sp == pytest.approx(20.0)
    assert found.actuator is not None
    assert found.actuator["k1"].value == pytest.approx(gain)


@pytest.mark.parametrize(
    ("table", "name", "unit", "needed"),
    [
        ("friction", "m", "N", "[friction.m] unit 'N' is of another kind than 'kg'"),
        ("friction", "F_vp", "N m", "[friction.F_vp] unit 'N m' is of another kind than 'N s/m'"),
        ("friction", "m", "kq", "[friction.m] unit 'kq' is unknown"),
        ("actuator", "k2", "N/V", "[actuator.k2] unit 'N/V' is of another kind than 'N/m'"),
    ],
)
def test_units_of_another_kind_are_refused(
    tmp_path: Path, document: dict[str, Any], table: str, name: str, unit: str, needed: str
) -> None:
    document[table][name]["unit"] = unit
    assert needed in refused(tmp_path, document)


def test_a_rotary_model_has_rotary_units(tmp_path: Path, document: dict[str, Any]) -> None:
    document["rig"]["motion"] = "rotary"
    assert "'kg' is of another kind than 'kg m^2'" in refused(tmp_path, document)
