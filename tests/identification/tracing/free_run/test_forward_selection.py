"""The forward run as judge: what the equations do not show is named, and nothing else is."""

from copy import deepcopy
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.motion_log import shortened
from identification.estimation.regression.row_fit import first_stage
from identification.estimation.structure_fit import FittedStructure, fitted_structure
from identification.estimation.windowed_run.parameters import even
from identification.thresholds import COMPLETE
from identification.tracing.free_run import contenders
from identification.tracing.free_run.backward_elimination import Setting, equations_explained
from identification.tracing.free_run.contenders import Entrant, RunContender, less_load
from identification.tracing.free_run.forward_selection import (
    contest,
    corrected_p_value,
    decisive,
    judged_forward,
    most_left,
)
from identification.tracing.regression.candidates import EffectCandidate
from identification.tracing.regression.stepwise import Choice, choose
from identification.tracing.trace import trace
from tests.identification.motor_logs import K_A, NINE, made, plant, seen
from tests.identification.tracing.settings import MOTOR, setting_of


def setting_with_play(seed: int, width: float) -> tuple[Setting, FittedStructure]:
    """What the contest needs of a log with that play in its transducer, of its own to change."""
    setting, plain = fitted_setting(seed, width)
    return replace(setting, rng=deepcopy(setting.rng), made=dict(setting.made)), plain


@cache
def fitted_setting(seed: int, width: float) -> tuple[Setting, FittedStructure]:
    one = seen(made(seed, {"backlash": {"width": width}}))
    start, first = first_stage([one], False)
    rng = np.random.default_rng(0)
    plain = fitted_structure(start, first, (), RecordedLogs((one,), MOTOR, "command"), rng)
    return setting_of([one], plain, built_in(), rng), plain


@pytest.mark.method
def test_play_shows_in_the_run_alone_and_is_named() -> None:
    setting, plain = setting_with_play(4, 4e-4)
    assert plain.misfit > 5.0
    rng = np.random.default_rng(0)
    choice = choose(setting.plain.start, setting.plain.first, {}, rng, lambda _s, _p: None)
    found, model = judged_forward(choice, plain, setting, lambda _s, _p: None)
    (step,) = found.steps
    assert step.candidate.effect.key == "backlash"
    assert step.candidate.values["width"] == pytest.approx(4e-4, rel=0.02)
    assert model.misfit <= COMPLETE
    assert step.p_value < 1e-6 and step.explained is not None and step.explained > 0.97
    assert step.rivals and all(c.gain < step.candidate.gain for c in step.rivals)


@pytest.mark.method
def test_the_contest_is_held_on_a_stretch_of_each_log(monkeypatch: pytest.MonkeyPatch) -> None:
    setting, plain = setting_with_play(4, 4e-4)
    none = choose(setting.plain.start, setting.plain.first, {}, setting.rng, lambda _s, _p: None)
    seen_short: list[list[MotionLog]] = []

    def contest(_choice: Choice, _model: FittedStructure, own: Setting, _report: object) -> None:
        seen_short.append(list(own.short))

    place = "identification.tracing.free_run.forward_selection"
    monkeypatch.setattr(f"{place}.contest", contest)
    monkeypatch.setattr(f"{place}.most_left", lambda _p, one, _d, size: shortened(one, size, 2000))
    kept, model = judged_forward(none, plain, setting, lambda _s, _p: None)
    assert not kept.steps and model is plain and len(seen_short) == 1
    assert seen_short[0][0].log["t"][0] == pytest.approx(4.0)


@pytest.mark.method
def test_an_effect_taken_out_of_the_library_is_not_replaced_by_a_helper() -> None:
    setting, plain = setting_with_play(4, 4e-4)
    library = {k: e for k, e in built_in().items() if k != "backlash"}
    rng = np.random.default_rng(0)
    choice = choose(setting.plain.start, setting.plain.first, {}, rng, lambda _s, _p: None)
    fewer = replace(setting, plain=replace(setting.plain, library=library))
    found, model = judged_forward(choice, plain, fewer, lambda _s, _p: None)
    assert not found.steps and model is plain


