"""Numbers as an engineer reads them."""

import pytest

from design.machine.readable import Display, as_shown, in_digits, number, small, times
from identification.log import Rig
from identification.model.estimates import Estimate


@pytest.mark.parametrize(
    ("value", "digits", "said"),
    [(5543.2, 2, "5500"), (0.000123456, 3, "0.000123"), (12.0, 3, "12"), (-0.05, 3, "-0.05"),
     (0.0, 3, "0"), (9.996, 3, "10"), (1234567.0, 3, "1230000"), (float("inf"), 3, "inf")],
)  # fmt: skip
def test_numbers_have_no_exponent(value: float, digits: int, said: str) -> None:
    assert number(value, digits) == said


@pytest.mark.parametrize(
    ("metres", "said"),
    [(5.63e-3, "5.63 mm"), (9.94e-6, "9.94 µm"), (-1.2, "-1200 mm"), (0.0, "0 mm")],
)
def test_lengths_are_in_mm_and_below_in_micrometres(metres: float, said: str) -> None:
    assert Display().length_text(metres) == said


def test_a_rotary_machine_has_angles_and_torques() -> None:
    turns = Display("rotary")
    assert turns.length_text(0.0123) == "0.0123 rad" and turns.force_text(2.0) == "2 N m"
    assert Display().force_text(2.415) == "2.42 N" and times(5540.0) == "5500 times"


def test_a_display_is_made_once_of_a_rig() -> None:
    found = Display.of(Rig("motor", motion="rotary", command_unit="A"))
    assert found == Display("rotary", "A")
    assert (found.stiffness, found.force_gain, found.mass) == ("N m/rad", "A/(N m)", "kg m^2")
    assert found.named("force_per_command") == "N m/A" and found.named("s") == "s"
    assert found.shown("velocity") == ("rad/s", 1.0)
    assert Display.of(Rig("force")).shown("velocity") == ("mm/s", 1e3)


def test_less_than_a_column_shows() -> None:
    assert (small(1e-5), small(2e-4), small(0.0)) == ("< 0.0001", "0.0002", "0")


def test_estimates_are_shown_in_other_units_with_their_interval() -> None:
    found = as_shown(Estimate(0.04, "m/s", sd=1e-3, low=0.038, high=0.042))
    assert (found.unit, found.value, found.sd) == ("mm/s", 40.0, 1.0)
    assert found.low == pytest.approx(38.0) and found.high == pytest.approx(42.0)
    unknown = Estimate(None, "m/s", reason="found 0.01")
    assert as_shown(unknown) is unknown  # its reason speaks of m/s


@pytest.mark.parametrize(
    ("value", "sd", "said"),
    [(12.00019, 2.5e-4, "12.0002"), (22.0, 3.5, "22"), (19530.081, 0.11, "19530.1"),
     (0.0, 1.0, "0.000"), (3.0, None, "3.000")],
)  # fmt: skip
def test_digits_are_those_that_the_deviation_leaves(
    value: float, sd: float | None, said: str
) -> None:
    assert in_digits([value], value, sd) == [said]
