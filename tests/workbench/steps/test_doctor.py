"""A log looked over: what is wrong with it is found, and what it can tell is what a fit tells."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from design.identified.examined import Examined, doctor_document
from design.identified.identify_logs import identify_logs
from design.simulated.record import record
from identification.arrays import Array
from identification.errors import NotIdentifiable
from identification.model.karnopp import NAMES
from identification.signals.bad_samples import Kind
from tests.bad_inputs.shop import CARDS
from tests.identification.motor_logs import K_A, H, made
from tests.screens import one_screen
from workbench.cards.card import Card, load_card
from workbench.logs.sources import read_sources
from workbench.report.doctor import doctor_picture, doctor_screen
from workbench.report.next_steps import after_doctor
from workbench.steps.doctor import examine

Table = dict[str, Array]
MOTOR = f"""
[card]
name = "motor"
[rig]
kind = "motor"
force_per_command = {K_A}
[signals]
t = {{ column = "t", unit = "s" }}
y = {{ column = "y", unit = "m" }}
u = {{ column = "u", unit = "V" }}
"""


@pytest.fixture
def force(tmp_path: Path) -> tuple[Card, Table]:
    """A force-driven machine's card and log."""
    (tmp_path / "card.toml").write_text(CARDS["force"], "utf-8")
    card = load_card(tmp_path / "card.toml")
    assert card.recipe is not None
    log = record("force", card.recipe, 3, card.rig())
    return card, {name: np.array(log[name]) for name in card.signals}


@pytest.fixture
def motor(tmp_path: Path) -> tuple[Card, Table]:
    """A motor's card and log."""
    (tmp_path / "card.toml").write_text(MOTOR, "utf-8")
    log = made(3)
    return load_card(tmp_path / "card.toml"), {name: np.array(log[name]) for name in "tyu"}


def examined_log(card: Card, table: Table) -> Examined:
    path = card.path.parent / "run.csv"
    pd.DataFrame(table).to_csv(path, index=False)
    return examine(path, card)


@pytest.mark.slow
def test_what_it_tells_is_what_a_fit_tells(motor: tuple[Card, Table]) -> None:
    card, table = motor
    found = examined_log(card, table)
    path = card.path.parent / "run.csv"
    model = identify_logs(read_sources([str(path)], str(card.path)).logs).model
    can = {one.name: one.can for one in found.identifiability}
    assert {n for n in NAMES if can[n]} == {n for n in NAMES if model.friction[n].value is not None}
    assert found.verdict == "ready"


@pytest.mark.slow
def test_identify_says_that_a_voltage_brakes(motor: tuple[Card, Table]) -> None:
    card, table = motor
    voltage = table["u"] + 40.0 * np.gradient(table["y"], table["t"])  # the motor's own, 40 V s/m
    examined_log(card, {**table, "u": voltage})
    path = card.path.parent / "run.csv"
    remarks = identify_logs(read_sources([str(path)], str(card.path)).logs).remarks
    assert any("if it is the motor's voltage, F_vp and F_vn hold" in one for one in remarks)


@pytest.mark.slow
def test_one_way_alone_tells_nothing_of_the_other(motor: tuple[Card, Table]) -> None:
    card, table = motor
    up = table["u"] > 0
    y = np.cumsum(np.where(np.diff(table["y"], prepend=table["y"][0]) > 0,
                           np.diff(table["y"], prepend=table["y"][0]), 0.0))  # fmt: skip
    found = examined_log(card, {"t": table["t"], "y": y, "u": np.where(up, table["u"], 0.0)})
    can = {one.name: one for one in found.identifiability}
    assert not can["F_cn"].can and not can["F_sn"].can
    assert "negative direction" in can["F_cn"].why
    assert any("motion that way" in one for one in found.add)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "signal"),
    [("spike", "y"), ("jump", "y"), ("missing", "F"), ("saturated", "u"), ("saturated", "F")],
)
def test_bad_samples_are_reported(force: tuple[Card, Table], kind: Kind, signal: str) -> None:
    card, table = force
    x = table[signal]
    if kind == "spike":
        x[1200] += 0.01
    elif kind == "jump":
        x[1500:] += 0.004
    elif kind == "missing":
        x[1000] = np.nan
    else:
        limit = np.quantile(np.abs(x), 0.8)
        table[signal] = np.clip(x, -limit, limit)
    found = examined_log(card, table)
    reported = [one for one in found.bad if (one.kind, one.signal) == (kind, signal)]
    assert reported
    assert all(
        ("command" in one.line) == (signal == "u") for one in reported if kind == "saturated"
    )


