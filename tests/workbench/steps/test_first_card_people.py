"""A first card of files as people have them: their layouts, and names that no word list holds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from benchmarks.init_people import KINDS, make_file
from benchmarks.init_real_tables import fewest_wrong, machine
from benchmarks.init_table_words import KINDS as TABLES
from design.first_card.answers import BadAnswer, with_rig
from design.first_card.proposal import Proposal
from identification.arrays import Array
from identification.errors import BadLog
from workbench.cards.card import load_card
from workbench.logs.runs import read_runs
from workbench.page.drops import OTHER_FIELD, form_of, stored_form
from workbench.steps.first_card.proposal import proposed, with_signal
from workbench.steps.first_card.written import checked_proposal, written

T: Array = np.asarray(2e-3 * np.arange(5000), dtype=np.float64)


@pytest.fixture(scope="module")
def joint() -> dict[str, Array]:
    """The signals of a joint behind a limited loop, in SI."""
    return machine(np.random.default_rng(5), T, TABLES["choose"][0])


def propose(folder: Path, headers: str, *columns: Array) -> Proposal:
    rows = (",".join(f"{one:.9g}" for one in row) for row in np.column_stack(columns).tolist())
    path = folder / "run.csv"
    path.write_text("\n".join([headers, *rows]), "utf-8")
    return proposed(path)


@pytest.mark.parametrize("seed", range(len(KINDS)), ids=[one.said for one in KINDS])
def test_a_file_of_each_layout_is_right(tmp_path: Path, seed: int) -> None:
    table = make_file(100 * len(KINDS) + seed, "choose", tmp_path)
    assert fewest_wrong(proposed(table.path), table) == {}


def test_the_other_kind_is_one_key_away(joint: dict[str, Array], tmp_path: Path) -> None:
    found = propose(tmp_path, "t,a1,a2", T, joint["y"], joint["F"])
    kind = next(one for one in found.rig if one.key == "kind")
    assert not kind.sure and {found.kind, kind.rival} == {"force", "motor"}
    other = with_rig(found, "kind", "+")
    assert other.kind == kind.rival
    assert other.signal("F" if other.kind == "force" else "u") is not None
    assert with_rig(other, "kind", "+").kind == found.kind
    with pytest.raises(BadAnswer, match="'steam': "):
        with_rig(found, "kind", "steam")
    (tmp_path / "card.toml").write_text(written(other), "utf-8")
    assert read_runs(tmp_path / "run.csv", load_card(tmp_path / "card.toml")).runs


def test_a_command_that_is_the_velocity_may_be_a_valves(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-5.0, 5.0, 50), 100)
    v = np.convolve(0.02 * u, np.exp(-np.arange(60) / 10.0) / 10.5)[: len(T)]
    y = np.cumsum(v) * 2e-3 + 1e-6 * rng.standard_normal(len(T))
    found = propose(tmp_path, "time_s,stroke_m,valve_V", T, y, u + 0.2 * np.sign(u))
    assert found.kind == "velocity"
    assert with_rig(found, "kind", "+").kind == "motor"
    named = propose(tmp_path, "time_s,stroke_m,command_V", T, y, u + 0.2 * np.sign(u))
    assert named.kind == "motor"
    assert with_rig(named, "kind", "+").kind == "velocity"


def test_an_error_drives_nothing_and_names_its_reference(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    """The difference of two columns is an error, whatever it is called."""
    y = joint["y"] + 1e-5 * np.random.default_rng(1).standard_normal(len(T))
    found = propose(
        tmp_path, "t,c1,c2,c3,c4,c5", T, joint["r"] - y, y, joint["target"], joint["F"], joint["r"]
    )
    columns = {one.name: one.column for one in found.signals}
    assert columns["y"] == "c2" and columns["r"] == "c5"
    assert "c4" in (columns.get("F"), columns.get("u"))


def test_what_is_hardly_identifiable_stands_in_the_card(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    zoh = joint["y"][(np.arange(len(T)) // 10) * 10]
    found = checked_proposal(
        propose(tmp_path, "time [s],angle [rad],torque [Nm]", T, zoh, joint["F"])
    )
    assert any("the position is renewed at 50 Hz" in one for one in found.hardly)
    assert "# the position is renewed at 50 Hz" in written(found)
    assert found.as_json()["hardly_told"] == found.hardly
    sound = checked_proposal(
        propose(tmp_path, "time [s],angle [rad],torque [Nm]", T, joint["y"], joint["F"])
    )
    assert sound.hardly == () and sound.refused == ""


def test_the_pages_form_takes_the_other_of_a_guess(joint: dict[str, Array], tmp_path: Path) -> None:
    y = joint["y"] + 1e-4 * np.random.default_rng(1).standard_normal(len(T))
    found = propose(tmp_path, "t,a1,a2", T, y, joint["F"])
    form = form_of(found, "run.csv")
    rival = next(one.rival for one in found.rig if one.key == "kind")
    assert form.others["kind"][0] == rival
    after = form.with_fields({**form.fields, OTHER_FIELD: "kind"})
    assert after["kind"] == rival
    again = after.with_fields({**after.fields, OTHER_FIELD: "kind"})  # and back by the same button
    assert again.fields == {**again.fields, **form.fields}
    drive = {"force": "F", "motor": "u"}
    assert after[f"column_{drive[rival]}"] == form[f"column_{drive[found.kind]}"]
    assert after[f"column_{drive[found.kind]}"] == ""
    assert f"else {rival}" in form.text("run.csv").partition("motion")[0]
    assert f"else {form['kind']}" in after.text("run.csv").partition("motion")[0]
    turned = form.with_fields({**form.fields, OTHER_FIELD: "motion"})
    assert turned["motion"] != form["motion"] and turned["unit_y"] != form["unit_y"]


def test_the_pages_form_is_kept_with_guesses_of_columns(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    noise = np.random.default_rng(1).standard_normal((2, len(T)))
    y = joint["y"] + 1e-4 * noise[0]
    form = form_of(propose(tmp_path, "t,a1,a2", T, y, joint["F"] + 0.5 * noise[1]), "run.csv")
    form.store(tmp_path)
    assert not all(sure for sure, _ in form.why.values())
    kept = stored_form(tmp_path)
    assert kept is not None and kept.why == form.why and kept.others == form.others


def test_a_sign_is_turned_only_where_the_force_tells_it(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    headers = "time [s],angle [rad],torque [Nm]"
    found = propose(tmp_path, headers, T, joint["y"], -joint["F"])
    assert found.signal("F").gain == -1.0  # type: ignore[union-attr]
    swing = 0.9 * np.sin(1.9 * T) + 0.5 * np.sin(4.8 * T + 1.0)
    noise = 1e-4 * np.random.default_rng(1).standard_normal((2, len(T)))
    weight = -2.5 * np.sin(swing + noise[0]) + 100.0 * noise[1]
    found = propose(tmp_path, headers, T, swing + noise[0], weight)
    assert found.signal("F").gain is None  # type: ignore[union-attr]


def test_a_clock_of_ticks_counts_from_its_epoch(joint: dict[str, Array], tmp_path: Path) -> None:
    ticks = 133_500_000_000_000_000 + np.round(1e7 * T)
    rows = [
        f"{int(t)},{y:.9g},{F:.9g}" for t, y, F in zip(ticks, joint["y"], joint["F"], strict=True)
    ]
    path = tmp_path / "run.csv"
    path.write_text("\n".join(["stamp,angle [rad],torque [Nm]", *rows]), "utf-8")
    t = proposed(path).signal("t")
    assert t is not None and (t.unit, t.gain, t.sure) == ("1", "10000000 1/s", True)


def test_a_row_number_is_no_clock_beside_one(joint: dict[str, Array], tmp_path: Path) -> None:
    rows = np.arange(float(len(T)))
    found = propose(tmp_path, ",k0,a1,a2", rows, T, joint["y"], joint["F"])
    assert found.signal("t").column == "k0"  # type: ignore[union-attr]


def test_axes_need_more_than_names_of_their_own(joint: dict[str, Array], tmp_path: Path) -> None:
    """A position, its reference and its target are no axes, whatever they are called."""
    found = propose(tmp_path, "t,c1 [rad],c2 [rad],c3 [rad],c4 [Nm]", T, joint["y"], joint["r"],
                    joint["target"], joint["F"])  # fmt: skip
    assert found.axes == ()
    assert {one.name: one.column for one in found.signals}["y"] == "c1 [rad]"


def test_a_proposal_keeps_its_other_through_answers(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    found = propose(tmp_path, "t,a1,a2", T, joint["y"], joint["F"])
    assert replace(found, name="b").other is found.other
    assert with_rig(found, "kind", "").kind == found.kind


@pytest.mark.parametrize(
    "headers",
    [
        "time,rpm,voltage",
        "time_s,Speed actual,torque_Nm",
        "t,omega [rad/s],Force_N",
        "t,deg/s,iq_A",
    ],
)
def test_a_speed_is_no_position(joint: dict[str, Array], tmp_path: Path, headers: str) -> None:
    """Beside a position it is none; without one a card has its sum, in the speed's own unit."""
    found = propose(tmp_path, headers + ",angle_deg", T, joint["v"], joint["F"], joint["y"])
    assert {one.name: one.column for one in found.signals}["y"] == "angle_deg"
    y = propose(tmp_path, headers, T, joint["v"], joint["F"]).signal("y")
    assert y is not None and (y.column, y.summed) == (headers.split(",")[1], True)
    assert y.unit == {"rpm": "rpm", "deg/s": "deg/s", "omega [rad/s]": "rad/s"}.get(
        str(y.column), "rad/s"
    )


