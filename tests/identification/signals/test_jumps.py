"""Spikes are interpolated with a remark, jumps and wraps refused; no sound log is touched."""

from collections.abc import Callable

import numpy as np
import pytest

from identification.arrays import Array
from identification.errors import BadLog
from identification.log import Log, Rig
from identification.signals.clean import check, prepare, repair

RIG = Rig("force")
ROTARY = Rig("force", motion="rotary")


def moving(h: float = 1e-3, seconds: float = 12.0, seed: int = 0, noise: float = 1e-5) -> Log:
    """A body driven to and fro over 0.1 m with rests, against 10 N of Coulomb friction."""
    t = h * np.arange(round(seconds / h), dtype=np.float64)
    phase = np.cumsum(np.clip(1.5 * np.sin(2 * np.pi * 0.2 * t), -1.0, 1.0)) * h
    y = 0.05 * np.sin(2.0 * phase)
    v = np.gradient(y, t)
    rng = np.random.default_rng(seed)
    F = 10.0 * np.tanh(v / 1e-3) + 50.0 * v + 0.01 * rng.standard_normal(t.size)
    return Log("run", {"t": t, "y": y + noise * rng.standard_normal(t.size), "F": F})


def changed(log: Log, name: str, change: Callable[[Array], None]) -> Log:
    values = log[name].copy()
    change(values)
    return log.with_signals(**{name: values})


@pytest.mark.parametrize("length", [1, 2, 3])
@pytest.mark.parametrize(("name", "height"), [("y", 0.5), ("y", 0.005), ("F", 400.0)])
def test_a_spike_each_second_is_interpolated(name: str, height: float, length: int) -> None:
    log = moving()

    def spike(x: Array) -> None:
        for first in range(500, 12_000, 1000):
            x[first : first + length] += height

    found, remarks, _ = repair(changed(log, name, spike), first_row=2)
    np.testing.assert_allclose(found[name], log[name], atol=1e-3 if name == "y" else 1.0)
    assert len(remarks) == 1
    assert f"isolated spikes of {name!r} in {12 * length} samples interpolated" in remarks[0]
    assert "first in row 502" in remarks[0]
    assert prepare(found, RIG).remarks == ()


def test_two_spikes_side_by_side_and_a_pressure_s() -> None:
    log = moving().with_signals(p_p=3e5 + 1e3 * np.sin(moving()["t"]))

    def spike(x: Array) -> None:
        x[[3000, 3003, 3006]] += [0.02, -0.03, 0.5]

    def burst(x: Array) -> None:
        x[700:702] = 2e6

    found, remarks, _ = repair(changed(changed(log, "y", spike), "p_p", burst))
    np.testing.assert_allclose(found["y"], log["y"], atol=1e-3)
    np.testing.assert_allclose(found["p_p"], log["p_p"], rtol=1e-3)
    assert [line.split("(")[0] for line in remarks] == [
        "run: isolated spikes of 'y' in 3 samples interpolated ",
        "run: isolated spikes of 'p_p' in 2 samples interpolated ",
    ]


def test_a_sensor_that_spikes_all_the_time_is_refused() -> None:
    def spike(x: Array) -> None:
        x[50:11_950:50] += 0.3

    with pytest.raises(BadLog, match=r"'y' has large spikes in 2.0% .* row 51, .* at most 1%"):
        repair(changed(moving(), "y", spike))


def early(tau: float, seed: int) -> Log:
    """A body that swings less and less and comes to rest; each eleventh sample is early [s]."""
    rng = np.random.default_rng(seed)
    t = 0.01 * np.arange(500, dtype=np.float64)
    at = t - tau * (np.arange(len(t)) % 11 == 3)
    y = np.cos(4.0 * at) * np.clip(1.0 - at / 4.0, 0.0, None) ** 2
    return Log("run", {"t": t, "y": y + 1e-6 * rng.standard_normal(len(t)), "F": np.sin(t)})


