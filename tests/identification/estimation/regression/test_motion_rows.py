"""Windows of sliding whose width the logs choose, and which terms of friction hold in them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from design.simulated.record import record
from identification.arrays import Array
from identification.estimation.prescribed_motion import fit_prescribed
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.regression.equation_rows import FIVE, MotionLog
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.regression.motion_rows import (
    HALF_WIDTHS,
    converged_rows,
    rows_and_windows,
    rows_of_width,
    without_reversals,
)
from identification.estimation.regression.weighted_rows import solve_rows
from identification.log import Log, Rig
from identification.model.karnopp import Karnopp
from tests.chain import short_recipe

H = 1e-3
NONE = np.array([1.0, 0.0, 0.0, 0.0, 0.0])


def swinging(
    five: tuple[float, float, float, float, float], *, hz: float = 1.0, noise_y: float = 0.0,
    noise_F: float = 0.0, seconds: float = 12.0, seed: int = 0,
) -> Log:  # fmt: skip
    """A body driven along two sines, its force that of m, F_cp, F_cn, F_vp, F_vn alone."""
    t = H * np.arange(round(seconds / H), dtype=np.float64)
    w = 2.0 * np.pi * hz
    y = 0.05 * np.sin(w * t) + 0.02 * np.sin(2.3 * w * t)
    v = w * (0.05 * np.cos(w * t) + 0.046 * np.cos(2.3 * w * t))
    a = -(w**2) * (0.05 * np.sin(w * t) + 0.02 * 2.3**2 * np.sin(2.3 * w * t))
    m, F_cp, F_cn, F_vp, F_vn = five
    F = m * a + np.where(v > 0, F_cp + F_vp * v, -F_cn + F_vn * v)
    rng = np.random.default_rng(seed)
    noisy = y + noise_y * rng.standard_normal(len(t)), F + noise_F * rng.standard_normal(len(t))
    return Log("swings", {"t": t, "y": noisy[0], "F": noisy[1]})


def moved(log: Log) -> MotionLog:
    return motion_log(log, zoh=False, by_command=False)


def by_least_squares(log: Log) -> Array:
    return solve_rows(rows_and_windows([moved(log)], NONE)[0].rows).theta


@settings(max_examples=12, deadline=None)
@given(
    m=st.floats(0.5, 5.0),
    F_cp=st.floats(1.0, 10.0),
    F_cn=st.floats(1.0, 10.0),
    F_vp=st.floats(2.0, 20.0),
    F_vn=st.floats(2.0, 20.0),
)
def test_the_rows_are_the_equation_of_motion(
    m: float, F_cp: float, F_cn: float, F_vp: float, F_vn: float
) -> None:
    """Within reversals too: a window knows how long the body went each way."""
    truth = m, F_cp, F_cn, F_vp, F_vn
    assert by_least_squares(swinging(truth)) == pytest.approx(truth, rel=5e-3)


def test_windows_widen_with_noise_and_narrow_with_quick_motion() -> None:
    truth = 1.0, 4.0, 3.0, 8.0, 6.0

    def length(log: Log) -> int:
        (made,) = rows_and_windows([moved(log)], NONE)
        return made.windows.length

    quiet, noisy = swinging(truth), swinging(truth, noise_F=2.0, noise_y=2e-5)
    quick = swinging(truth, hz=8.0)
    assert length(noisy) > length(quiet)
    assert length(quick) <= length(quiet)
    found = by_least_squares(noisy)
    assert found[[0, 1, 2]] == pytest.approx([1.0, 4.0, 3.0], rel=0.05)


def test_reversals_of_friction_of_sliding_alone_stay() -> None:
    truth = 1.0, 4.0, 3.0, 8.0, 6.0
    for hz in (1.0, 8.0):  # few of the windows hold reversals, and nearly all
        rows = rows_and_windows([moved(swinging(truth, hz=hz, noise_F=0.01))], NONE)
        assert without_reversals(rows)[0] is rows[0]


@pytest.mark.parametrize("seed", [401, 404])
def test_reversals_in_which_a_body_sticks_are_left_out(seed: int) -> None:
    """Table 1's rig sticks at 1.7 times its Coulomb friction."""
    _, recipe = short_recipe(12.0)
    (one,) = recorded_logs([record("made", recipe, seed)], Rig("force"), "force").logs
    rows = converged_rows([one])
    (kept,) = without_reversals(rows)
    assert len(kept.windows.middle) == len(kept.rows.b) < len(rows[0].rows.b)
    found, bent = (solve_rows(part.rows).theta for part in (kept, rows[0]))
    assert np.all(np.abs(found[[1, 2]] / (12.0, 15.0) - 1.0) < 0.01)
    assert np.max(np.abs(bent[[1, 2]] / (12.0, 15.0) - 1.0)) > 0.01