def test_gaps_and_jitter_of_the_clock_are_reported(force: tuple[Card, Table]) -> None:
    card, table = force
    keep = np.ones(len(table["t"]), dtype=bool)
    keep[1000:1100] = False
    rng = np.random.default_rng(1)
    table["t"] = table["t"] + 2e-4 * rng.uniform(-1, 1, len(keep))
    found = examined_log(card, {name: x[keep] for name, x in table.items()})
    assert found.clock.gaps == 1
    assert found.clock.longest_gap == pytest.approx(0.202, abs=1e-3)
    assert found.clock.jitter == pytest.approx(2e-4 / np.sqrt(3) * np.sqrt(2) / 2e-3, rel=0.2)
    assert found.clock.h == pytest.approx(2e-3, rel=0.02)


@pytest.mark.parametrize("late", [0, 8])
def test_a_late_command_is_reported(force: tuple[Card, Table], late: int) -> None:
    card, table = force
    u = table["u"]
    table["u"] = np.concatenate([u[late:], np.full(late, u[-1])])  # logged before it acts
    found = examined_log(card, table)
    delay = next(one for one in found.delays if one.of == "u")
    if late:
        assert delay.seconds is not None
        assert delay.seconds == pytest.approx(late * 2e-3, abs=2e-3)
    else:
        assert delay.seconds is None


@pytest.mark.parametrize("exchanged", [False, True])
def test_a_position_ahead_of_its_reference_is_reported(
    motor: tuple[Card, Table], exchanged: bool
) -> None:
    card, table = motor
    (card.path).write_text(MOTOR + 'r = { column = "r", unit = "m" }\n', "utf-8")
    noise = 2e-6 * np.random.default_rng(1).standard_normal(len(table["y"]))
    smooth = np.convolve(table["y"], np.ones(5) / 5.0, mode="same")
    ahead, behind = np.append(smooth[1:], smooth[-1]), table["y"] + noise
    own = {"y": ahead, "r": behind} if exchanged else {"y": behind, "r": ahead}
    found = examined_log(load_card(card.path), {**table, **own})
    assert found.exchanged == exchanged
    said = "the columns of r and y look exchanged; exchange them in the card"
    text = doctor_screen(found, None).text()
    assert any(said in one for one in found.remarks) == exchanged
    assert ("behind its reference by" in text and "(100% alike)" in text) == (not exchanged)
    assert ("exchange the columns of r and y in the card (see note)" in text) == exchanged


def test_a_unit_that_makes_a_travel_of_no_machine_is_said_first(motor: tuple[Card, Table]) -> None:
    card, table = motor
    card.path.write_text(MOTOR.replace('"y", unit = "m"', '"y", unit = "parsec"'), "utf-8")
    found = examined_log(load_card(card.path), table)
    text = doctor_screen(found, None).text().splitlines()
    assert after_doctor(found, "run.csv", "card.toml") is None
    assert text[1].split(maxsplit=1) == [
        "next", "check the units in the card (see note), then ask again"
    ]  # fmt: skip
    assert "signals.y, read in 'parsec': the position covers" in found.remarks[0]


def test_a_refusal_is_shown_to_its_end_and_the_card_is_named(motor: tuple[Card, Table]) -> None:
    card, table = motor
    then = after_doctor(examined_log(card, table), "logs/run.csv", "my card.toml")
    assert then and then.command == "workbench identify logs/run.csv --card 'my card.toml'"
    found = examined_log(card, {**table, "u": -table["u"]})
    shown = " ".join(doctor_screen(found, None).text().split())
    assert "give the column of y gain = -1" in shown and "..." not in shown


def test_a_card_without_its_constant_is_filled_in_first(motor: tuple[Card, Table]) -> None:
    card, table = motor
    card.path.write_text(MOTOR.replace(f"force_per_command = {K_A}\n", ""), "utf-8")
    text = doctor_screen(examined_log(load_card(card.path), table), None).text()
    assert "write force_per_command under the card's [rig]" in text


def test_rounding_is_no_noise(motor: tuple[Card, Table]) -> None:
    card, table = motor
    card.path.write_text(MOTOR + 'r = { column = "r", unit = "m" }\n', "utf-8")
    found = examined_log(load_card(card.path), {**table, "r": 0.1 + 0.02 * table["t"]})
    assert next(one for one in found.sensors if one.name == "r").noise == 0.0


def test_a_unit_that_the_header_denies_is_reported_though_the_log_is_refused(
    motor: tuple[Card, Table],
) -> None:
    card, table = motor
    text = MOTOR.replace('column = "y", unit = "m"', 'column = "y [mm]", unit = "m"')
    card.path.write_text(text, "utf-8")
    found = examined_log(
        load_card(card.path), {"t": table["t"], "y [mm]": table["y"], "u": -table["u"]}
    )
    assert found.verdict == "refused"
    assert any("the header 'y [mm]' says mm, the card 'm'" in one for one in found.remarks)


