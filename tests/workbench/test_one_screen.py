"""Every command prints one screen, 40 lines of 100 columns, on the fullest of its results."""

import inspect
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from design.asked import Limits, RobustAsked
from design.closed_loop.loop_figures import COMPENSATED, PRESENT, LoopFigures
from design.closed_loop.loop_motion import LimitCycle
from design.controllers.validate import Validation
from design.experiment.planned import Experiment, Promised, Safety
from design.judgement import Candidate
from design.machine.design import Recommendation
from design.machine.model import Model
from design.machine.readable import Display
from design.measured.drift_of_logs import Drifted
from design.measured.drift_of_logs import Tested as OneTested
from design.measured.predicted_logs import Predicted
from design.measured.response import respond
from design.robust.outcomes import MEASURES, Outcomes
from design.robust.robust import NOMINAL, ROBUST, Promise, Robust, Spread
from design.tune import Asked
from identification.drift.drift_result import DriftTest, Shift, Statistic
from identification.frequency.modes import Modes, Peak
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from identification.model.size import Size
from identification.remarks import MinorRemark
from identification.tracing.result import Change
from tests.chain import designed, identified, short_recipe
from tests.screens import one_screen, words_of
from tests.workbench.trace_values import trace_of, traced
from workbench import cli
from workbench.commands.fleet import fleet_screen
from workbench.commands.reidentify import pass_screen
from workbench.registry.store import Registry
from workbench.registry.values import LogOutcome, SeenLog
from workbench.report.doctor import installation_screen
from workbench.report.first_card import proposal_screen
from workbench.report.trace_words import words
from workbench.report.validation import demo_screen
from workbench.report.view import view
from workbench.screen import Screen
from workbench.steps.demo import Demonstration
from workbench.steps.first_card.proposal import proposed
from workbench.steps.installation import check_installation

LOGS = tuple(f"day {n // 4}/run {n}.csv" for n in range(40))
OUT = Path("results") / ("a folder with a long name " * 4)
NOW = datetime(2024, 5, 6, 7, 8, 9, tzinfo=UTC)
SLOW = Asked((20.0, 0.9))  # nothing to be searched
WHY = (
    "the interval is wider than the value: not identifiable from these logs; excite it more, or log"
    " longer"
)
REMARKS = (
    *(f"{log}: uneven clock, resampled every {n % 3 + 5:.3g} ms" for n, log in enumerate(LOGS)),
    *(f"{log}: isolated spikes of 'y' in {n} samples interpolated" for n, log in enumerate(LOGS)),
    *(MinorRemark(f"{log}: its clock jitters by {n} us") for n, log in enumerate(LOGS)),
    *(f"signals.{n}: its unit is of no machine's size; check the unit in the card" for n in LOGS),
)


def lost(e: Estimate, why: str) -> Estimate:
    """An estimate that the logs do not tell."""
    return Estimate(None, e.unit, reason=why, assumed=e.value)


def many_logs(model: Model, identifiable: int = 9) -> Model:
    """The model of forty logs, of whose nine parameters only the first are identifiable."""
    friction = {
        name: e if n < identifiable else lost(e, f"{name}: {WHY}")
        for n, (name, e) in enumerate(model.friction.items())
    }
    entries = tuple(replace(model.log[0], file=log, position_rms=1e-5 * n) for n, log in
                    enumerate(LOGS))  # fmt: skip
    return replace(model, log=entries, friction=friction)


def identify() -> Iterator[Screen]:
    for identifiable in (9, 2):
        for adequate in (True, False):
            model = many_logs(identified().model, identifiable)
            model = replace(model, fit=replace(model.fit, adequate=adequate))
            yield view(replace(identified(), model=model, remarks=REMARKS)).screen(OUT)


def trace() -> Iterator[Screen]:
    every = ("stribeck", "spring", "valve_dead_zone", "rising_stiction")
    drift = tuple(Change(name, "N", 12.0, 14.4, 0.1) for name in (*NAMES, "k1", "k2"))
    for verdict, keys in (("effect", every), ("unknown", every[:1]), ("none", ()), ("drift", ()),
                          ("inseparable", every[:2])):  # fmt: skip
        found = replace(trace_of(verdict, keys), remarks=REMARKS)  # type: ignore[arg-type]
        found = replace(found, drift=drift if verdict == "drift" else found.drift)
        yield view(replace(traced(found), remarks=REMARKS)).screen(OUT)


