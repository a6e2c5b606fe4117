"""Repair, checks, even clock, F_e, velocity and filters."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.arrays import Array
from identification.errors import BadLog, BadSpecification
from identification.log import Log, Rig
from identification.signals.check import work_share
from identification.signals.clean import applied_force, check, limits, prepare, repair
from identification.signals.differentiate import resolution
from identification.signals.even_clock import even_clock, rows_lost
from identification.signals.filters import RIG_A, RIG_C, apply_filter, fir_lowpass, velocity

RIG = Rig(kind="force", stroke=(-0.2, 0.2))


def sliding_log(n: int = 2000, h: float = 0.01, t: Array | None = None) -> Log:
    """A body of 1 kg driven to and fro at 0.5 Hz against 10 N of Coulomb friction."""
    if t is None:
        t = h * np.arange(n, dtype=np.float64)
    w = np.pi
    y, v = 0.1 * np.sin(w * t), 0.1 * w * np.cos(w * t)
    return Log("run", {"t": t, "y": y, "F": 10.0 * np.sign(v) - 0.1 * w**2 * np.sin(w * t)})


def test_a_sound_log_passes_and_stays_bit_identical() -> None:
    log = sliding_log()
    check(log, RIG)
    prepared = prepare(log, RIG)
    assert prepared.runs[0] is log
    assert prepared.remarks == ()


@pytest.mark.parametrize("start", [0.0, -3.0, 1e6])
def test_rounded_even_clock_is_not_touched(start: float) -> None:
    t = start + np.round(0.001 * np.arange(500, dtype=np.float64), 6)
    assert even_clock(sliding_log(t=t))[0]["t"] is not None
    assert np.array_equal(even_clock(sliding_log(t=t))[0]["t"], t)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**31), st.floats(1e-4, 1.0), st.floats(0.01, 0.45))
def test_jittered_clock_becomes_even_and_keeps_lines_and_range(
    seed: int, h: float, jitter: float
) -> None:
    rng = np.random.default_rng(seed)
    t = h * (np.arange(300, dtype=np.float64) + rng.uniform(-jitter, jitter, 300))
    values = rng.normal(size=300)
    log = Log("run", {"t": t, "y": 3.0 * t - 1.0, "F": values})
    (run,) = even_clock(log)
    assert np.ptp(np.diff(run["t"])) < 1e-9 * h * 300
    assert run["t"][0] == t[0]
    # The period is the median one, by jitter and rounding a little more or less than h.
    assert t[-1] - h < run["t"][-1] + 1e-2 * h
    np.testing.assert_allclose(run["y"], 3.0 * run["t"] - 1.0, atol=1e-9 * h * 300)
    assert values.min() <= run["F"].min()
    assert run["F"].max() <= values.max()


def moved(n: int, count: float = 0.0, h: float = 0.002) -> dict[str, Array]:
    """Signals of a body that swings, every h [s]; its position in whole counts [m], if any."""
    t = h * np.arange(n, dtype=np.float64)
    y = 0.1 * np.sin(3.0 * t)
    return {"t": t, "y": count * np.rint(y / count) if count else y, "F": np.cos(3.0 * t)}


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**31), st.floats(0.02, 0.2), st.sampled_from([0.0, 1e-5]))
def test_lost_rows_are_put_back_where_they_were(seed: int, share: float, count: float) -> None:
    whole = moved(600, count)
    kept = np.random.default_rng(seed).random(600) >= share
    kept[[0, -1]] = True
    kept[3::5] = True  # no gap is long enough to cut the log
    (run,) = even_clock(Log("run", {k: x[kept] for k, x in whole.items()}))
    assert run.lost is not None and np.array_equal(run.lost, ~kept)
    np.testing.assert_allclose(run["t"], whole["t"], atol=1e-9)
    assert np.array_equal(run["F"][kept], whole["F"][kept])
    np.testing.assert_allclose(run["y"], whole["y"], atol=2e-9 + 1.01 * count)
    assert resolution(run["y"]) == pytest.approx(count, rel=1e-6)


def test_a_clock_that_jitters_has_lost_no_rows() -> None:
    signals = moved(400)
    signals["t"] = signals["t"] + 1e-4 * np.random.default_rng(0).uniform(-1.0, 1.0, 400)
    (run,) = even_clock(Log("run", signals))
    assert run.lost is None


def test_rows_are_lost_between_gaps_and_not_in_them() -> None:
    """A piece of three rows, one of them lost beside it, is no run, and no fault."""
    whole = moved(1200)
    kept = np.ones(1200, dtype=bool)
    kept[500:600] = kept[603:700] = kept[601] = kept[50] = False
    log = Log("run", {k: x[kept] for k, x in whole.items()})
    assert [len(run) for run in even_clock(log)] == [500, 500]
    assert rows_lost(log["t"], log.h) == 2
    assert rows_lost(np.where(kept[kept], np.nan, log["t"]), log.h) == 0
    assert rows_lost(np.array([0.0]), 0.0) == 0


def test_the_share_of_lost_rows_is_reported_and_follows_the_log() -> None:
    kept = np.arange(1000) % 10 != 7
    log = sliding_log(n=1000)
    log = Log("run", {k: x[kept] for k, x in log.signals.items()})
    prepared = prepare(log, Rig("force"))
    assert any("10 % of its rows are lost" in one for one in prepared.remarks)
    lost = prepared.runs[0].part(0, 100).with_signals(F=np.zeros(100)).lost
    assert lost is not None and np.count_nonzero(lost) == 10


def test_no_spike_is_seen_where_rows_are_lost() -> None:
    whole = moved(2000, 1e-6)
    kept = np.ones(2000, dtype=bool)
    kept[[500, 501, 502, 900, 1300, 1301]] = False
    repaired = repair(Log("run", {k: x[kept] for k, x in whole.items()}))
    assert not [one for one in repaired.bad if one.kind == "spike"]


def test_a_bridged_sample_stays_on_the_counts_of_its_sensor() -> None:
    signals = moved(2000, 1e-5)
    signals["y"][[400, 1400]] = np.nan
    repaired = repair(Log("run", signals))
    assert resolution(repaired.log["y"]) == pytest.approx(1e-5, rel=1e-6)


def test_steps_of_position_and_command_do_not_ring_and_a_switch_is_held() -> None:
    rng = np.random.default_rng(1)
    t = 0.01 * (np.arange(400, dtype=np.float64) + rng.uniform(-0.3, 0.3, 400))
    step = np.where(t < 2.0, 0.0, 1.0)
    steps3 = step + np.where(t < 3.0, 0.0, 1.0)
    (run,) = even_clock(Log("run", {"t": t, "y": steps3, "u": steps3, "on": step}))
    assert set(run["on"]) == {0.0, 1.0}
    for key in ("y", "u"):
        assert np.all(np.diff(run[key]) >= 0.0)
        assert np.sum((run[key] % 1.0) != 0.0) <= 4


@settings(max_examples=25, deadline=None)
@given(st.sets(st.integers(1, 8), max_size=5))
def test_gaps_cut_the_log_and_short_runs_are_left_out(cuts: set[int]) -> None:
    h, t = 0.01, 0.01 * np.arange(1000, dtype=np.float64)
    for cut in cuts:
        t[cut * 105 :] += 20 * h
    runs = even_clock(sliding_log(t=t))
    assert len(runs) == len(cuts) + 1
    assert sum(len(run) for run in runs) == 1000


def test_runs_all_too_short_are_refused() -> None:
    t = 0.01 * np.arange(300, dtype=np.float64) + 0.5 * np.floor(
        np.arange(300, dtype=np.float64) / 50
    )
    with pytest.raises(BadLog, match="leave no run of 100 samples"):
        even_clock(sliding_log(t=t))


def test_gap_and_jitter_are_remarked() -> None:
    rng = np.random.default_rng(2)
    t = 0.01 * (np.arange(1000, dtype=np.float64) + rng.uniform(-0.2, 0.2, 1000))
    t[500:] += 0.3
    prepared = prepare(sliding_log(t=t), RIG)
    assert len(prepared.runs) == 2
    assert "uneven clock" in prepared.remarks[0]
    assert "2 runs" in prepared.remarks[1]


def test_isolated_nan_is_filled_and_remarked() -> None:
    log = sliding_log()
    y = log["y"].copy()
    y[[100, 500, 501]] = np.nan
    repaired, remarks, _ = repair(log.with_signals(y=y))
    np.testing.assert_allclose(repaired["y"], log["y"], atol=1e-4)
    assert remarks == ("run: 3 isolated missing samples of 'y' interpolated",)


@pytest.mark.parametrize("rows", [[0], [1999], range(7), [0, 1, 1998, 1999]])
def test_rows_without_a_value_at_the_ends_are_left_out(rows: list[int]) -> None:
    log = sliding_log()
    for bad in (np.nan, np.inf):
        F = log["F"].copy()
        F[list(rows)] = bad
        repaired, remarks, found = repair(log.with_signals(F=F), first_row=2)
        kept = np.setdiff1d(np.arange(2000), rows)
        np.testing.assert_array_equal(repaired["t"], log["t"][kept])
        assert f"{len(rows)} rows at the log's ends" in remarks[0]
        assert not found


@pytest.mark.parametrize(("name", "every"), [("F", 20), ("y", 20), ("u", 100)])
def test_rows_without_a_value_count_as_lost(name: str, every: int) -> None:
    """A command that is missing, or more than a hundredth of another signal."""
    log = sliding_log().with_signals(u=sliding_log()["F"])
    x = log[name].copy()
    x[10:1900:every] = np.nan
    made = prepare(log.with_signals(**{name: x}), RIG)
    (run,) = made.runs
    assert run.lost is not None
    np.testing.assert_array_equal(np.flatnonzero(run.lost), np.arange(10, 1900, every))
    assert f"{len(range(10, 1900, every))} rows without a value of '{name}'" in made.remarks[0]
    np.testing.assert_allclose(run["y"], log["y"], atol=1e-4)


def test_too_many_missing_samples_are_refused_with_their_row() -> None:
    log = sliding_log()
    F = log["F"].copy()
    F[10:1900:8] = np.nan
    with pytest.raises(BadLog, match="in 12% of the rows, first in row 12"):
        repair(log.with_signals(F=F), first_row=2)


def test_time_that_goes_back_or_repeats_is_refused_with_its_row() -> None:
    t = 0.01 * np.arange(200, dtype=np.float64)
    t[50] = t[49]
    with pytest.raises(BadLog, match="time repeats in row 52"):
        check(sliding_log(t=t), RIG, first_row=2)
    t[50] = t[40]
    with pytest.raises(BadLog, match="time goes back in row 51"):
        check(sliding_log(t=t), RIG)
    t[50] = np.nan
    with pytest.raises(BadLog, match="time in row 51 is not a number"):
        check(sliding_log(t=t), RIG)


def test_too_short_constant_and_out_of_stroke_are_refused() -> None:
    log = sliding_log()
    with pytest.raises(BadLog, match="99 samples, at least 100"):
        check(log.part(0, 99), RIG)
    with pytest.raises(BadLog, match="position is constant"):
        check(log.with_signals(y=np.full(len(log), 0.1)), RIG)
    with pytest.raises(BadLog, match="stroke"):
        check(log.with_signals(y=1000.0 * log["y"]), RIG)


def test_wrong_sign_and_swap_are_distinguished() -> None:
    log = sliding_log(n=4000)
    no_stroke = Rig(kind="force")
    with pytest.raises(BadLog, match="wrong sign"):
        check(log.with_signals(F=-log["F"]), no_stroke)
    with pytest.raises(BadLog, match="look swapped"):
        check(Log("run", {"t": log["t"], "y": log["F"], "F": log["y"]}), no_stroke)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.0, 100.0), st.floats(0.0, 1000.0), st.floats(-50.0, 50.0), st.integers(0, 2**31))
def test_springs_masses_and_offsets_are_not_refused(
    m: float, k: float, F_0: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    t = 0.002 * np.arange(5000, dtype=np.float64)
    y = np.zeros_like(t)
    acc = np.zeros_like(t)
    for f, a, phase in zip(
        rng.uniform(0.2, 3, 4), rng.normal(size=4), rng.uniform(0, 6, 4), strict=True
    ):
        w = 2 * np.pi * f
        y += 0.05 * a * np.sin(w * t + phase)
        acc -= 0.05 * a * w**2 * np.sin(w * t + phase)
    F = m * acc + k * y + F_0 + 2.0 * np.sign(np.gradient(y, t)) + rng.normal(0, 0.1, t.size)
    check(Log("run", {"t": t, "y": y + rng.normal(0, 1e-5, t.size), "F": F}), Rig(kind="force"))


def test_a_throw_braked_hard_and_brought_back_slowly_is_not_refused() -> None:
    t = 0.001 * np.arange(6000, dtype=np.float64)
    out, back = np.clip(t / 0.5, 0, 1), np.clip((t - 1.0) / 4.5, 0, 1)
    y = 0.1 * (out**2 * (3 - 2 * out) - back**2 * (3 - 2 * back))
    v = np.gradient(y, t)
    F = 50.0 * np.gradient(v, t) + 0.5 * np.sign(v)
    check(Log("run", {"t": t, "y": y, "F": F}), Rig(kind="force"))


def test_work_share_is_one_for_pure_friction_and_none_without_return() -> None:
    t = np.linspace(0.0, 10.0, 5000)
    y = np.sin(t)
    share = work_share(y, np.sign(np.cos(t)))
    assert share is not None
    assert share > 0.9
    assert work_share(t, np.ones_like(t)) is None


def test_applied_force_of_each_rig() -> None:
    n = 5
    p_p, p_n = np.linspace(2e5, 3e5, n), np.linspace(4e5, 1e5, n)
    F, u = np.arange(n, dtype=float), np.linspace(-1, 1, n)
    log = Log("run", {"t": F, "p_p": p_p, "p_n": p_n, "F": F, "u": u})
    pneumatic = Rig("electro-pneumatic", area_p=12.6e-4, area_n=10e-4, supply_pressure=5e5)
    expected = 12.6e-4 * p_p - 10e-4 * p_n - 2.6e-4 * 5e5
    cases = [
        (pneumatic, expected),
        (Rig("force"), F),
        (Rig("force", area_n=2e-4), F - 2e-4 * p_n),
        (Rig("force", area_p=3e-4), F + 3e-4 * p_p),
        (Rig("force", area_p=3e-4, area_n=2e-4), F + 3e-4 * p_p - 2e-4 * p_n),
        (Rig("motor", force_per_command=7.0), 7.0 * u),
    ]
    for rig, force in cases:
        found = applied_force(log, rig)
        assert found is not None
        np.testing.assert_allclose(found, force, rtol=1e-12)
    assert applied_force(log, Rig("motor")) is None


@given(st.floats(-5, 5), st.floats(-5, 5), st.integers(2, 9))
def test_velocity_of_a_line_is_its_slope(slope: float, start: float, N_d: int) -> None:
    y = start + slope * 0.01 * np.arange(50, dtype=np.float64)
    v = velocity(y, 0.01, N_d)
    assert v.shape == y.shape
    assert v[0] == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(v[N_d:], slope, atol=1e-9)


def test_velocity_is_the_least_squares_slope() -> None:
    y = np.random.default_rng(0).normal(size=30)
    v = velocity(y, 0.5, 5)
    for k in range(5, 30):
        slope = np.polyfit(0.5 * np.arange(5, dtype=np.float64), y[k - 4 : k + 1], 1)[0]
        assert v[k] == pytest.approx(slope, abs=1e-9)
    with pytest.raises(BadSpecification):
        velocity(y, 0.5, 1)


def test_filters_pass_a_constant_and_match_their_difference_equations() -> None:
    x = np.random.default_rng(0).normal(size=40) + 3.0
    out = apply_filter(RIG_A, x)
    np.testing.assert_allclose(out[1:], 0.5 * out[:-1] + 0.5 * x[1:], rtol=1e-12)
    assert out[0] == pytest.approx(x[0])
    out = apply_filter(RIG_C, x)
    np.testing.assert_allclose(out[1:], 0.8 * out[:-1] + 0.2 * x[1:], rtol=1e-12)
    low = fir_lowpass(5.0, 1e-3)
    assert len(low.b) == 41
    assert sum(low.b) == pytest.approx(1.0)
    np.testing.assert_allclose(apply_filter(low, np.full(90, 2.0)), 2.0)
    with pytest.raises(BadSpecification, match="cut-off"):
        fir_lowpass(600.0, 1e-3)


def test_a_run_of_missing_samples_cuts_the_log() -> None:
    log = sliding_log()
    F = log["F"].copy()
    F[700:720] = np.nan
    made = prepare(log.with_signals(F=F), RIG)
    assert len(made.runs) == 2
    assert all(np.all(np.isfinite(run["F"])) for run in made.runs)
    (found,) = made.bad
    assert (found.kind, found.done, found.samples) == ("missing", "cut out", 20)
    assert (found.first, found.last) == pytest.approx((7.0, 7.19))


def test_a_tenth_of_a_log_is_not_cut_out() -> None:
    log = sliding_log()
    F = log["F"].copy()
    for first in range(100, 1900, 100):
        F[first : first + 9] = np.nan
    with pytest.raises(BadLog, match=r"at most 10% are left out|is NaN or infinite in"):
        repair(log.with_signals(F=F))


def test_a_command_at_its_limit_is_reported_and_kept() -> None:
    log = sliding_log()
    u = np.clip(log["F"] + 0.01 * np.sin(30.0 * log["t"]), -9.5, 9.5)
    made = prepare(log.with_signals(u=u), RIG)
    assert {(one.kind, one.done) for one in made.bad} == {("saturated", "kept")}
    np.testing.assert_array_equal(made.runs[0]["u"], u)


def test_a_value_that_a_logger_repeats_is_no_limit() -> None:
    """The largest value of a held command is a limit where the next new one is the same."""
    log = sliding_log()
    loop = np.random.default_rng(2).standard_normal(len(log)) + 10.0 * np.sin(
        0.37 * log["t"] ** 1.1
    )
    for step in (6, 8):
        u = np.repeat(loop[::step], step)[: len(log)]
        assert limits(log.with_signals(u=u), "u") == []
        reported = limits(log.with_signals(u=np.clip(u, -9.0, 9.0)), "u")
        assert {one.kind for one in reported} == {"saturated"}


def test_a_short_log_of_a_held_command_has_no_limit_either() -> None:
    """Of a few held values, the largest is no limit for being repeated."""
    t = np.asarray(0.01 * np.arange(180), dtype=np.float64)
    u: Array = np.repeat(np.round(np.sin(0.4 * np.arange(23)), 2), 8)[:180].astype(np.float64)
    assert limits(Log("short", {"t": t, "u": u}), "u") == []
    assert limits(Log("short", {"t": t, "u": np.clip(u, -0.8, 0.8)}), "u") != []


@pytest.mark.parametrize("grows", [0.0, 0.3])
def test_the_crest_of_a_command_in_whole_counts_is_no_limit(grows: float) -> None:
    """It stands at its largest count for some samples, whether or not the next crest is larger."""
    log = sliding_log()
    size = 100.0 * (1.0 + grows * log["t"] / log.duration)
    u = np.round(size * np.sin(2.0 * np.pi * 0.4 * log["t"]))
    assert np.count_nonzero(np.diff(u)[u[1:] == u.max()] == 0.0) >= 3
    assert limits(log.with_signals(u=u), "u") == []
    reported = limits(log.with_signals(u=np.clip(u, -80.0, 90.0)), "u")
    assert [one.kind for one in reported] == ["saturated", "saturated"]


def noisy_force(log: Log) -> Log:
    noise = 0.05 * np.random.default_rng(0).standard_normal(len(log))
    return log.with_signals(F=log["F"] + noise)


def test_rows_beyond_the_range_of_a_force_sensor_are_cut_out() -> None:
    log = noisy_force(sliding_log(n=8000, h=0.005))
    made = prepare(log.with_signals(F=np.clip(log["F"], -10.7, 10.5)), RIG)
    assert {(one.signal, one.kind, one.done) for one in made.bad} == {("F", "saturated", "cut out")}
    assert sum(one.samples for one in made.bad) == np.count_nonzero(
        (log["F"] <= -10.7) | (log["F"] >= 10.5)
    )
    assert all(run["F"].min() > -10.7 and run["F"].max() < 10.5 for run in made.runs)
    assert "'F' is at an end of its range" in made.remarks[0]
    assert not any("uneven clock" in one for one in made.remarks)


def test_a_force_sensor_at_its_end_all_over_is_refused() -> None:
    log = noisy_force(sliding_log())
    with pytest.raises(BadLog, match=r"at an end of its range .* in .* larger range"):
        repair(log.with_signals(F=np.clip(log["F"], -10.0, 10.0)))


def test_a_force_that_is_the_command_is_kept_at_its_limit() -> None:
    log = noisy_force(sliding_log())
    u = np.clip(log["F"], -10.0, 10.0)
    made = prepare(log.with_signals(F=2.0 * u, u=u), RIG)
    assert {(one.signal, one.done) for one in made.bad} == {("u", "kept")}
