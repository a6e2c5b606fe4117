"""Cogging by its orders of a turn: found beside friction, inertia and gravity, each sure."""

import numpy as np
import pytest

from identification.arrays import Array
from identification.effects._library import built_in, numbered, of_key
from identification.estimation.prescribed_motion import way_of
from identification.estimation.surroundings import surroundings
from identification.estimation.turn_orders import (
    _by_chance,
    _explained,
    orders_explain,
    turn_orders,
)
from identification.log import Log, Rig
from identification.model.surroundings import Surroundings

H, N = 2e-3, 15_000
RIG = Rig("force", motion="rotary")
T: Array = np.asarray(H * np.arange(N), dtype=np.float64)
BOTH_WAYS = 4.0 * np.sin(0.5 * T) + 0.6 * np.sin(2.3 * T)
ONE_WAY = 1.3 * T + 0.4 * np.sin(2.0 * T)


def log_of(y: Array, cogging: dict[float, float], gravity: float = 0.0, seed: int = 0) -> Log:
    """A body driven along y under friction, inertia, and torques that repeat so often in a turn."""
    v, rng = np.gradient(y, H), np.random.default_rng(seed)
    force = 0.02 * np.gradient(v, H) + 0.15 * np.sign(v) + 0.03 * v + gravity * np.sin(y)
    force += sum((size * np.sin(n * y + 0.3 * n) for n, size in cogging.items()), np.zeros(len(y)))
    noise = rng.standard_normal((2, len(y)))
    shown = np.asarray(y + 2e-4 * noise[0], dtype=np.float64)
    measured = np.asarray(force + 0.01 * noise[1], dtype=np.float64)
    return Log("turn", {"t": T, "y": shown, "F": measured})


def sizes(y: Array, cogging: dict[float, float], gravity: float = 0.0) -> dict[int, float]:
    """Sizes of the orders that are found."""
    found = turn_orders([log_of(y, cogging, gravity)], RIG)
    return {one.order: one.size for one in found}


@pytest.mark.parametrize("y", [BOTH_WAYS, ONE_WAY])
def test_each_order_has_its_size(y: Array) -> None:
    found = sizes(y, {7: 0.8, 28: 0.4}, gravity=0.5)
    assert list(found) == [7, 28]
    assert found == pytest.approx({7: 0.8, 28: 0.4}, rel=0.03)


def test_its_interval_holds_the_size() -> None:
    off = []
    for seed in range(8):
        (one,) = turn_orders([log_of(BOTH_WAYS, {12: 0.8}, seed=seed)], RIG)
        off.append((one.size - 0.8) / one.sd)
    assert np.mean(np.abs(off) < 3.0) > 0.8


def test_as_many_orders_are_found_as_there_are() -> None:
    many: dict[float, float] = {
        n: 0.8 / (1 + i) for i, n in enumerate((7, 28, 14, 12, 36, 35, 56, 21, 8, 64, 43, 42))
    }
    assert sizes(BOTH_WAYS, many) == pytest.approx(many, rel=0.1)


def test_noise_alone_has_an_order_as_seldom_as_by_chance() -> None:
    rng, found = np.random.default_rng(0), 0
    for _ in range(300):
        pairs = rng.standard_normal((40, 250, 2))
        left = rng.standard_normal(250)
        base = np.linalg.qr(rng.standard_normal((250, 7)))[0]
        left = left - base @ (base.T @ left)
        most = max(_explained(pair, base, left) for pair in pairs)
        found += most > _by_chance(40, 250.0 - 7.0) * float(left @ left)
    assert found <= 9


def test_gravity_and_friction_alone_have_none() -> None:
    assert sizes(BOTH_WAYS, {}, gravity=3.0) == {}


def test_what_repeats_with_something_else_than_the_turn_is_none() -> None:
    assert sizes(BOTH_WAYS, {7.4: 0.8}) == {}


def test_small_orders_are_left_to_a_trace() -> None:
    assert sizes(BOTH_WAYS, {7: 0.003}) == {}


def test_a_machine_that_slides_has_none() -> None:
    assert turn_orders([log_of(BOTH_WAYS, {7: 0.8})], Rig("force")) == ()


def test_they_are_taken_out_and_are_the_plant_s_cogging() -> None:
    log = log_of(BOTH_WAYS, {7: 0.8, 28: 0.4}, gravity=1.0)
    found = surroundings([log], RIG)
    assert found.sine.value == pytest.approx(1.0, rel=0.02)
    assert [one.key for one in found.cogging] == ["cogging", "cogging_2"]
    plain = log_of(BOTH_WAYS, {})
    assert np.std(found.taken_out(log)["F"] - plain["F"]) < 0.02
    without, left = orders_explain([log], RIG, found)
    assert left < 0.05 * without


def test_a_zero_order_hold_command_feels_them_over_its_period() -> None:
    around = Surroundings(orders=turn_orders([log_of(BOTH_WAYS, {7: 0.8})], RIG), gives=2.0)
    log = log_of(BOTH_WAYS, {}).with_signals(u=np.zeros(N))
    middle = np.interp(T + 0.5 * H, T, BOTH_WAYS)
    whole = around.taken_out(log)
    assert np.asarray(whole["u"])[:-1] == pytest.approx(
        0.5 * (np.asarray(log["F"]) - 0.8 * np.sin(7 * middle + 2.1))[:-1], abs=0.01
    )


def test_an_effect_acts_again_by_its_number() -> None:
    library = built_in()
    again = of_key("cogging_2", library)
    assert again == numbered(library["cogging"], 2)
    assert of_key("cogging", library) is library["cogging"]
    assert of_key("cogging_1", library) is None and of_key("rogging_2", library) is None


def test_the_way_of_a_log() -> None:
    assert way_of([log_of(ONE_WAY, {})], zoh=False) is True
    assert way_of([log_of(-ONE_WAY, {})], zoh=False) is False
    assert way_of([log_of(BOTH_WAYS, {})], zoh=False) is None
