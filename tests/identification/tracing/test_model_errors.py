"""What a model leaves of the test logs."""

from dataclasses import replace

import pytest

from identification.estimation.structure_fit import FittedStructure
from identification.tracing.model_errors import (
    OnTest,
    lacks,
    predicted,
    share_left,
)
from identification.tracing.result import Errors
from tests.identification.motor_logs import plant
from tests.identification.test_thresholds import stage


def left_of(
    force: float | None, actuator: float | None = None, misfit: float | None = None
) -> OnTest:
    """What a model leaves of the test logs: of force [N] and actuator [N/s], and in its run."""
    return OnTest(Errors(force, None, None, actuator), misfit)


def sensors(force: float, actuator: float | None = None) -> Errors:
    """What the sensors alone leave of the equations."""
    return Errors(force, None, None, actuator)


def test_without_an_error_nothing_is_held_against_it() -> None:
    assert share_left(left_of(None), left_of(None), sensors(0.1)) == 0.0


def test_the_share_left_is_beyond_what_the_sensors_leave_alone() -> None:
    left = share_left(left_of(1.0, 2.0), left_of(1.0, 1.0), sensors(1.0, 0.5))
    assert left == pytest.approx((1.0 - 0.25) / (4.0 - 0.25))


def test_the_share_is_that_of_the_first_error_that_stood_out() -> None:
    noise = sensors(1.0, 10.0)
    assert share_left(left_of(1.2, 11.0, 21.0), left_of(1.19, 11.0, 2.0), noise) == 0.05
    assert share_left(left_of(1.2, 11.0, 21.0), left_of(1.19, 11.0, 0.9), noise) == 0.0
    # A stop lost by chance is not held against what explains the actuator.
    assert share_left(left_of(1.2, 90.0, 21.0), left_of(1.2, 10.0, 40.0), noise) == 0.0
    # Where no run is judged, the equation alone counts.
    assert share_left(left_of(1.2, 11.0), left_of(1.1, 10.0), noise) == 0.0


def test_a_run_that_lacks_much_comes_before_an_equation_that_lacks_little() -> None:
    noise = sensors(1.0, 1.0)
    assert share_left(left_of(1.0, 1.5, 21.0), left_of(1.0, 1.5, 6.0), noise) == 0.25
    assert share_left(left_of(1.0, 2.5, 21.0), left_of(1.0, 2.5, 6.0), noise) == 1.0
    assert share_left(left_of(1.0, 1.5, 1.4), left_of(1.0, 1.5, 1.0), noise) == 1.0


@pytest.mark.parametrize(
    ("force", "misfit", "expected"),
    [(1.1, 1.2, True), (None, 1.2, True), (1.1, None, True), (1.4, 1.2, False), (1.1, 1.7, False)],
)
def test_a_model_is_complete_that_leaves_hardly_more_than_noise(
    force: float | None, misfit: float | None, expected: bool
) -> None:
    assert predicted(left_of(force, None, misfit), sensors(1.0)) is expected


def test_a_run_that_leaves_more_than_noise_lacks_something_where_it_is_off_the_motion(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    errors = Errors(1.2, None, None, None)
    model = FittedStructure(stage(), {}, plant(), {}, False, 5.0)
    for off, lacking in ((2e-3, True), (5e-4, False)):
        monkeypatch.setattr("identification.tracing.model_errors.off", lambda _, off=off: off)
        assert lacks(model, errors, sensors(1.0)) is lacking
    assert not lacks(replace(model, misfit=1.2), errors, sensors(1.0))
    far = Errors(9.0, None, None, None)  # of an equation: a run that is followed answers it
    assert lacks(replace(model, misfit=1.2), far, sensors(1.0))
    assert not lacks(replace(model, misfit=1.05), far, sensors(1.0))


@pytest.mark.parametrize(("force", "expected"), [(1.1, False), (2.0, True), (None, False)])
def test_a_prescribed_motion_lacks_force_beyond_noise_that_friction_would_feel(
    force: float | None, expected: bool
) -> None:
    model = FittedStructure(stage(), {}, plant(), {}, True)
    errors = Errors(force, None, None, None)
    assert lacks(model, errors, sensors(1.0)) is expected
    small = sensors(1e-3)  # far above the noise, but nothing beside friction
    assert not lacks(model, Errors(2e-3, None, None, None), small)