@pytest.mark.parametrize("seed", range(3))
def test_samples_taken_early_are_noise_and_no_fault_of_the_sensor(seed: int) -> None:
    log = early(0.002, seed)
    found, remarks, bad = repair(log, rotary=True)
    assert np.array_equal(found["y"], log["y"]) and not bad
    assert len(remarks) == 1 and "a clock that jitters; kept, as noise" in remarks[0]


@pytest.mark.parametrize("seed", range(3))
def test_small_spikes_of_a_sensor_are_refused_by_the_limit_that_is_said(seed: int) -> None:
    def spike(x: Array) -> None:
        x[180:490:9] += 2e-3

    with pytest.raises(BadLog, match=r"'y' has spikes in .* at most 5% are interpolated"):
        repair(changed(early(0.0, seed), "y", spike), rotary=True)


@pytest.mark.parametrize("size", [0.5, -0.01, 0.002, 3e-4])
def test_a_lasting_jump_is_taken_out_and_the_log_cut_there(size: float) -> None:
    def jump(x: Array) -> None:
        x[7000:] += size

    log = moving()
    before, after = prepare(changed(log, "y", jump), RIG, first_row=2).runs
    np.testing.assert_array_equal(before["y"], log["y"][: len(before)])
    np.testing.assert_allclose(after["y"], log["y"][-len(after) :], atol=5e-5)
    assert len(before) + len(after) > len(log) - 10
    (found,) = prepare(changed(log, "y", jump), RIG).bad
    assert (found.signal, found.kind, found.done) == ("y", "jump", "offset removed")
    assert found.first == found.last == log["t"][7000]
    assert found.size == pytest.approx(abs(size), abs=5e-5)
    assert "'y' has a jump that stays at t = 7 s (1 sample, " in found.line


def test_a_jump_near_another_is_taken_out_without_a_cut() -> None:
    def jump(x: Array) -> None:
        x[7000:] += 0.01
        x[7400:] -= 0.003

    log = moving()
    made = prepare(changed(log, "y", jump), RIG)
    assert [one.kind for one in made.bad] == ["jump", "jump"]
    np.testing.assert_allclose(made.runs[-1]["y"][-1000:], log["y"][-1000:], atol=1e-4)


@pytest.mark.parametrize("period", [0.02, 2.0**16 * 1e-6, 0.095])
@pytest.mark.parametrize("h", [1e-3, 1e-2])
def test_a_counter_that_wraps_is_unwrapped(period: float, h: float) -> None:
    log = moving(h=h)
    wrapped = log.with_signals(y=np.mod(log["y"] + 0.013, period))
    made = prepare(wrapped, RIG)
    assert [one.kind for one in made.bad] == ["wrap"]
    assert made.bad[0].size == pytest.approx(period, abs=2e-5)
    off = made.runs[0]["y"] - log["y"]
    assert np.ptp(off) < 2e-4


def test_a_counter_of_whole_steps_is_unwrapped_exactly() -> None:
    log = moving()
    count = 2e-6
    y = count * np.round(log["y"] / count)
    made = prepare(log.with_signals(y=np.mod(y, count * 2.0**14)), RIG)
    assert np.ptp(made.runs[0]["y"] - y) < 1e-12


def test_an_angle_modulo_a_turn_is_unwrapped_exactly() -> None:
    log = moving(h=5e-3)
    turns = np.mod(200.0 * log["y"], 2 * np.pi)
    made = prepare(log.with_signals(y=turns), ROTARY)
    assert np.ptp(made.runs[0]["y"] - 200.0 * log["y"]) < 1e-9
    assert prepare(log.with_signals(y=np.unwrap(turns)), ROTARY).bad == ()


