"""Reasons of a fit by the equation of motion alone."""

import numpy as np
import pytest

from identification.estimation.prescribed_motion import _reasoned as reasoned
from identification.estimation.prescribed_motion import fit_prescribed, way_of
from identification.estimation.recorded_logs import recorded_logs
from identification.log import Log, Rig


def test_a_direction_in_which_nothing_moved_is_not_said_to_need_no_friction() -> None:
    """A wheel whose speed is controlled, and never turns back."""
    t = np.arange(2000, dtype=np.float64) * 2e-3
    v = 20.0 * (1.0 - np.exp(-t / 0.1)) + 4.0 * np.sin(9.0 * t) * (t > 0.3)
    y = np.cumsum(v) * 2e-3 + 1e-4 * np.random.default_rng(0).standard_normal(len(t))
    F = 0.14 * np.gradient(v, 2e-3) + 30.0 + 1.1 * v
    fit = fit_prescribed(
        recorded_logs([Log("wheel", {"t": t, "y": y, "F": F})], Rig("force"), "force"), "why"
    )
    for name in ("F_cn", "F_vn"):
        assert "0 samples of sliding in the negative direction" in str(fit.estimates[name].reason)


def test_a_wheel_of_one_speed_has_the_force_that_it_was_logged_with() -> None:
    """Level and slope are one there: fitted together they were -0.1 and 0.055, of which a level
    below 0 was then left out, and twice the force predicted."""
    rng = np.random.default_rng(4)
    t = np.arange(6000, dtype=np.float64) * 1e-3
    v = 5.0 + 0.2 * np.sin(40.0 * t)
    y = np.cumsum(v) * 1e-3 + 1e-5 * rng.standard_normal(len(t))
    F = 0.15 + 2e-4 * np.gradient(v, 1e-3) - 0.02 * (v - 5.0) + 0.03 * rng.standard_normal(len(t))
    fit = fit_prescribed(
        recorded_logs([Log("wheel", {"t": t, "y": y, "F": F})], Rig("force"), "force"), "why"
    )
    predicted = fit.friction.F_cp + 5.0 * fit.friction.F_vp
    assert abs(predicted - 0.15) < 0.01


@pytest.mark.parametrize(
    ("share", "said"), [(0.87, "as well without"), (4e-3, "0.4% of the force")]
)
def test_a_mass_is_not_withheld_for_an_inertia_of_account(share: float, said: str) -> None:
    """That inertia explains 87 % of the force was given as the reason for no mass."""
    t = np.arange(2000, dtype=np.float64) * 2e-3
    log = Log("lift", {"t": t, "y": 0.1 * np.sin(9.0 * t), "F": np.cos(9.0 * t)})
    recorded = recorded_logs([log], Rig("force"), "force")
    assert said in str(reasoned({}, np.ones(9), share, recorded)["m"].reason)


def test_a_mass_that_the_equation_does_without_is_slight_in_any_motion() -> None:
    """Even strokes, in whose wide windows hardly anything accelerates: 20 kg were slight there, and
    took 18 % of the force of the same motion where it was smoothed less."""
    h, rng = 0.01, np.random.default_rng(1)
    v = np.tile(np.repeat([14e-3, -14e-3], 300), 6)
    F = np.where(v > 0.0, 6.0, -4.0) + 0.1 * rng.standard_normal(len(v))
    y = h * np.cumsum(v) + 1e-5 * rng.standard_normal(len(v))
    log = Log("seal", {"t": h * np.arange(len(v), dtype=np.float64), "y": y, "F": F})
    fit = fit_prescribed(recorded_logs([log], Rig("force"), "force"), "why")
    assert fit.estimates["m"].value is None
    jerk = float(np.max(np.abs(np.diff(v)))) / h  # a reversal from one sample to the next
    assert fit.friction.m * jerk < 0.01 * 5.0


def test_jerks_back_before_slow_passes_make_no_motion_both_ways() -> None:
    """0.6 s of 20 go down, each time too briefly for a window of sliding."""
    t = np.arange(10_000, dtype=np.float64) * 2e-3
    v = np.where((t < 3.0) & (t % 0.25 < 0.05), -1.0, 0.5)
    y = np.cumsum(v) * 2e-3 + 1e-5 * np.random.default_rng(0).standard_normal(len(t))
    assert way_of([Log("slow", {"t": t, "y": y, "F": 0.4 + 0.1 * v})], zoh=False) is True
    quick = 0.5 * np.sin(2.0 * np.pi * 8.0 * t)
    assert way_of([Log("quick", {"t": t, "y": quick, "F": quick})], zoh=False) is None
