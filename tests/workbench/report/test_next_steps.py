"""What is to be typed after a refusal or an alarm: a command that the command line takes."""

import shlex
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import numpy as np
import pytest

from design.asked import Limits
from design.controllers.validate import validate
from design.machine.arx_plant import ArxPlant
from design.machine.design import Design
from design.machine.model import LogEntry, Model, used
from design.tune import Asked
from identification.errors import NotIdentifiable
from identification.model.plant import Actuator
from tests.chain import TABLES, designed, model_of
from workbench import cli
from workbench.commands.axis_test import after_axis_test
from workbench.commands.fleet import after_fleet
from workbench.commands.reidentify import after_pass
from workbench.output import Refused, Step, refused_with, step
from workbench.report.next_steps import (
    after_demo,
    after_design,
    after_doctor,
    after_drift,
    after_identify,
    after_predict,
    after_trace,
    after_validate,
    check_of_refused,
    without_design,
)

ACTUATOR = Actuator(19530.0, 10405.0)
MODEL = Path("my model/model.json")
OUT = Path("out")
FAST = Asked((300.0, 0.7))


def taken(then: Step | None) -> str:
    """The proposed command, once the command line has parsed it."""
    assert then is not None
    program, name, *arguments = shlex.split(then.command)
    assert program == "workbench" and str(then) == f"next ({then.why}): {then.command}"
    with cli.cli.make_context("workbench", [], resilient_parsing=True) as ctx:
        command: click.Command | None = cli.cli.get_command(ctx, name)
        while isinstance(command, click.Group):
            command = command.get_command(ctx, arguments.pop(0))
        assert command is not None
        command.make_context(name, list(arguments), parent=ctx)
    return then.command


@pytest.fixture(scope="module")
def model() -> Model:
    return model_of(TABLES["paper_table1"], ACTUATOR)


@pytest.fixture(scope="module")
def found(model: Model) -> Design:
    return designed(model)


@pytest.fixture(scope="module")
def too_fast(model: Model) -> Design:
    return designed(model, FAST)


def test_names_are_quoted_for_a_shell() -> None:
    then = step("why", "design", Path("my model") / "m.json", None, "--poles", "3,1")
    assert then.command == "workbench design 'my model/m.json' --poles 3,1"


def test_a_refusal_of_logs_looks_over_the_one_it_names() -> None:
    then = check_of_refused(["logs/a.csv", "logs/b.csv"], "card.toml")
    assert taken(then("b.csv: no motion")) == "workbench doctor logs/b.csv --card card.toml"
    assert taken(then("no motion")) == "workbench doctor logs/a.csv --card card.toml"


def test_after_identify(model: Model) -> None:
    then = after_identify(model, ["a.csv"], "emps", Path("out"))
    assert taken(then) == "workbench design out/model.json"
    lacking = replace(
        model, fit=replace(model.fit, adequate=False), log=(*model.log, other_log(model, "b.csv"))
    )
    then = after_identify(lacking, ["a.csv", "b.csv"], "emps", Path("out"))
    assert taken(then) == "workbench trace a.csv b.csv --card emps"
    assert then.why == "an effect is missing"


def test_steps_go_to_no_trace_which_refuses_them(model: Model) -> None:
    """By steady speeds no equation of motion, and no run, leaves a share of the force."""
    by_steps = replace(
        model, fit=replace(model.fit, adequate=False, force_relative=None),
        log=tuple(replace(one, position_rms=None) for one in model.log),
    )  # fmt: skip
    assert by_steps.by_equation
    then = after_identify(by_steps, ["a.csv"], "emps", OUT)
    assert taken(then) == "workbench doctor a.csv --card emps"


def other_log(model: Model, name: str) -> LogEntry:
    """The model's first log under another name."""
    return replace(model.log[0], file=name)


