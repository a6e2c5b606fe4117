"""Effects that are not needed: the run does without them."""

from dataclasses import replace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.row_fit import first_stage
from identification.estimation.structure_fit import fitted_structure
from identification.log import Rig
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
    suffices,
    without,
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
    assert fewest(part, setting)[1].plant is alone.plant  # made once
    assert not suffices(replace(alone, misfit=1.01 * ASTRAY), part, setting)
    missing = replace(part, base=setting.first)  # the spring is not explained
    assert not equations_explained(missing.base) and first_alone(missing, setting) is None
    assert not suffices(None, part, setting)


def test_a_plant_keeps_the_effects_of_its_steps(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    both = plant({**SPRING, "backlash": {"width": 1e-4}})
    assert [a.key for a in keeping(both, choice.steps[:1]).effects] == ["spring"]
    assert keeping(both, choice.steps[:1]).friction == NINE
    assert not keeping(both, ()).effects
    assert without(setting.plain, (), setting).friction == setting.plain.plant.friction


def test_the_fewest_effects_with_which_the_run_is_followed(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    beside = next(one for one in choice.tried if one.effect.key == "stribeck")
    more = Step(beside, 0.01, (), choice.end, choice.base)
    both = replace(choice, steps=(*choice.steps, more))
    kept, model = fewest(both, setting)
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
    kept, model = fewest(both, replace(setting, plain=plain))
    assert (len(kept.steps), model.misfit) == (count, misfits[count])


def test_what_a_choice_has_to_reach(found: tuple[Setting, Choice]) -> None:
    setting, choice = found
    far = replace(setting, plain=replace(setting.plain, misfit=41.0))
    assert followed_up_to(choice, far, True) == pytest.approx(5.0)  # a tenth of what was left
    assert followed_up_to(choice, far, False) == COMPLETE
    assert followed_up_to(choice, replace(far, drive="force"), False) > COMPLETE
    assert equations_explained(choice.base) and not equations_explained(setting.first)


def test_without_effects_a_measured_force_is_contested_sooner(
    found: tuple[Setting, Choice],
) -> None:
    setting, choice = found
    forced = replace(setting, drive="force", plain=replace(setting.plain, misfit=2.0))
    assert enough(forced, ()) == ADEQUATE < ASTRAY == enough(forced, choice.steps)
    astray = replace(forced, plain=replace(setting.plain, misfit=200.0))
    assert enough(astray, ()) == ADEQUATE < ASTRAY < enough(astray, choice.steps)
