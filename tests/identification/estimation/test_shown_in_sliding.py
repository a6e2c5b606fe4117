"""What a log's sliding does not show becomes a reason; what it shows stays."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from benchmarks.drives_rig import make
from identification.arrays import Array
from identification.estimation.fit import fit_plant
from identification.estimation.prescribed_motion import fit_prescribed
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.shown_in_sliding import as_sliding_shows
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.model.karnopp import Karnopp
from identification.model.plant import Plant
from identification.simulation.free_run import free_run

H = 2e-3
M, F_CP, F_CN, F_VP, F_VN = 5.0, 16.0, 14.0, 22.0, 19.0


def fitted(speeds: Array, turning: float) -> KarnoppFit:
    """The fit of strokes at these speeds [m/s], of half a second each; turning: samples in which
    the body turns back."""
    return of_velocity(gaussian_filter1d(np.repeat(speeds, 250), turning))


def of_velocity(v: Array, stiffness: float = 0.0, mass: float = M) -> KarnoppFit:
    """The fit of a body of this velocity [m/s] and mass [kg] on a spring [N/m]."""
    y, a = np.cumsum(v) * H, np.gradient(v, H)
    F = mass * a + np.where(v > 0, F_CP + F_VP * v, -F_CN + F_VN * v) + stiffness * y
    rng = np.random.default_rng(0)
    t = H * np.arange(len(v), dtype=np.float64)
    F, y = F + 0.2 * rng.standard_normal(len(v)), y + 1e-7 * rng.standard_normal(len(v))
    recorded = recorded_logs(
        [Log("run.csv", {"t": t, "y": np.asarray(y), "F": np.asarray(F)})], Rig("force"), "force"
    )
    return as_sliding_shows(fit_prescribed(recorded, "why"), recorded)


def test_one_speed_both_ways_shows_a_sum_alone() -> None:
    found = fitted(0.25 * np.resize([1.0, -1.0], 40), 2.0).estimates
    assert all(found[name].value is None for name in ("m", "F_cp", "F_cn", "F_vp", "F_vn"))
    assert found["F_cp"].reason == found["F_vp"].reason
    sums = f"{F_CP + 0.25 * F_VP:.3g} N", f"{F_CN + 0.25 * F_VN:.3g} N"
    for name, force in zip(("F_cp", "F_cn"), sums, strict=True):
        reason = found[name].reason or ""
        assert "one speed, 250 mm/s" in reason and force in reason and "other speeds" in reason
    assert "the mass is not identifiable" in (found["m"].reason or "")


def test_a_slope_of_speeds_nearly_alike_is_not_stated_where_no_inertia_shows() -> None:
    """Strokes of a rig at 0.2 to 0.3 m/s: whatever else differs from one to the next, as the place
    or the pressure of a seal's test stand, would be taken for viscous friction."""
    speeds = (0.25 + 0.05 * np.sin(np.arange(40.0))) * np.resize([1.0, -1.0], 40)
    v = gaussian_filter1d(np.repeat(speeds, 250), 2.0)
    found = of_velocity(v, mass=0.0).estimates
    assert found["m"].value is None
    for name in ("F_vp", "F_vn"):
        assert found[name].value is None
        assert "together alone" in (found[name].reason or "")


@pytest.mark.parametrize("turning", [2.0, 40.0])
def test_strokes_at_several_speeds_show_friction(turning: float) -> None:
    found = fitted(np.resize([0.05, -0.05, 0.1, -0.1, 0.3, -0.3], 42), turning).estimates
    for name, value in zip(("F_cp", "F_cn", "F_vp", "F_vn"), (F_CP, F_CN, F_VP, F_VN), strict=True):
        assert found[name].value == pytest.approx(value, rel=0.1)
    assert (found["m"].value is None) == (turning < 10.0)


def test_one_speed_reached_on_slow_ramps_shows_all_five() -> None:
    found = fitted(0.25 * np.resize([1.0, -1.0], 40), 40.0).estimates
    assert found["m"].value == pytest.approx(M, rel=0.05)
    assert found["F_cp"].value == pytest.approx(F_CP, rel=0.1)
    assert found["F_vp"].value == pytest.approx(F_VP, rel=0.3)


def test_a_mass_of_next_to_no_inertia_is_none() -> None:
    found = fitted(np.resize([0.001, -0.001, 0.004, -0.004], 40), 10.0)
    stated = found.estimates["m"]
    assert stated.value is None
    assert "inertia explains" in (stated.reason or "")


def test_a_mass_in_one_sine_is_a_springs_too() -> None:
    t = H * np.arange(10_000)
    one = 0.3 * np.minimum(t, 1.0) * np.cos(5.0 * t)
    two = one + 0.2 * np.cos(13.0 * t)
    found = of_velocity(one, stiffness=40.0).estimates
    assert found["m"].value is None
    reason = found["m"].reason or ""
    assert "any spring" in reason and "several frequencies" in reason
    assert found["F_vp"].value is not None
    assert of_velocity(one).estimates["m"].value == pytest.approx(M, rel=0.05)
    assert of_velocity(two).estimates["m"].value == pytest.approx(M, rel=0.05)


RUNS_BY = Karnopp(2.0, 4.0, 4.0, 10.0, 10.0, 0.005, -0.005, 5.0, -5.0)


def by_a_force_that_is_noisy_in_motion(seed: int) -> Log:
    """A body driven by the measured force, whose sensor is quiet for a quarter, at rest."""
    h, n, rng = 1e-3, 6000, np.random.default_rng(seed)
    t = h * np.arange(n, dtype=np.float64)
    slow, quick = rng.uniform(0, 6, 2)
    F = 12.0 * np.sin(1.8 * np.pi * t + slow) + 6.0 * np.sin(4.6 * np.pi * t + quick)
    F[:1500] = 1.0
    blank = Log("noisy.csv", {"t": t, "y": np.zeros(n), "F": F})
    run = free_run(Plant(RUNS_BY), blank, (0.0, 0.0, 1.0), "force")
    noise = rng.standard_normal((2, n))
    return blank.with_signals(
        y=run.y + 2e-6 * noise[0], F=F + np.where(t < 1.5, 0.01, 0.3) * noise[1]
    )


def test_noise_of_the_force_that_is_larger_in_motion_widens_what_the_run_gives() -> None:
    """The quiet part alone shows the noise; the equation leaves thirty times as much."""
    log = by_a_force_that_is_noisy_in_motion(0)
    found = fit_plant([log], np.random.default_rng(0), rig=Rig("force")).estimates
    for name in ("m", "F_cp", "F_cn", "F_vp"):
        one = found[name]
        assert one.low is not None and one.high is not None
        assert one.low < getattr(RUNS_BY, name) < one.high


@pytest.mark.slow
@pytest.mark.parametrize(("family", "seed"), [("force", 1306), ("motor", 1301)])
def test_a_mass_is_as_unsure_as_the_instants_of_the_force(family: str, seed: int) -> None:
    """A measured force that lags by half a period, and a command whose loop is four times faster
    than its log: what viscous friction makes of either is mass."""
    made = make(family, ("none",), seed, 0.2)
    one = fit_plant([made.train], np.random.default_rng(0), rig=made.machine.rig).estimates["m"]
    assert one.value is not None and one.sd is not None
    assert abs(one.value - made.machine.nine.m) < 3.0 * one.sd < 0.04 * one.value
