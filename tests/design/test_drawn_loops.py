"""Margins of many plants at once against those of one, and the share that keeps a goal."""

import numpy as np
import pytest

from design.drawn_loops import DrawnPlants, loop_margins
from design.linear import linear_plant
from design.margins import margins
from design.pid import pid_to_rst
from design.rst import RST
from design.tune import Asked, Goals, tune_pid, tune_rst
from identification.arrays import Array
from identification.errors import BadSpecification

H = 2e-3
NOMINAL = linear_plant(3.0, 60.0, H)


def drawn(spread: float, count: int = 60, seed: int = 0) -> list[tuple[Array, Array]]:
    """Sliding bodies whose mass and friction differ by this relative deviation."""
    factors = np.exp(spread * np.random.default_rng(seed).standard_normal((count, 2)))
    return [linear_plant(3.0 * a, 60.0 * b, H) for a, b in factors.tolist()]


def rst(speed: float) -> RST:
    return tune_rst(*NOMINAL, H, Asked(dominant=(speed, 1.0)), Goals()).rst


@pytest.mark.slow
@pytest.mark.parametrize("speed", [20.0, 60.0, 150.0])
def test_they_are_the_margins_of_each_plant(speed: float) -> None:
    controller, plants = rst(speed), drawn(0.3)
    one = DrawnPlants.of(plants, 0.9)
    found = loop_margins(one.A, one.B, controller)
    seen = 0
    for i, (A, B) in enumerate(plants):
        try:
            own = margins(A, B, controller)
        except BadSpecification:
            assert found.modulus[i] == 0.0 and found.delay[i] == 0.0 and np.isinf(found.effort[i])
            continue
        seen += 1
        assert found.modulus[i] == pytest.approx(own.modulus, rel=1e-6)
        assert own.delay_s is not None and own.S_up_max_db is not None
        assert found.delay[i] == pytest.approx(own.delay_s / H, rel=1e-2)
        assert 20.0 * np.log10(found.effort[i]) == pytest.approx(own.S_up_max_db, abs=0.1)
    assert seen > 10


def test_an_unstable_loop_has_no_margin() -> None:
    wild = pid_to_rst(1e7, 0.05, 0.05, 0.01, H)
    one = DrawnPlants.of(drawn(0.1, 5), 0.9)
    found = loop_margins(one.A, one.B, wild)
    assert np.all(found.modulus == 0.0)
    assert len(one.missed(wild, Goals())) == 2


def test_the_share_counts_the_plants_on_which_no_loop_is_stable() -> None:
    controller = rst(40.0)
    whole = DrawnPlants.of(drawn(0.01, 20), 0.95)
    assert whole.missed(controller, Goals(0.5, 2.0)) == ()
    some_lost = DrawnPlants.of(drawn(0.01, 18), 0.95, lost=2)
    (modulus, delay) = some_lost.missed(controller, Goals(0.5, 2.0))
    assert "90 % of the machines drawn" in modulus
    assert "90 %" in delay


@pytest.mark.slow
def test_a_loop_is_placed_for_the_plants_drawn() -> None:
    """The wider they are, the slower the loop that keeps its margins on nine in ten of them."""
    speeds = []
    for spread in (0.02, 0.25, 0.5):
        plants = DrawnPlants.of(drawn(spread), 0.9)
        found = tune_pid(*NOMINAL, H, Asked(), Goals(0.6, 2.0), drawn=plants)
        assert not found.missed
        kept = loop_margins(plants.A, plants.B, found.rst).modulus >= 0.6
        assert np.mean(kept) >= 0.9
        speeds.append(found.dominant[0])
    assert speeds[0] > speeds[1] > speeds[2]


@pytest.mark.parametrize("probability", [0.0, 1.0, -1.0])
def test_a_share_that_is_none_is_refused(probability: float) -> None:
    with pytest.raises(BadSpecification, match="give one above 0 and below 1"):
        DrawnPlants.of(drawn(0.1, 3), probability)


def test_no_plants_are_refused() -> None:
    with pytest.raises(BadSpecification, match="0 plants A"):
        DrawnPlants.of([], 0.9)