def figures(n: int, *missed: str) -> LoopFigures:
    """Figures of a loop with a limit cycle."""
    design = designed(identified().model, SLOW)
    margins = next(iter(design.controllers.values())).margins
    x = 1e-3 * n
    return LoopFigures(
        stable=True, margins=margins, step=x, standstill=x, standstill_relative=x, overshoot=x,
        settling=x, step_rms=x, smooth_rms=x, smooth_relative=x, force_rms=x, force_peak=x,
        force_seen=x, command_peak=4.7, command_limit=5.0, command_noise=0.1, missed=missed,
        limit_cycle=LimitCycle(2e-3, 0.97), limited=0.02, force_limit=150.0,
    )  # fmt: skip


def validation(passed: bool) -> Validation:
    """Every loop on two plants, with all that can be remarked of them."""
    loops = (PRESENT, "rst", "pid", f"rst{COMPENSATED}", f"pid{COMPENSATED}")
    missed = () if passed else tuple(f"limit {n} is exceeded on this plant" for n in range(6))
    found = {
        name: {place: figures(n + 1, *missed) for place in ("model", "plant")}
        for n, name in enumerate(loops)
    }
    notes = tuple(f"{name} on the {place}: it swings" for name in loops for place in LOGS)
    return Validation("a", "rst", passed, Limits(), found, notes, {}, "RST: good (PID: worse): so")


def validate() -> Iterator[Screen]:
    yield from (view(validation(passed), {}, Display()).screen(OUT) for passed in (True, False))


def design() -> Iterator[Screen]:
    found = designed(identified().model, SLOW)
    goals = tuple(f"goal {n}" for n in range(30))
    rst = found.rst and replace(found.rst, missed=goals, note="slow " * 30)
    pid = found.pid and replace(found.pid, missed=goals, note="slow " * 30)
    worst = replace(found, remarks=REMARKS, refused={"pid": "no gains " * 30}, rst=rst, pid=pid)
    none = Recommendation("none", False, "; ".join(LOGS))
    yield view(replace(found, remarks=REMARKS)).screen(OUT)
    yield view(worst).screen(OUT)
    worst = replace(worst, recommended="none", recommendation=none)
    yield view(worst).screen(OUT)
    measures = {one.name: Spread(0.1, 0.2, 0.3, 0.25, 0.9) for one in MEASURES}
    promise = Promise("rst", True, measures, 0.8, Outcomes({}))
    promises = dict.fromkeys((ROBUST, NOMINAL, PRESENT), promise)
    for missed in ((), tuple(f"limit {n} is kept by too few" for n in range(9))):
        robust = Robust(found, RobustAsked(), promises, 40, 1e-3, missed, REMARKS)
        yield view(robust).screen(OUT)


def demo() -> Iterator[Screen]:
    for passed, keys in ((True, ("stribeck",)), (False, ("stribeck", "spring")), (False, ())):
        found = traced(trace_of("effect" if keys else "none", keys))
        truth = {
            "friction": {n: {"value": 1.2345} for n in NAMES},
            "effects": {"stribeck": {"F_s": {"value": 3.5}}},
        }
        taken = Recommendation("rst", bool(keys), "RST: good")
        chosen = designed(identified().model, SLOW)
        chosen = replace(chosen, recommended="rst", recommendation=taken)
        judged = "rst + compensator" if keys else "rst"
        checked = replace(validation(passed), judged=judged)
        made = Demonstration(found, chosen, checked, {}, truth)
        yield demo_screen(made, OUT)