def test_a_log_that_was_left_out_of_the_fit_is_not_named(model: Model) -> None:
    """Of a motor's six logs two are too short, and `trace` of all of them was proposed."""
    one = replace(model, log=(other_log(model, "b.csv"),))
    lacking = replace(one, fit=replace(one.fit, adequate=False))
    logs = ["short.csv", "logs/b.csv"]
    assert taken(after_identify(lacking, logs, "emps", OUT)) == (
        "workbench trace logs/b.csv --card emps"
    )
    nothing = withheld(one, *model.friction)
    assert taken(after_identify(nothing, logs, "emps", OUT)) == (
        "workbench doctor logs/b.csv --card emps"
    )


def test_a_refusal_looks_over_no_log_that_was_left_out() -> None:
    then = check_of_refused(["logs/a.csv", "logs/short.csv"], "card.toml")
    added = "2 logs: no run follows; short.csv: 94 samples, at least 100 needed: left out"
    with pytest.raises(Refused) as refused, refused_with(then):
        raise NotIdentifiable(added) from NotIdentifiable("2 logs: no run follows")
    assert str(refused.value) == added
    assert refused.value.then.command == "workbench doctor logs/a.csv --card card.toml"


def test_motion_one_way_goes_to_no_trace_which_refuses_it(model: Model) -> None:
    up = withheld(model, "F_cp", "F_cn", "F_vn")
    assert up.identifies_one_way and not model.identifies_one_way
    lacking = replace(up, fit=replace(up.fit, adequate=False))
    for then in (
        after_identify(lacking, ["a.csv"], "emps", OUT),
        after_predict("a.csv", "emps", one_way=True),
    ):
        assert taken(then) == "workbench doctor a.csv --card emps"
        assert then.why == "which run to add"
    assert taken(after_predict("a.csv", "emps")) == "workbench trace a.csv --card emps"


def test_no_design_is_proposed_of_a_model_that_carries_none(model: Model) -> None:
    massless, nothing = withheld(model, "m"), withheld(model, *model.friction)
    arx = ArxPlant(
        1, 1, 1, (1.0, -0.9), (0.0, 1.0), 0.01, "F", 0.0, (0.1,), (0.1,), 0.1, 0.1, 0.1, None
    )
    lacking = replace(nothing, fit=replace(nothing.fit, adequate=False), plant=arx)
    for one in (massless, nothing, lacking):
        then = after_identify(one, ["logs/a.csv"], "emps", OUT)
        assert taken(then) == "workbench doctor logs/a.csv --card emps"
    for verdict, effects in (("none", ()), ("effect", ("spring",))):
        traced = after_trace(verdict, effects, massless, ["b.csv"], "emps", OUT)
        assert taken(traced) == "workbench doctor b.csv --card emps"


def withheld(model: Model, *names: str) -> Model:
    """The model with these of its parameters not identified."""
    none = {n: one.withheld("why; what to do", used(one)) for n, one in model.friction.items()}
    return replace(
        model, friction={n: none[n] if n in names else one for n, one in model.friction.items()}
    )


