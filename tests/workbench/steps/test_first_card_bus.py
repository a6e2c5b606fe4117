"""A first card for logs off a bus: held positions, late speeds, motion one way alone."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from design.first_card.proposal import Proposal
from design.first_card.remarks import no_body
from identification.columns.column import read_register
from identification.columns.log_columns import columns_of
from identification.errors import BadLog
from workbench.logs.notation import NOTATION
from workbench.logs.unknown import read_unknown
from workbench.steps.first_card.proposal import proposed

Floats = np.ndarray[Any, np.dtype[np.floating[Any]]]
H, HOLD, LATE = 0.005, 4, 20  # s a row; rows for which a value is held; rows of a speed's mean
K_S, K_V, K_A = 0.86, 0.108, 0.02  # V, V s/rad, V s^2/rad of a drive train
COUNTS = 46.0  # a radian


def ramp(way: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Clock, voltage, and position and speed as a bus gives them: a slow ramp of the voltage."""
    n = 1600
    t, u = H * np.arange(n), way * 0.6 * H * np.arange(n)
    y, v = np.zeros(n), 0.0
    for k in range(1, n):
        pushed = abs(u[k]) - K_S
        v = max(0.0, v + H / K_A * (pushed - K_V * v)) if v > 0.0 or pushed > 0.0 else 0.0
        y[k] = y[k - 1] + H * v
    y = way * np.round(COUNTS * y) / COUNTS
    speed = (y - np.concatenate([np.zeros(LATE), y[:-LATE]])) / (LATE * H)
    new = np.arange(n) // HOLD * HOLD
    jitter = 2e-5 * np.random.default_rng(1).standard_normal(n)
    return t + jitter, u, 100.0 + y[new], speed[new]


def propose(folder: Path, headers: str, *columns: Floats) -> Proposal:
    path = folder / "run.csv"
    rows = (",".join(f"{one:.9g}" for one in row) for row in np.column_stack(columns).tolist())
    path.write_text("\n".join([headers, *rows]), "utf-8")
    return proposed(path)


def test_a_speed_that_comes_late_behind_a_held_position_is_no_force(tmp_path: Path) -> None:
    runs = {name: np.column_stack(ramp(way)).tolist() for name, way in
            (("slow-backward", -1.0), ("slow-forward", 1.0))}  # fmt: skip
    path = tmp_path / "sysid_data.json"
    path.write_text(json.dumps({**runs, "sysid": True, "units": "Radians"}), "utf-8")
    found = proposed(path)
    columns = {one.name: one.column for one in found.signals}
    assert (columns["t"], columns["y"]) == (0, 2)
    assert {columns.get("F"), columns.get("u")} == {1, None}
    assert "derivative" in found.unused["number 3"]
    assert found.remarks[0] == (
        "'slow-forward' hold rows as 'slow-backward' does, which the card reads; give another run"
        " by the card's [file] rows"
    )


def test_a_ramp_of_a_voltage_is_no_clock(tmp_path: Path) -> None:
    found = propose(tmp_path, "timestamp,voltage,position,velocity", *ramp(1.0))
    one = found.signal("u")
    assert found.kind == "motor" and one is not None and one.column == "voltage"
    assert "derivative" in found.unused["'velocity'"]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_one_way_alone_says_nothing_of_two_directions(tmp_path: Path, sign: float) -> None:
    """A stroke whose position some rows repeat: its acceleration is of steps, unless smoothed."""
    t = 0.002 * np.arange(220)
    force = 30.0 * np.exp(-t / 0.08) - 4.0 * (1.0 - np.exp(-t / 0.08)) + 6.0
    v = np.cumsum(force - 6.0) * 0.002 / 0.35
    y = np.degrees(np.cumsum(v) * 0.002)
    lost = np.random.default_rng(2).choice(np.arange(60, 220), 30, replace=False)
    for k in np.sort(lost):
        y[k] = y[k - 1]
    found = propose(tmp_path, "t_s,angle_deg,torque_Nm", t, np.round(y, 3), sign * force)
    one = found.signal("F")
    assert one is not None and (one.gain == -1.0) == (sign < 0.0)
    assert not any("two directions" in text or "explain only" in text for text in found.remarks)


def test_a_drive_that_is_logged_is_not_said_to_be_missing(tmp_path: Path) -> None:
    steps, y = np.repeat([20.0, 90.0, 20.0, 90.0], 40), np.full(160, 20.0)
    for k in range(1, 160):
        y[k] = y[k - 1] + np.clip(steps[k - 1] - y[k - 1], -14.0, 14.0)
    current = 100.0 + 400.0 * (np.abs(np.gradient(y)) > 1.0)
    with pytest.raises(BadLog, match="too few to see whether 'current_mA' drives it") as refused:
        propose(tmp_path, "time_ms,command_angle,feedback_angle,current_mA",
                51.0 * np.arange(160), steps, y + 0.3 * np.sin(np.arange(160.0)),
                current)  # fmt: skip
    assert "is logged; log its current" not in str(refused.value)


