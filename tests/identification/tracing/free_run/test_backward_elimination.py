"""Effects that are not needed: left out where the band is unknown, or the run does without."""

from dataclasses import replace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.row_fit import first_stage
from identification.estimation.structure_fit import fitted_structure
from identification.estimation.windowed_run.refinement import Refit
from identification.log import Rig
from identification.model.plant import Plant
from identification.thresholds import ADEQUATE, ASTRAY, COMPLETE
from identification.tracing.free_run.backward_elimination import (
    Setting,
    enough,
    equations_explained,
    fewest,
    first_alone,
    first_steps,
    followed_up_to,
    keeping,
    known,
    levelled,
    pruned,
    suffices,
    vain,
    without,
    without_growth,
    without_slow,
)
from identification.tracing.regression.stepwise import Choice, Step, choose
from tests.identification.motor_logs import K_A, NINE, made, plant, seen

MOTOR = Rig("motor", force_per_command=K_A)
SPRING = {"spring": {"k": 40.0}}
SPRING_ALONE = frozenset({"spring"})


@pytest.fixture(scope="module")
def found() -> tuple[Setting, Choice]:
    """A motor with a spring, and what its equations call for."""
    one = seen(made(4, SPRING))
    rng = np.random.default_rng(0)
    start, first = first_stage([one], False)
    plain = fitted_structure(start, first, (), RecordedLogs((one,), MOTOR, "command"), rng)
    library = {key: built_in()[key] for key in ("spring", "stribeck")}
    setting = Setting([one], [one], "command", MOTOR, library, start, first, plain, rng)
    return setting, choose(start, first, library, rng, lambda _stage, _share: None)


