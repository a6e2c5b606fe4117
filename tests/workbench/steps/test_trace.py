"""A trace as trace.json and model.json, in words, and as a report."""

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from design.identified import trace_logs as tracing
from design.identified.trace_document import trace_document
from design.identified.trace_logs import trace_logs, traced_model
from design.machine.documents import model_document
from design.machine.readable import Display
from design.measured.friction_curve import sliding_friction
from identification.effects._library import built_in
from identification.errors import BadLog
from identification.estimation.estimates import FIXED_AT_DEFAULT, of_effect
from identification.log import Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from identification.model.resonance import Resonance
from identification.model.size import Size
from identification.model.surroundings import Surroundings
from identification.signals.running_median import running_median
from identification.tracing.residual_rows import effect_at_rows, log_starts, share_inside
from identification.tracing.result import (
    Change,
    Dependence,
    Errors,
    FreeCurve,
    Left,
    Residual,
    TraceVerdict,
)
from identification.tracing.shown_against import pictures
from identification.tracing.trace import MOVE_IT
from tests.reported import broken_in
from tests.workbench.report.test_report import checked
from tests.workbench.trace_values import residual, sources, trace_of, traced
from workbench.documents.result_files import read_model
from workbench.output import dumps
from workbench.report.trace import (
    changes_table,
    differences_table,
    effects_table,
    errors_table,
    rivals_table,
    trace_parts,
)
from workbench.report.trace_pictures import axis_of
from workbench.report.trace_words import advice, percent, trace_sentence
from workbench.report.view import view
from workbench.steps.trace import named_logs

CONTRACT = {
    "schema", "verdict", "before", "after", "noise_floor", "effects", "rivals", "unknown", "drift",
    "next_experiment",
}  # fmt: skip
BESIDE = {
    "bad_samples", "complete", "curves", "left", "not_tried", "remarks", "parameters", "card",
    "log", "test_log", "versions", "gravity", "constant_force", "lag", "resonance",
    "missing_of_friction", "actuator_like",
}  # fmt: skip
ERRORS = {"force_rms", "force_relative", "position_rms", "actuator_rms"}
NUMBER = {"value", "unit", "sd", "low", "high"}


def test_the_document_has_the_keys_of_the_contract() -> None:
    found = json.loads(dumps(trace_document(traced(trace_of()))))
    assert set(found) == CONTRACT | BESIDE
    assert found["schema"] == "trace/1"
    for when in ("before", "after"):
        assert {where: set(found[when][where]) for where in found[when]} == {
            "train": ERRORS,
            "test": ERRORS,
        }
    assert found["noise_floor"] == {"force_rms": 0.069}
    (effect,) = found["effects"]
    assert set(effect) == {"key", "params", "explained", "p_value", "probability"}
    assert set(effect["params"]) == {"F_s", "v_s", "asymmetry", "delta"}
    assert all(set(number) >= NUMBER for number in effect["params"].values())
    assert list(broken_in(found)) == []
    assert all(set(rival) == {"key", "test_force_rms", "why_not"} for rival in found["rivals"])
    assert set(found["unknown"]) == {"depends_on", "explained"}
    assert set(found["parameters"]["after"]) == {*NAMES, "k1", "k2"}
    assert [log["file"] for log in found["log"] + found["test_log"]] == ["a.csv", "b.csv"]
    assert found["remarks"] == ["a log was repaired", "a remark of the trace"]


def test_numbers_that_do_not_exist_are_null() -> None:
    found = trace_of()
    none = {where: Errors(float("nan"), None, None, None) for where in ("train", "test")}
    document = json.loads(dumps(trace_document(traced(replace(found, before=none)))))
    assert set(document["before"]["test"].values()) == {None}


def test_the_model_after_is_read_back_with_its_effects(tmp_path: Path) -> None:
    model = traced(trace_of("effect", ("stribeck", "spring"))).model
    (tmp_path / "model.json").write_text(dumps(model_document(model)), encoding="utf-8")
    found = read_model(tmp_path / "model.json")
    assert found.simulated == model.simulated
    assert {a.key for a in found.acting} == {"stribeck", "spring"}
    assert found.friction["F_cp"].value == 11.0
    assert found.plant is not None and found.fit.adequate
    assert not traced(trace_of("unknown", ())).model.fit.adequate