def test_a_filtered_copy_is_no_reference(tmp_path: Path) -> None:
    t = 0.01 * np.arange(3000)
    y = 50.0 * np.sin(1.3 * t + 0.2 * np.sin(0.31 * t)) + 3.0 * np.sin(5.0 * t)
    v = np.gradient(y, t)
    current = 2e-3 * np.gradient(v, t) + 0.8 * np.sign(v) + 4e-3 * v
    noise = np.random.default_rng(3).standard_normal((2, len(t)))
    raw = y + 0.05 * noise[0]
    smooth = np.convolve(raw, [0.25, 0.5, 0.25], "same")
    found = propose(tmp_path, "time,distance,filtered,current_A", t, raw, smooth,
                    current + 0.01 * noise[1])  # fmt: skip
    columns = {one.name: one.column for one in found.signals}
    assert columns["y"] == "distance" and "r" not in columns


@pytest.mark.parametrize("rows", [1, 3])
def test_a_sign_bit_is_seen_where_a_stroke_is_a_few_rows(tmp_path: Path, rows: int) -> None:
    """A bus servo's load: at each step of its target it turns within a row, and decays to zero."""
    n, h = 6000, 0.01
    target = 2047.0 + 200.0 * np.sign(np.sin(2.0 * np.pi * 0.4 * h * np.arange(n)))
    y, v, load = np.full(n, 2047.0), 0.0, np.zeros(n)
    for k in range(1, n):
        load[k] = np.clip(16.0 * (target[k] - y[k - 1]), -1000.0, 1000.0)
        v += 0.1 * (2.0 * load[k] - v)
        y[k] = y[k - 1] + h * v
    words = np.where(load < 0.0, 1024.0 - np.round(load), np.round(load))
    with pytest.raises(BadLog, match=r"'load' jumps by 1024 .*sign and magnitude, bit 10"):
        propose(tmp_path, "time_s,target,pos,load", h * np.arange(n)[::rows], target[::rows],
                np.round(y)[::rows], words[::rows])  # fmt: skip


def test_a_signal_that_goes_through_a_power_of_two_has_no_sign_bit() -> None:
    swing = np.round(1024.0 + 900.0 * np.sin(0.05 * np.arange(4000)))
    steps = np.where(np.arange(4000) // 40 % 2, 1500.0, 0.0) + np.arange(4000.0) % 3.0
    assert read_register(swing) is None and read_register(steps) is None


def steps(*lengths: int) -> tuple[Floats, Floats, Floats]:
    """Clock, voltage, and angle in steps of a degree, of runs from rest by a constant voltage, the
    clock of each from 0."""
    t, u, y = [], [], []
    for k, n in enumerate(lengths):
        own = 6e-3 * np.arange(n)
        level = (-1.0) ** k * (10.0 - k)
        t.append(own + 1e-4)
        u.append(np.full(n, level))
        y.append(np.round(100.0 * level * (own - 0.1 * (1.0 - np.exp(-own / 0.1)))))
    return np.concatenate(t), np.concatenate(u), np.concatenate(y)


def test_a_clock_without_a_name_may_begin_again(tmp_path: Path) -> None:
    t, u, y = steps(110, 120, 115)
    path = tmp_path / "runs.csv"
    rows = np.column_stack([u, t, y]).tolist()
    path.write_text("\n".join(", ".join(f"{one:.9g}" for one in row) for row in rows), "utf-8")
    found = proposed(path)
    assert {one.name: one.column for one in found.signals}["t"] == 1
    assert any("clock begins again: 3 runs" in remark for remark in found.remarks)


def test_a_drive_that_is_constant_in_the_longest_run_is_said(tmp_path: Path) -> None:
    found = propose(tmp_path, "time_s,voltage_V,angle_deg", *steps(110, 120, 115))
    drive = next(one for one in found.signals if one.name == "u")
    assert not drive.sure and drive.why.startswith("constant in the longest run")
    assert not any("explain only" in remark for remark in found.remarks)


def test_a_clock_that_begins_again_too_soon_is_said(tmp_path: Path) -> None:
    with pytest.raises(BadLog, match="begins again in data row 71, as that of several runs in one"):
        propose(tmp_path, "time_s,voltage_V,angle_deg", *steps(70, 120, 60))


@pytest.mark.parametrize("signed", [False, True])
def test_a_command_without_its_sign_is_named(tmp_path: Path, signed: bool) -> None:
    """A hoist by pulses of the motor, whose direction stands nowhere; rests between."""
    u = np.tile(np.repeat([70.0, 0.0, -30.0, 0.0], [8, 20, 16, 20]), 4)
    y = np.cumsum(np.where(u > 0.0, 1500.0, np.where(u < 0.0, -750.0, 0.0)))
    y = np.round(y + 40.0 * np.random.default_rng(2).standard_normal(len(y)) * (u != 0.0))
    u = u if signed else np.abs(u)
    said = "'MotorPWM' is never negative, though 'Encoder' goes both ways"
    found = propose(tmp_path, "time_ms,MotorPWM,Encoder", 100.0 * np.arange(len(u)), u, y)
    assert any(said in remark for remark in found.remarks) is not signed
    refused = no_body(columns_of(read_unknown(tmp_path / "run.csv"), NOTATION))
    assert (said in str(refused)) is not signed
