"""A first card of what trace tools and loggers of drives write: channels, not signals."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.init_real_tables import machine
from benchmarks.init_table_words import KINDS as TABLES
from design.first_card.proposal import Proposal
from identification.arrays import Array
from identification.errors import BadLog
from workbench.steps.first_card.proposal import proposed
from workbench.steps.first_card.written import checked_proposal

T: Array = np.asarray(2e-3 * np.arange(5000), dtype=np.float64)


@pytest.fixture(scope="module")
def joint() -> dict[str, Array]:
    """The signals of a joint behind a limited loop, in SI."""
    return machine(np.random.default_rng(5), T, TABLES["choose"][0])


def table(folder: Path, head: str, *columns: Array, end: str = "") -> Path:
    """A file of these columns below these lines, each row with this end."""
    rows = (",".join(f"{x:.9g}" for x in row) for row in np.column_stack(columns).tolist())
    path = folder / "run.csv"
    path.write_text("\n".join([head, *(row + end for row in rows)]), "utf-8")
    return path


def columns_of(found: Proposal) -> dict[str, str | int]:
    assert not found.refused
    return {one.name: one.column for one in found.signals}


def test_rows_that_end_in_a_comma_have_the_names_above_them(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    head = "STEP1: 11 V, no container, 7 below\nTIME,POS,VOLT"
    path = table(tmp_path, head, 1e6 * T, joint["y"], joint["F"], end=",")
    found = checked_proposal(proposed(path))
    assert columns_of(found) == {"t": "TIME", "y": "POS", "u": "VOLT"}


def test_a_channel_is_called_what_stands_above_its_x_and_y(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    """The export of a drive's trace: each channel over the number of its sample."""
    k = np.arange(len(T), dtype=np.float64)
    head = "Parameter [0x2201/31],,Value [0x4C01/5],,Value [0x4C01/2],\nX,Y,X,Y,X,Y"
    path = table(tmp_path, head, k, 0.0 * k, k, 100.0 * joint["F"], k, joint["y"])
    found = checked_proposal(proposed(path))
    own = columns_of(found)
    assert own.pop("t") == 0
    assert set(own.values()) == {"Value [0x4C01/2]", "Value [0x4C01/5]"}


