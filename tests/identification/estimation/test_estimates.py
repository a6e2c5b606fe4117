"""Reasons instead of numbers where the events or the spread do not carry a parameter."""

import numpy as np
import pytest

from identification.arrays import IntArray
from identification.estimation.estimates import Events, estimates, events_of
from identification.log import Rig
from identification.model.karnopp import NAMES
from identification.simulation.karnopp_step import BAND_P, SLIP_N, SLIP_P, STUCK
from tests.identification.plants import table

PLENTY = Events((10, 10), (10, 10), (1000, 1000), (0.5, 0.5))


VALUES = dict(zip(NAMES, table(1).array.tolist(), strict=True))


def spread(relative: float) -> dict[str, float]:
    return {name: relative * abs(value) for name, value in VALUES.items()}


def test_events_are_counted_by_direction() -> None:
    modes: IntArray = np.array(
        [STUCK, BAND_P, SLIP_P, SLIP_P, STUCK, STUCK, SLIP_N, SLIP_N, STUCK], dtype=np.int64
    )
    v = np.array([0, 0.01, 0.1, 0.2, 0, 0, -0.3, -0.1, 0])
    events = events_of([modes], [v])
    assert events.breakaways == (1, 1)
    assert events.crossings == (2, 2)
    assert events.sliding == (2, 2)
    assert events.fastest == (0.2, 0.3)


def test_an_interval_holds_its_value_and_the_sign() -> None:
    found = estimates(VALUES, spread(0.01), PLENTY, Rig("force"), "log")
    for name, value in zip(NAMES, table(1).array, strict=True):
        one = found[name]
        assert one.value == value
        assert one.low is not None
        assert one.high is not None
        assert one.low < value < one.high
        assert one.high - one.low == pytest.approx(2 * 1.96 * 0.01 * abs(value), rel=0.1)


@pytest.mark.parametrize(
    ("events", "silent"),
    [
        (Events((0, 9), (9, 9), (999, 999), (1, 1)), {"F_sp"}),
        (Events((9, 2), (9, 9), (999, 999), (1, 1)), {"F_sn"}),
        (Events((9, 9), (0, 9), (999, 999), (1, 1)), {"dv_p"}),
        (Events((9, 9), (9, 9), (0, 999), (0, 1)), {"F_cp", "F_vp", "dv_p", "F_sp"}),
    ],
)
def test_missing_events_silence_their_parameters(events: Events, silent: set[str]) -> None:
    found = estimates(VALUES, spread(0.01), events, Rig("force"), "run3.csv")
    assert {name for name in NAMES if found[name].value is None} == silent
    for name in silent:
        reason = found[name].reason
        assert reason is not None
        assert "run3.csv" in reason
        assert "needed" in reason


def test_motion_that_only_the_fitted_run_lacks_is_not_said_to_be_missing_in_the_log() -> None:
    events = Events((9, 9), (9, 9), (45, 999), (1, 1), moved=(87, 999))
    found = estimates(VALUES, spread(0.01), events, Rig("force"), "run3.csv")["F_cp"]
    assert found.value is None and "moves in 87 samples, the fitted run slides in 45" in str(
        found.reason
    )


def test_what_lies_at_its_bound_where_the_body_never_moved_is_said_to_lack_motion() -> None:
    """A fitted run may slide to and fro where the log goes one way."""
    sliding = ((9, 9), (9, 9), (999, 999), (1.0, 1.0))
    for moved, said in (
        ((0, 500), "0 samples of sliding in the positive"),
        ((9, 500), "not significantly"),
    ):
        events = Events(*sliding, moved=moved)
        found = estimates(VALUES | {"F_cp": 0.0}, spread(0.01) | {"F_cp": 0.3}, events,
                          Rig("force"), "run3.csv")  # fmt: skip
        assert found["F_cp"].value is None and said in str(found["F_cp"].reason)


def test_a_wide_interval_silences_a_parameter() -> None:
    sd = spread(0.01) | {"dv_p": 0.58 * table(1).dv_p}
    found = estimates(VALUES, sd, PLENTY, Rig("force"), "log")
    assert {name for name in NAMES if found[name].value is None} == {"dv_p"}
    assert found["dv_p"].assumed == table(1).dv_p


def test_of_a_viscous_term_that_is_surely_small_its_largest_size_is_reported() -> None:
    values, sd = VALUES | {"F_vp": 0.1}, spread(0.001) | {"F_vp": 0.1}
    found = estimates(values, sd, PLENTY, Rig("force"), "log")
    small = found["F_vp"]
    assert small.value is None and small.known
    assert small.assumed == 0.1
    assert small.at_most == pytest.approx(0.1 + 1.96 * 0.1)
    assert small.reason is not None and "not significantly different from 0" in small.reason


def test_rotary_units() -> None:
    found = estimates(VALUES, spread(0.01), PLENTY, Rig("force", motion="rotary"), "log")
    assert found["m"].unit == "kg m^2"
    assert found["dv_p"].unit == "rad/s"


def test_next_to_nothing_is_no_friction_however_narrow_its_interval() -> None:
    tiny = VALUES | {"F_cp": 1e-6, "dv_p": 1e-8}
    sd = {name: 1e-3 * abs(value) for name, value in tiny.items()}
    pulled = Events((10, 10), (10, 10), (1000, 1000), (0.5, 0.5), force=20.0)
    found = estimates(tiny, sd, pulled, Rig("force"), "log")
    for name in ("F_cp", "dv_p"):
        assert found[name].value is None
        assert "not significantly different from 0" in (found[name].reason or "")
    assert found["F_cn"].value == tiny["F_cn"]


def test_a_stick_limit_no_higher_than_the_coulomb_level_is_none_nor_is_its_band() -> None:
    values = {**VALUES, "F_sn": -0.9 * VALUES["F_cn"]}
    found = estimates(values, spread(0.01), PLENTY, Rig("force"), "log")
    for name in ("F_sn", "dv_n"):
        assert found[name].value is None
        assert "no F_sn above the Coulomb level" in (found[name].reason or "")
    assert found["F_sp"].value is not None
    assert found["dv_p"].value is not None


def test_an_interval_of_a_stick_limit_ends_at_the_coulomb_level() -> None:
    values = {**VALUES, "F_sn": -VALUES["F_cn"]}
    found = estimates(values, {**spread(0.01), "F_sn": 0.1 * VALUES["F_cn"]}, PLENTY, Rig("force"),
                      "log")["F_sn"]  # fmt: skip
    assert found.high == pytest.approx(-(1.0 - 1.96 * 0.01) * VALUES["F_cn"], rel=1e-3)