def test_a_summed_speed_is_read_as_the_position(joint: dict[str, Array], tmp_path: Path) -> None:
    rpm = joint["v"] * 30.0 / np.pi
    rpm[100:103] = np.nan
    found = checked_proposal(propose(tmp_path, "t_s,n_rpm,torque_Nm", T, rpm, joint["F"]))
    assert not found.refused
    (tmp_path / "card.toml").write_text(written(found), "utf-8")
    read = read_runs(tmp_path / "run.csv", load_card(tmp_path / "card.toml"))
    (run,) = read.runs
    y = joint["y"] - joint["y"][0]
    assert np.max(np.abs(run["y"] - y)) < 0.02 * np.ptp(y)
    assert any("the speed 'n_rpm' summed over time" in one for one in read.remarks)


def test_of_several_speeds_each_has_its_axis(joint: dict[str, Array], tmp_path: Path) -> None:
    other = np.roll(joint["v"], 700), np.roll(joint["F"], 700)
    headers = "t_s,leftSpeed,leftCommand,rightSpeed,rightCommand"
    propose(tmp_path, headers, T, joint["v"], joint["F"], *other)
    for axis in ("left", "right"):
        found = proposed(tmp_path / "run.csv", axis=axis)
        columns = {one.name: one.column for one in found.signals}
        assert (columns["y"], columns["u"]) == (f"{axis}Speed", f"{axis}Command")


