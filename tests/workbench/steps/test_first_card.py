"""A first card: which column is what, in which unit and with which sign."""

import tomllib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from design.first_card.answers import BadAnswer, with_rig
from design.first_card.proposal import Proposal
from design.simulated.record import record
from identification.arrays import Array
from identification.errors import BadLog
from tests.bad_inputs.shop import CARDS
from tests.identification.motor_logs import made
from workbench.cards.card import load_card
from workbench.logs.runs import read_log
from workbench.steps.first_card.proposal import proposed, with_signal
from workbench.steps.first_card.written import refusal, written

Table = dict[str, Array]
NAMES = ("c1", "c2", "c3", "c4", "c5", "c6", "c7")


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Table]:
    """A log of each kind of rig, in SI."""
    folder = tmp_path_factory.mktemp("cards")
    moved = made(3)
    out: dict[str, Table] = {"motor": {name: np.array(moved[name]) for name in ("t", "y", "u")}}
    for kind, text in CARDS.items():
        if kind == "motor":
            continue
        path = folder / f"{kind}.toml"
        path.write_text(text, "utf-8")
        card = load_card(path)
        assert card.recipe is not None
        log = record(kind, card.recipe, 3, card.rig())
        out[kind] = {name: np.array(log[name]) for name in card.signals}
    return out


def propose(folder: Path, table: Table, **layout: str) -> Proposal:
    path = folder / "run.csv"
    pd.DataFrame(table).to_csv(path, index=False, **layout)  # type: ignore[call-overload]
    return proposed(path)


def as_read(folder: Path, found: Proposal) -> Table:
    """The log's signals as the proposed card reads them."""
    card = folder / "card.toml"
    card.write_text(written(found), "utf-8")
    assert refusal(folder / "run.csv", card) == ""
    log = read_log(folder / "run.csv", load_card(card))
    return {name: np.asarray(x) for name, x in log.signals.items()}


def alike(found: Array, true: Array) -> bool:
    return bool(np.allclose(found, true, rtol=1e-6, atol=1e-6 * float(np.ptp(true))))


@pytest.mark.slow
@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    order=st.permutations(["t", "r", "y", "F", "u"]),
    unit=st.sampled_from([("mm", 1e-3), ("µm", 1e-6), ("m", 1.0)]),
    clock=st.sampled_from([("ms", 1e-3), ("s", 1.0), ("us", 1e-6)]),
    force=st.sampled_from([("N", 1.0), ("kN", 1e3)]),
    sign=st.sampled_from([1.0, -1.0]),
)
def test_a_force_rig_is_read_back_from_units_in_the_header(
    logs: dict[str, Table],
    tmp_path: Path,
    order: list[str],
    unit: tuple[str, float],
    clock: tuple[str, float],
    force: tuple[str, float],
    sign: float,
) -> None:
    true = logs["force"]
    made = {
        "t": (f"Zeit [{clock[0]}]", true["t"] / clock[1]),
        "r": (f"Soll [{unit[0]}]", true["r"] / unit[1]),
        "y": (f"Weg [{unit[0]}]", true["y"] / unit[1]),
        "F": (f"Kraft [{force[0]}]", sign * true["F"] / force[1]),
        "u": ("Ventil [V]", true["u"]),
    }
    found = propose(tmp_path, dict(made[name] for name in order))
    assert found.kind == "force"
    back = as_read(tmp_path, found)
    for name in ("r", "y", "F", "u"):
        assert alike(back[name], true[name]), name
    one = found.signal("F")
    assert one is not None and (one.gain == -1.0) == (sign < 0.0)


@pytest.mark.parametrize("kind", list(CARDS))
def test_physics_tells_the_columns_without_a_word(
    logs: dict[str, Table], tmp_path: Path, kind: str
) -> None:
    true = logs[kind]
    order = np.random.default_rng(4).permutation(list(true)).tolist()
    found = propose(tmp_path, dict(zip(NAMES, (true[name] for name in order), strict=False)))
    columns = {one.name: order[NAMES.index(str(one.column))] for one in found.signals}
    for name in ("t", "y", "r"):
        assert name not in true or columns[name] == name
    if kind == "pneumatic":
        assert found.kind in ("electro-pneumatic", "force")
    else:
        assert columns["F" if kind == "force" else "u"] == ("F" if kind == "force" else "u")


def test_two_pressures_are_the_right_way_round(logs: dict[str, Table], tmp_path: Path) -> None:
    true = logs["pneumatic"]
    table = {"time": true["t"], "x": true["y"], "P1 [bar]": true["p_n"] / 1e5,
             "P2 [bar]": true["p_p"] / 1e5}  # fmt: skip
    found = propose(tmp_path, table)
    assert found.kind == "electro-pneumatic"
    assert (found.signal("p_p"), found.signal("p_n")) != (None, None)
    one = found.signal("p_p")
    assert one is not None and one.column == "P2 [bar]"
    card = tomllib.loads(written(found))
    assert {"area_p_m2", "area_n_m2"} <= set(card["rig"])
    assert card["rig"]["supply_pressure_pa"] == 1e5  # around the rod, of absolute pressures


def test_a_force_beside_two_pressures_without_a_word_has_a_reason_of_its_own(
    logs: dict[str, Table], tmp_path: Path
) -> None:
    """It had been "the header says so"."""
    true = logs["pneumatic"]
    force = 1.256e-3 * true["p_p"] - 1e-3 * true["p_n"]
    columns = (true["t"], true["y"], true["p_p"] / 1e5, true["p_n"] / 1e5, 1.0 * force)
    one = propose(tmp_path, dict(zip(NAMES, columns, strict=False))).signal("F")
    assert one is not None and "header says so" not in one.why


