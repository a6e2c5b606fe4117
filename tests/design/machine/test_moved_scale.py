"""Every length, every force or the time of a log by one factor: a slip of unit, and no wear."""

import pytest

from design.machine.readable import Display
from design.machine.slip_of_scale import Moved, no_wear, other_mass, slip_of_scale
from tests.chain import TABLES

NINE = {
    name: getattr(TABLES["paper_table1"], name) for name in ("m", "F_cp", "F_vn", "dv_p", "F_sn")
}


def moved(sd: float = 0.01, **by: float) -> dict[str, Moved]:
    return {n: Moved(value, value * by.get(n, 1.0), sd) for n, value in NINE.items()}


@pytest.mark.parametrize(
    ("by", "said"),
    [
        ({"m": 0.1, "F_vn": 0.1, "dv_p": 10.0}, "every length by the factor 10 "),
        ({"m": 1e3, "F_cp": 1e3, "F_vn": 1e3, "F_sn": 1e3}, "every force by the factor 1000 "),
        ({"m": 1e6, "F_vn": 1e3, "dv_p": 1e-3}, "every time by the factor 1000 "),
    ],
)
def test_one_factor_that_moves_all_is_a_slip_of_scale(by: dict[str, float], said: str) -> None:
    assert said in slip_of_scale(moved(**by), Display())
    by = {**by, "m": 1.5 * by["m"]}
    assert slip_of_scale(moved(**by), Display()) == ""  # and the mass by its own


def test_angles_are_called_so() -> None:
    by = {"m": 0.1, "F_vn": 0.1, "dv_p": 10.0}
    assert "every angle by the factor 10 (the unit of the position 1/10" in slip_of_scale(
        moved(**by), Display("rotary")
    )


@pytest.mark.parametrize(
    "by",
    [
        {},
        {"F_cp": 1.3, "F_vn": 1.3, "F_sn": 1.3},
        {"m": 1.2, "F_cp": 1.2, "F_vn": 1.2, "F_sn": 1.2},
    ],
)
def test_wear_is_no_slip_of_scale(by: dict[str, float]) -> None:
    assert slip_of_scale(moved(**by), Display()) == ""


def test_without_a_mass_or_with_two_parameters_nothing_is_said() -> None:
    by = moved(m=0.1, F_vn=0.1)
    assert slip_of_scale({n: one for n, one in by.items() if n != "m"}, Display()) == ""
    assert slip_of_scale({n: by[n] for n in ("m", "F_vn")}, Display()) == ""


def test_a_mass_of_more_than_twice_is_another_load() -> None:
    assert other_mass(moved(m=1.9), Display()) == ""
    assert other_mass(moved(m=2.5), Display()).startswith("m 1 -> 2.5 kg, which no wear does")
    assert no_wear(moved(m=2.5, F_cp=1.2), Display()).startswith("m 1 -> 2.5 kg, which no")
    assert "kg m^2" in other_mass(moved(m=0.3), Display("rotary"))
    assert other_mass(moved(m=2.5, sd=1.0), Display()) == ""  # hardly identified
