"""P-PI cascades for models: with a notch on two masses, validated, exported, written and read."""

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from design.closed_loop.driven_loop import driven_loop, load_of, run_driven
from design.closed_loop.linear_loop import plants_of
from design.controllers.cascade import beside_resonance, filter_words, unseen_lag
from design.controllers.design import design, usual_structures
from design.controllers.validate import validate, with_resonance
from design.generated.exported import exported
from design.machine.design import Design
from design.machine.documents import design_document
from design.machine.model import Model, used
from design.program_run import ProgramRun
from identification.errors import BadModel
from identification.model.estimates import Estimate
from tests.chain import EMPS, model_of
from workbench.documents.result_files import read_design
from workbench.export.data import json_file
from workbench.output import dumps
from workbench.report.design_tables import cascade_lines, design_lines, design_sentence
from workbench.report.reports import bode_chart
from workbench.steps.elastic import beyond_response, with_response

RESONANCE = {
    "frequency": Estimate(60.0, "Hz", sd=0.2, low=59.6, high=60.4),
    "anti_resonance": Estimate(40.0, "Hz"), "damping": Estimate(0.02, "1"),
    "m_1": Estimate(EMPS.m * (40.0 / 60.0) ** 2, "kg"),
    "m_2": Estimate(EMPS.m * (1.0 - (40.0 / 60.0) ** 2), "kg"),
}  # fmt: skip


def plain() -> Model:
    model = model_of(EMPS, k_a=35.15)
    late = {"input_delay": {"tau": Estimate(2e-3, "s")}}
    quiet = replace(model.fit, noise_y=2e-8)  # so that the resonance bounds the gains
    return replace(model, rig=replace(model.rig, control_limit=10.0), effects=late, fit=quiet)


def swinging() -> Model:
    return replace(plain(), resonance=RESONANCE)


@cache
def made() -> Design:
    return design(swinging(), structures=("p-pi",))


@pytest.mark.slow
def test_a_notch_is_proposed_on_two_masses_and_holds_on_all_of_them() -> None:
    found = made()
    assert found.recommended == "p-pi" and found.rst is None and found.p_pi is not None
    one = found.p_pi
    assert one.series is not None and one.missed == ()
    assert one.margins.modulus >= 0.5 and (one.margins.worst_modulus or 0.0) >= 0.499
    assert len(found.plant.A) > 4  # the margins are those of two masses
    remark_text = " ".join(found.remarks)
    assert "two masses with a resonance at 60 Hz" in remark_text and one.series.kind in remark_text
    assert any("Kv = " in line and "m/min/mm" in line for line in cascade_lines(found))
    assert "V s/m" in cascade_lines(found)[0]
    before, after = bode_chart(found).panels[0].lines
    near = (before.x > 55.0) & (before.x < 65.0)
    assert np.max(after.y[near]) < np.max(before.y[near]) - 3.0


@pytest.mark.slow
def test_it_passes_in_simulation_on_two_masses_that_slide_and_stick() -> None:
    assert load_of(swinging()) is not None
    result, traces = validate(swinging(), made(), np.random.default_rng(0))
    assert result.judged == "p-pi" and result.passed
    assert list(result.figures) == ["p-pi"]  # friction is fed forward: no compensator beside it
    one = result.figures["p-pi"]["model"]
    assert one.smooth_relative < 0.02 and one.overshoot < 0.1
    assert ("p-pi", "model") in traces
    # A model without the resonance is given that of the design.
    again, _ = validate(plain(), made(), np.random.default_rng(0))
    assert again.figures["p-pi"]["model"].margins == one.margins


@pytest.mark.slow
def test_a_design_is_written_and_read_again(tmp_path: Path) -> None:
    file = tmp_path / "design.json"
    file.write_text(dumps(design_document(made())))
    again = read_design(file)
    assert again.p_pi == made().p_pi and again.recommendation == made().recommendation
    written = json.loads(file.read_text())
    assert written["p_pi"]["cascade"]["k_p_command"]["unit"] == "V s/m"
    written["p_pi"]["filter"]["b"][0] *= 1.01
    file.write_text(json.dumps(written))
    with pytest.raises(BadModel, match=r"is not the .* of its numbers"):
        read_design(file)


@pytest.mark.slow
def test_the_exported_program_is_the_loop_that_was_simulated() -> None:
    found, model = made(), swinging()
    assert found.p_pi is not None
    what = exported(found)
    loop = driven_loop(model, found, found.p_pi)
    r = np.where(np.arange(4000) % 1500 < 700, 0.0, 0.02)
    run = run_driven(model, loop, r, None)
    assert [one.name for one in what.program.inputs] == ["r", "y"]
    step = ProgramRun(what.program, float(run.y_measured[0])).step
    found_u = [float(step(a, b)) for a, b in zip(r, run.y_measured, strict=True)]
    np.testing.assert_array_equal(found_u, run.u)
    values = json.loads(next(iter(json_file(what).values())))["values"]
    assert values["filter"]["kind"] == "notch" and values["cascade"]["k_v"] > 0.0
    assert values["compensator"] is None and values["feed_forward"]["m"] == pytest.approx(EMPS.m)
    with pytest.raises(BadModel, match="takes no compensator"):
        exported(found, compensated=True)