def drift() -> Iterator[Screen]:
    source = traced(trace_of()).train[0]
    shift = {n: Shift(n, "N", 12.0, 0.1, 14.4, 0.1, 14.2, 14.6, 0.2, 0.01, 0.0) for n in NAMES[:4]}
    reasons, none = dict.fromkeys(NAMES[4:], WHY), Statistic(3.0, 12.0, 0.5, 9)
    state: Any = None
    for verdict in ("none", "drift", "structure", "not_judged"):
        test = DriftTest(verdict, state, f"{WHY} {WHY}", 1.0, 2.0, tuple(shift.values()),
                         NAMES[4:], shift, reasons, {}, none, none, none, "mean")  # fmt: skip
        tests = tuple(
            OneTested(replace(source, file=log, log=replace(source.log, name=log)),
                   replace(test, reason=f"{log}: {WHY}"), False)
            for log in LOGS
        )  # fmt: skip
        settings: Any = SimpleNamespace(margin=0.02, run_length=1e3, variation=0.01, to_be_seen=1.0)
        found = Drifted(identified().model, "", settings, tests, state, REMARKS)
        yield view(found, "model.json").screen(OUT)


def experiment() -> Iterator[Screen]:
    promise = tuple(Promised(f"parameter_{n}", "N s/m", 1.0, 0.1, 0.01, 0.9) for n in range(45))
    peaks: Any = SimpleNamespace(low=-0.1, high=0.1, speed=0.3, force=90.0, command=4.0)
    limits: Any = SimpleNamespace(stroke=(-0.2, 0.2), speed=0.4, force=100.0, command=5.0)
    found = object.__new__(Experiment)  # with what its view reads
    vars(found).update(
        card="a", h=1e-3, r=np.zeros(20_001), promise=promise, separation=(),
        motion="linear", limits=limits,
        safety=Safety(20, peaks, 3, 0.7), tried=(40, 9), controller="the present controller",
        segments=(1, 2), efficiency=0.9, remarks=REMARKS, command_unit="V",
    )  # fmt: skip
    assert set(vars(found)) <= set(Experiment.__dataclass_fields__)
    yield view(found).screen(OUT)


def predict() -> Iterator[Screen]:
    summary = {
        "drive": "force", "window": None, "position_rms": 1e-3, "force_predicted_rms": 1.0,
        "force_applied_rms": 0.5,
        "force_simulated_rms": 1.0, "run_refused": WHY * 3, "remarks": REMARKS,
    }  # fmt: skip
    yield view(Predicted((), summary), Display(), LOGS[0]).screen(OUT)


def response() -> Iterator[Screen]:
    source = replace(identified().sources[0], file=LOGS[0])
    card, _ = short_recipe()
    found = respond([source], card.rig(), card.name, identified().model, read=REMARKS)
    size = Size(123.456, 0.5)
    peaks = tuple(Peak("anti-resonance", size, Size(0.0123, 0.1 / n)) for n in range(1, 40))
    modes = Modes(peaks, np.zeros(2), np.zeros(2), 1.0)
    logs = tuple({"file": log} for log in LOGS)
    for left_in in (None, WHY):
        many = replace(found, modes=modes, logs=logs, left_in=left_in)
        yield view(many).screen(OUT)


def reidentify() -> Iterator[Screen]:
    outcomes = tuple(
        LogOutcome(f"machine-{n}", SeenLog("0" * 64, log, 1, 1), "set_aside", WHY, 1, {}, NOW)
        for n, log in enumerate(LOGS)
    )
    done: Any = SimpleNamespace(machines=40, outcomes=outcomes, growing=3, busy=LOGS,
                                without_model=LOGS, no_logs=LOGS)  # fmt: skip
    yield pass_screen(done)


def fleet() -> Iterator[Screen]:
    bad = [SimpleNamespace(log=SimpleNamespace(machine=log), verdict="refused", reason=WHY)
           for log in LOGS * 25]  # fmt: skip
    done: Any = SimpleNamespace(logs=1000, verdicts={"refused": 1000}, before=3, later=4, bad=bad,
                                seconds=9.0, busy=9.0, memory=1)  # fmt: skip
    yield fleet_screen(done, OUT)


def doctor() -> Iterator[Screen]:
    """Alone; of a log: tests/workbench/steps/test_doctor.py."""
    yield installation_screen(check_installation(), {"where": "x" * 150, "answers": False}, LOGS)


