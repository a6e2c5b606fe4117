"""Whether what explains the training logs carries over to the test logs."""

import pytest

from identification.tracing.model_errors import (
    NoiseFloor,
    OnTest,
    carries,
    hardly_predicted,
    predicted,
    share_left,
)
from identification.tracing.result import Errors


def of(train: float | None, test: float | None) -> dict[str, Errors]:
    """Errors of the force [N]; the others are not judged."""
    return {name: Errors(x, None, None, None) for name, x in (("train", train), ("test", test))}


@pytest.mark.parametrize(
    ("before", "train", "test", "expected"),
    [
        (1.2, 0.1, 0.1, True),
        (1.2, 0.1, 0.19, True),  # another reference leaves a little more
        (1.2, 0.1, 0.42, False),
        (5.0, 0.1, 0.42, True),  # next to all that was missing is explained
    ],
)
def test_a_structure_carries_over_or_stands_in_for_another(
    before: float, train: float, test: float, expected: bool
) -> None:
    assert carries(of(before, before), of(train, test)) is expected


def left_of(
    force: float | None, actuator: float | None = None, misfit: float | None = None
) -> OnTest:
    """What a model leaves of the test logs: of force [N] and actuator [N/s], and in its run."""
    return OnTest(Errors(force, None, None, actuator), misfit)


def test_without_a_force_error_nothing_is_held_against_it() -> None:
    assert carries(of(None, None), of(None, None))
    assert share_left(left_of(None), left_of(None), NoiseFloor(0.1, None)) == 0.0


def test_the_share_left_is_beyond_what_the_sensors_leave_alone() -> None:
    left = share_left(left_of(2.0), left_of(1.0), NoiseFloor(0.5, None))
    assert left == pytest.approx((1.0 - 0.25) / (4.0 - 0.25))


def test_the_share_is_that_of_the_first_error_that_stood_out() -> None:
    """An effect of stops hardly shows in the equation of sliding, but in the run."""
    noise = NoiseFloor(1.0, 10.0)
    assert share_left(left_of(1.2, 11.0, 21.0), left_of(1.19, 11.0, 2.0), noise) == 0.05
    assert share_left(left_of(1.2, 11.0, 21.0), left_of(1.19, 11.0, 0.9), noise) == 0.0
    # A stop lost by luck is not held against what explains the force, or the actuator.
    assert share_left(left_of(9.0, None, 21.0), left_of(1.0, None, 40.0), noise) == 0.0
    assert share_left(left_of(1.2, 90.0, 21.0), left_of(1.2, 10.0, 40.0), noise) == 0.0
    # Where no run is judged, the equations alone count.
    assert share_left(left_of(1.2, 11.0), left_of(1.1, 10.0), noise) == 0.0


def test_a_run_that_lacks_much_comes_before_an_equation_that_lacks_little() -> None:
    noise = NoiseFloor(1.0, None)
    assert share_left(left_of(1.5, None, 21.0), left_of(1.5, None, 6.0), noise) == 0.25
    assert share_left(left_of(2.5, None, 21.0), left_of(2.5, None, 6.0), noise) == 1.0
    assert share_left(left_of(1.5, None, 1.4), left_of(1.5, None, 1.0), noise) == 1.0


@pytest.mark.parametrize(
    ("force", "misfit", "expected"),
    [(1.1, 1.2, True), (None, 1.2, True), (1.1, None, True), (1.4, 1.2, False), (1.1, 1.7, False)],
)
def test_a_model_is_complete_that_leaves_hardly_more_than_noise(
    force: float | None, misfit: float | None, expected: bool
) -> None:
    assert predicted(left_of(force, None, misfit), NoiseFloor(1.0, None)) is expected


@pytest.mark.parametrize(("force", "expected"), [(1.8, True), (1.6, False), (None, False)])
def test_a_model_hardly_predicts_logs_that_are_left_far_more_than_noise(
    force: float | None, expected: bool
) -> None:
    assert hardly_predicted(left_of(force, None), NoiseFloor(1.0, None)) is expected
