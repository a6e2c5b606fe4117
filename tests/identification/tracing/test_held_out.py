"""What the held-out logs say of effects: beside a change of the machine, and above which speed."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from identification.effects._library import built_in
from identification.estimation.latent_force import LatentForce, LatentForces, Rougher
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.row_fit import RowFit, first_stage
from identification.estimation.structure_fit import FittedStructure, band
from identification.tracing import held_out, judgement
from identification.tracing.free_run.backward_elimination import only
from identification.tracing.held_out import HeldOut
from identification.tracing.model_errors import OnTest
from identification.tracing.parameter_drift import ParameterDrift
from identification.tracing.predictive_check import Worse
from identification.tracing.regression.stepwise import choose
from identification.tracing.result import Change, MissingForce, Residual, Trace
from identification.tracing.trace import trace
from identification.tracing.verdict import parameters_before
from tests.identification.motor_logs import NINE, made, plant, seen
from tests.identification.tracing.settings import MOTOR, setting_of

FALLS = {"stribeck": {"F_s": 6.0, "v_s": 0.05}}
NO_BAND = replace(NINE, dv_p=0.0, dv_n=0.0, F_sp=18.0, F_sn=-16.0)


@cache
def worn() -> Trace:
    """A motor with Stribeck friction whose Coulomb levels are a tenth higher in the test log."""
    later = replace(NO_BAND, F_cp=1.1 * NO_BAND.F_cp, F_cn=1.1 * NO_BAND.F_cn)
    logs = [[made(i, FALLS, friction=p)] for i, p in ((4, NO_BAND), (5, later))]
    library = {"stribeck": built_in()["stribeck"]}
    return trace(logs[0], logs[1], MOTOR, library, np.random.default_rng(0))


@pytest.mark.slow
def test_a_change_of_the_machine_is_not_held_against_an_effect() -> None:
    found = worn()
    assert found.verdict == "effect"
    assert {one.name for one in found.drift} == {"F_cp", "F_cn"}
    assert found.effects[0].probability > 0.95


def far_off(stage: EffectRows, first: Mapping[str, RowFit]) -> FittedStructure:
    """A plain model whose run follows no log."""
    plain = plant(friction=replace(NINE, F_cp=20.0, F_cn=4.0))
    return FittedStructure(stage, first, plain, dict.fromkeys(vars(NINE), 90.0), False, 90.0)


@cache
def judged() -> HeldOut:
    """A motor with a spring of 40 N/m, its plain model far off, and the model with the spring."""
    one = seen(made(4, {"spring": {"k": 40.0}}))
    rng = np.random.default_rng(0)
    start, first = first_stage([one], False)
    plain = far_off(start, first)
    library = {"spring": built_in()["spring"]}
    setting = setting_of([one], plain, library, rng)
    choice = choose(start, first, library, rng, lambda _stage, _share: None)
    sprung = plant({"spring": {"k": 40.0}})
    model = FittedStructure(choice.end, choice.base, sprung, {}, False, 1.0)
    return HeldOut(setting.plain, choice, model, ())


def test_force_is_missing_above_the_band_of_the_model_that_explains_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The plain model's own band may have taken the place of the effect."""
    evaluated, asked = judged(), list[float]()

    def missing(before: Any, after: Any, logs: Any, slowest: float) -> None:
        asked.append(slowest)

    monkeypatch.setattr(held_out, "missing_force", missing)
    swollen = replace(evaluated.choice.start, band=0.5)
    replace(evaluated, choice=replace(evaluated.choice, start=swollen)).missing  # noqa: B018
    assert asked[0] <= max(band(evaluated.model), evaluated.choice.base["mechanical"].slowest) < 0.5


def test_before_an_effect_a_plain_run_that_is_not_followed_has_the_values_of_the_equation() -> None:
    one = seen(made(4))
    start, first = first_stage([one], False)
    plain = far_off(start, first)
    found = parameters_before(
        plain, setting_of([one], plain, {}, np.random.default_rng(0)).recorded
    )
    assert found["F_cp"].value == pytest.approx(NINE.F_cp, rel=0.05)
    assert found["F_cn"].value == pytest.approx(NINE.F_cn, rel=0.05)
    assert found["dv_p"].value is None