def axis_test() -> Iterator[Screen]:
    """Every number beyond its limits, of a log of many runs."""
    from design.machine.source import Source
    from design.measured.axis_limits import MEANING_OF
    from design.simulated.record import record
    from tests.chain import short_recipe
    from workbench.logs.sources import Sources
    from workbench.steps.axis_test import axis_test_of_sources

    card, recipe = short_recipe()
    log = record("short", recipe, 7)
    runs = (Source(log, "a long name of a file " * 3, "0" * 64, len(log)),) * 3
    limits = dict.fromkeys(MEANING_OF, (1e6, 2e6))
    for given in ({}, limits):
        found = Sources(replace(card, limits=given), card.rig(), runs, tuple(REMARKS))
        yield view(axis_test_of_sources(found)).screen(OUT)


BY_VIEW: tuple[Callable[[], Iterator[Screen]], ...] = (
    identify, trace, validate, design, demo, drift, experiment, predict, response, reidentify,
    fleet, doctor, axis_test,
)  # fmt: skip
BY_COMMAND = ("effects", "init", "registry", "token", "simulate", "export")  # run below
NO_SCREEN = ("serve", "work", "watch")  # events as JSON lines, until they are stopped


def test_every_command_fits_one_screen() -> None:
    views = {view.__name__.replace("_", "-") for view in BY_VIEW}
    contained = views | {*BY_COMMAND, *NO_SCREEN}
    assert contained == set(cli.COMMANDS)
    tests = inspect.getsource(inspect.getmodule(one_screen_of))  # type: ignore[arg-type]
    assert all(f'one_screen_of("{name}"' in tests for name in BY_COMMAND)


@pytest.mark.parametrize("view", BY_VIEW)
def test_the_fullest_result_is_one_screen(view: Callable[[], Iterator[Screen]]) -> None:
    for shown in view():
        text = one_screen(shown)
        whole = shown.text(verbose=True)
        assert len(whole.splitlines()) >= len(text.splitlines())
        # The answer, and where the results are, survive every cut.
        assert text.splitlines()[0] == whole.splitlines()[0]
        assert ("written: " in text) == ("written: " in whole)


def test_remarks_on_many_logs_are_reported_once() -> None:
    shown = next(identify())
    text, whole = (words_of(shown.text(verbose=one)) for one in (False, True))
    assert "note: 40 logs: uneven clock, resampled every 5 to 7 ms" in text
    assert re.search(r"note: 40 logs: isolated spikes of 'y' in 0 to 39 samples", text)
    assert re.search(r"\d+ logs: simulated position within 10 to 90 µm rms", text)
    assert "jitters" not in text and whole.count("jitters") == len(LOGS)
    assert whole.count("uneven clock") == len(LOGS)


def test_parameters_not_identifiable_for_one_reason_are_reported_together() -> None:
    model = many_logs(identified().model)
    for name in ("dv_p", "dv_n"):
        model.friction[name] = lost(model.friction[name], f"5 logs: {WHY}")  # type: ignore[index]
    shown = view(replace(identified(), model=model, remarks=())).screen()
    assert "dv_p, dv_n - m/s not identifiable: the interval is wider than the value" in words_of(
        shown.text()
    )
    assert words_of(shown.text(verbose=True)).count("excite it more") == 2


def test_the_demo_sets_the_controllers_side_by_side() -> None:
    text = words_of(next(demo()).text())
    assert "Recommended: RST with the compensator, which meets all limits" in text
    assert "before: present" in text and "after: RST+comp" in text
    assert "stribeck F_s 3.50 N 3.43 to 3.57 3.5 " in text
    assert "workbench init LOG" in text and "report.html" in text


def test_effects_and_their_parameters_have_names_on_one_screen() -> None:
    for shown, keys in zip(trace(), (("stribeck", "spring"), ("stribeck",)), strict=False):
        text = one_screen(shown)
        assert all(f"{words(key)}" in text for key in keys)