def test_the_plant_of_a_resonance_is_that_of_two_masses() -> None:
    stiff, elastic = (plants_of(one, 1e-3, None) for one in (plain(), swinging()))
    assert len(elastic[0][0]) == len(stiff[0][0]) + 2
    assert len(elastic) == 1 + 2 * len(stiff[1:])  # both ends of the resonance too
    assert load_of(plain()) is None


def test_a_lag_that_no_log_would_have_shown_is_held_off() -> None:
    remark_text = plain()
    motor, force = replace(remark_text, effects={}), replace(remark_text, effects={}, actuator=None)
    force = replace(force, rig=replace(force.rig, kind="force"))
    assert unseen_lag(remark_text) == 0.0
    assert unseen_lag(motor) == pytest.approx(0.4 * motor.period)
    assert unseen_lag(force) == pytest.approx(0.4 * force.period + 1e-3)
    slow = replace(motor, log=(replace(motor.log[0], h=8e-3),))
    quick, careful = (design(one, structures=("p-pi",), period=1e-3).p_pi for one in (motor, slow))
    assert quick is not None and careful is not None
    assert quick.dominant[0] > careful.dominant[0]


def test_a_cascade_is_designed_where_the_machine_swings() -> None:
    assert usual_structures(plain(), None) == ("rst", "pid")
    assert usual_structures(swinging(), None) == ("rst", "pid", "p-pi")


def peak(kind: str, hertz: float) -> dict[str, object]:
    return {
        "kind": kind,
        "frequency": {"value": hertz, "unit": "Hz", "sd": 0.1, "low": hertz - 0.2,
                      "high": hertz + 0.2},
        "damping": {"value": 0.02, "unit": "1", "sd": 0.002, "low": 0.016, "high": 0.024},
    }  # fmt: skip


def test_the_resonance_of_a_response_is_taken(tmp_path: Path) -> None:
    file = tmp_path / "response.json"
    peaks = [peak("resonance", 60.0), peak("anti-resonance", 40.0), peak("resonance", 150.0)]
    file.write_text(json.dumps({"schema": "response/1", "peaks": peaks}))
    model = with_response(plain(), file)
    assert model.resonance is not None and model.resonance["frequency"].value == 60.0
    assert model.resonance["m_1"].value == pytest.approx(EMPS.m * (40.0 / 60.0) ** 2)
    assert with_response(plain(), None) == plain()
    assert with_resonance(plain(), model.resonance) == model


def test_a_pair_in_a_gap_of_the_response_is_taken_with_a_damping_that_is_no_more_than_assumed(
    tmp_path: Path,
) -> None:
    file = tmp_path / "response.json"
    felt = peak("resonance", 60.0)
    felt["damping"] = {"value": None, "unit": "1", "reason": "wide", "assumed": 0.03}
    found = {"schema": "response/1", "peaks": [], "felt": [peak("anti-resonance", 40.0), felt]}
    file.write_text(json.dumps(found))
    model = with_response(plain(), file)
    assert model.resonance is not None and model.resonance["frequency"].value == 60.0
    assert used(model.resonance["damping"]) == 0.03


def test_a_crossover_beyond_what_a_response_identifies_comes_first(tmp_path: Path) -> None:
    found, file = made(), tmp_path / "response.json"
    at = found.controllers[str(found.recommended)].margins.crossover_hz
    assert at is not None
    for spans, said in (([[0.1, 0.5 * at]], True), ([[0.1, 0.5 * at], [0.9 * at, 2 * at]], False)):
        file.write_text(json.dumps({"schema": "response/1", "plant": {"seen_hz": spans}}))
        sentence = design_sentence(beyond_response(found, file))
        assert sentence.startswith("The P-PI crosses over at") is said
        assert ("does not identify the plant" in sentence) is said
    assert beyond_response(found, None) is found


def test_a_cascade_stands_to_a_resonance_by_what_it_rejects_and_not_by_its_Kv() -> None:
    found = made()
    one = found.p_pi
    assert one is not None and one.margins.rejection_hz is not None
    bare = replace(found, p_pi=replace(one, series=None))
    (said,) = beside_resonance(swinging(), bare, "p-pi")
    assert f"it rejects disturbances up to {one.margins.rejection_hz:.3g} Hz" in said


def test_a_response_without_such_a_pair_is_refused_in_a_line(tmp_path: Path) -> None:
    file = tmp_path / "response.json"
    file.write_text(json.dumps({"schema": "response/1", "peaks": [peak("resonance", 60.0)]}))
    with pytest.raises(BadModel, match="no anti-resonance with a resonance above it"):
        with_response(plain(), file)
    file.write_text(json.dumps({"schema": "model/1"}))
    with pytest.raises(BadModel, match="'response/1' needed"):
        with_response(plain(), file)


@pytest.mark.slow
def test_a_notch_is_so_many_decibels_deep_and_said_once() -> None:
    found = made()
    assert found.p_pi is not None and found.p_pi.series is not None
    assert re.search(r" Hz wide at -3 dB, \d[\d.]* dB deep", filter_words(found.p_pi.series))
    said = [line for line in design_lines(found) if line.startswith("P-PI:") and " dB deep" in line]
    assert len(said) == 1
