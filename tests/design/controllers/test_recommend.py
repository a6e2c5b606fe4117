"""Which controller is recommended, and that the reason has the numbers it rests on."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from design.closed_loop.linear_loop import force_period, periods
from design.closed_loop.loop_figures import PRESENT, LoopFigures
from design.closed_loop.loop_motion import LimitCycle
from design.controllers import recommend
from design.controllers.design import with_choice
from design.controllers.recommend import recommended
from design.controllers.validate import validate
from design.machine.controller import CardController, present
from design.machine.design import Design, Recommendation
from design.machine.model import Model
from design.machine.readable import Display
from design.tune import Asked
from identification.model.estimates import Estimate
from identification.model.plant import Actuator
from tests.chain import EMPS, TABLES, designed, model_of
from workbench.report.design_tables import margins_table
from workbench.report.validation import validation_table

ACTUATOR = Actuator(19530.0, 10405.0)


def now(model: Model, k_d: float, period: float | None = None) -> Model:
    """The model of a machine that has a PD."""
    gains = {"k_d": Estimate(k_d, "V/m"), "T_d": Estimate(0.03, "s"), "eps": Estimate(0.01, "s")}
    given = CardController("PD", gains, {}, period, "command", None, None, None)
    return replace(model, controller=present(given, model.rig, model.period))


@cache
def motor() -> tuple[Model, Design]:
    model = model_of(EMPS, k_a=35.15)
    model = replace(model, rig=replace(model.rig, control_limit=10.0, force_per_command=35.15))
    model = now(model, 150.0)
    return model, designed(model, period=5e-3)


def choose(monkeypatch: pytest.MonkeyPatch, **changes: LoopFigures) -> tuple[str, bool, str]:
    """The recommendation where the loops come to these figures."""
    model, found = motor()
    figures = recommend.compared(model, found)
    calm = {name: replace(one, limit_cycle=None, missed=()) for name, one in figures.items()}
    same = {name: replace(calm["rst"], margins=one.margins) for name, one in calm.items()}
    monkeypatch.setattr(recommend, "compared", lambda *_: {**same, **changes})
    chosen = recommended(model, found)
    return chosen.controller, chosen.compensator, chosen.why


@cache
def plain() -> LoopFigures:
    model, found = motor()
    return replace(recommend.compared(model, found)["rst"], limit_cycle=None, missed=())


@pytest.mark.slow
def test_the_better_loop_is_taken_and_said_with_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    one = plain()
    better = replace(
        one, settling=0.5 * one.settling, force_peak=0.5 * one.force_peak, standstill_relative=0.002
    )
    worse = replace(one, standstill_relative=0.011)
    name, compensator, why = choose(monkeypatch, pid=better, rst=worse, present=worse)
    assert (name, compensator) == ("pid", False)
    assert why.startswith("PID: static error 0.2 % of the step")
    assert "RST: 1.1 %" in why and "the present controller: 1.1 %" in why
    assert f"of {one.force_limit:.3g} N" in why and " % larger with the " in why


def test_of_equal_loops_the_larger_margin_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    one = plain()
    assert one.margins is not None
    safer = replace(one, margins=replace(one.margins, modulus=0.9))
    for name in ("rst", "pid"):
        with monkeypatch.context() as patch:
            found, _, why = choose(patch, **{name: safer})
        assert found == name and "the smaller margin" in why


def test_a_loop_that_does_not_come_to_rest_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    faster = replace(plain(), settling=1e-2, limit_cycle=LimitCycle(1e-4, 0.3))
    with monkeypatch.context() as patch:
        name, _, why = choose(patch, pid=faster)
    assert name == "rst"
    assert "limit cycle of 0.1 mm every 0.3 s" in why and "does not come to rest" in why
    failing = replace(plain(), settling=1e-2, missed=("overshoot",))
    name, _, why = choose(monkeypatch, pid=failing)
    assert name == "rst" and "misses a limit, overshoot" in why


def test_the_best_of_loops_that_all_miss_a_limit_is_said_to(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    failing = replace(plain(), missed=("overshoot 30 %", "force"))
    why = choose(monkeypatch, rst=failing, pid=failing)[2]
    assert "; it misses a limit, overshoot 30 %; " in why and "force;" not in why


def test_the_compensator_only_where_it_is_clearly_better(monkeypatch: pytest.MonkeyPatch) -> None:
    half = replace(plain(), settling=0.5 * plain().settling)
    for one, taken in ((half, True), (replace(half, limit_cycle=LimitCycle(1e-4, 0.3)), False)):
        both = {"rst + compensator": one, "pid + compensator": one}
        with monkeypatch.context() as patch:
            _, compensator, why = choose(patch, **both)
        assert compensator is taken
        assert why.startswith(("RST with the compensator", "PID with the compensator")) is taken


def test_a_present_controller_that_is_as_good_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    assert choose(monkeypatch)[2].endswith("the present controller is as good, keep it")


def test_the_present_controller_is_the_first_row_on_every_plant() -> None:
    model, found = motor()
    result, traces = validate(model, found, np.random.default_rng(0), plant=model)
    assert next(iter(result.figures)) == PRESENT
    assert set(result.figures[PRESENT]) == {"model", "plant"} and (PRESENT, "plant") in traces
    table = validation_table(result, Display())
    row = dict(zip(table.head, table.whole[0], strict=True))
    assert row["loop"] == "present" and row["ok"] == "no"
    # A PD against Coulomb friction stays off by up to F_c/(k_a k_d).
    off = result.figures[PRESENT]["model"].standstill
    assert 0.0 < off < 1.2 * 25.0 / (35.15 * 150.0)
    assert (
        any("present controller on the model" in line for line in result.remarks)
        or row["limit cycle"]
    )
    assert result.why.startswith(found.recommended.upper())


def test_a_design_that_recommends_nothing_is_reported_as_such() -> None:
    model, found = motor()
    none = with_choice(model, found, Recommendation("none", False, "staircase of 3 mm"))
    validated, _ = validate(model, none, np.random.default_rng(0))
    assert validated.remarks[0] == (
        "the design recommends no controller (staircase of 3 mm); its RST is shown"
    )


def test_a_present_controller_that_cannot_be_simulated_is_reported() -> None:
    model, found = motor()
    unknown = replace(model, actuator=None, rig=replace(model.rig, kind="force"))
    result, _ = validate(unknown, found, np.random.default_rng(0))
    assert PRESENT not in result.figures
    assert any("the present controller is not shown on the model: it gives" in line
               for line in result.remarks)  # fmt: skip
    away = now(replace(model, rig=replace(model.rig, control_limit=None)), 1e6)
    result, _ = validate(away, found, np.random.default_rng(0))
    shown = result.figures.get(PRESENT)
    assert shown is None or not shown["model"].passed


def test_its_margins_are_those_of_its_own_period() -> None:
    model, found = motor()
    figures, _ = validate(model, found, np.random.default_rng(0))
    margin = figures.figures[PRESENT]["model"].margins
    assert margin is not None and margin.delay_s is not None and margin.delay_samples is not None
    assert margin.delay_s / margin.delay_samples == pytest.approx(model.period)


def test_a_command_at_its_limit_is_reported_with_force_and_time() -> None:
    model, found = motor()
    tight = replace(model, rig=replace(model.rig, control_limit=3.0))
    result, _ = validate(tight, found, np.random.default_rng(0))
    one = result.figures[found.recommended]["model"]
    assert one.limited > 0.0 and one.force_limit == pytest.approx(3.0 * 35.15)
    assert any("its limit of 3 V, 105 N, for" in said for said in one.missed)
    assert one.force_peak <= 3.0 * 35.15


def test_periods_come_from_the_card_and_the_log() -> None:
    model = model_of(EMPS, k_a=35.15)
    assert model.period == 1e-3
    assert periods(model) == (1e-3, 2e-3, 5e-3, 10e-3, 20e-3)
    fast = replace(model, log=(replace(model.log[0], h=1e-3, period=5.0002e-4),))
    assert periods(fast)[0] == 5e-4
    assert periods(now(model, 100.0, period=2.5e-4))[0] == 2.5e-4
    slow = replace(model, log=(replace(model.log[0], h=0.05),))
    assert periods(slow) == (0.05,)
    cylinder = model_of(TABLES["paper_table2"], ACTUATOR)
    assert periods(cylinder)[0] == pytest.approx(5e-3)  # five samples of the force loop
    assert force_period(cylinder) == 1e-3


@pytest.mark.slow
def test_a_design_says_why_it_is_not_at_the_drive_s_period() -> None:
    model = model_of(EMPS, k_a=35.15)
    noisy = replace(model, fit=replace(model.fit, noise_y=3e-4))
    found = designed(noisy)
    assert found.plant.h > 1e-3
    assert any(line.startswith("not every 1 ms: ") for line in found.remarks)


@pytest.mark.slow
def test_a_loop_is_no_faster_than_its_reference_may_be_moved() -> None:
    model = model_of(EMPS, k_a=35.15)
    precise = replace(model, fit=replace(model.fit, noise_y=1e-8))
    hasty = designed(precise, period=1e-3)
    seen = replace(precise, log=(replace(model.log[0], speed=0.15),))
    calm = designed(seen, period=1e-3)
    for name in ("rst", "pid"):
        fast, slow = hasty.controllers[name], calm.controllers[name]
        assert fast.rate is not None and fast.rate < 0.15
        assert slow.rate is not None and slow.rate >= 0.15
        assert slow.dominant[0] < fast.dominant[0] and not slow.missed
    result, traces = validate(seen, calm, np.random.default_rng(0))
    assert result.passed
    smooth = traces["rst", "model"].smooth
    assert np.max(np.abs(np.diff(smooth.r))) / 1e-3 < 1.05 * 0.15


def test_a_motor_s_design_says_where_a_cascade_would_track_better_and_how() -> None:
    plain = model_of(EMPS, k_a=35.15)
    found = designed(plain)
    (said,) = [line for line in found.remarks if line.startswith("a P-PI")]
    assert "would track better: static error" in said and "--structure p-pi" in said
    alone = designed(plain, structures=("p-pi",))
    assert alone.recommendation is not None
    for figure in ("static error", "tracking error", "settling time"):
        part = said.split(figure)[1].split(",")[0]
        assert f"{figure}{part}" in alone.recommendation.why
    assert not any(line.startswith("a P-PI") for line in alone.remarks)
    by_hand = designed(plain, Asked((8.0, 0.9)), period=5e-3)
    assert not any(line.startswith("a P-PI") for line in by_hand.remarks)


def test_structures_that_were_not_asked_for_are_no_reason() -> None:
    alone = designed(model_of(EMPS, k_a=35.15), structures=("p-pi",))
    assert alone.recommendation is not None and "there is no" not in alone.recommendation.why
    row = margins_table(alone).whole[0]
    assert alone.p_pi is not None and alone.p_pi.cascade is not None
    assert row[1:3] == (f"Kv {alone.p_pi.cascade.k_v:.3g}", "-")


def test_a_compensator_with_which_a_loop_rests_further_off_is_not_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    one = plain()
    faster = replace(one, settling=0.2 * one.settling, standstill=1.1 * one.standstill)
    both = {"rst + compensator": faster, "pid + compensator": faster}
    assert choose(monkeypatch, **both)[1] is False
