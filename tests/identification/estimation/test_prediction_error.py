"""Sliding friction and effects of largest likelihood, against the plants that made the logs."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from identification.estimation.prediction_error import PredictionErrorFit, prediction_error_fit
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.regression.equation_rows import FIVE, MotionLog
from identification.log import Rig
from identification.model.plant import Plant
from tests.identification.motor_logs import NINE, made, plant, seen
from tests.identification.plants import made_log, table

SLOWEST = 0.012  # m/s, above the bands of these plants
SPRING = {"spring": {"k": 40.0}}


@cache
def by_force(seed: int) -> tuple[MotionLog, ...]:
    """A log of table 1, driven by the measured force with its noise."""
    return recorded_logs([made_log(table(1), seed=seed, seconds=8.0)], Rig("force"), "force").logs


def from_plant(p: Plant, seed: int = 0) -> PredictionErrorFit:
    found = prediction_error_fit(p, FIVE, by_force(seed), SLOWEST)
    assert found is not None
    return found


def off(found: PredictionErrorFit) -> list[float]:
    """Errors of the five in their deviations."""
    p, sd = found.plant.friction, np.sqrt(np.diag(found.covariance)).tolist()
    errors = (getattr(p, name) - getattr(table(1), name) for name in found.names)
    return [error / s for error, s in zip(errors, sd, strict=True)]


def test_bent_parameters_give_way_to_those_of_the_plant() -> None:
    p = table(1)
    found = from_plant(Plant(replace(p, m=1.03 * p.m, F_cp=0.97 * p.F_cp, F_vn=1.05 * p.F_vn)))
    assert found.is_likelier and found.gain > 100.0
    assert np.max(np.abs(off(found))) < 4.0
    assert found.covariance[0, 0] ** 0.5 < 0.01 * p.m
    assert found.plant.friction.F_sp == p.F_sp  # of which sliding says nothing


def test_the_plant_itself_is_as_likely_as_any() -> None:
    assert not any(from_plant(Plant(table(1)), seed).is_likelier for seed in range(4))


@pytest.mark.slow
def test_deviations_are_as_large_as_the_errors() -> None:
    errors = np.array([off(from_plant(Plant(table(1)), seed)) for seed in range(12)])
    assert 0.5 < np.sqrt(np.mean(errors**2)) < 1.7


def test_parameters_that_would_stand_for_what_is_missing_are_not_taken() -> None:
    """A spring of 40 N/m, which friction of any size would follow better than this one does."""
    bent = replace(NINE, F_cp=1.1 * NINE.F_cp)
    logs = [seen(made(4, SPRING))]
    lacking = prediction_error_fit(Plant(bent, plant().actuator), FIVE, logs, SLOWEST)
    whole = prediction_error_fit(replace(plant(SPRING), friction=bent), FIVE, logs, SLOWEST)
    assert lacking is not None and not lacking.is_likelier
    assert whole is not None and whole.is_likelier
    assert whole.plant.friction.F_cp == pytest.approx(NINE.F_cp, rel=5e-3)


def test_parameters_at_none_stay_there() -> None:
    without = Plant(replace(table(1), F_vp=1e-9, F_vn=1e-9))
    assert prediction_error_fit(without, ("F_vp", "F_vn"), by_force(0), SLOWEST) is None
    assert from_plant(without).names == ("m", "F_cp", "F_cn")