def test_counts_get_their_gain_from_the_reference(logs: dict[str, Table], tmp_path: Path) -> None:
    true = logs["force"]
    table = {"t": true["t"], "setpoint [mm]": 1e3 * true["r"], "F": true["F"],
             "encoder": np.round(2e6 * true["y"])}  # fmt: skip
    one = propose(tmp_path, table).signal("y")
    assert one is not None and one.column == "encoder"
    assert one.unit == "count"
    assert one.gain == "2000 count/mm"
    assert not one.sure


def test_twos_complement_is_seen(logs: dict[str, Table], tmp_path: Path) -> None:
    true = logs["motor"]
    raw = np.round(300.0 * true["u"]).astype(int) % 65536
    found = propose(tmp_path, {"t": true["t"], "y": true["y"], "pwm": raw.astype(float)})
    one = found.signal("u")
    assert one is not None and one.bits == 16
    assert alike(as_read(tmp_path, found)["u"], np.round(300.0 * true["u"]))


def test_a_step_of_a_turn_over_a_power_of_two_makes_it_rotary(
    logs: dict[str, Table], tmp_path: Path
) -> None:
    true = logs["motor"]
    step = 2.0 * np.pi / 4096
    table = {"t": true["t"], "y": step * np.round(10.0 * true["y"] / step), "u": true["u"]}
    found = propose(tmp_path, table)
    assert found.motion == "rotary"


def test_a_sensor_and_its_signal_are_one(logs: dict[str, Table], tmp_path: Path) -> None:
    true = logs["force"]
    table = {"t": true["t"], "ai0 [V]": np.round(5.0 + 10.0 * true["y"], 3), "F": true["F"],
             "pos [mm]": 1e3 * true["y"]}  # fmt: skip
    found = propose(tmp_path, table)
    one = found.signal("y")
    assert one is not None and one.column == "pos [mm]"
    assert "in another unit" in found.unused["'ai0 [V]'"]


def test_a_sample_number_gets_its_rate_from_the_speed(
    logs: dict[str, Table], tmp_path: Path
) -> None:
    true = logs["force"]
    number = np.arange(len(true["t"]), dtype=np.float64)
    table = {"index": number, "y [mm]": 1e3 * true["y"], "F [N]": true["F"],
             "speed [mm/s]": 1e3 * np.gradient(true["y"], 2e-3)}  # fmt: skip
    for headers in (tuple(table), ("index", "angle", "torque", "velocity")):
        named = dict(zip(headers, table.values(), strict=True))
        one = propose(tmp_path, named).signal("t")
        assert one is not None
        assert (one.unit, one.gain) == ("1", "500 1/s")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"t": None}, "no clock"),
        ({"F": None, "u": None, "r": None}, "no column moves as a body"),
        ({"y": 0.0}, "is always 0"),
    ],
)
def test_a_log_that_no_card_can_be_made_of_is_refused_in_one_line(
    logs: dict[str, Table], tmp_path: Path, change: dict[str, float | None], said: str
) -> None:
    table = {}
    for name, x in logs["force"].items():
        value = change.get(name, x)
        if value is not None:
            table[name] = np.broadcast_to(value, x.shape)
    with pytest.raises(BadLog, match=said) as refused:
        propose(tmp_path, table)
    assert "\n" not in str(refused.value)


def test_answers_change_column_unit_and_rig(logs: dict[str, Table], tmp_path: Path) -> None:
    true = logs["motor"]
    found = propose(tmp_path, {"t": true["t"], "a b": true["y"], "u": true["u"]})
    other = with_signal(found, "y", "a b mm")
    one = other.signal("y")
    assert one is not None and (one.column, one.unit, one.sure) == ("a b", "mm", True)
    assert with_signal(found, "u", "1 mA").signal("u") != found.signal("u")
    kept = with_signal(found, "u", "").signal("u")
    assert kept is not None and kept.sure
    given_one = with_rig(found, "force_per_command", "35,2")
    assert next(x.value for x in given_one.rig if x.key == "force_per_command") == 35.2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "answer"),
    [("y", "-"), ("y", "nowhere"), ("y", "bar"), ("t", "1 mm"), ("u", "a furlong")],
)
def test_an_answer_that_cannot_be_is_said(
    logs: dict[str, Table], tmp_path: Path, name: str, answer: str
) -> None:
    found = propose(tmp_path, {name: logs["motor"][name] for name in ("t", "y", "u")})
    with pytest.raises(BadAnswer) as refused:
        with_signal(found, name, answer)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("answer", ["0", "much", "nan"])
def test_a_number_that_cannot_be_is_said(
    logs: dict[str, Table], tmp_path: Path, answer: str
) -> None:
    found = propose(tmp_path, {name: logs["motor"][name] for name in ("t", "y", "u")})
    with pytest.raises(BadAnswer):
        with_rig(found, "force_per_command", answer)


@pytest.mark.parametrize("step", [1e-300, 1e15])
def test_a_clock_that_no_machine_has_is_no_fault(
    logs: dict[str, Table], tmp_path: Path, step: float
) -> None:
    true = logs["motor"]
    number = np.arange(len(true["t"]), dtype=np.float64)
    found = propose(tmp_path, {"t": step * (number + 1.0), "y": true["y"], "u": true["u"]})
    assert found.signal("t") is not None


def test_missing_values_are_no_fault(logs: dict[str, Table], tmp_path: Path) -> None:
    true = logs["force"]
    table = {name: np.where(np.arange(len(x)) % 97 == 50, np.nan, x) if name != "t" else x
             for name, x in true.items()}  # fmt: skip
    columns = {one.name: one.column for one in propose(tmp_path, table).signals}
    assert columns == {name: name for name in ("t", "r", "y", "F", "u")}