def test_counts_are_reported_as_a_step(motor: tuple[Card, Table]) -> None:
    card, table = motor
    table["y"] = 2e-5 * np.round(table["y"] / 2e-5)
    state = next(one for one in examined_log(card, table).sensors if one.name == "y")
    assert state.step == pytest.approx(2e-5, rel=1e-6)


def test_a_motor_without_its_constant_is_looked_at_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "card.toml").write_text(MOTOR.replace(f"force_per_command = {K_A}\n", ""), "utf-8")
    log = made(3)
    found = examined_log(
        load_card(tmp_path / "card.toml"), {name: np.array(log[name]) for name in "tyu"}
    )
    assert found.ways is not None and found.ways.positive.breakaways >= 3


@pytest.mark.parametrize("name", ["y", "F"])
def test_a_log_that_a_fit_refuses_is_refused_with_its_reason(
    force: tuple[Card, Table], name: str
) -> None:
    card, table = force
    table[name] = np.full(len(table["t"]), 1.0) if name == "y" else -table["F"]
    found = examined_log(card, table)
    assert found.verdict == "refused"
    assert found.refused
    assert doctor_document(found, card.name)["refused"] == found.refused


@pytest.mark.slow
@pytest.mark.parametrize("rig", ["force", "motor"])
def test_one_screen_and_a_picture(rig: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    card, table = request.getfixturevalue(rig)
    table["y"][::50] += 0.02  # as much to tell as can be
    for refused in (False, True):
        table["y"] = np.zeros(len(table["t"])) if refused else table["y"]
        found = examined_log(card, table)
        lines = one_screen(doctor_screen(found, tmp_path)).splitlines()
        assert "written: " in lines[-1] or "written: " in lines[-2]
        doctor_picture(found, tmp_path / "doctor.png")
        assert (tmp_path / "doctor.png").read_bytes().startswith(b"\x89PNG")


def test_speeds_and_rests_are_those_of_the_log(motor: tuple[Card, Table]) -> None:
    card, table = motor
    found = examined_log(card, table)
    assert found.ways is not None
    v = np.abs(np.gradient(table["y"], H))
    assert found.ways.positive.fast == pytest.approx(float(np.quantile(v, 0.99)), rel=0.5)
    moved = found.ways.positive.seconds + found.ways.negative.seconds
    assert 0.2 * found.clock.duration < moved < found.clock.duration
    assert found.ways.rests > 5


def test_what_a_coarse_sensor_calls_rest_is_reported_by_its_speed(
    motor: tuple[Card, Table],
) -> None:
    card, table = motor

    def hidden(step: float) -> float:
        found = examined_log(card, {**table, "y": step * np.round(table["y"] / step)})
        text = " ".join(doctor_screen(found, None).text().split())
        return float(text.partition("at rest (slower than ")[2].split()[0])

    fine, coarse = hidden(1e-6), hidden(1e-3)
    assert 0.0 < fine < coarse / 4.0


def test_times_that_are_no_numbers_are_refused_and_no_fault(motor: tuple[Card, Table]) -> None:
    card, table = motor
    table["t"][::50] = np.inf
    assert examined_log(card, table).verdict == "refused"


def test_a_refusal_of_what_is_left_names_what_was_left_out(motor: tuple[Card, Table]) -> None:
    """Of five steps in one log, four too short: the one that is left is constant."""
    card, _ = motor
    rows = np.repeat(np.arange(5), [80, 120, 80, 80, 80])
    t = H * np.arange(len(rows)) + 2.0 * rows
    u = np.array([3.0, -2.0, 2.0, -3.0, 2.5])[rows]
    found = examined_log(card, {"t": t, "y": np.cumsum(0.01 * H * u), "u": u})
    left = "run.csv: in 1 run; 8.64 s in gaps and 4 runs of under 100 rows or at rest left out"
    assert "the applied force is constant" in found.refused
    assert left in found.refused
    with pytest.raises(NotIdentifiable, match="4 runs of under 100 rows or at rest left out"):
        identify_logs(read_sources([str(card.path.parent / "run.csv")], str(card.path)).logs)


@pytest.mark.parametrize(("ticks", "led"), [(1.0, False), (10.0, True)])
def test_a_slow_clock_to_the_thousandth_of_a_second_leads_to_no_other_unit(
    motor: tuple[Card, Table], ticks: float, led: bool
) -> None:
    """ticks: thousandths in which the rows' times are whole."""
    card, table = motor
    rows = len(table["t"])
    beside = np.random.default_rng(4).integers(-3, 4, rows)
    ticked = np.arange(rows) + ticks * 1e-3 * beside
    table["t"] = np.asarray(np.round(ticked, 3), dtype=np.float64)
    found = examined_log(card, table)
    assert any("ms in place of s" in one for one in found.remarks)
    assert found.other_units == led