def test_a_force_without_noise_is_no_fault() -> None:
    model = traced_model(replace(trace_of(), noise_force=0.0), sources().logs, built_in())
    assert model.fit.chi_square == 1.0


def test_a_rotary_machine_has_rotary_units() -> None:
    found = traced(trace_of("effect", ("stribeck", "spring")), rotary=True)
    document = trace_document(found)
    assert document["effects"][0]["params"]["v_s"]["unit"] == "rad/s"
    assert found.model.effects["spring"]["k"].unit == "N m/rad"
    assert [row[2] for row in effects_table(found.trace, Rig("force", motion="rotary")).whole] == [
        "N m",
        "rad/s",
        "",
        "",
        "N m/rad",
        "N m/rad**3",
    ]
    errors = errors_table(found.trace, found.model.display)
    assert "[rad]" in str(errors.whole) and "N m" in trace_sentence(found)
    html = checked(view(found).page(), 5)
    assert "velocity [rad/s]" in html and "residual [N m]" in html and "[mm/s]" not in html


def test_a_test_log_that_is_a_training_log_is_refused() -> None:
    with pytest.raises(BadLog, match=r"--test b\.csv: the same bytes as the training log a\.csv"):
        trace_logs(sources().logs, sources("b.csv", "a").logs, built_in())


@pytest.mark.parametrize(("signal", "factor", "said"), [
    ("t", 1e3, r"b\.csv: signals\.t: sampled every 2 s, 1000 times more .* ms in place of s;"),
    ("y", 1e-3, r"b\.csv: signals\.y: the position covers .* less .* m in place of mm;"),
])  # fmt: skip
def test_a_test_log_in_other_units_is_refused_by_its_name(
    signal: str, factor: float, said: str
) -> None:
    other = sources("b.csv", "b")
    log = other.runs[0].log
    signals = {**log.signals, signal: factor * log[signal]}
    run = replace(other.runs[0], log=replace(log, name="b.csv", signals=signals))
    with pytest.raises(BadLog, match=said):
        trace_logs(sources().logs, replace(other, runs=(run,)).logs, built_in())


def test_a_verdict_never_rests_on_no_row(monkeypatch: pytest.MonkeyPatch) -> None:
    without = Errors(None, None, 0.3, None)
    found = replace(trace_of("none", ()), after={"train": without, "test": without})
    assert trace_sentence(traced(found, tested=False)).startswith("Open: no row was held out")
    monkeypatch.setattr(tracing, "trace", lambda *_, **__: found)
    with pytest.raises(BadLog, match=r"b\.csv: no row of it could be judged"):
        trace_logs(sources().logs, sources("b.csv", "b").logs, built_in())
    # A load that swings may leave no steady sliding, and is judged by its own windows.
    swings = Resonance(*[Size(1.0, 0.01)] * 9)
    found = replace(found, verdict="unknown", surroundings=Surroundings(resonance=swings))
    assert trace_logs(sources().logs, sources("b.csv", "b").logs, built_in()).trace is found


@pytest.mark.parametrize("on", [(), ("t",)])
def test_where_nothing_could_be_tested_no_dependence_is_denied_or_told(on: tuple[str, ...]) -> None:
    move = MOVE_IT + ": 17 windows"
    found = replace(trace_of("unknown", ()), next_experiment=move, unknown=Dependence(on, 0.3))
    said = trace_sentence(traced(found))
    assert "the held-out logs slide too little to test on what it depends: 17 windows." in said
    assert "depends on" not in said and "no effect" not in said


def test_other_machines_and_motors_without_a_constant_are_refused() -> None:
    other = sources("b.csv", "b")
    turned = replace(other, rig=replace(other.rig, motion="rotary"))
    with pytest.raises(BadLog, match="another rig"):
        trace_logs(sources().logs, turned.logs, built_in())
    motor = replace(other, rig=replace(other.rig, kind="motor", force_per_command=0.0))
    with pytest.raises(BadLog, match="needs its force_per_command"):
        trace_logs(motor.logs, None, built_in())