@pytest.mark.slow
def test_a_choice_goes_on_from_its_first_effect(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    more = setting.start, setting.first, setting.library
    rng = np.random.default_rng(0)
    begun = choose(*more, rng, lambda _stage, _share: None, most=1)
    on = choose(*more, rng, lambda _stage, _share: None, begun)
    keys = [[s.candidate.effect.key for s in one.steps] for one in (begun, on, choice)]
    assert keys[0] == keys[2][:1] and keys[1] == keys[2]


@pytest.mark.slow
def test_one_effect_is_enough_where_its_run_leaves_noise(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    part = first_steps(choice, 1)
    alone = first_alone(part, setting)
    assert alone is not None and suffices(alone, part, setting)
    assert fewest(part, setting, False)[1].plant is alone.plant  # made once
    assert not suffices(replace(alone, misfit=1.01 * ASTRAY), part, setting)
    missing = replace(part, base=setting.first)  # the spring is not explained
    assert not equations_explained(missing.base) and first_alone(missing, setting) is None
    assert not suffices(None, part, setting)


def test_a_trifle_that_does_not_help_the_run_is_not_taken(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    part = first_steps(choice, 1)
    assert vain(setting) == np.inf  # its equations call for the spring
    slides = replace(setting, first=choice.base)  # as if they hardly did
    alone = first_alone(part, setting)
    assert alone is not None
    poor = replace(alone, misfit=1.1 * vain(slides))
    none, model = fewest(part, replace(slides, made={SPRING_ALONE: poor}), False)
    assert not none.steps and model is setting.plain
    assert [one.effect.key for one in none.tried][-1] == "spring"
    assert fewest(part, replace(setting, made={SPRING_ALONE: poor}), False)[0].steps
    helps = replace(alone, misfit=0.9 * vain(slides))
    kept, model = fewest(part, replace(slides, made={SPRING_ALONE: helps}), False)
    assert kept.steps and model.misfit == helps.misfit


def test_what_is_chosen_up_to_an_effect_of_slow_motion_stays(
    found: tuple[Setting, Choice],
) -> None:
    _, choice = found
    first = choice.steps[0]
    assert first.candidate.effect.key == "spring"
    kept = without_slow(choice)
    assert [step.candidate.effect.key for step in kept.steps] == ["spring"]
    other = replace(first, candidate=replace(first.candidate, effect=built_in()["stribeck"]))
    assert not without_slow(replace(choice, steps=(other, first))).steps


@pytest.mark.method
def test_an_effect_that_is_needed_stays(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    kept = without_slow(choice)
    model = fitted_structure(
        kept.end, kept.base, kept.effects, setting.recorded, np.random.default_rng(1)
    )
    assert model.misfit <= COMPLETE
    after, same = pruned(kept, model, setting)
    assert after.steps == kept.steps and same is model


def test_a_plant_keeps_the_effects_of_its_steps(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    both = plant({**SPRING, "backlash": {"width": 1e-4}})
    assert [a.key for a in keeping(both, choice.steps[:1]).effects] == ["spring"]
    assert keeping(both, choice.steps[:1]).friction == NINE
    assert not keeping(both, ()).effects
    assert without(setting.plain, (), setting).friction == setting.plain.plant.friction


def test_levels_taken_by_an_effect_are_given_back() -> None:
    friction = NINE
    less = replace(friction, F_cp=friction.F_cp - 3.0, F_sp=friction.F_sp - 3.0)
    theta = np.array([NINE.m, NINE.F_cp, NINE.F_cn, NINE.F_vp, NINE.F_vn])
    assert levelled(less, theta).array == pytest.approx(NINE.array)


def test_growth_is_left_to_the_run(found: tuple[Setting, Choice]) -> None:
    _, choice = found
    first = choice.steps[0]
    of = {
        k: replace(first.candidate, effect=built_in()[k]) for k in ("rising_stiction", "stribeck")
    }
    grows, slow = (replace(first, candidate=one) for one in of.values())
    kept = without_growth(replace(choice, steps=(grows, slow, first)))
    assert kept.steps == (slow, first)  # the spring is missing from sliding: so may the other be
    assert kept.tried == (*choice.tried, of["rising_stiction"])
    slides = replace(choice, steps=(grows, slow, first), first=choice.base)
    assert without_growth(slides).steps == (first,)
    assert without_growth(choice) is choice


def test_what_sliding_calls_for_is_not_searched_without(
    found: tuple[Setting, Choice], monkeypatch: pytest.MonkeyPatch
) -> None:
    setting, choice = found
    kept = without_slow(choice)
    model = replace(setting.plain, plant=plant(SPRING), misfit=1.0)
    searched: list[object] = []

    def refined(tried: Plant, _setting: Setting) -> Refit:
        searched.append(tried)
        return Refit(tried, 5.0, (), {}, lambda: np.zeros((0, 0)))

    monkeypatch.setattr(
        "identification.tracing.free_run.backward_elimination.refined_near", refined
    )
    assert pruned(kept, model, setting)[0] is kept and not searched
    assert pruned(replace(kept, base=choice.first), model, setting)[0].steps == kept.steps
    assert len(searched) == len(kept.steps)


def test_what_does_nothing_goes_though_sliding_calls_for_it(
    found: tuple[Setting, Choice], monkeypatch: pytest.MonkeyPatch
) -> None:
    setting, choice = found
    kept = without_slow(choice)
    model = replace(setting.plain, plant=plant(SPRING), misfit=1.0)
    near: list[Plant] = []

    def refined(tried: Plant, *_: object, **__: object) -> Refit:
        near.append(tried)
        return Refit(tried, 1.0, (), {}, lambda: np.zeros((0, 0)))

    monkeypatch.setattr("identification.tracing.free_run.backward_elimination.refit", refined)
    for bare, count in ((1.01, 1), (1.0, 0)):  # what the run leaves without the spring
        monkeypatch.setattr(
            "identification.tracing.free_run.backward_elimination.misfit",
            lambda *_, bare=bare: bare,
        )
        assert len(pruned(kept, model, setting)[0].steps) == count
    assert [one.effects for one in near] == [()]


@pytest.mark.parametrize(("bare", "count"), [(1.00005, 0), (1.001, 1)])
def test_a_single_effect_of_no_size_goes_where_a_command_holds_the_run(
    found: tuple[Setting, Choice], monkeypatch: pytest.MonkeyPatch, bare: float, count: int
) -> None:
    setting, choice = found
    kept = without_slow(choice)
    model = replace(setting.plain, plant=plant(SPRING), misfit=1.0)
    place = "identification.tracing.free_run.backward_elimination"
    monkeypatch.setattr(f"{place}.loose", lambda *_: False)
    monkeypatch.setattr(f"{place}.misfit", lambda *_: bare)
    less, left = pruned(kept, model, setting)
    assert len(less.steps) == count
    assert left is (model if count else setting.plain)


def test_the_fewest_effects_with_which_the_run_is_followed(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    beside = next(one for one in choice.tried if one.effect.key == "stribeck")
    more = Step(beside, 0.01, (), choice.end, choice.base)
    both = replace(choice, steps=(*choice.steps, more))
    kept, model = fewest(both, setting, True)
    assert [step.candidate.effect.key for step in kept.steps] == ["spring"]
    assert model.misfit <= COMPLETE
    assert first_steps(both, 2) is both and len(first_steps(both, 1).steps) == 1


@pytest.mark.parametrize(("less", "count"), [(5.0, 1), (4.0, 2)])
def test_one_effect_more_has_to_earn_its_place_in_the_run(
    found: tuple[Setting, Choice], monkeypatch: pytest.MonkeyPatch, less: float, count: int
) -> None:
    setting, choice = found
    beside = next(one for one in choice.tried if one.effect.key == "stribeck")
    both = replace(choice, steps=(*choice.steps, Step(beside, 0.01, (), choice.end, choice.base)))
    plain = replace(setting.plain, misfit=90.0)
    misfits = {1: 5.4, 2: less}
    monkeypatch.setattr(
        "identification.tracing.free_run.backward_elimination.fitted",
        lambda part, _setting: replace(plain, misfit=misfits[len(part.steps)]),
    )
    monkeypatch.setattr(
        "identification.tracing.free_run.backward_elimination.followed_up_to", lambda *_: COMPLETE
    )
    kept, model = fewest(both, replace(setting, plain=plain), unsure=False)
    assert (len(kept.steps), model.misfit) == (count, misfits[count])


def test_what_a_choice_has_to_reach(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    far = replace(setting, plain=replace(setting.plain, misfit=41.0))
    assert followed_up_to(choice, far, True) == pytest.approx(5.0)  # a tenth of what was left
    assert followed_up_to(choice, far, False) == COMPLETE
    assert followed_up_to(choice, replace(far, drive="force"), False) > COMPLETE
    assert equations_explained(choice.base) and not equations_explained(setting.first)


def test_what_stops_lack_is_searched_in_the_run_where_sliding_is_explained(
    found: tuple[Setting, Choice],
) -> None:
    setting, choice = found
    far = replace(setting, plain=replace(setting.plain, misfit=41.0))
    assert not known(far)  # its spring is missing from the equations
    assert known(replace(far, first=choice.base))
    assert known(replace(setting, plain=replace(setting.plain, misfit=4.0)))


@pytest.mark.slow
def test_what_was_doubted_is_not_tried_again(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    stribeck = next(one for one in choice.tried if one.effect.key == "stribeck")
    both = replace(
        choice, steps=(choice.steps[0], Step(stribeck, 0.01, (), choice.end, choice.base))
    )
    hardly = {"stribeck": {"F_s": 1e-3, "v_s": 0.02}}
    model = replace(setting.plain, plant=plant({**SPRING, **hardly}), misfit=1.0)
    kept, same = pruned(both, model, replace(setting, doubted=both.steps))
    assert kept is both and same is model
    less, _ = pruned(both, model, setting)
    assert less.steps == both.steps[:1]


def test_without_effects_a_measured_force_is_contested_sooner(
    found: tuple[Setting, Choice],
) -> None:
    setting, choice = found
    forced = replace(setting, drive="force", plain=replace(setting.plain, misfit=2.0))
    assert enough(forced, ()) == ADEQUATE < ASTRAY == enough(forced, choice.steps)
    astray = replace(forced, plain=replace(setting.plain, misfit=200.0))
    assert enough(astray, ()) == ADEQUATE < ASTRAY < enough(astray, choice.steps)
