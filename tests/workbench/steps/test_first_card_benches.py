"""A first card of what benches, robots' recorders and scopes write: layouts, and their units."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from benchmarks.init_real_tables import machine
from benchmarks.init_table_words import KINDS
from design.first_card.proposal import Proposal
from identification.arrays import Array
from identification.errors import BadLog
from workbench.cards.card import load_card
from workbench.cards.headers import read_header
from workbench.logs.runs import read_runs
from workbench.steps.first_card.proposal import proposed
from workbench.steps.first_card.written import written

H, ROWS = 4e-3, 2500
T: Array = np.asarray(H * np.arange(ROWS), dtype=np.float64)


def servo(seed: int) -> dict[str, Array]:
    """The signals of a joint behind its loop, in SI."""
    return {**machine(np.random.default_rng(seed), T, KINDS["choose"][0]), "t": T}


@pytest.fixture(scope="module")
def joint() -> dict[str, Array]:
    return servo(5)


def text_of(columns: Sequence[Array], pattern: str) -> str:
    return "".join(pattern.format(*row) for row in np.column_stack(columns).tolist())


def card_of(path: Path, content: str = "") -> Proposal:
    if content:
        path.write_text(content, "utf-8")
    return proposed(path)


def is_read(found: Proposal, truth: Mapping[str, Array]) -> bool:
    """Whether the card is read, and gives these signals up to an offset."""
    card = Path(found.log).with_suffix(".toml")
    card.write_text(written(found), "utf-8")
    run = read_runs(Path(found.log), load_card(card)).runs[0]
    return len(run) == pytest.approx(ROWS, abs=30) and all(
        np.corrcoef(run[name], x[: len(run)])[0, 1] > 0.98
        and np.std(run[name]) == pytest.approx(np.std(x), rel=0.05)
        for name, x in truth.items()
    )


LAYOUTS = {
    "units in quoted cells": (
        '"Time","axis position","axis torque"\n',
        '"2024-03-01 12:00:{0:06.3f}","{1:.6f} rad","{2:.5f} N·m"\n',
    ),
    "a word begins each row, and milliseconds stand behind a semicolon": (
        "Header:,A Trend,\nTrend Name:,T1\nHeader:,Date,Time;ms,Axis.angle,Axis.torque\n",
        "Data,1/9/2023,8:00:{3:02.0f};{4:03.0f},{1:.6f},{2:.5f}\n",
    ),
    "the time is named in the row of units": (
        "Model,X-4\nDate,2023/04/01\n,CH1,CH2\n,Angle,Torque\nTime[s],[rad],[Nm]\n",
        "{0:.3f},{1:.6f},{2:.5f}\n",
    ),
    "names stand behind a sign of comments": (
        "% bench, run 12\n% t angle torque\n",
        "{0:.3f}\t{1:.6f}\t{2:.5f}\n",
    ),
    "names are broken in two lines": (
        '"t\n[s]";"angle\n[rad]";"torque\n[Nm]"\n',
        "{0:.3f};{1:.6f};{2:.5f}\n",
    ),
    "arrays as Python prints them beside names": (
        "stamp,name,angle,torque\n",
        "{0:.3f},\"['a', 'b']\",\"array('d', [{1:.6f}, 0.0])\",\"array('d', [{2:.5f}, 0.0])\"\n",
    ),
    "Greek letters": ("t,θ,τ\n", "{0:.3f},{1:.6f},{2:.5f}\n"),
}


@pytest.mark.parametrize("said", LAYOUTS)
def test_layouts(joint: dict[str, Array], tmp_path: Path, said: str) -> None:
    head, row = LAYOUTS[said]
    whole = np.floor(T + 1e-9)
    columns = (T, joint["y"], joint["F"], whole, 1e3 * (T - whole))
    found = card_of(tmp_path / "run.csv", head + text_of(columns, row))
    assert found.kind == "force" and found.motion == "rotary"
    assert is_read(found, {"y": joint["y"], "F": joint["F"]})


def test_rows_from_the_last_to_the_first_are_turned(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    own = (T[::-1], joint["y"][::-1], joint["F"][::-1])
    found = card_of(tmp_path / "run.csv", "t,angle,torque\n" + text_of(own, "{},{},{}\n"))
    assert any("the other way round" in one for one in found.remarks)
    assert is_read(found, {"y": joint["y"], "F": joint["F"]})


def test_a_line_may_be_a_signal_with_its_name_first(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    lines = [f"{name}," + ",".join(map(str, joint[key].tolist()))
             for name, key in (("t", "t"), ("angle", "y"), ("torque", "F"))]  # fmt: skip
    found = card_of(tmp_path / "run.csv", "\n".join(lines))
    assert is_read(found, {"y": joint["y"], "F": joint["F"]})


def test_variables_may_stand_one_below_the_other(joint: dict[str, Array], tmp_path: Path) -> None:
    text = "# Created by Octave\n"
    for name, key in (("t", "t"), ("angle", "y"), ("torque", "F")):
        text += f"# name: {name}\n# type: matrix\n# rows: {ROWS}\n# columns: 1\n"
        text += text_of([joint[key]], " {}\n") + "\n\n"
    found = card_of(tmp_path / "run.txt", text)
    assert is_read(found, {"y": joint["y"], "F": joint["F"]})


def test_keys_beside_the_values_are_no_header(joint: dict[str, Array], tmp_path: Path) -> None:
    keys = [f"Record Length,{ROWS}", f"Sample Interval,{H}", *[","] * 3, "Source,CH1", "Scale,1.0"]
    rows = text_of((T, joint["y"], joint["F"]), "{:.3f},{:.6f},{:.5f},\n").splitlines()
    lines = [f"{key},,{row}" for key, row in zip(keys + [","] * ROWS, rows, strict=False)]
    found = card_of(tmp_path / "run.csv", "\n".join(lines))
    y = found.signal("y")
    assert y is not None and y.column == 4
    drive = "u" if found.kind == "motor" else "F"
    own = found.signal(drive)
    assert own is not None and own.column == 5


def test_a_period_in_the_first_row_makes_the_clock(joint: dict[str, Array], tmp_path: Path) -> None:
    rows = text_of((joint["u"], joint["y"]), "{:.6f},{:.6f},,\n")
    found = card_of(tmp_path / "run.csv", "uEst,yEst,Ts,\n" + rows.replace(",,", f",{H},", 1))
    t = found.signal("t")
    assert t is not None and (t.column, t.summed) == ("Ts", True)


def test_matrices_of_one_clock_are_one_log(joint: dict[str, Array], tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    savemat(path, {"data_theta": np.column_stack([T, joint["r"], joint["y"]]),
                   "data_vm": np.column_stack([T, joint["u"]])})  # fmt: skip
    found = card_of(path)
    assert found.kind == "motor"
    u = found.signal("u")
    assert u is not None and u.column == "data_vm[1]"


def test_arrays_of_hdf5_have_a_column_for_each_joint(tmp_path: Path) -> None:
    path, joints = tmp_path / "run.h5", [servo(5), servo(6), servo(7)]
    with h5py.File(path, "w") as file:
        file["demo/timestamp"] = T
        for name, key in (("joint_pos", "y"), ("joint_torque", "F")):
            file[f"demo/obs/{name}"] = np.column_stack([one[key] for one in joints])
    found = card_of(path)
    y, F = found.signal("y"), found.signal("F")
    assert y is not None and F is not None
    assert str(y.column)[:-3] == "demo/obs/joint_pos" and str(y.column)[-3:] == str(F.column)[-3:]


def test_units_of_channels_in_json_are_read(joint: dict[str, Array], tmp_path: Path) -> None:
    channels = [
        {"name": name, "unit": unit, "data": (factor * joint[key]).tolist()}
        for name, unit, key, factor in (("ActualAngle", "mrad", "y", 1e3), ("Torque", "Nm", "F", 1))
    ]
    content = {"sampleTime": {"value": 1e3 * H, "unit": "ms"}, "channels": channels}
    found = card_of(tmp_path / "run.json", json.dumps(content))
    t, y = found.signal("t"), found.signal("y")
    assert t is not None and (t.column, t.unit) == ("sampleTime.value", "ms")
    assert y is not None and y.sure and y.unit == "mrad"
    assert is_read(found, {"y": joint["y"], "F": joint["F"]})


def test_units_with_a_factor_are_read(joint: dict[str, Array], tmp_path: Path) -> None:
    own = (np.round(1e4 * T), np.round(1e4 * joint["y"]), 1e4 * joint["F"])
    head = "Time [0.1ms],Angle [0.0001 rad],Torque [0.1 mNm]\n"
    found = card_of(tmp_path / "run.csv", head + text_of(own, "{:.0f},{:.0f},{:.0f}\n"))
    y = found.signal("y")
    assert y is not None and y.sure and y.unit == "0.0001 rad"


def test_a_speed_in_a_unit_with_a_factor_is_summed(joint: dict[str, Array], tmp_path: Path) -> None:
    v = np.gradient(joint["y"], H) * 30.0 / np.pi
    own = (1e3 * T, 10.0 * v, joint["F"])
    head = "Time[ms],Feedback Speed[0.1 rpm],Torque[Nm]\n"
    found = card_of(tmp_path / "run.csv", head + text_of(own, "{},{:.0f},{}\n"))
    y = found.signal("y")
    assert y is not None and (y.unit, y.summed) == ("0.1 rpm", True)
    assert is_read(found, {"y": joint["y"], "F": joint["F"]})


@pytest.mark.parametrize(
    ("header", "unit"),
    [("Load (kg)", "kgf"), ("Torque (kgf.cm)", "kgf cm"), ("Torque [oz-in]", "ozf inch"),
     ("speed [0.1 rpm]", "0.1 rpm"), ("millis", "ms"), ("Current (A rms)", "A"),
     ("tacho_meter", None), ("distance_meter", "m")],
)  # fmt: skip
def test_units_of_benches(header: str, unit: str | None) -> None:
    found = read_header(header).unit
    assert (found.card if found else None) == unit


@pytest.mark.parametrize(
    ("header", "means", "purpose"),
    [("axisQMsr_R820_1[3]", "position", "measured"), ("Usoll [V]", "command", "demand"),
     ("axisQCmd_R820_1[3]", "position", "reference"), ("θ̇", "velocity", ""),
     ("Load position [mm]", "position", "")],
)  # fmt: skip
def test_words_of_recorders(header: str, means: str, purpose: str) -> None:
    found = read_header(header)
    assert means in found.means
    assert found.purpose == purpose


def test_a_number_in_every_name_is_no_axis(tmp_path: Path) -> None:
    joints = [servo(seed) for seed in (5, 6)]
    names = [f"axis{what}_R820_1[{k}]" for what in ("QMsr", "QCmd", "TauMsr") for k in (0, 1)]
    columns = [joints[k][key] for key in ("y", "r", "F") for k in (0, 1)]
    head = " ".join(["SEC", *names]) + "\n"
    found = card_of(
        tmp_path / "run.log", head + text_of([T, *columns], " ".join(["{}"] * 7) + "\n")
    )
    assert found.axes == ("0", "1") and found.signal("u") is None
    index = {str(one.column)[-3:] for one in found.signals if one.name != "t"}
    assert len(index) == 1


def cylinder() -> tuple[Array, ...]:
    """Clock [s], place [mm], both pressures [bar] and what changes these, of a cylinder."""
    y = 0.05 * np.sin(2.0 * T) + 0.02 * np.sin(5.1 * T)
    v, a = np.gradient(y, H), np.gradient(np.gradient(y, H), H)
    F = 20.0 * a + 150.0 * np.sign(v) + 800.0 * v
    noise = 0.02 * np.random.default_rng(2).standard_normal((2, ROWS))
    return T, 1e3 * y, 60.0 + F / 40.0 + noise[0], 90.0 - F / 40.0 + noise[1], np.gradient(F, H)


def test_both_chambers_have_one_unit(tmp_path: Path) -> None:
    """One is near the sizes of compressed air, the other of oil."""
    _, y, p_p, p_n, _ = cylinder()
    own = (T, y, p_p, p_n)
    found = card_of(tmp_path / "run.csv", "t,x,p1,p2\n" + text_of(own, "{},{},{},{}\n"))
    pair = [found.signal(name) for name in ("p_p", "p_n")]
    assert found.kind == "electro-pneumatic" and None not in pair
    assert len({one.unit for one in pair if one}) == 1


def test_the_reference_of_a_valve_in_volts_is_its_command(tmp_path: Path) -> None:
    head = "Zeit [s];xK [mm];pA [bar];pB [bar];Usoll [V]\n"
    found = card_of(tmp_path / "run.csv", head + text_of(cylinder(), "{};{};{};{};{}\n"))
    u = found.signal("u")
    assert u is not None and u.column == "Usoll [V]"


def test_what_turns_before_a_screw_is_paired_with_its_torque(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    turns, lead = joint["y"] / (2.0 * np.pi), 5.0
    head = "t [s],Motor position [rev],Load position [mm],Motor torque [Nm],Load setpoint [mm]\n"
    own = (T, turns, lead * turns, joint["F"], lead * joint["r"] / (2.0 * np.pi))
    found = card_of(tmp_path / "run.csv", head + text_of(own, "{},{},{},{},{}\n"))
    y, r = found.signal("y"), found.signal("r")
    assert y is not None and y.column == "Motor position [rev]"
    assert r is not None and r.gain == "5 mm/turn" and not r.sure
    assert is_read(found, {"y": joint["y"], "F": joint["F"]})


def test_a_torque_beside_a_slide_asks_for_what_is_between(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    own = (T, 1e2 * joint["y"], joint["F"])
    head = "t [s],position [mm],motor torque [Nm]\n"
    found = card_of(tmp_path / "run.csv", head + text_of(own, "{},{},{}\n"))
    F = found.signal("F")
    assert F is not None and F.gain == "1 N m/N" and not F.sure
    assert is_read(found, {})


def test_a_reference_and_its_error_are_no_position(joint: dict[str, Array], tmp_path: Path) -> None:
    own = (T, joint["r"], joint["r"] - joint["y"], joint["u"])
    head = "t [s],angle_setpoint [rad],angle_error [rad],motor_current [A]\n"
    with pytest.raises(BadLog, match=r"no position but its reference .* and the error"):
        card_of(tmp_path / "run.csv", head + text_of(own, "{},{},{},{}\n"))
