"""Rivals that the equations do not tell from an effect: the free run does, or does not."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.row_fit import first_stage
from identification.estimation.structure_fit import FittedStructure, fitted_structure
from identification.log import Rig
from identification.tracing.free_run import rivals as module
from identification.tracing.free_run.backward_elimination import Setting
from identification.tracing.free_run.rivals import discriminated, equal_rivals
from identification.tracing.regression.stepwise import Choice, Step, choose
from identification.tracing.result import Dependence
from identification.tracing.verdict import rivals_of, verdict_of
from tests.identification.motor_logs import K_A, made, seen

MOTOR = Rig("motor", force_per_command=K_A)
NOTHING = Dependence((), 0.0)


@pytest.fixture(scope="module")
def found() -> tuple[Setting, Choice, FittedStructure]:
    """A motor with a spring, and a rival that the equations do not tell from it."""
    one = seen(made(4, {"spring": {"k": 40.0}}))
    rng = np.random.default_rng(0)
    start, first = first_stage([one], False)
    plain = fitted_structure(start, first, (), RecordedLogs((one,), MOTOR, "command"), rng)
    library = {"spring": built_in()["spring"]}
    setting = Setting([one], [one], "command", MOTOR, library, start, first, plain, rng)
    choice = choose(start, first, library, rng, lambda _stage, _share: None)
    (step,) = choice.steps
    twin = replace(step.candidate, effect=replace(library["spring"], key="twin"))
    choice = replace(choice, steps=(replace(step, rivals=(twin,)),))
    return setting, choice, replace(plain, misfit=1.0)


def leaving(misfit: float) -> Callable[[Choice, Setting], FittedStructure]:
    """A fit of any choice, of which the run leaves this."""
    return lambda choice, setting: replace(setting.plain, misfit=misfit)


@pytest.mark.parametrize(("misfit", "verdict"), [(8.0, "effect"), (1.02, "inseparable")])
def test_the_run_has_a_say(
    found: tuple[Setting, Choice, FittedStructure], misfit: float, verdict: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    setting, choice, after = found
    assert [one.effect.key for one in equal_rivals(choice.steps[0])] == ["twin"]
    monkeypatch.setattr(module, "fitted", leaving(misfit))
    told = discriminated(choice, after, setting)
    assert verdict_of(told, ()) == verdict
    (rival,) = rivals_of(told, ())
    assert ("leaves more in the run" in rival.why_not) == (verdict == "effect")


def test_a_run_that_is_not_followed_has_none(
    found: tuple[Setting, Choice, FittedStructure], monkeypatch: pytest.MonkeyPatch
) -> None:
    setting, choice, after = found
    monkeypatch.setattr(module, "fitted", leaving(50.0))
    for less in (replace(after, misfit=2.0), replace(after, imposed=True)):
        steps: tuple[Step, ...] = discriminated(choice, less, setting).steps
        assert not steps[0].apart