def one_screen_of(*arguments: str, status: int = 0) -> str:
    """What a command prints by default, which is one screen; with --verbose no less."""
    done = CliRunner().invoke(cli.cli, arguments, standalone_mode=False)
    assert done.return_value in (status, None) and done.exception is None, done.output
    return one_screen(done.output)


def test_the_list_of_effects() -> None:
    text = one_screen_of("effects", "list")
    assert "stribeck: friction falls with speed" in text and "source:" not in text
    assert "source:" in one_screen_of("effects", "list", "stribeck")
    whole = CliRunner().invoke(cli.cli, ["effects", "list", "--verbose"]).output
    assert whole.count("source:") == text.count(": ") - 1


def test_a_card_for_a_log_of_a_hundred_columns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    log = traced(trace_of()).train[0].log
    columns = np.column_stack([log["t"], log["y"], log["F"]])[:800]
    np.savetxt("run.csv", columns, delimiter=",", header="time [s],position [m],force [N]",
               comments="", fmt="%.6g")  # fmt: skip
    assert "written: card.toml" in one_screen_of("init", "run.csv")
    found = proposed(Path("run.csv"), None)
    unused = {f"channel {n}": "no signal that a card needs" for n in range(100)}
    text = one_screen(
        proposal_screen(replace(found, unused=unused, refused=WHY), OUT / "card.toml")
    )
    assert "... and 95 more: --verbose" in text and text.splitlines()[-1].endswith("card.toml")


@pytest.mark.slow
def test_a_registry_of_many_machines_and_versions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    who: Any = {"reason": "why it was done, at some length " * 3, "by": "tester", "now": NOW}
    friction = {f"F_{n}": {"value": n, "unit": "N"} for n in range(60)}
    with Registry("registry.db") as found:
        for n in range(45):
            found.add("a", Candidate({"friction": friction, "m": n}), **who)
            found.add(f"machine-{n}", Candidate({"m": n}), **who)
        found.promote("a", 45, **who)
    assert "more: --verbose" in one_screen_of("registry", "list")
    shown = one_screen_of("registry", "show", "a")
    assert "promoted" in shown and "earlier: --verbose" in shown
    one_screen_of("registry", "diff", "a", "1", "2")
    one_screen_of("registry", "promote", "a", "3", "--reason", "why " * 50)
    one_screen_of("registry", "rollback", "a", "--reason", "why " * 50)
    one_screen_of("registry", "retry", "a", "--reason", "why")
    one_screen_of("token", "add", "anna")
    one_screen_of("token", "list")


def test_a_simulation_and_an_export(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from design.machine.documents import design_document
    from tests.chain import CARD
    from workbench.output import dumps

    monkeypatch.chdir(tmp_path)
    Path("card.toml").write_text(CARD, "utf-8")
    one_screen_of("simulate", "card.toml", "--out", "made")
    Path("design.json").write_text(
        dumps(design_document(designed(identified().model, SLOW))), "utf-8"
    )
    chosen = ["--controller", "rst", "--compensator"]
    chosen += [word for name in ("c", "st", "plcopen", "json") for word in ("--to", name)]
    assert "written: " in one_screen_of("export", "design.json", *chosen, "--out", "code")


def test_an_export_of_every_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from design.machine.documents import model_document
    from tests.workbench.export.models import COGGING, PLACE, PLAY, STRIBECK, linear
    from workbench.output import dumps

    monkeypatch.chdir(tmp_path)
    slow = {"warmup": {"a": -0.2, "tau": 100.0}, "rising_stiction": {"F_r": 1.0, "tau": 1.0}}
    full = linear({**STRIBECK, **COGGING, **PLACE, **PLAY, **slow})
    full = replace(full, fit=replace(full.fit, adequate=False))
    Path("model.json").write_text(dumps(model_document(full)), "utf-8")
    every = ("friction-table", "cogging-table", "backlash", "csv", "c", "st")
    asked = ["--rated", "2 N m", "--per-turn", "48 mm", "--encoder", "motor", "--speed", "0.5 m/s"]
    asked += [word for one in every for word in ("--to", one)]
    text = one_screen_of("export", "model.json", *asked, "--out", "tables")
    assert "asymmetry" in text and "written: tables" in text
