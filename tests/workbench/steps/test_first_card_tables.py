"""A first card of tables as drives log them: what is no signal, what acts, which axis."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from benchmarks.init_real_tables import fewest_wrong, machine, make_table
from benchmarks.init_table_words import KINDS
from design.first_card.answers import BadAnswer, with_rig
from design.first_card.proposal import Proposal
from identification.arrays import Array
from identification.columns.log_columns import columns_of
from identification.errors import BadLog
from workbench.cards.card import load_card
from workbench.logs.notation import NOTATION
from workbench.logs.unknown import read_unknown
from workbench.steps.first_card.proposal import proposed, with_signal
from workbench.steps.first_card.written import written

T: Array = np.asarray(2e-3 * np.arange(5000), dtype=np.float64)


@pytest.fixture(scope="module")
def joint() -> dict[str, Array]:
    """The signals of a joint behind a limited loop, in SI."""
    return machine(np.random.default_rng(5), T, KINDS["choose"][0])


@pytest.fixture(scope="module")
def other() -> dict[str, Array]:
    """The signals of another joint."""
    return machine(np.random.default_rng(8), T, KINDS["choose"][0])


def propose(folder: Path, headers: str, *columns: Array, axis: str | None = None) -> Proposal:
    """The proposal for a table with this line of headers, as it stands in a file."""
    rows = (",".join(f"{one:.9g}" for one in row) for row in np.column_stack(columns).tolist())
    path = folder / "run.csv"
    path.write_text("\n".join([headers, *rows]), "utf-8")
    return proposed(path, axis=axis)


def plain(joint: Mapping[str, Array]) -> Array:
    """Its position without the steps of a turn."""
    return joint["y"] + 1e-4 * np.random.default_rng(1).standard_normal(len(T))


def columns(found: Proposal) -> Mapping[str, str | int]:
    return {one.name: one.column for one in found.signals}


@pytest.mark.parametrize(("part", "seed"), [("choose", 2), ("choose", 9), ("judge", 1)])
def test_a_table_of_the_bench_is_right(tmp_path: Path, part: str, seed: int) -> None:
    table = make_table(seed, part, tmp_path)
    assert fewest_wrong(proposed(table.path), table) == {}


def test_what_comes_out_of_a_limiter_acts(joint: dict[str, Array], tmp_path: Path) -> None:
    limit = 0.6 * float(np.max(np.abs(joint["u0"])))
    u = np.clip(joint["u0"], -limit, limit)
    found = propose(tmp_path, "t,a,pos,controller,drive", T, joint["a"], joint["y"], joint["u0"], u)
    assert columns(found)["u"] == "drive"
    found = propose(tmp_path, "t,pos,out1,out2,ff", T, joint["y"], joint["u0"] - joint["ff"],
                    joint["u0"], joint["ff"])  # fmt: skip
    assert columns(found)["u"] == ("out2" if np.any(joint["ff"]) else columns(found)["u"])


def test_switches_supplies_and_predictions_are_no_signals(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    switch = (T > 3.0).astype(np.float64)
    found = propose(
        tmp_path, " time, pred_angle, active, Vsupply, angle [deg], error, torque [Nm]", T,
        57.3 * joint["pred"], switch, 12.0 - 0.1 * np.abs(joint["F"]), 57.3 * joint["y"],
        joint["e"], joint["F"],
    )  # fmt: skip
    assert columns(found) == {"t": "time", "y": "angle [deg]", "F": "torque [Nm]"}
    assert found.motion == "rotary"


def test_each_of_several_axes_has_its_card(
    joint: dict[str, Array], other: dict[str, Array], tmp_path: Path
) -> None:
    table = (T, joint["y"], joint["F"], other["y"], other["F"], joint["v"], other["v"])
    headers = "time,hip_pos,hip_tau,knee_pos,knee_tau,hip_vel,knee_vel"
    found = propose(tmp_path, headers, *table)
    assert found.axes == ("hip", "knee")
    assert columns(found) == {"t": "time", "y": "hip_pos", "F": "hip_tau"}
    assert any("2 axes in this log: hip, knee" in one for one in found.remarks)
    found = propose(tmp_path, headers, *table, axis="knee")
    assert columns(found) == {"t": "time", "y": "knee_pos", "F": "knee_tau"}
    with pytest.raises(BadLog, match="axes: hip, knee"):
        propose(tmp_path, headers, *table, axis="toe")


def test_axes_go_by_the_names_of_their_headers(
    joint: dict[str, Array], other: dict[str, Array], tmp_path: Path
) -> None:
    table = (T, joint["y"], joint["F"], other["y"], other["F"], 0.7 * plain(joint)[::-1],
             1e-3 * np.random.default_rng(4).standard_normal(len(T)))  # fmt: skip
    headers = "time,arm_1_pos,arm_1_tau,arm_2_pos,arm_2_tau,torso_lift_pos,torso_lift_tau"
    for axis, of in (("arm_2", "arm_2"), ("2", "arm_2"), ("torso_lift", "torso_lift")):
        found = propose(tmp_path, headers, *table, axis=axis)
        assert columns(found) == {"t": "time", "y": f"{of}_pos", "F": f"{of}_tau"}
    assert found.axes == ("arm_1", "arm_2", "torso_lift")
    assert any("inertia and friction explain only" in one for one in found.remarks)
    with pytest.raises(BadLog, match="axes: arm_1, arm_2, torso_lift"):
        propose(tmp_path, headers, *table, axis="arm")


def test_a_reference_named_u_is_known_by_the_command_that_a_controller_makes_of_it(
    tmp_path: Path,
) -> None:
    """A PD loop with friction along a sweep, far behind its reference; the command is named v."""
    h, n = 2e-3, 1500
    t = h * np.arange(n, dtype=np.float64)
    u = 50.0 * np.sin(2.0 * np.pi * (0.5 + 0.8 * t) * t)
    y, command = np.zeros(n), np.zeros(n)
    at = speed = 0.0
    rng = np.random.default_rng(3)
    for k in range(n):
        y[k] = np.round(at)
        error = u[k] - y[k]
        command[k] = np.round(2.0 * error - 0.04 * speed + 0.5 * rng.standard_normal())
        for _ in range(10):
            speed += 0.1 * h * (600.0 * command[k] - 30.0 * speed - 4e3 * np.tanh(speed))
            at += 0.1 * h * speed
    found = propose(tmp_path, "t,u,v,theta", t, np.round(u), command, y)
    assert columns(found) == {"t": "t", "r": "u", "y": "theta", "u": "v"}


@pytest.mark.parametrize("measured", ["Ms", "Len"])
def test_axes_go_by_the_first_word_of_what_is_commanded_and_what_moves(
    measured: str, joint: dict[str, Array], other: dict[str, Array], tmp_path: Path
) -> None:
    """No header speaks of a position, and the other axis has a command that is always the same."""
    table = (T, joint["F"], 0.0 * T + 7.5, 0.0 * T, joint["y"], other["y"])
    headers = f"Time,Boom Cmd,Stick Cmd,Swing Cmd,Boom {measured},Stick {measured}"
    headers += "" if measured == "Ms" else ",Stick Load"
    values = table if measured == "Ms" else (*table, other["F"])
    found = propose(tmp_path, headers, *values, axis="Boom")
    assert found.axes == ("boom", "stick") and found.axis == "boom"
    assert columns(found) == {"t": "Time", "y": f"Boom {measured}", "u": "Boom Cmd"}


@pytest.mark.parametrize("driven", [False, True])
def test_a_current_of_the_motor_that_the_body_turns_is_no_drive(
    joint: dict[str, Array], tmp_path: Path, driven: bool
) -> None:
    v = np.gradient(plain(joint), T)
    noise = 1e-3 * np.std(v) * np.random.default_rng(2).standard_normal(len(T))
    voltage = joint["F"] if driven else np.zeros(len(T))
    table = (T, plain(joint), np.asarray(-0.006 * (v + noise)), voltage)
    if driven:
        propose(tmp_path, "t,theta,current,Vm", *table)
        return
    with pytest.raises(BadLog, match="nothing drives: the command 'Vm' is always 0, and 'current'"):
        propose(tmp_path, "t,theta,current,Vm", *table)


def test_a_joint_may_slide(joint: dict[str, Array], tmp_path: Path) -> None:
    found = propose(tmp_path, "t,lift_joint_pos,lift_joint_effort", T, plain(joint), joint["F"])
    assert found.motion == "rotary"
    assert next(one for one in found.rig if one.key == "motion").rival == "linear"


def test_a_sign_bit_is_named_and_nothing_is_fitted(joint: dict[str, Array], tmp_path: Path) -> None:
    raw = np.round(2000.0 * joint["y"])
    raw = np.where(raw < 0.0, 32768.0 - raw, raw)
    with pytest.raises(BadLog, match=r"jumps by 32768 .*sign and magnitude, bit 15") as refused:
        propose(tmp_path, "t,pos,torque", T, raw, joint["F"])
    assert "\n" not in str(refused.value)


def test_a_clock_that_a_velocity_denies_is_named(joint: dict[str, Array], tmp_path: Path) -> None:
    headers = "time [s],angle [rad],speed [rad/s],torque [Nm]"
    found = propose(tmp_path, headers, 0.5 * T, joint["y"], joint["v"], joint["F"])
    assert any("the clock runs 2 times too slow" in one for one in found.remarks)
    found = propose(tmp_path, headers, T, joint["y"], joint["v"], joint["F"])
    assert not any("the clock runs" in one for one in found.remarks)


def test_a_velocity_makes_sure_of_a_position(joint: dict[str, Array], tmp_path: Path) -> None:
    found = propose(tmp_path, "time [s],angle,speed [deg/s],torque [Nm]", T,
                    joint["y"] * 180.0 / np.pi, joint["v"] * 180.0 / np.pi, joint["F"])  # fmt: skip
    one = found.signal("y")
    assert one is not None and (one.unit, one.sure) == ("deg", True)


def test_sizes_alone_make_nothing_sure(joint: dict[str, Array], tmp_path: Path) -> None:
    found = propose(tmp_path, "time,position,force", T, plain(joint), joint["F"])
    assert [one.name for one in found.signals if one.sure] == []
    motion = next(one for one in found.rig if one.key == "motion")
    assert (motion.sure, motion.rival) == (False, "rotary")
    turned = with_rig(found, "motion", "+")
    assert turned.motion == "rotary"
    units = {one.name: one.unit for one in turned.signals}
    assert units["F"] == "N m" and units["y"] in ("rad", "deg")


def test_the_other_guess_is_one_key_away(joint: dict[str, Array], tmp_path: Path) -> None:
    found = propose(tmp_path, "time [s],angle,torque", T, plain(joint), joint["F"])
    y = found.signal("y")
    assert y is not None and y.rival
    after = with_signal(found, "y", "+").signal("y")
    assert after is not None and y.rival in (after.unit, str(after.column))
    with pytest.raises(BadAnswer, match="nothing else"):
        with_signal(found, "t", "+")


def test_columns_of_one_name_are_named(joint: dict[str, Array], tmp_path: Path) -> None:
    found = propose(tmp_path, "t,angle,torque,torque", T, joint["y"], joint["F"], 0.0 * T)
    assert columns(found)["F"] == 2
    assert any("columns 2 and 3 (from 0) are all named 'torque'" in one for one in found.remarks)


@pytest.mark.parametrize("turned", [False, True])
def test_arrays_of_numpy_are_tables(joint: dict[str, Array], tmp_path: Path, turned: bool) -> None:
    rows = np.column_stack([T, joint["y"], joint["F"]])
    np.save(tmp_path / "run.npy", rows.T if turned else rows)
    found = proposed(tmp_path / "run.npy")
    assert {one.name: one.column for one in found.signals if one.name in "ty"} == {"t": 0, "y": 1}
    np.savez(tmp_path / "run.npz", time=T, q=np.stack([joint["y"], joint["v"]]), tau=joint["F"])
    assert columns(proposed(tmp_path / "run.npz"))["F"] == "tau"


def test_python_objects_in_arrays_are_never_unpickled(tmp_path: Path) -> None:
    np.save(tmp_path / "run.npy", np.array([{}, []], dtype=object), allow_pickle=True)
    with pytest.raises(BadLog, match="holds Python objects") as refused:
        proposed(tmp_path / "run.npy")
    assert "\n" not in str(refused.value)


def test_a_comma_for_both_is_refused_in_those_words(tmp_path: Path) -> None:
    rows = [f"{k // 100},{k % 100:02d},{k},{k % 7}" for k in range(300)]
    (tmp_path / "run.csv").write_text("\n".join(["Zeit_s,Kraft_N", *rows]), "utf-8")
    with pytest.raises(BadLog, match="a comma both parts the columns and is the decimal sign"):
        proposed(tmp_path / "run.csv")


def test_stamps_and_bars_are_read(joint: dict[str, Array], tmp_path: Path) -> None:
    rows = [
        f"2024-05-01T10:00:{t:06.3f}Z,|,{y:.6f},|,{F:.5f}"
        for t, y, F in zip(T, joint["y"], joint["F"], strict=True)
    ]
    (tmp_path / "run.csv").write_text("\n".join(["stamp,s1,q,s2,tau", *rows]), "utf-8")
    found = proposed(tmp_path / "run.csv")
    assert columns(found) == {"t": "stamp", "y": "q", "F": "tau"}
    assert found.unused["'s1'"] == "'|' alone"


@pytest.mark.parametrize(("least", "counts"), [(-32768.0, "4096"), (0.0, "65536")])
def test_a_counter_that_overflows_is_unwrapped(
    joint: dict[str, Array], tmp_path: Path, least: float, counts: str
) -> None:
    counted: Array = np.round(2e5 * joint["y"] / np.std(joint["y"])).astype(np.float64)
    whole: Array = (counted - least) % 65536.0 + least
    found = propose(
        tmp_path, "time_s,position_counts,torque_Nm", T, whole, joint["F"],
    )  # fmt: skip
    assert columns(found) == {"t": "time_s", "y": "position_counts", "F": "torque_Nm"}
    own = {one.name: one for one in found.signals}
    assert own["F"].gain is None and own["y"].gain == f"{counts} count/turn"
    assert not own["y"].sure
    assert any("leaps by 65536" in one and "a counter of 16 bits" in one for one in found.remarks)


def test_chinese_headers_give_units_and_a_current(joint: dict[str, Array], tmp_path: Path) -> None:
    found = propose(tmp_path, "时间(秒),实际位置(度),电流(安培)", T, joint["y"], joint["F"])
    assert [(one.unit, one.sure) for one in found.signals] == [
        ("s", True), ("deg", True), ("A", True)
    ]  # fmt: skip
    found = propose(tmp_path, "时间,反馈位置,电流反馈", T, joint["y"], joint["F"])
    assert found.signals[-1].name == "u" and found.signals[-1].unit == "A"


def test_dates_of_parquet_are_a_clock(joint: dict[str, Array], tmp_path: Path) -> None:
    stamps = np.datetime64("2026-05-03", "ns") + np.round(1e9 * T).astype("m8[ns]")
    table = {"time": stamps, "pos": plain(joint), "tau": joint["F"]}
    pq.write_table(pa.table(table), tmp_path / "run.parquet")
    assert columns(proposed(tmp_path / "run.parquet"))["t"] == "time"


def test_a_position_that_only_rises_is_no_clock(tmp_path: Path) -> None:
    y = np.cumsum(1e-3 * (2.0 + np.sin(3.0 * T)))
    np.savetxt(tmp_path / "run.csv", np.column_stack([T, y, np.cos(3.0 * T)]), delimiter=",",
               header="t,position,current", comments="")  # fmt: skip
    found = columns_of(read_unknown(tmp_path / "run.csv"), NOTATION)
    assert [one.raw.header for one in found.signals] == ["position", "current"]


def test_what_else_was_measured_is_offered(
    joint: dict[str, Array], other: dict[str, Array], tmp_path: Path
) -> None:
    """Another angle may be what the rest depends on; whoever knows takes the # away."""
    found = propose(
        tmp_path, "t,pos arm,u arm,pos rod", T, joint["y"], joint["u0"], other["y"], axis="arm"
    )
    assert found.extra == {"pos_rod": "pos rod"}
    path = tmp_path / "card.toml"
    path.write_text(written(found).replace("# [signals.extra]", "[signals.extra]"), "utf-8")
    text = path.read_text("utf-8").replace("# pos_rod = {", "pos_rod = {")
    path.write_text(text.replace("# force_per_command = ...", "force_per_command = 1.0"), "utf-8")
    assert load_card(path).signals["pos_rod"].column == "pos rod"


@pytest.mark.parametrize("rows", [5000, 25000])
def test_the_rate_of_counted_samples_is_found_in_short_and_long_logs(
    rows: int, tmp_path: Path
) -> None:
    t, w = 1e-3 * np.arange(rows), np.pi
    y = 20.0 * np.sin(w * t) + 5.0 * np.sin(2.7 * w * t + 1.0)
    v = np.gradient(y, t)
    F = 15.0 * np.sign(v) + 0.2 * v + 2e-3 * np.gradient(v, t)
    noise = 0.01 * np.random.default_rng(1).standard_normal((2, rows))
    columns = (np.arange(rows, dtype=np.float64), np.round(y, 3), v + noise[0], F + noise[1])
    one = propose(tmp_path, "sample,pos [mm],vel [mm/s],force [N]", *columns).signal("t")
    assert one is not None and (one.unit, one.gain) == ("1", "1000 1/s")