def test_the_trace_gets_logs_seed_and_library(monkeypatch: pytest.MonkeyPatch) -> None:
    given = []

    def trace(train, test, rig, library, rng, *, on_progress, keep_going):  # type: ignore[no-untyped-def]
        given.append((len(train), len(test), rig.kind, sorted(library), rng.integers(1000)))
        return trace_of()

    monkeypatch.setattr(tracing, "trace", trace)
    split = sources()
    split = replace(split, card=replace(split.card, split={"test": ("a.csv",)}))
    found = trace_logs(split.logs, sources("b.csv", "b").logs, built_in(), seed=7)
    expected = np.random.default_rng(7).integers(1000)
    assert given == [(1, 1, split.rig.kind, sorted(built_in()), expected)]
    assert "a.csv: trained on, though the card's [split] keeps it for tests" in found.remarks
    assert trace_logs(sources().logs, None, built_in()).test == ()


def test_logs_that_are_not_named_are_the_cards() -> None:
    assert named_logs(["a", "b"], ["c"], "no such card") == (("a", "b"), ("c",))
    assert named_logs([], [], "emps") == (("DATA_EMPS.mat",), ("DATA_EMPS_PULSES.mat",))
    assert named_logs([], ["c"], "emps") == (("DATA_EMPS.mat",), ("c",))
    with pytest.raises(BadLog, match="no log to train on"):
        named_logs([], [], "demo")


@pytest.mark.parametrize(
    ("verdict", "keys", "said"),
    [
        ("none", (), "Nothing is missing: the model leaves 0.07 N"),
        ("effect", ("stribeck",), "Missing: stribeck – friction falls with speed"),
        ("effect", ("stribeck",), "It explains all of what was missing on the held-out logs"),
        ("effect", ("stribeck", "spring"), "They explain all of what was missing"),
        ("drift", (), "Drift: between training and test logs the machine changed in F_cp from 12 "),
        ("unknown", (), "what is left depends on y (which accounts for 40 % of it)"),
        ("unknown", ("stribeck",), "Found in part: stribeck – friction falls"),
        ("inseparable", ("stribeck",), "It is not distinguishable from spring."),
    ],
)
def test_the_verdict_is_a_plain_sentence(
    verdict: TraceVerdict, keys: tuple[str, ...], said: str
) -> None:
    text = trace_sentence(traced(trace_of(verdict, keys)))
    assert said in text
    errors = "Held-out force error 1.83 N -> 0.07 N (sensors' noise 0.069 N)."
    assert (errors in text) == bool(keys)


def test_two_masses_are_the_answer_where_no_effect_is() -> None:
    size = Size(25.0, 0.01)
    resonance = Resonance(*[size] * 9)
    found = replace(trace_of("unknown", ()), surroundings=Surroundings(resonance=resonance))
    found = replace(found, next_experiment="")
    text = trace_sentence(traced(found))
    assert text.startswith("No effect of the library: two masses with a spring between them swing")
    assert "25 Hz" in text and "depends on" not in text
    assert not advice(traced(found))


def test_an_effect_that_is_not_all_is_reported_with_its_share_and_the_rest() -> None:
    found = replace(trace_of("effect"), complete=False, left=Left(0.0012, ("v",)))
    text = trace_sentence(traced(found))
    assert text.startswith("Missing: stribeck")
    assert "It explains 99.9 % of what was missing on the held-out logs" in text
    assert "the rest depends on v." in text
    alone = replace(found, left=Left(0.3, ()))
    said = trace_sentence(traced(alone, tested=False))
    assert "It explains 70 % of what was missing on the stretches left out" in said
    assert "the rest shows no dependence on a signal" in said


def test_beside_a_change_of_the_machine_the_rest_is_no_riddle() -> None:
    changed = (Change("F_cp", "N", 12.0, 13.2, 0.01),)
    found = replace(trace_of("effect"), complete=False, left=Left(0.6, ()), drift=changed)
    said = trace_sentence(traced(found))
    assert "40 % of what was missing on the held-out logs; the machine has changed beside." in said
    assert "no dependence" not in said


