"""Effects that are not needed: the run does without them."""

from dataclasses import replace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.row_fit import first_stage
from identification.estimation.structure_fit import fitted_structure
from identification.thresholds import ADEQUATE, ASTRAY, COMPLETE
from identification.tracing.free_run.backward_elimination import (
    Setting,
    enough,
    equations_explained,
    fewest,
    followed_up_to,
    only,
    suffices,
    without,
)
from identification.tracing.regression.stepwise import Choice, Step, choose
from tests.identification.motor_logs import NINE, made, plant, seen
from tests.identification.tracing.settings import MOTOR, setting_of, with_plain

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
    setting = setting_of([one], plain, library, rng)
    return setting, choose(start, first, library, rng, lambda _stage, _share: None)


@pytest.mark.slow
def test_a_choice_goes_on_from_its_first_effect(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    more = setting.plain.start, setting.plain.first, setting.plain.library
    rng = np.random.default_rng(0)
    begun = choose(*more, rng, lambda _stage, _share: None, most=1)
    on = choose(*more, rng, lambda _stage, _share: None, begun)
    keys = [[s.candidate.effect.key for s in one.steps] for one in (begun, on, choice)]
    assert keys[0] == keys[2][:1] and keys[1] == keys[2]


@pytest.mark.slow
def test_one_effect_is_enough_where_its_run_leaves_noise(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    part = only(choice, choice.steps[:1])
    assert suffices(part, setting)
    (alone,) = setting.made.values()
    assert fewest(part, setting)[1].plant is alone.plant  # made once
    astray = {SPRING_ALONE: replace(alone, misfit=1.01 * ASTRAY)}
    assert not suffices(part, replace(setting, made=astray))
    missing = replace(part, base=setting.plain.first)  # the spring is not explained
    assert not equations_explained(missing.base) and not suffices(missing, setting)
    assert not suffices(only(choice, ()), setting)


def test_a_plant_keeps_the_effects_of_its_steps(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    both = plant({**SPRING, "backlash": {"width": 1e-4}})
    model = replace(setting.plain.model, plant=both)
    kept = without(model, choice.steps[:1], setting)
    assert [a.key for a in kept.effects] == ["spring"] and kept.friction == NINE
    none = without(model, (), setting)
    assert not none.effects and none.friction == setting.plain.model.plant.friction


def test_the_fewest_effects_with_which_the_run_is_followed(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    beside = next(one for one in choice.tried if one.effect.key == "stribeck")
    more = Step(beside, 0.01, (), choice.end, choice.base)
    both = replace(choice, steps=(*choice.steps, more))
    kept, model = fewest(both, setting)
    assert [step.candidate.effect.key for step in kept.steps] == ["spring"]
    assert model.misfit <= COMPLETE
    assert only(both, both.steps) is both and len(only(both, both.steps[:1]).steps) == 1


@pytest.mark.parametrize(("less", "count"), [(5.0, 1), (4.0, 2)])
def test_one_effect_more_has_to_earn_its_place_in_the_run(
    found: tuple[Setting, Choice], monkeypatch: pytest.MonkeyPatch, less: float, count: int
) -> None:
    setting, choice = found
    beside = next(one for one in choice.tried if one.effect.key == "stribeck")
    both = replace(choice, steps=(*choice.steps, Step(beside, 0.01, (), choice.end, choice.base)))
    plain = replace(setting.plain.model, misfit=90.0)
    misfits = {1: 5.4, 2: less}
    monkeypatch.setattr(
        "identification.tracing.free_run.backward_elimination.fitted",
        lambda part, _setting: replace(plain, misfit=misfits[len(part.steps)]),
    )
    monkeypatch.setattr(
        "identification.tracing.free_run.backward_elimination.followed_up_to", lambda *_: COMPLETE
    )
    kept, model = fewest(both, with_plain(setting, plain))
    assert (len(kept.steps), model.misfit) == (count, misfits[count])


def test_what_a_choice_has_to_reach(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    plain = setting.plain.model
    far = with_plain(setting, replace(plain, misfit=41.0))
    assert followed_up_to(choice, far, True) == pytest.approx(5.0)  # a tenth of what was left
    assert followed_up_to(choice, far, False) == COMPLETE
    forced = setting_of(setting.logs, plain, {}, setting.rng, "force")
    assert followed_up_to(choice, forced, False) == COMPLETE
    assert equations_explained(choice.base) and not equations_explained(setting.plain.first)


def test_without_effects_a_measured_force_is_contested_sooner(
    found: tuple[Setting, Choice],
) -> None:
    setting, choice = found
    plain = replace(setting.plain.model, misfit=2.0)
    forced = setting_of(setting.logs, plain, {}, setting.rng, "force")
    assert enough(forced, ()) == ADEQUATE < ASTRAY == enough(forced, choice.steps)
    astray = with_plain(forced, replace(plain, misfit=200.0))
    assert enough(astray, ()) == ADEQUATE < ASTRAY < enough(astray, choice.steps)