def test_a_model_without_design(
    model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of files that do not lie there no path is made up: a model knows their names alone."""
    monkeypatch.chdir(tmp_path)
    assert taken(without_design(model, None)("")) == "workbench doctor LOG --card CARD"
    assert taken(without_design(model, "c.toml")("")) == "workbench doctor LOG --card c.toml"
    Path("a.csv").touch()
    assert taken(without_design(model, "c.toml")("")) == "workbench doctor a.csv --card c.toml"
    Path("card.toml").touch()
    assert taken(without_design(model, None)("")).endswith("--card card.toml")
    shipped = replace(model, card="emps")
    assert taken(without_design(shipped, None)("")) == "workbench doctor a.csv --card emps"


def test_margins_that_are_missed_become_those_that_are_kept(too_fast: Design) -> None:
    assert too_fast.recommended == "none" and too_fast.rst is not None
    kept = replace(too_fast.rst.margins, modulus=0.437, worst_modulus=0.419, delay_samples=1.239)
    missed = ("modulus margin 0.437, at least 0.5 asked", "delay margin 1.239 samples, ...")
    near = replace(too_fast, rst=replace(too_fast.rst, margins=kept, missed=missed), pid=None)
    start = f"workbench design '{MODEL}' --from physical"
    asked = ("--from", "physical")
    then = taken(after_design(near, MODEL, False, asked, OUT))
    assert then == f"{start} --modulus 0.41 --delay 1.23"
    slow = replace(near, rst=replace(too_fast.rst, missed=("a step overshoots by 9 %",)))
    w_n, zeta = too_fast.rst.dominant
    then = taken(after_design(slow, MODEL, False, asked, OUT))
    assert then == f"{start} --poles {0.7 * w_n:.3g},{zeta:.3g}"


def test_poles_that_miss_the_goals_are_searched(found: Design, too_fast: Design) -> None:
    assert taken(after_design(too_fast, MODEL, True, (), OUT)) == f"workbench design '{MODEL}'"


def test_a_controller_is_tried_in_simulation_by_the_files_at_hand(found: Design) -> None:
    then = taken(after_design(found, MODEL, False, (), OUT))
    assert then == f"workbench validate '{MODEL}' out/design.json"


@pytest.mark.parametrize(
    ("verdict", "effects", "command"),
    [
        ("none", (), "workbench design out/model.json"),
        ("effect", ("spring",), "workbench design out/model.json"),
        ("inseparable", ("spring",), "workbench design out/model.json"),
        ("drift", (), "workbench identify new.csv --card emps"),
        ("unknown", (), None),
    ],
)
def test_after_trace(
    model: Model, verdict: str, effects: tuple[str, ...], command: str | None
) -> None:
    then = after_trace(verdict, effects, model, ["new.csv"], "emps", OUT)
    assert (then and taken(then)) == command


@pytest.mark.slow
def test_a_loop_that_misses_a_limit(model: Model, found: Design) -> None:
    def then(limits: Limits, of: Model = model, plant: Path | None = None) -> Step | None:
        result, _ = validate(of, found, np.random.default_rng(0), limits=limits)
        return after_validate(result, found, of, MODEL, plant, None)

    start = f"workbench design '{MODEL}'"
    assert then(Limits()) is None
    assert taken(then(Limits(modulus=0.9))) == f"{start} --modulus 0.9 --delay 2"
    w_n, zeta = found.controllers[found.recommended].dominant
    assert taken(then(Limits(overshoot=1e-6))) == f"{start} --poles {0.7 * w_n:.3g},{zeta:.3g}"
    assert taken(then(Limits(force=0.5))) == f"{start} --poles {0.7 * w_n:.3g},{zeta:.3g}"
    assert taken(then(Limits(tracking=1e-3))) == f"{start} --poles {1.4 * w_n:.3g},{zeta:.3g}"
    lacking = replace(model, fit=replace(model.fit, adequate=False))
    traced = then(Limits(tracking=1e-3), lacking)
    assert taken(traced).startswith("workbench trace LOG --card CARD")


def test_a_machine_on_which_a_design_fails_gets_its_own(model: Model, found: Design) -> None:
    other = model_of(replace(TABLES["paper_table1"], m=0.2), ACTUATOR)
    limits = Limits(overshoot=0.02)
    result, _ = validate(model, found, np.random.default_rng(0), plant=other, limits=limits)
    places = result.figures[result.judged]
    assert places["model"].passed and not places["plant"].passed
    then = after_validate(result, found, model, MODEL, Path("other.json"), None)
    assert taken(then) == "workbench design other.json"


def drifted(verdict: str, files: dict[str, str], tested: bool = True, slip: str = "") -> Any:
    tests = tuple(
        SimpleNamespace(source=SimpleNamespace(file=name), test=SimpleNamespace(verdict=one))
        for name, one in files.items()
    )
    return SimpleNamespace(verdict=verdict, tests=tests, tested=tested, slip=slip)


def test_a_slip_of_unit_asks_for_the_units_and_no_new_model() -> None:
    found = drifted("drift", {"b.csv": "drift"}, slip="no wear")
    assert taken(after_drift(found, ["b.csv"], "emps")) == "workbench doctor b.csv --card emps"


@pytest.mark.parametrize(
    ("verdict", "command"),
    [("structure", "trace"), ("drift", "identify"), ("not_judged", "doctor")],
)
def test_an_alarm_of_drift(verdict: str, command: str) -> None:
    found = drifted(verdict, {"a.csv": "none", "b.csv": verdict}, tested=False)
    then = after_drift(found, ["day 1/a.csv", "day 1/b.csv"], "emps")
    assert taken(then) == f"workbench {command} 'day 1/b.csv' --card emps"


def test_no_alarm_asks_for_nothing() -> None:
    assert after_drift(drifted("none", {"a.csv": "none"}), ["a.csv"], "emps") is None
    assert after_drift(drifted("not_judged", {"a.csv": "not_judged"}), ["a.csv"], "emps") is None


def test_a_log_that_tells_nothing_leads_to_no_command_on_it() -> None:
    nothing: Any = SimpleNamespace(verdict="nothing")
    assert after_doctor(nothing, "a.csv", "c/card.toml") is None
    refused: Any = SimpleNamespace(verdict="refused")
    then = taken(after_doctor(refused, "a.csv", "c/card.toml"))
    assert then == "workbench init a.csv --out c/card-new.toml"


def test_another_card_goes_beside_the_one_at_hand() -> None:
    refused: Any = SimpleNamespace(verdict="refused")
    assert taken(after_doctor(refused, "a.csv", "emps")).endswith("--out card.toml")


def test_a_demo_that_finds_another_effect(model: Model, found: Design) -> None:
    missed: Any = SimpleNamespace(named_rightly=False)
    assert taken(after_demo(missed, Path("demo"), 3)) == "workbench demo --seed 4"
    result, _ = validate(model, found, np.random.default_rng(0), limits=Limits(modulus=0.9))
    failed: Any = SimpleNamespace(
        named_rightly=True, validation=result, design=found, traced=SimpleNamespace(model=model)
    )
    assert taken(after_demo(failed, Path("demo"), 0)).startswith("workbench design demo/model.json")


def test_alarms_of_many_machines() -> None:
    outcome = SimpleNamespace(machine="b", verdict="promoted")
    done: Any = SimpleNamespace(outcomes=(SimpleNamespace(machine="a", verdict="none"), outcome))
    assert taken(after_pass(done, "f.db")) == "workbench registry show b --registry f.db"
    assert "secret" not in str(after_pass(done, "postgresql://me:secret@host/db"))
    quiet: Any = SimpleNamespace(outcomes=(SimpleNamespace(machine="a", verdict="none"),))
    assert after_pass(quiet, None) is None


def test_logs_of_a_fleet_to_look_at() -> None:
    def report(*verdicts: str, later: int = 0) -> Any:
        log = SimpleNamespace(machine="m1", path="/logs/m1/a.parquet")
        bad = tuple(SimpleNamespace(log=log, verdict=one) for one in verdicts)
        return SimpleNamespace(bad=bad, later=later)

    def then(done: Any, where: str | None = None, *, in_registry: bool = True) -> Step | None:
        return after_fleet(done, "logs", "emps", where, in_registry=in_registry)

    assert then(report()) is None
    assert taken(then(report(later=2), "f.db")).endswith("fleet logs --card emps --registry f.db")
    assert taken(then(report("promoted"))) == "workbench registry show m1"
    doctor_command = "workbench doctor /logs/m1/a.parquet --card emps"
    assert taken(then(report("set_aside", "promoted"))) == doctor_command
    assert taken(then(report("promoted"), in_registry=False)) == doctor_command


def test_limits_of_a_registry_are_asked_for_only_where_one_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("WORKBENCH_REGISTRY", raising=False)
    explained = SimpleNamespace(light="green")
    test: Any = SimpleNamespace(light="yellow", untested=True, of=lambda _: explained)
    then = after_axis_test(test, "a.csv", "card.toml", None)
    assert taken(then) == "workbench identify a.csv --card card.toml"
    Path("registry.db").touch()
    then = after_axis_test(test, "a.csv", "card.toml", None)
    assert taken(then).endswith("axis-test a.csv --card card.toml --registry registry.db")
