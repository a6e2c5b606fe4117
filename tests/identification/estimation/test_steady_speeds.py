"""Logs of steps that no run follows: friction from their steady speeds, the mass as they settle."""

import numpy as np
import pytest

from identification.errors import NotIdentifiable
from identification.estimation.fit import fit_plant
from identification.estimation.prescribed_motion import (
    STRAIGHT_WHY,
    UNSETTLED,
    fit_by_steady_speeds,
)
from identification.estimation.recorded_logs import recorded_logs
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit

RIG = Rig("motor", force_per_command=1.0, motion="rotary")
TRUE = {"m": 0.75, "F_cp": 8.5, "F_cn": 8.0, "F_vp": 8.3, "F_vn": 8.6}
BOTH = (40.0, 60.0, 100.0, -40.0, -60.0, -100.0)
COUNT = np.deg2rad(1.0)


def motor(
    u: float, rng: np.random.Generator, ripple: float = 0.0, bent: float = 0.0, count: float = COUNT
) -> Log:
    """A motor by a constant command from rest, after up to 20 ms, in counts [rad] every 6 ms.

    ripple: of its speed over a third of a turn [rad/s]; bent: force of speed squared [N m s2/rad2].
    """
    level, viscous = (8.5, 8.3) if u > 0.0 else (8.0, 8.6)
    y, v, out, phase = 0.0, 0.0, [], rng.uniform(0.0, 6.3)
    late, step = rng.uniform(0.0, 0.02), 2e-4
    for k in range(round(1.0 / step)):
        if k * step >= late:
            force = abs(u) - level - viscous * v - bent * v * v
            v += step * (force + 8.5 * ripple * np.sin(3.0 * y + phase)) / 0.75
            y += step * v
        if k % 30 == 0:
            out.append(np.sign(u) * y)
    t = np.arange(len(out), dtype=np.float64) * 6e-3
    counts = np.floor(np.array(out) / count) * count
    held = np.full(len(t), u)
    return Log(f"by {u:g}", {"t": t, "y": counts, "u": held, "F": held})


def steady(levels: tuple[float, ...], seed: int, **hidden: float) -> KarnoppFit | None:
    """The fit by steady speeds of logs of these levels."""
    rng = np.random.default_rng(seed)
    recorded = recorded_logs([motor(u, rng, **hidden) for u in levels], RIG)
    return fit_by_steady_speeds(recorded, "no run")


def held(fit: KarnoppFit | None) -> dict[str, bool]:
    """Whether the interval of each parameter that is given holds the truth."""
    assert fit is not None
    given = {name: fit.estimates[name] for name in TRUE}
    return {
        name: one.low < TRUE[name] < one.high
        for name, one in given.items()
        if one.low is not None and one.high is not None
    }


@pytest.mark.parametrize("levels", [BOTH, (30.0, 80.0, -30.0, -80.0)])
def test_intervals_of_friction_and_mass_hold_the_truth(levels: tuple[float, ...]) -> None:
    every = [hit for seed in range(6) for hit in held(steady(levels, seed)).items()]
    assert len(every) == 30 and sum(hit for _, hit in every) >= 27


@pytest.mark.parametrize("ripple", [0.1, 0.2])
def test_a_ripple_that_the_law_has_not_widens_them(ripple: float) -> None:
    found = [fit for seed in range(6) if (fit := steady(BOTH, seed, ripple=ripple))]
    every = [hit for fit in found for hit in held(fit).values()]
    assert len(every) >= 24 and sum(every) >= 0.9 * len(every)
    assert all(fit.chi_square > 1.1 for fit in found)


def test_friction_that_bends_with_speed_is_seen_by_three_levels() -> None:
    """Not by two, of which it is said that a straight line is assumed."""
    fit = steady(BOTH, 0, bent=0.1)
    assert fit is not None and fit.estimates["F_cp"].value is None
    assert STRAIGHT_WHY not in fit.remarks
    two = steady((30.0, 80.0, -30.0, -80.0), 0, bent=0.1)
    assert two is not None and STRAIGHT_WHY in two.remarks


def test_one_level_of_a_direction_is_both_terms_together() -> None:
    fit = steady((40.0, 60.0, 100.0, -60.0), 0)
    assert fit is not None and fit.estimates["F_vp"].value is not None
    for name in ("F_cn", "F_vn"):
        reason = fit.estimates[name].reason
        assert reason is not None and "F_cn and F_vn together alone, 60 N m" in reason
    assert steady((40.0, 41.0, -60.0), 0) is None


def test_a_log_that_does_not_settle_is_left_out_and_said() -> None:
    rng = np.random.default_rng(0)
    logs = [motor(u, rng) for u in BOTH]
    t = logs[0]["t"]
    logs.append(logs[2].with_signals(y=40.0 * t**2))
    fit = fit_by_steady_speeds(recorded_logs(logs, RIG), "no run")
    assert fit is not None and len(fit.logs) == 6
    assert f"{logs[-1].name}: {UNSETTLED}" in fit.remarks


def test_where_no_run_follows_the_steady_speeds_answer() -> None:
    """As of a LEGO motor by constant duty, off by 92 times its encoder's noise, in square."""
    rng = np.random.default_rng(3)
    logs = [motor(u, rng, ripple=0.6, count=2e-3) for u in BOTH]
    fit = fit_plant(logs, np.random.default_rng(0), rig=RIG)
    assert fit.prescribed and not fit.adequate and "steady speeds" in fit.remarks[0]
    assert fit.estimates["F_vp"].value == pytest.approx(8.3, rel=0.1)
    one_way = fit_plant([logs[0], logs[2]], np.random.default_rng(0), rig=RIG)
    reason = one_way.estimates["F_cp"].reason
    assert reason is not None and "any constant force together" in reason
    with pytest.raises(NotIdentifiable, match="constant"):
        fit_plant(logs[:1], np.random.default_rng(0), rig=RIG)