@pytest.mark.parametrize(
    ("like", "said"),
    [((), "the actuator is not linear."), (("leakage",), "which acts like leakage.")],
)
def test_what_lies_in_the_actuator_is_reported_beside_the_verdict(
    like: tuple[str, ...], said: str
) -> None:
    found = replace(trace_of("none"), actuator_like=like)
    assert said in trace_sentence(traced(found))
    assert "actuator" not in trace_sentence(traced(trace_of("none")))


def test_signals_that_no_log_has_are_said_in_words() -> None:
    found = replace(trace_of("unknown", ()), unknown=Dependence(("du", "u"), 0.4))
    text = trace_sentence(traced(found))
    assert "depends on the command's rate (du), u (which" in text


def test_what_is_left_without_structure_is_not_called_noise() -> None:
    text = trace_sentence(traced(replace(trace_of("none", ()), noise_force=0.01)))
    assert text.startswith("No effect is missing that these logs show: what is left (0.07 N")


def test_nothing_is_not_said_of_a_force_that_could_not_have_been_seen() -> None:
    bound: Any = SimpleNamespace(share=lambda level: 0.35, is_a_bound=True)
    hidden: Any = SimpleNamespace(before=bound, after=bound, lessened=False)
    text = trace_sentence(traced(replace(trace_of("none", ()), missing_force=hidden)))
    assert text.startswith("Open: a force of 35 % of friction would not show in these logs")


def test_a_force_that_might_be_larger_than_friction_is_no_share_of_it() -> None:
    bound: Any = SimpleNamespace(share=lambda level: 74.0, is_a_bound=True)
    hidden: Any = SimpleNamespace(before=bound, after=bound, lessened=False)
    text = trace_sentence(traced(replace(trace_of("unknown", ()), missing_force=hidden)))
    assert text.endswith("Force missing: an unknown share of friction.")
    blind = traced(replace(trace_of("unknown", ()), missing_force=hidden))
    unknown = {name: Estimate(None, "N", reason="x", assumed=1.0) for name in ("F_cp", "F_cn")}
    model = replace(blind.model, friction={**blind.model.friction, **unknown})
    assert "Force missing" not in trace_sentence(replace(blind, model=model))


def test_what_is_left_and_depends_on_no_signal_is_said_so() -> None:
    found = replace(trace_of("unknown", ()), unknown=Dependence((), 0.0))
    text = trace_sentence(traced(replace(found, noise_force=0.01)))
    assert text.startswith("Unknown: the model leaves 0.07 N of force")
    assert "shows no dependence on a signal" in text
    text = trace_sentence(traced(found))  # no more force than the sensors' noise: it is in the run
    assert text.startswith("Unknown: the free run has an error of") and "10 µm in 2 s" in text


def test_an_actuator_that_was_inconclusive_is_not_called_complete() -> None:
    text = trace_sentence(traced(replace(trace_of("none", ()), noise_actuator=None)))
    assert text.startswith("Nothing is missing in the equation of motion: the model leaves 0.07 N")


def test_the_error_in_which_an_effect_shows_is_reported() -> None:
    found = trace_of("effect", ("valve_dead_zone",), actuator=True)
    before = {"train": Errors(0.07, 0.002, 1e-5, 90.0), "test": Errors(0.07, 0.002, 1e-5, 90.0)}
    shown = replace(found, before=before)
    assert "Held-out error of the actuator equation 90 N/s -> 5 N/s" in trace_sentence(
        traced(shown)
    )
    assert "On stretches left out, error of" in trace_sentence(traced(shown, tested=False))
    assert "Force missing: 0.34 % of friction before, " in trace_sentence(traced(shown))
    none = {where: Errors(None, None, None, None) for where in before}
    unseen = replace(found, before=none, missing_force=None)
    assert trace_sentence(traced(unseen)).endswith("(probability 97 %).")


def test_rows_of_the_tables() -> None:
    found = trace_of("drift")
    assert errors_table(found, Display()).whole[0][1:] == ("1.83", "0.07", "1.83", "0.07", "0.069")
    assert [row[0] for row in rivals_table(found, Display()).whole] == [
        "spring",
        "nonlinear viscous",
        "cogging",
    ]
    early = traced(replace(found, not_tried=("effects",)))
    said = "the values are for now, as the trace ended early:"
    assert said in trace_parts(early) and said not in trace_parts(traced(found))
    changed = {row[0]: row[-1] for row in changes_table(found).whole}
    assert changed["F_cp"] == "-8.3 %" and changed["m"] == "0 %"
    assert len(changes_table(found).head) == len(changes_table(found).whole[0])
    plain = trace_of("none", ())
    assert len(changes_table(plain).head) == len(changes_table(plain).whole[0]) == 4
    assert differences_table(found).whole == (("F_cp", "12", "14.4 ± 0.2", "N", "+20 %"),)