@pytest.mark.method
def test_a_late_command_of_a_motor_is_named() -> None:
    effects = {"input_delay": {"tau": 0.006}}
    found = trace(
        [made(6, effects)], [made(7, effects)], MOTOR, built_in(), np.random.default_rng(0)
    )
    assert found.verdict == "effect"
    assert [e.effect.key for e in found.effects] == ["input_delay"]
    delay = found.effects[0].params["tau"]  # of the columns, by the equation of motion
    assert delay.low is not None and delay.high is not None
    assert delay.low < 0.006 < delay.high
    assert delay.value == pytest.approx(0.006, rel=0.15)


@pytest.mark.method
@pytest.mark.slow
def test_a_complete_run_of_a_motor_has_nothing_missing() -> None:
    found = trace([made(8)], [made(9)], MOTOR, built_in(), np.random.default_rng(0))
    assert found.verdict == "none" and not found.effects and not found.unknown.depends_on
    assert found.after["train"].position_rms == pytest.approx(1e-5, rel=0.05)


def test_a_contender_that_has_only_the_better_start_adds_no_effect(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Cogging's run of 6.5 became 1 with a coupling that gave by a thousandth of the noise."""
    setting, plain = setting_with_play(4, 0.0)
    lost = replace(plain, plant=plant(friction=replace(NINE, F_sp=20.0)), misfit=6.5)
    none = choose(setting.plain.start, setting.plain.first, {}, setting.rng, lambda _s, _p: None)
    good = plant({"compliance": {"flexibility": 1e-10}})
    one = RunContender((), built_in()["compliance"], good, 1.0)
    place = "identification.tracing.free_run.forward_selection"
    monkeypatch.setattr(f"{place}.structures", lambda *_: [None])
    monkeypatch.setattr(f"{place}.entrant", lambda *_: Entrant((good,), one))
    monkeypatch.setattr(f"{place}.contender", lambda *_: one)
    found = contest(none, lost, setting, lambda _s, _p: None)
    assert found is not None
    choice, model = found
    assert not choice.steps and not model.plant.effects
    assert model.misfit <= COMPLETE and model.plant.friction.F_sp == pytest.approx(16.0, rel=0.01)


@pytest.mark.parametrize(("searched", "taken"), [(3.0, "a lower limit"), (9.0, "as it began")])
def test_a_contender_whose_search_leads_astray_is_as_it_began(
    searched: float, taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    setting, _ = setting_with_play(4, 0.0)
    plants = {"as it began": plant(), "a lower limit": plant(friction=replace(NINE, F_sp=14.0))}
    done = SimpleNamespace(plant=plants["a lower limit"], misfit=searched)
    monkeypatch.setattr(contenders, "_near", lambda *_: done)
    begun = RunContender((), built_in()["presliding"], plants["as it began"], 5.0)
    found = contenders.contender(Entrant((plant(),), begun), setting)
    assert found.plant is plants[taken] and found.misfit == min(searched, 5.0)


def test_those_that_follow_best_after_a_few_steps_are_searched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A search of each of nine took 43 processor seconds of a trace of 55."""
    setting, plain = setting_with_play(4, 0.0)
    lost = replace(plain, misfit=9.0)
    none = choose(setting.plain.start, setting.plain.first, {}, setting.rng, lambda _s, _p: None)
    library, begun = built_in(), [5.0, 8.0, 2.0, 7.0, 6.0]
    entrants = [
        Entrant((plant(),), RunContender((), effect, plant(), left))
        for effect, left in zip(library.values(), begun, strict=False)
    ]
    waiting, searched = iter(entrants), list[float]()

    def contender(one: Entrant, _: Setting) -> RunContender:
        searched.append(one.begun.misfit)
        return one.begun

    place = "identification.tracing.free_run.forward_selection"
    monkeypatch.setattr(f"{place}.structures", lambda *_: entrants)
    monkeypatch.setattr(f"{place}.entrant", lambda *_: next(waiting))
    monkeypatch.setattr(f"{place}.contender", contender)
    monkeypatch.setattr(f"{place}.on_whole_logs", lambda *_: lost)
    assert contest(none, lost, setting, lambda _s, _p: None) is None
    assert searched == [2.0, 5.0, 6.0]


def test_what_is_decisive() -> None:
    def others(*misfits: float) -> list[RunContender]:
        effect = built_in()["spring"]
        return [RunContender((), effect, plant(), m) for m in misfits]

    assert decisive(100.0, others(90.0)) == pytest.approx(9.9)  # far less than any other
    assert decisive(20.0, others(3.0)) == pytest.approx(1.5)  # another does nearly as well
    assert decisive(1.6, others(1.5)) == pytest.approx(1.3)  # hardly anything was missing


def test_a_p_value_grows_with_what_was_tried() -> None:
    spring = EffectCandidate(built_in()["spring"], {"k": 1.0, "k_3": 0.0}, {}, 12.0)
    assert corrected_p_value(spring, 1) == pytest.approx(np.exp(-6.0))  # chi-square of two, at 12
    assert corrected_p_value(spring, 18) == pytest.approx(18 * corrected_p_value(spring, 1))
    assert corrected_p_value(replace(spring, gain=-3.0), 18) == 1.0


def test_the_stretch_of_which_most_is_left_is_where_the_run_errs() -> None:
    one = seen(made(2))
    y = one.log["y"].copy()
    y[6000:7000] += 1e-3 * np.sin(np.linspace(0.0, 20.0, 1000))
    disturbed = seen(one.log.with_signals(y=y))
    worst = most_left(plant(), disturbed, "command", 4.0)
    t = one.log["t"]
    assert len(worst.log) == 2000
    assert worst.log["t"][0] <= t[6000] and worst.log["t"][-1] >= t[6999]
    assert len(most_left(plant(), disturbed, "command", 60.0).log) == len(one.log)


def test_friction_by_load_takes_its_share_of_the_plain() -> None:
    acting = built_in()["load_dependent_friction"].acting({"mu": 0.2})
    less = less_load(plant(), acting).friction
    assert less.F_cp == pytest.approx(0.8 * plant().friction.F_cp)
    assert less.m == pytest.approx(0.8 * plant().friction.m)
    assert less.dv_p == plant().friction.dv_p


def test_asymmetries_of_zero_are_held() -> None:
    fixed = even(plant({"stribeck": {"F_s": 1.0, "v_s": 0.1}, "spring": {"k": 1.0}}))
    assert fixed == {"stribeck.asymmetry": 0.0, "stribeck.delta": 0.0}
    uneven = {"F_s": 1.0, "v_s": 0.1, "asymmetry": 0.1, "delta": 1.5}
    assert even(plant({"stribeck": uneven})) == {}


def test_no_contest_where_sliding_itself_is_not_explained() -> None:
    t = 2e-3 * np.arange(10_000)
    shaken = made(4)
    push = 6.0 * np.sin(2.0 * np.pi * 3.1 * t)
    one = seen(shaken.with_signals(F=shaken["F"] + push, u=shaken["u"] + push / K_A))
    start, first = first_stage([one], False)
    rng = np.random.default_rng(0)
    library = {k: e for k, e in built_in().items() if k in ("spring", "warmup", "backlash")}
    shown = choose(start, first, library, rng, lambda _s, _p: None)
    assert not equations_explained(shown.base)
    clean, none = first_stage([seen(shaken)], False)
    assert equations_explained(choose(clean, none, {}, rng, lambda _s, _p: None).base)


def test_a_bristle_begins_with_limits_above_sliding_friction() -> None:
    """Those that a rigid body has lost lie below, where a bristle never breaks away."""
    crept = replace(plant(), friction=replace(NINE, F_sp=0.3, F_sn=-20.0))
    p = contenders._that_sticks(crept).friction
    assert p.F_sp == pytest.approx(1.2 * NINE.F_cp) and p.F_sn == -20.0
    assert replace(p, F_sp=0.3) == crept.friction