@pytest.mark.parametrize("header", ["timestep [us]", "dt_us", ""])
@pytest.mark.parametrize("even", [True, False])
def test_the_time_from_row_to_row_is_summed(
    joint: dict[str, Array], tmp_path: Path, header: str, even: bool
) -> None:
    steps = np.full(len(T), 2000.0)
    if not even:
        steps += np.random.default_rng(1).integers(-200, 900, len(T))
    headers = f"{header},torque [Nm],angle [rad]" if header else ""
    if even and not header:  # a column of one value says nothing without a name
        return
    t = 1e-6 * (np.cumsum(steps) - steps[0])
    at = {name: np.interp(t, T, joint[name]) for name in ("F", "y")}
    propose_lines = [headers] * bool(header)
    rows = np.column_stack([steps * (1.0 if header else 1e-6), at["F"], at["y"]]).tolist()
    path = tmp_path / "run.csv"
    path.write_text("\n".join([*propose_lines, *(",".join(map(repr, row)) for row in rows)]))
    found = proposed(path)
    clock = found.signal("t")
    assert clock is not None and clock.summed and clock.unit == ("us" if header else "s")
    (tmp_path / "card.toml").write_text(written(found), "utf-8")
    runs = read_runs(path, load_card(tmp_path / "card.toml")).runs
    assert sum(run.duration for run in runs) == pytest.approx(t[-1], rel=1e-2)