def test_changes_by_another_fit_than_the_reported_one_say_so() -> None:
    """Of a regression on both logs, whose training value is not that of the table of parameters."""
    reported = trace_of("drift", ())
    assert differences_table(reported).head[0] == "parameter"
    found = replace(reported, drift=(Change("F_cp", "N", 11.0, 14.3, 0.1),))
    table = differences_table(found)
    assert table.head[0] == "parameter, by regression"
    assert table.whole == (("F_cp", "11", "14.3 ± 0.2", "N", "+30 %"),)
    said = trace_sentence(traced(found))
    assert "the machine changed in F_cp by +30 %;" in said and "11" not in said


def test_parameters_that_are_held_or_at_a_bound_say_so() -> None:
    found = trace_of()
    effect = found.effects[0]
    v_s = next(p for p in effect.effect.params if p.name == "v_s")
    params = {
        **effect.params,
        "v_s": of_effect(v_s, v_s.high, 1.0),
    }
    sized = replace(found, effects=(replace(effect, params=params),))
    rows = effects_table(sized, Rig("force")).whole
    assert [row[1] for row in rows[1:3]] == ["-", "0"]
    assert rows[1][3].startswith("at its bound 100: ")
    assert rows[2][3] == FIXED_AT_DEFAULT


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [(2.0, 3.0, "+50 %"), (100.0, 99.0, "-1 %"), (1e-9, 1.0, "over +1000 %"), (0.0, 1.0, ""),
     (1.0, -1e6, "below -1000 %"), (-2.0, -2.0, "0 %")],
)  # fmt: skip
def test_changes_in_percent(before: float, after: float, said: str) -> None:
    assert percent(before, after) == said


def test_the_view_for_a_terminal() -> None:
    screen = view(traced(trace_of("unknown"))).screen(Path("out"))
    first, whole = (" ".join(screen.text(verbose=one).split()) for one in (False, True))
    for part in ("Found in part: stribeck", "What is left depends on y", "held out before",
                 "stribeck", "F_s 3.50 N", "next: record more, the same stroke at several",
                 "note: a remark of the trace", "written: out/trace.json"):  # fmt: skip
        assert part in first and part in whole, part
    for part in ("stribeck F_s", "why not", "F_s*(1 + asymmetry*d)*exp(-(Abs(v)/v_s)**delta)"):
        assert part not in first and part in whole, part


@pytest.mark.parametrize(
    ("verdict", "keys", "figures"),
    [("effect", ("stribeck",), 4), ("effect", ("stribeck", "spring"), 5), ("none", (), 4),
     ("drift", (), 4), ("unknown", ("stribeck",), 5), ("inseparable", ("stribeck",), 4)],
)  # fmt: skip
def test_the_report(verdict: TraceVerdict, keys: tuple[str, ...], figures: int) -> None:
    found = traced(trace_of(verdict, keys))
    html = checked(view(found).page(), figures)
    assert re.sub("[<>'&]", "", trace_sentence(found))[:20] in html
    wanted = ["residual [N]", "with its 95 % band", "moving towards +", "Parameters"]
    if keys:
        wanted += ["Rivals, by the force", "Armstrong-Helouvry", "fitted: stribeck"]
    if len(keys) > 1:
        wanted += ["without spring", "without stribeck"]
    if verdict == "drift":
        wanted += ["14.4 ± 0.2", "on the test logs"]
    if verdict == "unknown":
        wanted += ["record more, the same stroke", "position [mm]"]
    for text in wanted:
        assert text in html, text


def test_an_effect_without_a_picture_is_named() -> None:
    html = checked(view(traced(trace_of("effect", ("rising_stiction",)))).page(), 3)
    assert "rising stiction shows in neither equation" in html
    assert pictures(replace(trace_of(), residuals=(), missing_force=None)) == []


