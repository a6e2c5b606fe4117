"""A model that lacks something: its own logs say how sure it is, of a new log as well."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.drift_machines import active
from identification.arrays import Array
from identification.drift.drift_result import DriftTest
from identification.drift.drift_test import DriftSettings, estimate_under_test
from identification.drift.log_estimate import LogEstimate
from identification.drift.mewma import fresh_state
from identification.drift.own_logs import own_logs_of, own_misfit, with_own_logs
from identification.drift.reference_model import OwnLogs, ReferenceModel
from identification.errors import BadModel
from identification.estimation.fit import fit_plant
from identification.log import Rig
from identification.model.karnopp import NAMES
from identification.model.plant import Plant
from tests.identification.plants import ACTUATOR, made_log, table

NINE = table(2)
SAID, TRUE = 0.004, 0.02  # relative deviation that a fit says, and that it has
LEFT = 30.0


def estimate(rng: np.random.Generator, factor: Array, left: float = LEFT) -> LogEstimate:
    """What a log of a machine changed by `factor` (9,) gives under a model that lacks something."""
    change = factor * (1.0 + TRUE * rng.standard_normal(9)) - 1.0
    return LogEstimate(change, SAID**2 * np.eye(9), {}, left, as_usual=True)


def model(rng: np.random.Generator, logs: int = 3) -> ReferenceModel:
    """The mean of its logs, with a misfit of them."""
    own = [estimate(rng, np.ones(9)) for _ in range(logs)]
    middle = np.mean([one.change for one in own], axis=0)
    values, covariance = (1.0 + middle) * NINE.array, np.diag((SAID * NINE.array) ** 2) / logs
    found = ReferenceModel(
        Plant(NINE, ACTUATOR), NAMES, values, covariance, Rig("force"), "force", chi_square=LEFT
    )
    return replace(found, own_logs=own_logs_of(found, [beside(found, one) for one in own]))


def beside(known: ReferenceModel, log: LogEstimate) -> LogEstimate:
    """The same from the model's values instead of the machine's."""
    share = NINE.array / known.values
    change = share * (1.0 + log.change) - 1.0
    return replace(log, change=change, covariance=log.covariance * np.outer(share, share))


def verdict(known: ReferenceModel, log: LogEstimate) -> DriftTest:
    state = fresh_state("", known.names)
    return estimate_under_test(known, beside(known, log), "log", state, DriftSettings())


def worn() -> Array:
    factor = np.ones(9)
    factor[[NAMES.index(name) for name in ("F_cp", "F_cn", "F_sp", "F_sn")]] = 1.2
    return factor


@pytest.mark.method
def test_a_machine_that_the_model_never_followed_has_not_changed() -> None:
    """Without its own logs the model cries drift on the next log of the unchanged machine."""
    cried = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        known = model(rng)
        logs = [estimate(rng, np.ones(9)) for _ in range(3)]
        assert all(verdict(known, log).verdict != "drift" for log in logs)
        blind = replace(known, own_logs=None)
        cried += any(verdict(blind, log).verdict == "drift" for log in logs)
    assert cried >= 10


@pytest.mark.method
@pytest.mark.slow
def test_a_worn_machine_is_found_all_the_same_and_its_mass_not_named() -> None:
    found = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        found.append(verdict(model(rng), estimate(rng, worn())))
    assert sum(one.verdict == "drift" for one in found) >= 18
    named = {shift.name for one in found for shift in one.moved}
    assert named <= {"F_cp", "F_cn", "F_sp", "F_sn"}


def test_a_fit_that_has_lost_its_way_judges_nothing() -> None:
    rng = np.random.default_rng(1)
    known = model(rng)
    found = verdict(known, estimate(rng, 1.5 * np.ones(9), left=1e4 * LEFT))
    assert found.verdict == "not_judged" and not found.tested
    assert "has lost its way" in found.reason
    near = verdict(known, estimate(rng, 1.5 * np.ones(9), left=20.0 * LEFT))
    assert near.tested


def test_a_fit_of_which_its_logs_are_surer_than_it_says_counts_as_they_do() -> None:
    rng = np.random.default_rng(1)
    known = model(rng)
    assert known.own_logs is not None
    near = replace(known.own_logs, apart=(0.01, 0.02, 0.01), scatter=(1e-3,) * 9)
    assert own_misfit(replace(known, own_logs=near)).factor < 0.2
    # One that leaves noise alone has intervals that hold: it is never surer than it says.
    assert own_misfit(replace(known, own_logs=near, chi_square=1.2)).factor == 1.0


def test_a_parameter_is_never_surer_than_the_models_own_logs_were_of_it() -> None:
    rng = np.random.default_rng(1)
    known = model(rng)
    misfit = own_misfit(known)
    wide = misfit.of_log(1e-12 * np.eye(9), LEFT)
    assert np.sqrt(np.diag(wide)) == pytest.approx(np.sqrt(misfit.scatter))
    assert np.all(np.diag(misfit.of_log(np.eye(9), LEFT)) == misfit.factor)


@pytest.mark.slow
def test_logs_that_a_model_follows_lie_as_far_from_it_as_their_errors_say() -> None:
    logs = [made_log(NINE, seed=k, seconds=8.0) for k in (1, 2)]
    rig = Rig("force")
    fit = fit_plant(logs, np.random.default_rng(1), rig=rig)
    known = with_own_logs(active(fit, rig), logs, np.random.default_rng(2))
    assert known.own_logs is not None and not known.own_logs.parts
    assert known.own_logs.left == pytest.approx((1.0, 1.0), abs=0.3)
    assert max(known.own_logs.apart) < 5.0
    scatter = dict(zip(known.own_logs.names, known.own_logs.scatter, strict=True))
    assert (scatter["F_cp"] or 0.0) < 0.01


@pytest.mark.slow
def test_a_single_log_of_which_more_is_left_is_cut_up() -> None:
    known = model(np.random.default_rng(1))
    rig = Rig("force")
    log = made_log(NINE, seed=1)
    fit = fit_plant([log], np.random.default_rng(1), rig=rig)
    worse = replace(active(fit, rig), chi_square=known.chi_square)
    found = with_own_logs(worse, [log], np.random.default_rng(2))
    assert found.own_logs is not None and found.own_logs.parts
    assert len(found.own_logs.left) == 3


def test_a_single_log_of_which_noise_is_left_is_not_cut_up() -> None:
    rng = np.random.default_rng(1)
    good = replace(model(rng), own_logs=None, chi_square=1.0)
    assert with_own_logs(good, [made_log(NINE)], rng) is good
    assert own_misfit(good).factor == 1.0


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"scatter": (0.1,)}, "1 values of scatter"),
        ({"apart": (1.0,)}, "1 values of apart, 2 of left"),
        ({"left": (1.0,), "apart": (1.0,)}, "two logs at least"),
        ({"apart": (-1.0, 1.0)}, "below 0"),
    ],
)
def test_own_logs_that_are_none_are_refused(wrong: dict[str, tuple[float, ...]], said: str) -> None:
    good = OwnLogs(("m", "F_cp"), (0.01, None), (1.0, 2.0), (3.0, 4.0))
    with pytest.raises(BadModel, match=said):
        replace(good, **wrong)  # type: ignore[arg-type]