def test_a_second_position_in_volts_is_no_command(joint: dict[str, Array], tmp_path: Path) -> None:
    volts = 2.5 + 0.4 * joint["y"] + 1e-3 * np.random.default_rng(2).standard_normal(len(T))
    headers = "t_s,torque [Nm],angle [rad],hall_voltage [V]"
    found = propose(tmp_path, headers, T, joint["F"], joint["y"], volts)
    assert found.signal("u") is None and found.signal("F") is not None


def test_volts_of_every_channel_tell_nothing_of_one(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    """A scope's channels: a position by a potentiometer, a current by a shunt."""
    y, u = 2.5 + 0.5 * joint["y"], 0.1 * joint["F"]
    noise = 1e-4 * np.random.default_rng(4).standard_normal((2, len(T)))
    rows = zip((T - 5.0).tolist(), (y + noise[0]).tolist(), (u + noise[1]).tolist(), strict=True)
    lines = ["x-axis,1,2", "second,Volt,Volt", *(",".join(f"{x:+.6E}" for x in r) for r in rows)]
    (tmp_path / "run.csv").write_text("\n".join(lines))
    found = checked_proposal(proposed(tmp_path / "run.csv"))
    one = found.signal("y")
    assert one is not None and (one.column, one.unit, one.sure) == ("1", "V", False)
    assert str(one.gain).partition(" ")[2].startswith("V/") and not found.refused


def test_the_increment_of_a_scope_is_the_time_of_a_sample(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    rows = enumerate(np.column_stack([2.5 + joint["y"], 0.1 * joint["F"]]).tolist())
    lines = ["X,CH1,CH2,Start,Increment,", "Sequence,VOLT,VOLT,-1.0e+01,2.000e-03"]
    lines += [f"{k},{a:.6e},{b:.6e},," for k, (a, b) in rows]
    (tmp_path / "run.csv").write_text("\n".join(lines))
    found = checked_proposal(proposed(tmp_path / "run.csv"))
    t = found.signal("t")
    assert t is not None and (t.column, t.gain, t.sure) == ("X", "500 1/s", True)
    assert not found.refused


@pytest.mark.parametrize(("turn", "unit"), [(2.0 * np.pi, "rad"), (360.0, "deg"), (1.0, "turn")])
def test_the_weight_of_an_arm_tells_an_angle_and_its_unit(
    tmp_path: Path, turn: float, unit: str
) -> None:
    y = 1.2 * np.sin(1.3 * T) + 0.5 * np.sin(3.1 * T + 1.0)
    v, a = np.gradient(y, T), np.gradient(np.gradient(y, T), T)
    u = 0.1 * a + 0.3 * v + 0.8 * np.sign(v)
    headers, of_turn = "t_s,pos,current", turn / (2.0 * np.pi)
    found = propose(tmp_path, headers, T, of_turn * y, u + 3.0 * np.sin(y))
    place = found.signal("y")
    assert place is not None and (found.motion, place.unit) == ("rotary", unit)
    assert propose(tmp_path, headers, T, of_turn * y, u + 2.0 * y).motion == "linear"  # a spring


def test_a_position_in_percent_of_its_travel_is_one(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    share = 50.0 + 20.0 * joint["y"]
    found = propose(tmp_path, "t_s,valve stem position [%],force_N", T, share, joint["F"])
    y = found.signal("y")
    assert y is not None and (y.column, y.unit) == ("valve stem position [%]", "%")
    assert str(y.gain).partition(" ")[2].startswith("%/")
    assert not checked_proposal(found).refused


def test_two_positions_that_move_as_one_have_two_drives(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    beside = joint["y"] + 1e-3 * np.sin(40.0 * joint["y"])
    part = 0.6 + 0.05 * np.sin(T)
    shares = part * joint["F"], (1.0 - part) * joint["F"]
    headers = "t_s,X1.pos [rad],X2.pos [rad],X1.torque [Nm],X2.torque [Nm]"
    found = propose(tmp_path, headers, T, joint["y"], beside, *shares)
    assert any("two drives push one body" in one for one in found.remarks)
    apart = propose(tmp_path, headers, T, joint["y"], np.roll(beside, 800), *shares)
    assert not any("two drives" in one for one in apart.remarks)


def test_a_single_sampling_time_makes_the_clock(joint: dict[str, Array], tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    savemat(path, {"Ts": 2e-3, "u": joint["F"][:, None], "y": joint["y"][:, None]})
    found = checked_proposal(proposed(path))
    t = found.signal("t")
    assert t is not None and (t.column, t.unit, t.summed) == ("Ts", "s", True)
    (tmp_path / "card.toml").write_text(written(found), "utf-8")
    (run,) = read_runs(path, load_card(tmp_path / "card.toml")).runs
    assert len(run) == len(T) and run.h == pytest.approx(2e-3)


def test_letters_that_tell_columns_apart_are_no_units(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    turn = 40.0 * joint["y"]
    noise = np.random.default_rng(6).standard_normal((3, len(T)))
    phases = [np.round(2048.0 + 100.0 * joint["F"] * np.cos(turn - k * 2.0944) + noise[k])
              for k in range(3)]  # fmt: skip
    headers = "t_s,angle_mrad,iq_mA,adc_a,adc_b,adc_c"
    angle = np.round(1e3 * np.mod(turn, 2.0 * np.pi))
    found = propose(tmp_path, headers, T, angle, 1e3 * joint["F"], *phases)
    assert {one.name: one.column for one in found.signals} == {
        "t": "t_s", "y": "angle_mrad", "u": "iq_mA",
    }  # fmt: skip
    assert any("leaps by 6283" in one for one in found.remarks)


def test_what_a_controllers_output_follows_is_no_command(tmp_path: Path) -> None:
    """Of r, k (r - y) and y the first is the reference, though its header says u."""
    r = np.sin(2.0 * np.pi * (1.0 + 0.1 * T) * T)
    y, v, zoh = np.zeros(len(T)), 0.0, np.zeros(len(T))
    for k in range(1, len(T)):
        zoh[k - 1] = 30.0 * (r[k - 1] - y[k - 1]) - 0.2 * v
        v += 2e-3 * (40.0 * zoh[k - 1] - 25.0 * v - 15.0 * np.sign(v))
        y[k] = y[k - 1] + 2e-3 * v
    found = propose(tmp_path, "t,u,v,$\\theta$", T, 50.0 * r, 50.0 * zoh, 50.0 * y)
    columns = {one.name: one.shown for one in found.signals}
    assert (columns["r"], columns["u"]) == ("'u'", "'v'")


def test_another_column_is_called_one(joint: dict[str, Array], tmp_path: Path) -> None:
    """In a file without names a number alone beside a unit says nothing."""
    path = tmp_path / "run.csv"
    np.savetxt(path, np.column_stack([T, joint["y"], joint["u"], joint["F"]]), delimiter=",")
    found = proposed(path)
    one = next(one for one in found.signals if one.rival.startswith("column "))
    after = with_signal(found, one.name, "+").signal(one.name)
    assert after is not None and f"column {after.column}" == one.rival


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_sign_of_a_reference_that_comes_back_is_open(tmp_path: Path, sign: float) -> None:
    """Half a period on it is as alike: unturned it counts, turned it is a guess."""
    phase = 2.0 * np.pi * (2.0 + 0.02 * T) * T
    y = np.sin(phase - 0.4) * (1.0 + 0.2 * np.sin(0.3 * phase))
    drive = np.gradient(np.gradient(y)) + 2e-4 * np.sign(np.gradient(y))
    found = propose(tmp_path, "time_s,target_mm,position_mm,current_A", T, sign * np.sin(phase), y,
                    1e4 * drive)  # fmt: skip
    one = found.signal("r")
    assert one is not None and one.gain == (None if sign > 0.0 else -1.0)
    assert one.sure == (sign > 0.0)
    late = next(text for text in found.remarks if text.startswith("the position follows"))
    assert float(late.split()[-2]) == pytest.approx(29.0, abs=4.0)


def test_what_a_model_says_is_no_reference(joint: dict[str, Array], tmp_path: Path) -> None:
    y = joint["y"]
    late = np.concatenate([np.full(6, y[0]), y[:-6]])
    with pytest.raises(BadLog, match="no column moves as a body"):
        propose(tmp_path, "time_s,position_simulated,position_measured", T, y, late)


def test_noise_that_nothing_follows_is_no_command(joint: dict[str, Array], tmp_path: Path) -> None:
    noise = 2e-3 * np.random.default_rng(1).standard_normal(len(T))
    found = propose(tmp_path, "t,angle_deg,torque_Nm,motor_current_A", T, joint["y"], joint["F"],
                    noise)  # fmt: skip
    assert found.kind == "force" and found.signal("u") is None
    assert "noise" in found.unused["'motor_current_A'"]


@pytest.mark.parametrize("headers", ["commanded_steps,encoder_mm", "target_mm,position_mm"])
def test_a_reference_and_a_position_alone_are_refused(
    joint: dict[str, Array], tmp_path: Path, headers: str
) -> None:
    y = joint["y"]
    late = np.concatenate([np.full(6, y[0]), y[:-6]])
    with pytest.raises(BadLog, match="follows its reference") as refused:
        propose(tmp_path, f"time_s,{headers}", T, np.round(4e3 * y), late)
    assert "log its current, torque or force too" in str(refused.value)


@pytest.mark.parametrize(("header", "reported"), [("PI_output_A", True), ("current_A", False)])
def test_a_controllers_output_may_lack_what_is_fed_forward(
    joint: dict[str, Array], tmp_path: Path, header: str, reported: bool
) -> None:
    found = propose(tmp_path, f"time_s,angle_deg,{header}", T, joint["y"], joint["u"])
    assert found.kind == "motor"
    assert any("feedforward of its own" in one for one in found.remarks) == reported


def test_a_column_that_stands_twice_is_in_no_other_unit(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    y = joint["y"]
    found = propose(tmp_path, "t,a,b,c,torque_Nm", T, y, y, 57.3 * y, joint["F"])
    said = sorted(found.unused[f"'{one}'"] for one in "abc" if f"'{one}'" in found.unused)
    assert [one.partition("'")[0] for one in said] == ["equals ", "is "]


def test_three_currents_whose_sum_is_0_drive_nothing_by_themselves(
    joint: dict[str, Array], tmp_path: Path
) -> None:
    rng, at = np.random.default_rng(4), 12.0 * joint["y"]
    phases = [
        joint["F"] * np.sin(at - k * 2.0 * np.pi / 3.0) + 1e-3 * rng.standard_normal(len(T))
        for k in range(3)
    ]
    headers = "t_s,angle_rad,i_u_A,i_v_A,i_w_A"
    with pytest.raises(BadLog, match="'i_u_A', 'i_v_A', 'i_w_A' are the three phase currents"):
        propose(tmp_path, headers, T, joint["y"], *phases)
    found = propose(tmp_path, f"{headers},i_q_A", T, joint["y"], *phases, joint["F"])
    u = found.signal("u")
    assert u is not None and u.column == "i_q_A"
    assert set(found.unused.values()) == {"one of three phase currents, whose sum is 0"}


def test_rows_that_were_stamped_late_have_a_clock(joint: dict[str, Array], tmp_path: Path) -> None:
    stamped = T.copy()
    stamped[70::90] = stamped[71::90]
    found = propose(tmp_path, "time_s,angle_rad,torque_Nm", stamped, joint["y"], joint["F"])
    t = found.signal("t")
    assert t is not None and t.column == "time_s"
    assert any("stamped late, taken as even rows" in one for one in found.remarks)