def test_the_free_run_is_drawn_before_and_after() -> None:
    found = trace_of("effect", ("rising_stiction",))
    t, one = np.linspace(0.0, 40.0, 400), np.ones(400)
    run = Residual("position", t, np.floor(t / 20.1), 9e-5 * one, 1e-5 * one, 1e-5 * one, {})
    html = checked(view(traced(replace(found, run=run))).page(), 4)
    assert "rising stiction shows in neither" in html and "residual [mm]" in html
    assert "0 % (before), 100 % (after)" in html and "in windows of 2 s" in html
    assert "residual [rad]" in view(traced(replace(found, run=run), rotary=True)).page()


def test_a_law_is_drawn_beside_what_the_logs_say_without_it() -> None:
    at = np.linspace(0.01, 0.3, 12)
    curve = FreeCurve("stribeck", "mechanical", "v", at, np.exp(-at), 0.01 + 0 * at, np.exp(-at))
    found = replace(trace_of("effect", ("stribeck",)), curves=(curve,))
    html = checked(view(traced(found)).page(), 5)
    for text in ("Law and logs", "stribeck [N]", "by the logs alone", "velocity [mm/s]"):
        assert text in html
    found = replace(found, curves=(replace(curve, signal="y", period=0.3),))
    assert "position within a period [mm]" in view(traced(found)).page()


def test_an_effect_is_shown_in_its_equation_against_its_signal() -> None:
    (shown,) = pictures(trace_of("effect", ("valve_dead_zone",), actuator=True))
    assert (shown.residual.equation, shown.signal, shown.how) == ("actuator", "u", "before")
    first, second = pictures(trace_of("effect", ("stribeck", "spring")))
    assert (first.signal, second.signal) == ("v", "y")
    rest = pictures(trace_of("unknown", ("stribeck",)))[1]
    assert (rest.signal, rest.effect) == ("y", None)


def test_what_an_effect_takes_away_is_its_own_share_of_the_residual() -> None:
    found = trace_of("effect", ("stribeck", "spring"))
    rows = residual("mechanical", ("stribeck", "spring"))
    taken = [effect_at_rows(acting, rows, found.plant.friction) for acting in found.plant.effects]
    assert taken[0] is not None and taken[1] is not None
    np.testing.assert_allclose(taken[0] + taken[1], rows.before - rows.after, atol=1e-12)
    stateful = trace_of("effect", ("rising_stiction",)).plant
    assert effect_at_rows(stateful.effects[0], rows, stateful.friction) is None


def test_the_running_median_is_not_drawn_across_a_gap() -> None:
    x = np.concatenate([np.linspace(0.0, 1.0, 300), np.linspace(9.0, 10.0, 300)])
    at, values = running_median(x, np.ones(600), 30)
    assert np.count_nonzero(np.isnan(values)) == 1 and np.all(np.diff(at) > 0)
    assert 1.0 < at[np.isnan(values)][0] < 9.0
    assert set(values[~np.isnan(values)]) == {1.0}


def test_shares_starts_and_labels() -> None:
    assert share_inside(np.array([0.0, 1.9, -2.1, 5.0]), np.ones(4)) == 50.0
    assert log_starts(residual("mechanical", ()))[0] == 0.1
    assert axis_of("temperature", Display()) == ("temperature", 1.0)
    assert axis_of("v", Display("rotary")) == ("velocity [rad/s]", 1.0)
    assert axis_of("v", Display()) == ("velocity [mm/s]", 1e3)
    assert axis_of("p_n", Display()) == ("pressure p_n [bar]", 1e-5)
    assert axis_of("du", Display("linear", "A")) == ("rate of the command [A/s]", 1.0)


def test_friction_of_speed_joins_the_curve() -> None:
    plant = trace_of().plant
    v = np.array([-0.2, -0.01, 0.01, 0.2])
    p = plant.friction
    more = sliding_friction(v, p, list(plant.effects)) - sliding_friction(v, p, [])
    np.testing.assert_allclose(more, 3.5 * np.sign(v) * np.exp(-((v / 0.05) ** 2)), atol=1e-12)