@pytest.mark.slow
@pytest.mark.parametrize("h", [2e-2, 5e-3, 1e-3, 1e-4])
@pytest.mark.parametrize("count", [0.0, 1e-6, 1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("noise", [0.0, 1e-5, 1e-4])
def test_noise_rates_and_encoders_are_no_fault(h: float, count: float, noise: float) -> None:
    log = moving(h=h, noise=noise)
    if count:
        log = log.with_signals(y=count * np.round(log["y"] / count))
    assert prepare(log, RIG).remarks == ()


@pytest.mark.slow
@pytest.mark.parametrize("h", [2e-2, 5e-3, 1e-3, 1e-4])
@pytest.mark.parametrize("bounce", [0.0, 0.6])
def test_impacts_on_end_stops_are_no_fault(h: float, bounce: float) -> None:
    fine = 1e-5
    v, y, out = 0.0, 0.0, np.empty(round(8.0 / fine))
    for i in range(out.size):
        v += fine * (30.0 if (i * fine) % 2.0 < 1.0 else -30.0)
        y += fine * v
        if abs(y) > 0.05 and v * y > 0.0:
            y, v = 0.05 * np.sign(y), -bounce * v
        out[i] = y
    y_h = out[:: round(h / fine)]
    t = h * np.arange(y_h.size, dtype=np.float64)
    repaired, remarks, _ = repair(Log("stops", {"t": t, "y": y_h}))
    assert remarks == ()
    check(repaired, RIG)


@pytest.mark.parametrize("h", [2e-2, 5e-3, 1e-3])
def test_slips_of_a_stick_slip_are_no_fault(h: float) -> None:
    """Slips of 0.5 to 2 mm in 6 ms at random times, rests of one level in between."""
    rng = np.random.default_rng(5)
    t = h * np.arange(round(20.0 / h), dtype=np.float64)
    y = np.zeros_like(t)
    begins, sizes = np.sort(rng.uniform(0, 20, 25)), rng.uniform(5e-4, 2e-3, 25)
    for begin, size in zip(begins, sizes, strict=True):
        share = np.clip((t - begin) / 6e-3, 0.0, 1.0)
        y += size * share**2 * (3 - 2 * share)
    log = Log("slips", {"t": t, "y": y + 1e-6 * rng.standard_normal(t.size)})
    repaired, remarks, _ = repair(log)
    assert remarks == ()
    check(repaired, RIG)


def test_a_step_over_a_gap_of_the_clock_is_no_jump() -> None:
    log = moving(h=1e-2)
    kept = np.concatenate([np.arange(400), np.arange(440, len(log))])
    prepare(Log("gap", {key: x[kept] for key, x in log.signals.items()}), RIG)


def test_pulses_that_move_the_body_are_no_spikes_of_the_force() -> None:
    h = 5e-3
    t = h * np.arange(4000, dtype=np.float64)
    F = np.zeros_like(t)
    F[np.arange(200, 4000, 400)] = 50.0 * (-1.0) ** np.arange(10)
    v = np.zeros_like(t)
    for i in range(1, t.size):
        v[i] = 0.8 * v[i - 1] + 1e-2 * h * F[i]  # stops within 0.1 s
    y = np.cumsum(v) * h
    log = Log("pulses", {"t": t, "y": y, "F": F + 1e-3 * np.sin(t)})
    assert repair(log).remarks == ()


@pytest.mark.parametrize(("limit", "scale"), [(5.0, 20.0), (1.0, 100.0), (24.0, 1e3)])
def test_a_command_far_beyond_the_card_s_limit_is_refused(limit: float, scale: float) -> None:
    log = moving()
    u = limit * np.clip(0.1 * log["F"], -1.0, 1.0)
    rig = Rig("force", control_limit=limit)
    rng = np.random.default_rng(1)
    check(log.with_signals(u=u * (1.0 + 0.05 * rng.standard_normal(u.size))), rig)
    check(log.with_signals(u=scale * u), RIG)
    with pytest.raises(BadLog, match=f"control_limit_v = {limit:g}, first in row ") as one:
        check(log.with_signals(u=scale * u), rig)
    assert "check unit, gain and offset of u" in str(one.value)
    assert "\n" not in str(one.value)
