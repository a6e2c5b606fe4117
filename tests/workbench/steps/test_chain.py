"""The chain by its links: runs to model, model to design, design to validation, prediction."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from design.asked import Limits
from design.closed_loop import loop_figures
from design.closed_loop.driven_loop import driven_loop, run_driven
from design.closed_loop.linear_loop import corners, linear_of
from design.controllers.design import effort_limit
from design.controllers.validate import validate, validation_document
from design.identified.identify import _actuator, _force_error, arx_plant, closed_loop_remarks
from design.loop import LoopRun
from design.machine.documents import design_document
from design.machine.model import Model
from design.measured.predict import predict
from design.simulated.recipe import RecipePID
from design.simulated.record import record, truth
from design.tune import Asked, Goals
from identification.arx.design_period import common_period, decimated, decimation
from identification.errors import BadCard, BadLog, BadModel, BadSpecification, NotIdentifiable
from identification.estimation.prescribed_motion import fit_prescribed
from identification.estimation.recorded_logs import recorded_logs
from identification.log import Log, Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from identification.model.plant import Actuator
from tests.chain import EMPS, TABLES, designed, identified, model_of, short_recipe
from tests.identification.plants import made_log, table
from workbench.documents.result_files import read_design
from workbench.output import dumps
from workbench.report.model_tables import fit_lines
from workbench.steps.predict import PREDICTION_COLUMNS, prediction_frame

ACTUATOR = Actuator(19530.0, 10405.0)


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def test_the_short_log_gives_all_nine_within_half_a_percent() -> None:
    model = identified().model
    for name in NAMES:
        found = model.friction[name]
        assert found.value is not None and found.low is not None and found.high is not None
        assert found.value == pytest.approx(getattr(TABLES["paper_table1"], name), rel=5e-3)
        assert found.low < found.value < found.high
    assert model.actuator is not None and set(model.actuator) == {"k1", "k2"}
    assert model.fit.adequate
    assert model.log[0].rows == 3001
    assert model.plant is not None and model.plant.h == pytest.approx(0.01)
    assert any("closed loop" in line for line in model.fit.remarks)


def test_the_arx_plant_takes_orders_and_period_as_asked() -> None:
    log = identified().sources[0].log
    found = arx_plant([log], (3, 2, 2), 0.02)
    assert (found.na, found.nb, found.nk) == (3, 2, 2)
    assert found.h == pytest.approx(0.02)
    assert found.B[:2] == (0.0, 0.0) and len(found.B) == 4
    assert found.input == "F"
    with pytest.raises(BadModel, match="the log is sampled every"):
        arx_plant([log], None, 1e-3)


def test_decimation_keeps_outputs_and_means_inputs() -> None:
    u, y = np.arange(10.0), np.arange(10.0) ** 2
    mean, kept = decimated(u, y, 3)
    assert mean.tolist() == [1.0, 4.0, 7.0]
    assert kept.tolist() == [0.0, 9.0, 36.0]
    assert decimation(1e-3, None) == 10
    assert decimation(0.05, None) == 1
    assert decimation(1e-3, 5e-3) == 5


def test_a_loop_is_remarked_only_where_y_follows_r() -> None:
    t = np.linspace(0.0, 1.0, 200)
    follows = Log("a", {"t": t, "y": np.sin(9 * t), "r": np.sin(9 * t)})
    not_so = Log("b", {"t": t, "y": np.sin(9 * t), "r": np.cos(90 * t)})
    assert len(closed_loop_remarks([follows, not_so])) == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", list(TABLES))
def test_default_designs_of_the_paper_s_plants_pass_in_simulation(name: str) -> None:
    model = model_of(TABLES[name], ACTUATOR)
    found = designed(model)
    assert found.plant.source == "physical" and found.force is not None
    assert found.rst is not None and found.rst.missed == ()
    assert found.rst.margins.modulus >= 0.5
    assert found.rst.margins.worst_modulus is not None
    assert found.rst.margins.worst_modulus >= 0.5
    assert found.rst.margins.delay_samples is not None
    assert found.rst.margins.delay_samples >= 2.0
    result, _ = validate(model, found, rng())
    assert result.passed, result.figures


@pytest.mark.slow
def test_the_default_design_of_the_emps_axis_passes() -> None:
    model = model_of(EMPS, k_a=35.15)
    found = designed(model)
    assert found.force is None
    assert found.recommended == "rst"
    result, _ = validate(model, found, rng())
    assert result.passed, result.figures


def test_a_design_comes_back_from_its_file(tmp_path: Path) -> None:
    found = designed(model_of(TABLES["paper_table2"], ACTUATOR))
    path = tmp_path / "design.json"
    path.write_text(dumps(design_document(found)), encoding="utf-8")
    back = read_design(path)
    assert dumps(design_document(back)) == dumps(design_document(found))
    document = json.loads(path.read_text(encoding="utf-8"))
    document["rst"]["Q"] = [1.0]
    path.write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(BadModel, match=r"\[rst\] unknown key 'Q'"):
        read_design(path)


@pytest.mark.slow
def test_asked_poles_and_period_are_taken() -> None:
    model = model_of(TABLES["paper_table2"], ACTUATOR)
    found = designed(model, Asked((12.0, 0.9)), period=0.02)
    assert found.rst is not None and found.rst.dominant == (12.0, 0.9)
    assert found.plant.h == 0.02 and found.rst.h == 0.02
    with pytest.raises(BadSpecification, match="zeta"):
        designed(model, Asked((12.0, -0.9)))
    plain = designed(model, Asked(integrator=False))
    assert plain.pid is None and "integrator" in plain.refused["pid"]


@pytest.mark.slow
def test_goals_are_taken() -> None:
    model = model_of(TABLES["paper_table2"], ACTUATOR)
    easy, strict = (designed(model, goals=Goals(m, 2.0)).rst for m in (0.4, 0.6))
    assert easy is not None and strict is not None
    assert strict.margins.modulus >= 0.6
    assert strict.dominant[0] < easy.dominant[0]
    limit = effort_limit(model)
    assert limit == pytest.approx(20 * np.log10(0.05 * 17.55 / 1e-5))


def without_mass(model: Model) -> Model:
    blank = Estimate(None, "kg", reason="no acceleration", assumed=1.0)
    return replace(model, friction={**model.friction, "m": blank})


@pytest.mark.slow
def test_without_a_mass_the_arx_plant_carries_the_design() -> None:
    model = without_mass(identified().model)
    found = designed(model)
    assert found.plant.source == "arx"
    assert found.rst is not None and found.rst.margins.modulus >= 0.5
    asked = designed(identified().model, source="arx")
    assert asked.plant.A == found.plant.A
    with pytest.raises(BadSpecification, match="identify again with --design-period"):
        designed(model, period=0.02)


def test_a_model_that_carries_no_design_is_refused() -> None:
    model = without_mass(model_of(TABLES["paper_table1"], ACTUATOR))
    with pytest.raises(NotIdentifiable, match="no ARX plant"):
        designed(model)
    plant = identified().model.plant
    assert plant is not None
    wild = replace(plant, simulation_relative=0.9)
    with pytest.raises(NotIdentifiable, match=r"leaves 90 % of the motion.* moves the body freely"):
        designed(replace(model, plant=wild))
    heavy = replace(model_of(TABLES["paper_table1"], ACTUATOR), plant=wild)
    with pytest.raises(NotIdentifiable, match="design; the mass is identified: design on it"):
        designed(heavy, source="arx")
    prescribed = replace(model.log[0], position_rms=None)
    moved = replace(model, log=(prescribed,), actuator=None)
    with pytest.raises(NotIdentifiable, match="prescribed"):
        designed(replace(moved, fit=replace(moved.fit, adequate=False)))
    with pytest.raises(NotIdentifiable, match="no ARX plant"):  # a run by the force follows it
        designed(moved)


def test_another_plant_can_fail_what_the_model_passes() -> None:
    model, other = (model_of(TABLES[f"paper_table{k}"], ACTUATOR) for k in (1, 3))
    found = designed(model)
    result, traces = validate(model, found, rng(), plant=other)
    assert set(result.figures["rst"]) == {"model", "plant"}
    assert result.figures["rst"]["model"].passed
    assert not result.figures["rst"]["plant"].passed
    assert not result.passed
    assert ("rst", "plant") in traces
    document = validation_document(result)
    assert document["schema"] == "validation/1"
    assert document["figures"]["rst"]["plant"]["passed"] is False


@pytest.mark.slow
def test_limits_are_taken() -> None:
    model = model_of(TABLES["paper_table1"], ACTUATOR)
    found = designed(model)
    for limits in (Limits(modulus=0.95), Limits(delay=9.0), Limits(standstill=1e-6),
                   Limits(tracking=1e-3), Limits(overshoot=1e-6), Limits(force=0.5)):  # fmt: skip
        result, _ = validate(model, found, rng(), limits=limits)
        assert not result.passed
        assert len(result.figures[result.judged]["model"].missed) == 1


def test_a_design_with_a_force_loop_does_not_fit_a_motor() -> None:
    model = model_of(TABLES["paper_table1"], ACTUATOR)
    with pytest.raises(BadModel, match="force loop"):
        validate(model, designed(model), rng(), plant=model_of(EMPS, k_a=35.0))


def test_a_prediction_follows_a_log_it_has_not_seen() -> None:
    card, recipe = short_recipe()
    log = record("other", recipe, seed=99)
    found = predict(identified().model, log)
    assert found.drive == "command"
    assert found.refused is None and found.remarks == ()
    assert found.position_rms is not None and found.position_rms < 2e-4
    assert found.force_simulated_rms is not None and found.force_simulated_rms < 0.03
    header, first, *_ = prediction_frame([found]).to_csv(index=False).splitlines()
    assert header == ",".join(PREDICTION_COLUMNS)
    assert len(first.split(",")) == len(PREDICTION_COLUMNS)
    assert card.recipe is not None


def test_a_prediction_beyond_the_speeds_of_its_logs_is_said_so() -> None:
    log = identified().sources[0].log
    (said,) = predict(identified().model, log.with_signals(y=1.3 * log["y"])).remarks
    assert said.startswith("faster than the logs of the model (")
    assert predict(identified().model, log).remarks == ()


def test_the_error_of_predicting_no_force_is_that_of_the_same_samples() -> None:
    found = predict(identified().model, identified().sources[0].log)
    squares = found.force_applied[found.sliding] ** 2
    assert found.force_applied_rms == pytest.approx(float(np.sqrt(np.mean(squares))))


@pytest.mark.slow
def test_a_prediction_by_force_drifts_less_in_windows() -> None:
    log = identified().sources[0].log
    model = identified().model
    free = predict(model, log, drive="force")
    windows = predict(model, log, drive="force", window=0.5)
    assert free.drive == "force"
    assert windows.position_rms is not None and free.position_rms is not None
    assert windows.position_rms < free.position_rms
    with pytest.raises(BadModel, match="window"):
        predict(model, log, window=1e-3)


def test_the_force_of_a_motor_is_its_commands_and_no_result() -> None:
    log = identified().sources[0].log
    motor = model_of(EMPS, k_a=35.15)
    found = predict(motor, Log("motor", {key: log[key] for key in ("t", "y", "u")}))
    assert found.drive == "command" and found.position_rms is not None
    assert found.force_simulated_rms is None and np.all(np.isnan(found.force_simulated))


def test_a_prediction_without_a_command_leaves_its_column_empty() -> None:
    log = identified().sources[0].log
    bare = Log("bare", {key: log[key] for key in ("t", "y", "F")})
    found = predict(identified().model, bare)
    assert found.drive == "force"
    assert found.force_simulated_rms is None
    assert prediction_frame([found]).to_csv(index=False).splitlines()[1].split(",")[3] == ""
    with pytest.raises(BadLog, match="no command u"):
        predict(identified().model, bare, drive="command")


@pytest.mark.parametrize("name", ["m", "F_cp", "F_vn"])
def test_without_what_a_run_needs_the_force_alone_is_predicted(name: str) -> None:
    model, log = identified().model, identified().sources[0].log
    one = model.friction[name]
    blank = Estimate(None, one.unit, reason="too slow", assumed=one.value)
    found = predict(replace(model, friction={**model.friction, name: blank}), log)
    assert found.refused is not None
    assert f"{name} not identified, which a run by the command needs" in found.refused
    assert f"({name}: too slow)" in found.refused
    assert "the run of identify is of the fit's own values" in found.refused
    assert found.position_rms is None and found.force_simulated_rms is None
    assert found.force_predicted_rms == predict(model, log).force_predicted_rms
    assert found.remarks == (f"force by assumed values of what is not identifiable: {name}",)
    assert prediction_frame([found]).to_csv(index=False).splitlines()[1].endswith(",")


def test_a_friction_that_is_surely_small_keeps_no_run_back() -> None:
    model, log = identified().model, identified().sources[0].log
    small = Estimate(None, "N s/m", 1.0, reason="small", assumed=200.0, at_most=202.0)
    found = predict(replace(model, friction={**model.friction, "F_vn": small}), log)
    assert found.refused is None and found.position_rms is not None


def test_without_an_actuator_that_is_reported_the_force_drives() -> None:
    model, log = identified().model, identified().sources[0].log
    blank = Estimate(None, "N/(V s)", reason="no linear actuator", assumed=ACTUATOR.k1)
    vague = replace(model, actuator={**(model.actuator or {}), "k1": blank})
    found = predict(vague, log)
    assert found.drive == "force" and found.refused is None
    assert found.force_simulated_rms is None
    assert "force, simulated: no free run: k1 not identified" in found.remarks[0]
    refused = predict(vague, log, drive="command").refused
    assert refused is not None and "k1: no linear actuator" in refused


def test_a_run_that_is_lost_leaves_the_force() -> None:
    """A stiff body on a long sample: its run comes to no number."""
    model, log = identified().model, identified().sources[0].log
    light = replace(model.friction["m"], value=1e-12, low=1e-13, high=1e-11)
    found = predict(replace(model, friction={**model.friction, "m": light}), log, drive="force")
    assert found.refused is not None and found.refused.startswith("no free run: short: the simul")
    assert found.force_predicted_rms is not None


def test_a_prediction_does_not_change_the_log() -> None:
    log = identified().sources[0].log
    before = {key: values.copy() for key, values in log.signals.items()}
    predict(identified().model, log, window=0.5)
    assert all(np.array_equal(before[key], log[key]) for key in before)


def test_a_recording_is_its_seed_s_and_the_truth_is_beside_it() -> None:
    _, recipe = short_recipe(1.0)
    one, again, other = (record("x", recipe, seed=s) for s in (1, 1, 2))
    assert np.array_equal(one["y"], again["y"])
    assert not np.array_equal(one["y"], other["y"])
    assert set(one.signals) == {"t", "r", "y", "F", "u"}
    known = truth("x", recipe, 2)
    assert known["seed"] == 2
    bare = {"sd": None, "low": None, "high": None}
    assert known["friction"]["F_sn"] == {"value": -23.0, "unit": "N", **bare}
    assert known["actuator"]["k1"] == {"value": 19530.0, "unit": "N/(V s)", **bare}
    turning = truth("x", recipe, 2, rig=Rig("force", motion="rotary"))
    assert turning["friction"]["F_vp"]["unit"] == "N m s/rad"
    assert turning["actuator"]["k2"]["unit"] == "N m/rad"


def test_a_loop_that_runs_away_is_no_log() -> None:
    _, recipe = short_recipe(1.0)
    assert recipe.loop is not None
    far = RecipePID(kind="PID", k_R=1e9, T_d=0.018, T_i=0.072, eps=0.2)
    wild = recipe.loop.model_copy(update={"position": far, "control_limit_v": None})
    with pytest.raises(BadCard, match=r"runs away after 0\.0\d+ s"):
        record("wild", replace(recipe, loop=wild))


@pytest.mark.slow
@pytest.mark.parametrize(("asked", "why"), [(True, "as asked"), (False, "only a part of the")])
def test_an_actuator_of_a_run_by_force_is_not_blamed(asked: bool, why: str) -> None:
    fit: Any = SimpleNamespace(actuator=ACTUATOR, estimates={})
    found = _actuator(fit, Rig("force"), asked)
    assert found and all(why in str(one.reason) for one in found.values())


def test_a_volt_limit_does_not_bound_the_force_of_a_machine_without_actuator() -> None:
    model = replace(model_of(EMPS), rig=Rig("force"))
    found = designed(model)
    assert found.rst is not None and found.force is None
    r = np.repeat([0.0, 0.05], 200)
    machines = [replace(model, rig=Rig("force", control_limit=v)) for v in (None, 1e-3)]
    free, limited = (
        run_driven(one, driven_loop(one, found, found.rst), r, rng()) for one in machines
    )
    assert np.array_equal(free.F, limited.F)
    motor = replace(model_of(EMPS, k_a=35.15), rig=Rig("motor", 35.15, control_limit=1e-3))
    run = run_driven(motor, driven_loop(motor, found, found.rst), r, rng())
    assert np.max(np.abs(run.u)) <= 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["standstill", "tracking", "modulus", "delay", "overshoot", "force"]
)
def test_a_limit_that_is_no_number_is_never_kept(name: str) -> None:
    model = model_of(TABLES["paper_table1"], ACTUATOR)
    result, _ = validate(model, designed(model), rng(), limits=Limits(**{name: np.nan}))
    assert not result.passed


def test_both_runs_must_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    model = model_of(TABLES["paper_table1"], ACTUATOR)
    found = designed(model)
    count = 0

    def lost(*arguments: Any) -> LoopRun:
        nonlocal count
        run = run_driven(*arguments)
        count += 1
        return run if count % 2 else replace(run, y=np.full_like(run.y, np.nan))

    monkeypatch.setattr(loop_figures, "run_driven", lost)
    result, _ = validate(model, found, rng())
    assert not result.figures["rst"]["model"].stable
    assert result.figures["rst"]["model"].missed == ("the simulated loop runs away",)


@pytest.mark.slow
def test_margins_of_a_validation_are_those_of_its_plant() -> None:
    model = identified().model
    found = designed(model, source="arx")
    assert model.plant is not None
    stronger = replace(model.plant, B=tuple(1.3 * b for b in model.plant.B))
    result, _ = validate(model, found, rng(), plant=replace(model, plant=stronger))
    one, other = (result.figures["rst"][place].margins for place in ("model", "plant"))
    assert one is not None and other is not None
    assert other.modulus != one.modulus
    wide = model_of(TABLES["paper_table1"], ACTUATOR, spread=0.05)
    physical = designed(wide)
    checked, _ = validate(wide, physical, rng())
    margin = checked.figures["rst"]["model"].margins
    assert margin is not None and margin.worst_modulus is not None
    assert margin.worst_modulus < margin.modulus
    assert physical.rst is not None
    assert margin.worst_modulus == pytest.approx(physical.rst.margins.worst_modulus)


@pytest.mark.slow
def test_a_physical_design_needs_a_mass_and_says_what_it_rests_on() -> None:
    model = identified().model
    with pytest.raises(NotIdentifiable, match=r"no physical plant.*no acceleration"):
        designed(without_mass(model), source="physical")
    assert "viscous friction are identified" in designed(model).plant.why
    blank = Estimate(None, "N s/m", reason="too slow", assumed=300.0)
    vague = replace(model, friction={**model.friction, "F_vp": blank})
    assert "the mass is identified, F_vp assumed" in designed(vague).plant.why


def test_an_interval_from_zero_is_not_taken_for_none() -> None:
    model = model_of(TABLES["paper_table1"], ACTUATOR)
    plant, force = linear_of(model)
    from_zero = replace(model.friction["m"], low=0.0)
    with pytest.raises(BadSpecification, match="m = 0 kg"):
        corners(replace(model, friction={**model.friction, "m": from_zero}), plant, force)


def every(h: float, name: str) -> Log:
    """A log of waves, sampled every h [s]."""
    t = h * np.arange(round(20 / h), dtype=np.float64)
    return Log(name, {"t": t, "y": np.sin(5 * t) + np.sin(13 * t), "F": np.cos(5 * t)})


def test_logs_of_different_periods_meet_at_the_design_period() -> None:
    fast, slow, odd = every(1e-3, "fast"), every(5e-3, "slow"), every(3e-3, "odd")
    h, steps = common_period([fast, slow], None)
    assert h == pytest.approx(0.01) and steps == (10, 2)
    with pytest.raises(BadLog, match=r"odd: sampled every 0.003 s, slow every 0.005 s"):
        common_period([slow, odd], None)
    with pytest.raises(BadModel, match=r"no multiple of the log's 0.005 s; ask for 0.01"):
        decimation(5e-3, 0.012)
    with pytest.raises(BadModel, match="finite"):
        decimation(5e-3, float("inf"))


def test_force_error_of_a_prediction_is_that_of_sliding() -> None:
    found = predict(identified().model, identified().sources[0].log)
    error = (found.force_applied - found.force_predicted)[found.sliding]
    assert 0 < found.sliding.sum() < len(found.t)
    assert found.force_predicted_rms == pytest.approx(float(np.sqrt(np.mean(error**2))))


def test_a_run_by_force_says_what_held_it() -> None:
    model = identified().model
    assert not any("corrected to" in line for line in fit_lines(model))
    by_force = replace(model, fit=replace(model.fit, drive="force", stiffness=123.0))
    said = (
        "corrected to the measured position by 123 N/m and restarted from the measured state"
        " every 2 s"
    )
    assert any(said in line for line in fit_lines(by_force))
    alone = replace(model, fit=replace(model.fit, drive="force", stiffness=0.0))
    assert any("restarted from" in line for line in fit_lines(alone))
    assert not any("corrected to" in line for line in fit_lines(alone))


def test_what_an_equation_leaves_is_reported_as_it_was_fitted() -> None:
    """In the weak form, which a clock that jitters does not spoil as it does derivatives."""
    log = made_log(table(2), seed=1, seconds=8.0)
    shaken = log.with_signals(y=log["y"] + 2e-5 * rng().standard_normal(len(log)))
    rig = Rig("force")
    fit = fit_prescribed(recorded_logs([shaken], rig, "force"), "why")
    reported = _force_error([shaken], fit, rig)
    by_derivatives = _force_error([shaken], replace(fit, left=None), rig)
    assert reported is not None and by_derivatives is not None
    assert reported.relative < 0.1
    assert reported.relative < by_derivatives.relative
