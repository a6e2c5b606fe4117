"""Tables of controls, each read back by a reader of its own and held against the model."""

import ctypes
import shutil
import subprocess
from configparser import ConfigParser
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from design.generated.compensation import Compensation, TableFile, TablesAsked
from design.generated.tables import Tables, tables
from design.machine.model import Model
from design.machine.readable import Display
from identification.errors import BadModel, UserError
from identification.model.estimates import Estimate
from identification.model.karnopp import slip_friction
from tests.workbench.export import table_readers as read
from tests.workbench.export.models import COGGING, PLACE, PLAY, STRIBECK, linear, lost, rotary
from tests.workbench.export.structured_text_runner import Blocks
from workbench.export.filled import filled
from workbench.export.table_targets import tables_asked

ONE_PER_CENT = 0.01
NOT_IDENTIFIABLE = Estimate(None, "N", reason="too weak; log longer", assumed=0.02)
SCREW = 0.01  # m a turn


def made(model: Model, *targets: str, controls: tuple[str, ...] = (), **asked: Any) -> Tables:
    return tables(Compensation(model, TablesAsked(**asked)), targets, controls, filled)


def one(found: Tables, ending: str) -> TableFile:
    (file,) = (each for each in found.files if each.name.endswith(ending))
    return file


def velocities(model: Model, n: int = 500) -> np.ndarray[Any, Any]:
    """Both ways over the range of a table."""
    assert model.speed is not None
    v = np.geomspace(1e-3 * model.speed, model.speed, n)
    return np.concatenate([-v[::-1], v])


