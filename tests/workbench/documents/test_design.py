"""design.json: every parameter with its unit, read back in SI, refused in one line."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from design.controllers.design import design
from design.machine.design import Design
from design.machine.documents import design_document
from identification.errors import BadModel
from identification.model.estimates import Estimate
from identification.model.plant import Actuator
from tests.chain import EMPS, TABLES, model_of
from workbench.documents.result_files import read_design
from workbench.output import dumps

BARE = {"sd": None, "low": None, "high": None}


@cache
def found() -> Design:
    model = model_of(TABLES["paper_table2"], Actuator(19530.0, 10405.0))
    blank = Estimate(None, "N", reason="too few breakaways", assumed=-20.0)
    return design(replace(model, friction={**model.friction, "F_sn": blank}))


def written(path: Path, change: Callable[[dict[str, Any]], None] = lambda _: None) -> Path:
    document = json.loads(dumps(design_document(found())))
    change(document)
    file = path / "design.json"
    file.write_text(json.dumps(document), encoding="utf-8")
    return file


@pytest.mark.slow
def test_every_parameter_has_its_unit() -> None:
    document = json.loads(dumps(design_document(found())))
    assert document["schema"] == "design/2"
    assert document["plant"]["h"] == {"value": 0.005, "unit": "s", **BARE}
    mass, viscous = document["plant"]["m"], document["plant"]["F_v"]
    assert mass["value"] == 3.5 and mass["unit"] == "kg" and mass["low"] < 3.5 < mass["high"]
    assert viscous["unit"] == "N s/m"
    assert viscous["sd"] == pytest.approx(0.5e-3 * (289.0**2 + 287.4**2) ** 0.5)
    assert document["force"]["k_i"]["unit"] == "V/N"
    pid = document["pid"]
    units = {name: entry["unit"] for name, entry in pid["gains"].items()}
    assert units == {"k_R": "N/m", "T_i": "s", "T_d": "s", "eps": "s", "b": "1", "c": "1"}
    assert pid["dominant"]["w_n"]["unit"] == "rad/s"
    assert pid["reference_rate"]["unit"] == "m/s"
    assert document["compensator"]["e_T"] == {"value": pytest.approx(2e-4), "unit": "m", **BARE}
    assert document["compensator"]["friction"]["F_sn"] == {
        "value": None, "unit": "N", **BARE, "reason": "too few breakaways", "assumed": -20.0
    }  # fmt: skip
    assert found().compensator.assumed == ("F_sn",)
    assert found().compensator.value.friction.F_sn == -20.0


@pytest.mark.slow
def test_numbers_without_a_unit_are_coefficients_and_results_only() -> None:
    document = json.loads(dumps(design_document(found())))
    free = {"R", "S", "T", "W", "A", "B", "C", "slope"}  # coefficients
    free |= {"auxiliary", "excess", "margins", "overshoot", "recommendation"}

    def bare(value: object, name: str) -> list[str]:
        if isinstance(value, Mapping):
            if "unit" in value or name in free:
                return []
            return [each for key, entry in value.items() for each in bare(entry, key)]
        return [name] if isinstance(value, (int, float)) else []

    names = [name for key, value in document.items() if key not in free
             for name in bare(value, key)]  # fmt: skip
    assert set(names) <= free


def test_other_units_are_converted(tmp_path: Path) -> None:
    def change(document: dict[str, Any]) -> None:
        document["rst"]["h"] |= {"value": 5.0, "unit": "ms"}
        document["plant"]["m"] |= {"value": 3500.0, "unit": "g", "low": 3400.0, "high": 3600.0}
        document["compensator"]["e_T"] |= {"value": 6.0, "unit": "mm"}
        document["pid"]["gains"]["k_R"]["unit"] = "kN/m"

    back = read_design(written(tmp_path, change))
    plain = found()
    assert back.rst is not None and back.rst.h == pytest.approx(0.005)
    assert back.plant.m is not None and back.plant.m.low == pytest.approx(3.4)
    assert back.compensator.e_T == pytest.approx(6e-3)
    assert back.pid is not None and back.pid.gains is not None
    assert plain.pid is not None and plain.pid.gains is not None
    assert back.pid.gains.k_R == pytest.approx(1e3 * plain.pid.gains.k_R)


def test_it_comes_back_as_it_was(tmp_path: Path) -> None:
    assert design_document(read_design(written(tmp_path))) == design_document(found())
    motor = design(model_of(EMPS, k_a=35.15))
    free = replace(motor, rst=motor.rst and replace(motor.rst, rate=None), motion="rotary")
    document = json.loads(dumps(design_document(free)))
    assert document["rst"]["reference_rate"] == {
        "value": None, "unit": "rad/s", **BARE, "reason": "no limit of force or command to keep"
    }  # fmt: skip
    assert document["compensator"]["e_T"]["unit"] == "rad"


def put(*keys: str, value: object) -> Callable[[dict[str, Any]], None]:
    def change(document: dict[str, Any]) -> None:
        for key in keys[:-1]:
            document = document[key]
        document[keys[-1]] = value

    return change


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (put("schema", value="design/1"), "schema 'design/1', 'design/2' needed"),
        (put("rst", "Q", value=[1.0]), "[rst] unknown key 'Q'"),
        (put("plant", "h", value=0.01), "[plant.h]"),
        (put("plant", "h", "value", value=-0.01), "[plant.h] -0.01 s: must be > 0"),
        (put("plant", "h", "value", value=None), "[plant.h] is null"),
        (put("rst", "h", "unit", value="kg"), "[rst.h] unit 'kg' is of another kind than 's'"),
        (put("pid", "gains", "T_i", "unit", value="xyz"), "unit 'xyz' is unknown"),
        (put("force", "k_i", "unit", value="N/V"), "[force.k_i] unit 'N/V' is of another kind"),
        (put("compensator", "friction", "F_cq", value={"value": 1.0, "unit": "N"}), "none of the"),
        (put("compensator", "friction", "m", "value", value=None), "needs a 'reason'"),
        (put("rst", "reference_rate", "value", value=None), "it needs a 'reason'"),
        (put("motion", value="round"), "[motion]"),
        (put("recommended", value="lqr"), "[recommended]"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(
    tmp_path: Path, change: Callable[[dict[str, Any]], None], said: str
) -> None:
    with pytest.raises(BadModel) as caught:
        read_design(written(tmp_path, change))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path))


def test_one_of_the_nine_may_not_be_left_out(tmp_path: Path) -> None:
    def drop(document: dict[str, Any]) -> None:
        del document["compensator"]["friction"]["F_vn"]

    with pytest.raises(BadModel, match="has no 'F_vn'; all nine are needed"):
        read_design(written(tmp_path, drop))