def test_a_force_that_is_explained_as_measured_is_not_outvoted_by_the_position(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Through stops a run loses its way by chance; an effect of the sensor makes its own force."""
    evaluated = replace(judged(), seen=judged().logs)
    monkeypatch.setattr(held_out, "predicts_worse", lambda *_: Worse(0.2, 9.0, 11.0))
    assert evaluated.share < 0.1 and evaluated.against == ""
    shown = built_in()["backlash"]
    (step,) = evaluated.choice.steps
    by_sensor = replace(step, candidate=replace(step.candidate, effect=shown))
    other = replace(evaluated, choice=replace(evaluated.choice, steps=(by_sensor,)))
    vars(other).update(
        {name: getattr(evaluated, name) for name in ("share", "before", "after", "drift")}
    )
    assert "position" in other.against


def test_an_effect_is_not_named_with_which_a_plant_predicts_the_force_worse() -> None:
    """The equation's own coefficients may explain a force that the refined plant does not have."""
    evaluated = judged()
    assert evaluated.against == ""
    wrong = plant({"spring": {"k": 300.0}})
    other = replace(evaluated, model=replace(evaluated.model, plant=wrong))
    assert other.share > 1.0 and "is left" in other.against
    nothing_missing = replace(
        evaluated.plain, model=replace(evaluated.plain.model, plant=evaluated.model.plant)
    )
    assert replace(other, plain=nothing_missing).share > 1.0


def test_a_run_that_loses_its_way_does_not_outvote_the_force_that_an_effect_explains(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Nor does one that finds it again make up for a force that is left."""
    evaluated, wrong = judged(), plant({"spring": {"k": 300.0}})
    monkeypatch.setattr(held_out, "share_left", lambda *_: 0.9)
    assert replace(evaluated).share < 0.01
    monkeypatch.setattr(held_out, "share_left", lambda *_: 0.1)
    assert replace(evaluated, model=replace(evaluated.model, plant=wrong)).share > 1.0


def latent(force: float, sd: float) -> LatentForces:
    """A latent force of this size and deviation [N] while a body slides."""
    n = np.ones(8)
    one = LatentForce(n, n, force * n, sd * n, n > 0.0, 0.0 * n)
    return LatentForces(force, 1.0, force + sd, Rougher(), (one,))


@pytest.mark.parametrize(
    ("force", "sd", "expected"),
    [
        (2.0, 0.1, 0.5),  # the share of the force that the model leaves
        (0.01, 0.001, 0.2),  # nothing beside friction
        (1.0, 2.0, 0.2),  # only bounded
    ],
)
def test_where_hardly_any_force_was_missing_the_error_says_how_probable_an_effect_is(
    force: float, sd: float, expected: float
) -> None:
    evaluated, n = replace(judged()), np.ones(8)
    sliding = Residual("mechanical", n, n, n, n, n, {})
    left = MissingForce(latent(force, sd), latent(0.5 * force, 0.5 * sd), sliding)
    vars(evaluated).update(share=0.04, missing=left, changed=())
    assert 10.0 ** evaluated.evidence[1] == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("gained", "judged_by_force"), [(60.0, True), (1.0, False)])
def test_an_effect_that_seldom_acts_is_judged_by_the_likelihood_of_the_held_out_motion(
    gained: float, judged_by_force: bool
) -> None:
    """A dip in slow motion alone lacks less than 1 % of friction on the whole, and a run loses its
    stops with it as without: it left 59 % of a run's error, and 0.6 % of the equation's."""

    own, n = judged(), np.ones(8)
    before, after, noise = own.before["test"], own.after["test"], own.noise.force_rms
    assert noise is not None
    evaluated = replace(own, seen=own.logs)
    lacks = latent(1e-3, 1e-4)
    likelier = replace(lacks, logs=(replace(lacks.logs[0], log_density=gained / 8.0 * n),))
    vars(evaluated).update(
        before={"test": replace(before, force_rms=9.0 * noise)},
        after={"test": replace(after, force_rms=1.1 * noise)},
        missing=MissingForce(lacks, likelier, Residual("mechanical", n, n, n, n, n, {})),
        was=OnTest(before, 22.0), now=OnTest(after, 13.6), changed=(),
    )  # fmt: skip
    assert evaluated._force_left(evaluated.missing) is None
    assert evaluated.share == pytest.approx(0.21 / 80.0 if judged_by_force else 12.6 / 21.0)
    assert ("half" not in evaluated.against) == judged_by_force


@pytest.mark.parametrize("measured", [True, False])
def test_no_effect_of_an_actuator_is_proved_by_the_force_that_a_body_lacks(
    measured: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The plain model's body is bent by its run, which numbers of the equation put right whatever
    is named: a dead zone stood for leakage. Of a motor the force is that of its command."""
    monkeypatch.setattr(RecordedLogs, "by_motor", not measured)
    own, n = replace(judged()), np.ones(8)
    (step,) = own.choice.steps
    effect = built_in()["valve_dead_zone"]
    named = replace(step, candidate=replace(step.candidate, effect=effect))
    evaluated = replace(own, choice=replace(own.choice, steps=(named,)))
    sliding = Residual("mechanical", n, n, n, n, n, {})
    found = evaluated._force_left(MissingForce(latent(2.0, 0.1), latent(0.02, 0.001), sliding))
    assert (found is None) == measured


@pytest.mark.parametrize(("lacks_force", "verdict"), [(False, "drift"), (True, "unknown")])
def test_other_levels_are_no_drift_where_a_force_of_account_is_missing(
    lacks_force: bool, verdict: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Behind an elastic shaft any level follows better than another."""
    evaluated = judged()
    none = replace(
        evaluated,
        model=evaluated.plain.model,
        choice=only(evaluated.choice, ()),
        seen=evaluated.logs,
    )
    vars(none).update(lacks_force=lacks_force, lacking=True)
    level = Change("F_cp", "N", 15.0, 16.0, 0.1)
    monkeypatch.setattr(judgement, "levels_refitted", lambda *_: ((level,), "how"))
    assert judgement.judgement(none).verdict == verdict


@pytest.mark.parametrize(
    ("misfit", "missing", "shown"),
    [
        (1.2, 0.5, False),  # which the parameters that have changed explain
        (4.0, 0.5, True),
        (0.0, 0.5, True),  # too little slides fast enough to show whether they do
        (0.0, 0.001, False),  # of the Coulomb level, which is of no account
    ],
)
def test_what_the_test_logs_alone_lack_is_shown_unless_changed_parameters_explain_it(
    misfit: float, missing: float, shown: bool
) -> None:
    """Slow test logs of a machine with Stribeck friction had nothing missing, 23 times the noise
    of their force and 49 mm off."""
    evaluated = judged()
    choice = only(evaluated.choice, ())
    none = replace(evaluated, model=evaluated.plain.model, choice=choice, seen=evaluated.logs)
    force = float(np.hypot(none.noise.force_rms or 0.0, missing * none.coulomb))
    left = replace(none.before["test"], force_rms=force)
    vars(none).update(
        before={**none.before, "test": left}, drift=ParameterDrift((), misfit),
        lacks_force=False, lacking=False,
    )  # fmt: skip
    assert none.shows_more_than_training == shown