def sliding(model: Model, v: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Friction (1) while sliding, and Stribeck's as it is written in the textbook."""
    p = replace(model.karnopp, dv_p=0.0, dv_n=0.0)
    F = slip_friction(v, p)
    if "stribeck" in model.effects:
        s = {name: e.value or 0.0 for name, e in model.effects["stribeck"].items()}
        d = np.sign(v)
        fall = np.exp(-((np.abs(v) / s["v_s"]) ** s["delta"]))
        F = F + d * s["F_s"] * (1 + s["asymmetry"] * d) * fall
    return np.asarray(F)


def mean_of_both(model: Model, v: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    return np.asarray(0.5 * (sliding(model, v) - sliding(model, -v)))


MODELS = {
    "linear": linear(),
    "stribeck": linear(STRIBECK),
    "rotary": rotary(),
    "rotary stribeck": rotary({"stribeck": {"F_s": 0.03, "v_s": 3.0, "delta": 1.0}}),
}


@pytest.mark.parametrize("name", MODELS)
def test_the_neutral_table_has_both_directions(name: str) -> None:
    model = MODELS[name]
    head, rows = read.neutral(one(made(model, "friction-table"), "known_friction.csv").text)
    assert head == (
        ["speed [rad/s]", "force moving positive [N m]", "force moving negative [N m]"]
        if model.rotary
        else ["speed [mm/s]", "force moving positive [N]", "force moving negative [N]"]
    )
    v = velocities(model)
    x = rows[:, 0] * (1.0 if model.rotary else 1e-3)
    found = np.where(v > 0, np.interp(v, x, rows[:, 1]), np.interp(-v, x, rows[:, 2]))
    assert np.all(np.abs(found / sliding(model, v) - 1) < ONE_PER_CENT)


@pytest.mark.parametrize("per_turn", [None, SCREW])
@pytest.mark.parametrize("name", MODELS)
def test_the_list_of_twincat_cnc(name: str, per_turn: float | None) -> None:
    model, rated = MODELS[name], 1.3
    asked = {"rated": rated, "per_turn": per_turn}
    file = one(made(model, "friction-table", controls=("twincat",), **asked), "cnc_friction.lis")
    curve = read.cnc_friction(file.text, model.rotary, rated, per_turn)
    v = velocities(model)
    assert np.all(np.abs(curve(v) / mean_of_both(model, v) - 1) < ONE_PER_CENT)
    assert curve(np.zeros(1)) == 0.0 and file.error is not None and file.error < ONE_PER_CENT


@pytest.mark.parametrize("name", MODELS)
def test_the_characteristic_of_sinamics(name: str) -> None:
    model = MODELS[name]
    v = velocities(model)
    for per_turn in (None, SCREW):
        file = one(
            made(model, "friction-table", controls=("sinumerik",), per_turn=per_turn), ".txt"
        )
        assert file.points == 10
        if per_turn is not None:  # a motor that turns, by its lead
            units = (per_turn / 60, 2 * np.pi / per_turn)
            assert file.units == "rpm, N m"
        else:
            units = (2 * np.pi / 60, 1.0) if model.rotary else (1 / 60, 1.0)
            assert file.units == ("rpm, N m" if model.rotary else "m/min, N")
        curve = read.sinamics_friction(file.text, *units)
        assert np.all(np.abs(curve(v) / mean_of_both(model, v) - 1) < ONE_PER_CENT)


@pytest.mark.parametrize("name", MODELS)
def test_the_lincurve_of_linuxcnc_has_both_directions(name: str) -> None:
    model = MODELS[name]
    file = one(made(model, "friction-table", controls=("linuxcnc",)), ".hal")
    curve = read.hal_curve(file.text, np.pi / 180 if model.rotary else 1e-3)
    v = velocities(model)
    assert np.all(np.abs(curve(v) / sliding(model, v) - 1) < ONE_PER_CENT)
    assert np.array_equal(curve(2 * v[[0, -1]]), curve(v[[0, -1]]))  # held beyond
    assert not any("asymmetry" in cost.what for cost in file.costs)


@pytest.mark.parametrize("per_turn", [None, SCREW])
@pytest.mark.parametrize("name", ["linear", "rotary"])
def test_the_objects_of_an_ax8000(name: str, per_turn: float | None) -> None:
    model = MODELS[name]
    file = one(
        made(model, "friction-table", controls=("twincat",), per_turn=per_turn), "8000_friction.csv"
    )
    found = read.objects(file.text)
    assert set(found) == {(0x3144, 2), (0x3144, 3)}
    torque = 2 * np.pi / per_turn if per_turn else 1.0
    turns = model.rotary or per_turn is not None
    assert found[0x3144, 3][1] == ("N m s/rad" if turns else "N s/m")
    v = velocities(model)
    force = torque * (np.sign(v) * found[0x3144, 2][0] + found[0x3144, 3][0] * v * torque)
    assert np.all(np.abs(force / mean_of_both(model, v) - 1) < ONE_PER_CENT)


def test_two_numbers_say_what_a_bent_curve_costs_them() -> None:
    model = MODELS["stribeck"]
    file = one(made(model, "friction-table", controls=("twincat",)), "8000_friction.csv")
    found = read.objects(file.text)
    v = np.linspace(1e-3 * 0.3, 0.3, 4000)
    off = np.abs(found[0x3144, 2][0] + found[0x3144, 3][0] * v - mean_of_both(model, v)).max()
    (cost,) = (each for each in file.costs if "straight line" in each.what)
    assert cost.force == pytest.approx(off, rel=0.01) and off > 1.0
    elastic = replace(model, effects={**model.effects, **linear(
        {"presliding": {"sigma_0": 3e4}}).effects})  # fmt: skip
    file = one(made(elastic, "friction-table", controls=("twincat",), per_turn=SCREW),
               "8000_friction.csv")  # fmt: skip
    value, unit = read.objects(file.text)[0x3144, 1]
    assert value == pytest.approx(3e4 * (SCREW / 2 / np.pi) ** 2) and unit == "N m/rad"


def test_what_a_table_cannot_hold_is_said_in_newtons() -> None:
    model = linear({**STRIBECK, **COGGING, "rising_stiction": {"F_r": 2.0, "tau": 1.0}})
    found = made(model, "friction-table")
    v = velocities(model)
    half = 0.5 * np.max(np.abs(sliding(model, v) + sliding(model, -v)))
    for file in found.files:
        costs = {cost.what: cost.force for cost in file.costs}
        asymmetry = [force for what, force in costs.items() if what.startswith("asymmetry")]
        if file.control in ("twincat", "sinumerik"):
            assert asymmetry == [pytest.approx(half, rel=1e-3)]
        else:
            assert asymmetry == []
        assert not any(what.startswith("stiction") for what in costs)
        (size,) = (force for what, force in costs.items() if what.startswith("cogging:"))
        assert size is not None and 0.4 < size < 0.75
        (none,) = (force for what, force in costs.items() if what.startswith("rising stiction"))
        assert none is None
        assert all(line in file.text for line in costs)


def test_breakaway_beyond_the_table_is_said() -> None:
    for file in made(linear(), "friction-table", "c").files:
        costs = {cost.what: cost.force for cost in file.costs if "stiction" in cost.what}
        up, down = (costs[one] for one in sorted(costs, reverse=True))
        assert up == pytest.approx(20.76 - 16.97, abs=0.1)
        assert down == pytest.approx(21.8 - 18.13, abs=0.1)


def test_a_constant_share_of_the_asymmetry_is_named() -> None:
    p = replace(linear().karnopp, F_cn=30.0)
    friction = {**linear().friction, "F_cn": replace(linear().friction["F_cn"], value=p.F_cn)}
    file = one(made(replace(linear(), friction=friction), "friction-table"), ".txt")
    (cost,) = (each for each in file.costs if each.what.startswith("asymmetry"))
    assert "a constant -6.39 N beside it" in cost.what
    assert cost.force == pytest.approx((30 - 16.97) / 2, rel=0.02)


@pytest.mark.parametrize("model", [linear(COGGING), rotary({"cogging": {
    "a": 0.02, "b": 0.01, "period": 2 * np.pi / 7, "a_2": 0.004, "b_2": -0.003}})])  # fmt: skip
def test_cogging_by_orders_and_over_a_turn(model: Model) -> None:
    found = made(model, "cogging-table", per_turn=None if model.rotary else 0.048)
    _, orders = read.neutral(one(found, "known_cogging.csv").text)
    head, turn = read.neutral(one(found, "_turn.csv").text)
    unit = 1.0 if model.rotary else 1e-3
    y = turn[:, 0] * unit
    wanted = np.zeros(len(y))
    for e in model.effects.values():
        p = {name: each.value or 0.0 for name, each in e.items()}
        angle = 2 * np.pi * y / p["period"]
        wanted += p["a"] * np.sin(angle) + p["b"] * np.cos(angle)
        wanted += p["a_2"] * np.sin(2 * angle) + p["b_2"] * np.cos(2 * angle)
    within = ONE_PER_CENT * np.max(np.abs(wanted))
    assert np.max(np.abs(turn[:, 1] - wanted)) < within
    assert np.array_equal(turn[:, 2], -turn[:, 1]) and "compensating" in head[2]
    angle = 2 * np.pi * np.arange(len(y)) / len(y)
    waves = sum(a * np.cos(n * angle - np.radians(phase)) for n, _, a, phase in orders)
    assert np.max(np.abs(waves - wanted)) < within
    file = one(made(model, "cogging-table", controls=("twincat",),
                    per_turn=None if model.rotary else 0.048), "8000_cogging.csv")  # fmt: skip
    torque, count = read.ax8000_cogging(file.text)
    assert count == len(orders) <= 9
    travel = 1.0 if model.rotary else 0.048 / (2 * np.pi)
    assert np.max(np.abs(torque(angle) + travel * wanted)) < travel * within


def test_a_drive_holds_nine_whole_orders_and_says_what_of_the_rest() -> None:
    many = {
        ("cogging" if n == 1 else f"cogging_{n}"): {
            "a": 0.1 / n, "b": 0.0, "period": 2 * np.pi / (3 * n), "a_2": 0.0, "b_2": 0.0}
        for n in range(1, 13)
    }  # fmt: skip
    many["cogging_13"] = {"a": 0.05, "b": 0.0, "period": 2 * np.pi / 4.5}
    file = one(made(rotary(many), "cogging-table"), "8000_cogging.csv")
    assert read.ax8000_cogging(file.text)[1] == 9
    assert sorted(cost.force or 0.0 for cost in file.costs) == pytest.approx(
        [0.1 / 12, 0.1 / 11, 0.1 / 10, 0.05]
    )
    with pytest.raises(BadModel, match="none of them whole"):
        made(rotary({"cogging": {"a": 1.0, "period": 2 * np.pi / 4.5}}), "cogging-table",
             controls=("twincat",))  # fmt: skip
    with pytest.raises(BadModel, match=r"in turns of the motor; .*--per-turn"):
        made(linear(COGGING), "cogging-table", controls=("twincat",))


def test_the_play_of_four_controls() -> None:
    model = linear(PLAY)
    found = made(model, "backlash", encoder="motor")
    _, rows = read.neutral(one(found, "known_backlash.csv").text.replace(",,", ",0,0"))
    assert rows[0, 0] == pytest.approx(0.24)
    nc = {name: one(found, f"{name}").text for name in (
        "sinumerik_backlash.mpf", "codesys_backlash.st", "linuxcnc_backlash.ini",
        "twincat_nc_backlash.st", "twincat_cnc_backlash.lis")}  # fmt: skip
    data = read.machine_data(nc["sinumerik_backlash.mpf"])
    assert data == {"32450 $MA_BACKLASH": pytest.approx(0.24)}
    # After a reversal SMC_BacklashCompensation moves twice fBacklash.
    assert 2 * read.st_constant(nc["codesys_backlash.st"]) == pytest.approx(0.24)
    assert read.st_constant(nc["twincat_nc_backlash.st"]) == pytest.approx(0.24)
    ini = ConfigParser()
    ini.read_string(nc["linuxcnc_backlash.ini"])
    assert float(ini["JOINT_0"]["BACKLASH"]) == pytest.approx(0.24)
    assert read.cnc_list(nc["twincat_cnc_backlash.lis"]) == {"getriebe[0].lose": 2400}
    assert any("MD32520" in line for file in found.files for line in file.remarks)


def test_behind_the_play_the_sign_is_the_other_or_there_is_none() -> None:
    found = made(linear(PLAY), "backlash", encoder="load")
    data = read.machine_data(one(found, ".mpf").text)
    assert data == {"32450 $MA_BACKLASH": pytest.approx(-0.24)}
    assert read.st_constant(one(found, "twincat_nc_backlash.st").text) == pytest.approx(-0.24)
    assert not any(file.control in ("codesys", "linuxcnc") for file in found.files)
    assert sum("behind the encoder alone" in line for line in found.left_out) == 2
    turned = made(rotary({"backlash": {"width": 0.02}}), "backlash", encoder="motor")
    value = read.machine_data(one(turned, ".mpf").text)["32450 $MA_BACKLASH"]
    assert value == pytest.approx(np.degrees(0.02))
    left = made(linear(PLAY), "backlash").left_out
    assert len(left) == 1 and "--encoder motor" in left[0]
    with pytest.raises(BadModel, match="--encoder motor"):
        made(linear(PLAY), "backlash", controls=("linuxcnc",))
    wide = made(linear({"backlash": {"width": 0.01}}), "backlash", encoder="motor")
    assert any("P-AXIS-00103" in line for line in wide.left_out)


def code(model: Model, folder: Path) -> Any:
    """The feed-forward in C, compiled; skipped where there is no compiler."""
    if shutil.which("gcc") is None:
        pytest.skip("no gcc on PATH")
    for file in made(model, "c").files:
        (folder / file.name).write_text(file.text)
    strict = ("-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror")
    target = folder / "ff.so"
    (source,) = folder.glob("*.c")
    subprocess.run(
        ["gcc", *strict, "-shared", "-fPIC", str(source), "-o", str(target), "-lm"], check=True
    )
    return ctypes.CDLL(str(target))


@pytest.mark.parametrize("model", [linear({**STRIBECK, **COGGING, **PLACE}), rotary(), linear()])
def test_the_feed_forward_is_the_model_in_c_and_st(model: Model, tmp_path: Path) -> None:
    compiled = code(model, tmp_path)
    force, command = compiled.known_ff_force, compiled.known_ff_command
    force.restype = command.restype = ctypes.c_double
    force.argtypes = command.argtypes = [ctypes.c_double] * 3
    block = Blocks(one(made(model, "st"), ".st").text).made("FB_known_feed_forward")
    rng = np.random.default_rng(3)
    v = rng.choice(velocities(model), 60)
    y, a = rng.uniform(-0.1, 0.1, 60), rng.uniform(-3, 3, 60)
    inertia, friction = model.karnopp.m * a, sliding(model, v)
    wanted = inertia + friction - of_place(model, y)
    size = np.abs(inertia) + np.abs(friction) + np.abs(of_place(model, y))
    for k in range(60):
        found = force(y[k], v[k], a[k])
        assert abs(found - wanted[k]) < ONE_PER_CENT * size[k]
        k_a = 0.4 if model.rotary else 35.15
        assert command(y[k], v[k], a[k]) == pytest.approx(found / k_a)
        block(y=y[k], v=v[k], a=a[k])
        assert block.values["f_drive"] == pytest.approx(found, rel=1e-12, abs=1e-12)
        assert block.values["u"] == pytest.approx(found / k_a)
    block(y=0.0, v=0.0, a=0.0)
    assert abs(block.values["f_friction"]) < 0.2 * np.max(np.abs(sliding(model, v)))


def of_place(model: Model, y: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Constant force, spring, gravity and cogging as they are written."""
    F = np.zeros(len(y))
    for key, e in model.effects.items():
        p = {name: each.value or 0.0 for name, each in e.items()}
        if key == "constant_force":
            F += p["F_0"]
        elif key == "spring":
            F -= p["k"] * y + p["k_3"] * y**3
        elif key == "gravity":
            F -= p["a"] * np.sin(y / p["turn"]) + p["b"] * np.cos(y / p["turn"])
        elif key.startswith("cogging"):
            angle = 2 * np.pi * y / p["period"]
            F += p["a"] * np.sin(angle) + p["b"] * np.cos(angle)
            F += p["a_2"] * np.sin(2 * angle) + p["b_2"] * np.cos(2 * angle)
    return F


@pytest.mark.parametrize("name", ["F_cp", "F_cn", "F_vp", "F_vn"])
def test_no_number_is_assumed_for_one_that_is_not_identified(name: str) -> None:
    model = lost(linear(), name)
    for target in ("friction-table", "c", "st", "csv"):
        with pytest.raises(BadModel, match=rf"{name}, which is not identified \(no slow run\)"):
            made(model, target)


def test_what_else_a_model_lacks() -> None:
    with pytest.raises(BadModel, match="feed-forward needs m, which is not"):
        made(lost(linear(), "m"), "c")
    assert made(lost(linear(), "m"), "friction-table").files
    no_speed = replace(linear(), log=(replace(linear().log[0], speed=None),))
    with pytest.raises(BadModel, match="--speed"):
        made(no_speed, "friction-table")
    assert made(no_speed, "friction-table", high=0.2).files
    for target, said in (("cogging-table", "no cogging"), ("backlash", "no backlash")):
        with pytest.raises(BadModel, match=said):
            made(linear(), target)
    unknown = lost(linear(), "F_sp")
    costs = made(unknown, "friction-table").files[0].costs
    assert any("direction: not identified" in cost.what and cost.force is None for cost in costs)
    blind = linear(PLAY)
    width = replace(blind.effects["backlash"]["width"], value=None, reason="too short; log on",
                    assumed=1e-4)  # fmt: skip
    with pytest.raises(BadModel, match=r"its width, which is not identified \(too short\)"):
        made(replace(blind, effects={"backlash": {"width": width}}), "backlash")


def test_a_wave_of_which_a_part_is_not_identifiable_keeps_the_rest() -> None:
    model = linear(COGGING)
    first = {**model.effects["cogging"], "b": NOT_IDENTIFIABLE}
    found = made(replace(model, effects={**model.effects, "cogging": first}), "cogging-table")
    _, orders = read.neutral(one(found, "known_cogging.csv").text)
    assert sorted(orders[:, 2]) == pytest.approx(
        sorted((0.3, np.hypot(0.1, 0.05), np.hypot(0.2, 0.1)))
    )
    assert any("cogging.b is not identified (too weak)" in line for line in found.files[0].remarks)
    assert "cogging.b is not identified" in found.files[0].text
    shape = {**model.effects["cogging"], "period": NOT_IDENTIFIABLE}
    found = made(replace(model, effects={**model.effects, "cogging": shape}), "cogging-table", "st")
    assert len(read.neutral(one(found, "known_cogging.csv").text)[1]) == 1
    assert "so cogging is left out" in one(found, ".st").text
    with pytest.raises(BadModel, match=r"no cogging table, as cogging\.period is not identified"):
        made(replace(model, effects={"cogging": shape}), "cogging-table")


def test_an_effect_of_speed_is_needed_whole() -> None:
    model = linear(STRIBECK)
    shape = {**model.effects["stribeck"], "v_s": NOT_IDENTIFIABLE}
    with pytest.raises(BadModel, match=r"needs stribeck\.v_s, which is not identified"):
        made(replace(model, effects={"stribeck": shape}), "friction-table")


def test_a_parameter_that_is_only_small_is_said() -> None:
    friction = dict(linear().friction)
    friction["F_vn"] = replace(friction["F_vn"], value=None, reason="small", assumed=0.0,
                               at_most=2.0)  # fmt: skip
    file = made(replace(linear(), friction=friction), "friction-table").files[0]
    assert any(line.startswith("F_vn: not significantly different from 0") for line in file.remarks)
    assert "F_vn: not significantly different from 0" in file.text


def test_beyond_the_logs_the_table_is_the_law_and_says_so() -> None:
    assert made(linear(), "friction-table").files[0].remarks == ()
    (line,) = made(linear(), "friction-table", high=0.6).files[0].remarks
    assert "the logs reach 300 mm/s" in line


def test_what_is_asked_comes_with_units() -> None:
    found = tables_asked(Display(), None, "0.5 m/s", "10", "2400 N mm", None)
    assert (found.high, found.per_turn) == (0.5, 0.01) and found.rated == pytest.approx(2.4)
    found = tables_asked(Display(), None, "500", None, "250 N", "motor")
    assert (found.high, found.per_turn, found.rated) == (0.5, None, 250.0)
    found = tables_asked(Display("rotary"), None, "60 rpm", "36 deg", "2 N m", None)
    assert found.high == pytest.approx(2 * np.pi) and found.per_turn == pytest.approx(np.pi / 5)
    for speed, per_turn, rated, said in (
        ("fast", None, None, "--speed"),
        ("-3", None, None, "above 0"),
        (None, "10 kg", None, "of another kind"),
        (None, None, "2 N m", "of another kind"),  # of a linear motor it is a force
    ):
        with pytest.raises(UserError, match=said):
            tables_asked(Display(), None, speed, per_turn, rated, None)