def test_rows_within_the_band_of_a_plant_are_known() -> None:
    log = swinging((1.0, 4.0, 3.0, 8.0, 6.0))
    made = rows_of_width(moved(log), HALF_WIDTHS[0], NONE)
    wide = Karnopp(1.0, 4.0, 3.0, 8.0, 6.0, 0.2, -0.2, 5.0, -4.0)
    narrow = Karnopp(1.0, 4.0, 3.0, 8.0, 6.0, 1e-6, -1e-6, 5.0, -4.0)
    assert np.all(made.outside(narrow))
    some = made.outside(wide)
    assert 0 < np.count_nonzero(some) < len(some)
    assert np.all(made.rows.speed[some] > 0.19)


def reported(log: Log) -> dict[str, float | None]:
    fit = fit_prescribed(recorded_logs([log], Rig("force"), "force"), "prescribed")
    return {name: fit.estimates[name].value for name in FIVE}


def test_friction_that_falls_with_speed_is_found_but_called_no_viscous_friction() -> None:
    log = swinging((0.0, 9.0, 5.0, -12.0, 0.0), noise_F=0.1)
    fit = fit_prescribed(recorded_logs([log], Rig("force"), "force"), "prescribed")
    up, down = fit.estimates["F_vp"], fit.estimates["F_vn"]
    assert up.value is None and up.assumed == 0.0
    assert fit.falling.keys() == {"F_cp", "F_vp"}
    assert fit.falling["F_vp"].value == pytest.approx(-12.0, rel=0.05)
    assert "falls with speed" in str(up.reason)
    assert down.value is None and "constant friction predicts as much" in str(down.reason)
    assert fit.falling["F_cp"].value == pytest.approx(9.0, rel=0.02)  # at rest
    logged = fit.estimates["F_cp"]  # at speeds from 0 to 0.6 m/s, over which it falls to 2 N
    assert logged.value is None and logged.assumed == pytest.approx(5.9, rel=0.05)
    assert fit.estimates["F_cn"].value == pytest.approx(5.0, rel=0.02)
    assert fit.friction.F_vp == 0.0  # what drives a body is not simulated


def test_terms_that_predict_nothing_are_left_out() -> None:
    plain = reported(swinging((0.0, 4.0, 3.0, 0.0, 0.0), noise_F=0.2))
    assert plain["F_cp"] == pytest.approx(4.0, rel=0.01)
    assert plain["F_vp"] is None and plain["m"] is None
    whole = reported(swinging((2.0, 4.0, 3.0, 8.0, 6.0), noise_F=0.2))
    assert [whole[name] for name in FIVE] == pytest.approx([2.0, 4.0, 3.0, 8.0, 6.0], rel=0.03)


def test_viscous_friction_takes_no_coulomb_friction_below_nothing() -> None:
    """At speeds alike a steep line through them stands for whatever else varies."""
    log = swinging((0.0, -1.0, -1.0, 30.0, 30.0), noise_F=0.2)
    fit = fit_prescribed(recorded_logs([log], Rig("force"), "force"), "prescribed")
    assert fit.estimates["F_vp"].value is None and fit.estimates["F_vn"].value is None
    assert (fit.friction.F_vp, fit.friction.F_vn) == (0.0, 0.0)
    assert min(fit.friction.F_cp, fit.friction.F_cn) > 1.0  # the level at these speeds


def test_noise_of_the_position_costs_no_mass() -> None:
    """Where more than noise is left in windows of any width, narrow ones leave hardly more, but
    their accelerations are noise."""
    log = swinging((1.0, 200.0, 200.0, 0.0, 0.0), hz=2.0, noise_y=4e-5)
    log = log.with_signals(F=log["F"] + 60.0 * np.sin(1.1 * log["t"]))
    narrow = solve_rows(rows_of_width(moved(log), HALF_WIDTHS[0], NONE).rows).theta
    assert narrow[0] < 0.9
    assert by_least_squares(log)[0] == pytest.approx(1.0, abs=0.05)


def test_a_log_of_few_samples_has_windows_of_few() -> None:
    whole = swinging((1.0, 4.0, 3.0, 8.0, 6.0), hz=1.5)
    slow = Log("slow", {name: x[::20] for name, x in whole.signals.items()})
    (made,) = rows_and_windows([moved(slow)], NONE)
    assert made.windows.length == 2 * HALF_WIDTHS[0]
    assert by_least_squares(slow)[:3] == pytest.approx([1.0, 4.0, 3.0], rel=0.02)
