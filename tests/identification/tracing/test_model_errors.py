"""Whether what explains the training logs carries over to the test logs."""

import pytest

from identification.tracing.model_errors import NoiseFloor, carries, share_left
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


def test_without_a_force_error_nothing_is_held_against_it() -> None:
    assert carries(of(None, None), of(None, None))
    assert share_left(of(None, None), of(None, None), NoiseFloor(0.1, 1.0, None)) == 0.0


def test_the_share_left_is_that_of_the_test_logs() -> None:
    """Beyond what the sensors leave alone."""
    left = share_left(of(1.0, 2.0), of(0.1, 1.0), NoiseFloor(0.5, 1.0, None))
    assert left == pytest.approx((1.0 - 0.25) / (4.0 - 0.25))


def test_the_share_is_that_of_the_first_error_that_stood_out() -> None:
    """An effect of stops hardly shows in the equation of sliding."""
    before = {"test": Errors(1.2, None, 50e-6, None)}
    after = {"test": Errors(1.19, None, 5e-6, None)}
    assert share_left(before, after, NoiseFloor(1.0, 5e-6, None)) == 0.0
    # A stop lost by luck is not held against what explains the force.
    before = {"test": Errors(9.0, None, 1e-3, None)}
    after = {"test": Errors(1.0, None, 2e-3, None)}
    assert share_left(before, after, NoiseFloor(1.0, 5e-6, None)) == 0.0