def test_the_inputs_of_a_logger_in_volts_are_any_signal(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    rng = np.random.default_rng(1)
    noise = 1e-4 * rng.standard_normal((2, len(T)))
    head = "Channel name,Force,Channel name,Input 1\nUnit,V,Unit,V"
    path = table(tmp_path, head, T, 0.1 * joint["F"] + noise[0], T, 2.5 + joint["y"] + noise[1])
    found = checked_proposal(proposed(path))
    assert columns_of(found) == {"t": 0, "y": "Input 1", "F": "Force"}
    force = found.signal("F")
    assert force is not None and force.unit == "V" and "V/N" in f"{force.gain} {force.rival}"


def test_a_speed_of_a_log_without_names_is_summed(tmp_path: Path) -> None:
    """A servo's log of voltage, current and speed, the current and the voltage one above the other:
    the position is none of these."""
    rng = np.random.default_rng(2)
    m, F_c, F_v, h = 2e-4, 2e-3, 2e-3, 2e-3
    F = np.repeat(rng.uniform(-0.08, 0.08, 100), 50)
    v = np.zeros(len(T))
    for k in range(1, len(T)):
        w = v[k - 1]
        for _ in range(20):
            slid = w + h / 20.0 * (F[k - 1] - F_c * np.sign(w or F[k - 1]) - F_v * w) / m
            w = 0.0 if slid * w < 0.0 else slid
        v[k] = w
    current, volts = F / 0.04, F / 0.005 + 0.04 * v
    noise = rng.standard_normal((2, len(T)))
    found = proposed(
        table(tmp_path, "Time,data", T, volts, current + 1e-3 * noise[0], v + 0.05 * noise[1])
    )
    y = found.signal("y")
    assert y is not None and (y.column, y.summed, y.unit.endswith("/s")) == (3, True, True)
    assert columns_of(found)["u"] in (1, 2)


def test_the_terms_of_a_controller_are_no_position(joint: dict[str, Array], tmp_path: Path) -> None:
    e = np.gradient(joint["v"], T) + 3.0 * joint["y"]
    p, i, d = 2e3 * e, 5.0 * np.cumsum(e), 40.0 * np.gradient(e)
    path = table(tmp_path, "t_s,error,p_term,i_term,d_term,output", T, e, p, i, d, p + i + d)
    with pytest.raises(BadLog, match="is made of the error 'error'"):
        proposed(path)


def test_before_and_behind_a_gear_the_position_is_that_of_the_force(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    """A drive logs the turn of its motor and that of the joint, and both torques; the current of
    its supply has no sign."""
    y, F = joint["y"], joint["F"]
    head = "time [s],a1 position [rad],a1 torque [Nm],c1 position [rev],c1 torque [Nm],supply [A]"
    path = table(tmp_path, head, T, y, F, 6.0 / (2.0 * np.pi) * y, np.round(F / 6.0, 4), np.abs(F))
    found = checked_proposal(proposed(path))
    own = columns_of(found)
    assert (own["y"], own["F"]) == ("a1 position [rad]", "a1 torque [Nm]")
    assert "u" not in own


@pytest.mark.parametrize(
    ("step", "turn", "unit", "motion"),
    [
        (90.0, 360.0, "deg", "rotary"),
        (0.5 * np.pi, 2.0 * np.pi, "rad", "rotary"),
        (0.02, 0.08, "m", "linear"),  # next to no part of a degree, which was taken for none
    ],
)
def test_a_reference_by_quarters_of_a_turn_is_an_angle(
    tmp_path: Path, step: float, turn: float, unit: str, motion: str
) -> None:
    r = step * np.repeat([0, 1, 2, 3, 1, 2, 0, 3, 2, 1], 500)
    y, v, u = np.zeros(len(T)), 0.0, np.zeros(len(T))
    for k in range(1, len(T)):
        y[k] = y[k - 1] + 2e-3 * v
        u[k] = 30.0 * (r[k] - y[k]) - 8.0 * v
        v += 2e-3 * (u[k] - 0.02 * turn * np.sign(v) - 0.5 * v)
    found = proposed(table(tmp_path, "t,r,y,u", T, r, y, u / turn))
    place = found.signal("y")
    assert place is not None and (found.motion, place.unit, place.sure) == (motion, unit, False)


def test_a_command_in_counts_is_where_the_position_goes(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    y, r = (np.round(65536.0 * joint[name] / (2.0 * np.pi)) for name in "yr")
    head = "Time (ms),IL.CMD (Arms),PL.FB (Counts16Bit),PL.CMD (Counts16Bit)"
    found = checked_proposal(proposed(table(tmp_path, head, 1e3 * T, joint["F"], y, r)))
    assert columns_of(found) == {
        "t": "Time (ms)", "y": "PL.FB (Counts16Bit)", "r": "PL.CMD (Counts16Bit)",
        "u": "IL.CMD (Arms)",
    }  # fmt: skip
    u = found.signal("u")
    assert u is not None and (u.unit, u.sure) == ("A", True)


def test_a_current_about_the_middle_of_a_converter_gets_an_offset(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    adc = np.round(512.0 + 30.0 * joint["F"])
    path = table(tmp_path, "t_s,position_rad,current", T, joint["y"], adc)
    (said,) = (one for one in proposed(path).remarks if "converter" in one)
    assert "about 51" in said and "write offset = 51" in said


def test_a_time_that_begins_again_stands_before_a_number_of_rows(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    row = np.arange(len(T), dtype=np.float64)
    episode = row // 3000.0
    t = T - T[3000 * episode.astype(int)]
    head = "observation.state[0],observation.effort[0],timestamp,frame_index,episode_index,index"
    columns = (joint["y"], joint["F"], t, row % 3000.0, episode, row)
    found = checked_proposal(proposed(table(tmp_path, head, *columns)))
    assert columns_of(found)["t"] == "timestamp"
    assert any("begins again: 2 runs" in one for one in found.remarks)
    assert found.motion == "rotary"


@pytest.mark.parametrize("index", [True, False])
def test_the_period_above_the_table_gives_the_clock(
    joint: dict[str, Array], tmp_path: Path, index: bool
) -> None:
    columns = [*([500.0 * T] if index else []), joint["y"], joint["F"]]
    head = "Device,X7\nSampling interval,2,ms\n" + "Sample," * index + "angle [rad],torque [Nm]"
    t = checked_proposal(proposed(table(tmp_path, head, *columns))).signal("t")
    assert t is not None
    expected = ("Sample", "500 1/s", False) if index else ("Sampling interval", None, True)
    assert (t.column, t.gain, t.summed) == expected
    assert t.sure or not index


def test_stamps_in_whole_milliseconds_have_the_period_of_the_rows(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    stamps = 7e4 + np.floor(1.15e3 * T)  # every 2.3 ms
    path = table(tmp_path, "time_ms,angle_rad,torque_Nm", stamps, joint["y"], joint["F"])
    found = checked_proposal(proposed(path))
    assert any("rows every 0.0023 s, an even clock" in one for one in found.remarks)


@pytest.mark.parametrize(
    ("head", "motion", "sure"),
    [
        ("t_s,position,velocity,effort", "rotary", False),
        ("t_s,position,velocity,force", "linear", False),
        ("t_s,position,velocity,ActualTorque", "rotary", False),
        ("t_s,angle,velocity,ActualTorque", "rotary", True),
    ],
)
def test_a_motors_torque_alone_is_no_proof_of_a_turn(
    joint: dict[str, Array], tmp_path: Path, head: str, motion: str, sure: bool
) -> None:
    y = joint["y"] + 1e-5 * np.random.default_rng(3).standard_normal(len(T))  # no encoder's steps
    found = proposed(table(tmp_path, head, T, y, joint["v"], joint["F"]))
    assert found.motion == motion
    assert next(one.sure for one in found.rig if one.key == "motion") is sure


@pytest.mark.parametrize(("size", "unit"), [(400.0, "1"), (4.0, "A")])
def test_a_current_of_large_whole_numbers_is_not_in_amperes(
    joint: dict[str, Array], tmp_path: Path, size: float, unit: str
) -> None:
    u = np.round(size * joint["F"] / np.max(np.abs(joint["F"])))
    position = np.round(4096.0 * joint["y"] / (2.0 * np.pi))
    found = proposed(table(tmp_path, "t_s,present_position,present_current", T, position, u))
    one = found.signal("u")
    assert one is not None and (one.unit, one.sure) == (unit, False)
