"""A card proposed for columns in memory, without a file and without the shell; answers to it."""

from collections.abc import Mapping

import numpy as np
import pytest

from design.first_card.answers import LEAVE_OUT, THE_OTHER, BadAnswer, with_rig, with_signal
from design.first_card.proposal import Proposal, SignalGuess, proposal_for
from identification.arrays import Array
from identification.columns.column import RawColumn
from identification.columns.header import Header, Quantity, WrittenUnit
from identification.columns.log_columns import UnknownLog
from identification.columns.notation import Notation
from identification.errors import BadCard, BadLog
from identification.log import Motion

UNITS = {
    "s": (WrittenUnit("s", "time"), 1.0),
    "ms": (WrittenUnit("ms", "time"), 1e-3),
    "mm": (WrittenUnit("mm", "position"), 1e-3),
    "um": (WrittenUnit("um", "position"), 1e-6),
    "N": (WrittenUnit("N", "force"), 1.0),
    "kN": (WrittenUnit("kN", "force"), 1e3),
}
OTHERS = {"m": 1.0, "us": 1e-6, "ns": 1e-9, "mN": 1e-3, "count": 1.0}
MEANINGS: Mapping[str, Mapping[Quantity, float]] = {
    "time": {"time": 3.0},
    "position": {"position": 3.0},
    "force": {"force": 3.0},
}
T: Array = np.asarray(2e-3 * np.arange(5000), dtype=np.float64)
W = 6.0
Y: Array = 0.05 * np.sin(W * T) + 0.02 * np.sin(2.3 * W * T)
V: Array = np.gradient(Y, T)
F: Array = 3.0 * np.gradient(V, T) + 40.0 * np.sign(V) + 20.0 * V


def read(text: str, _below: str) -> Header:
    """Of "position mm" and the like."""
    name, _, unit = text.partition(" ")
    own = UNITS[unit][0] if unit else None
    return Header(text, name, own, MEANINGS.get(name, {}), "", False)


def factor(unit: str) -> float:
    return UNITS[unit][1] if unit in UNITS else OTHERS[unit]


NOTATION = Notation(
    header=read,
    meaning=lambda word: MEANINGS.get(word, {}),
    says_purpose=lambda _word: False,
    unit=lambda text: UNITS[text][0] if text in UNITS else None,
    factor=factor,
)


def proposed(*columns: tuple[str, Array]) -> Proposal:
    raw = [RawColumn(k, head or k, head, "", x) for k, (head, x) in enumerate(columns)]
    log = UnknownLog("run 1.csv", {"encoding": "cp1252"}, tuple(raw), ())
    return proposal_for(log, "run 1", NOTATION)


def scaled(one: SignalGuess, _motion: Motion) -> None:
    """Of a force that is one."""
    if one.name == "F" and one.unit not in ("N", "kN"):
        raise BadCard(f"{one.unit} is no force")


@pytest.fixture(scope="module")
def found() -> Proposal:
    return proposed(("time ms", 1e3 * T), ("position", 1e3 * Y), ("force N", F))


def test_units_come_from_headers_and_sizes(found: Proposal) -> None:
    assert (found.kind, found.motion, found.name) == ("force", "linear", "run-1")
    assert {one.name: (one.unit, one.gain) for one in found.signals} == {
        "t": ("ms", None),
        "y": ("mm", None),
        "F": ("N", None),
    }
    sure = {one.name: one.sure for one in found.signals}
    assert sure["t"] and not sure["y"]


def test_what_it_prints_says_file_and_layout(found: Proposal) -> None:
    printed = found.as_json()
    assert (printed["log"], printed["file"]) == ("run 1.csv", {"encoding": "cp1252"})
    assert printed["signals"]["F"]["unit"] == "N"


def test_an_answer_names_a_unit_or_takes_the_other(found: Proposal) -> None:
    y = found.signal("y")
    assert y is not None
    other = with_signal(found, "y", THE_OTHER, NOTATION.unit, scaled).signal("y")
    assert other is not None and other.unit == y.rival
    kilo = with_signal(found, "F", "kN", NOTATION.unit, scaled).signal("F")
    assert kilo is not None and (kilo.unit, kilo.sure) == ("kN", True)


@pytest.mark.parametrize(
    ("answer", "said"),
    [("mm", "mm is no force"), (LEAVE_OUT, "needs F"), ("furlong", "neither a column nor a unit")],
)
def test_an_answer_that_makes_no_force_is_refused(found: Proposal, answer: str, said: str) -> None:
    with pytest.raises(BadAnswer, match=said):
        with_signal(found, "F", answer, NOTATION.unit, scaled)


def test_another_motion_turns_the_units(found: Proposal) -> None:
    turned = with_rig(found, "motion", "rotary")
    assert {one.name: one.unit for one in turned.signals} == {"t": "ms", "y": "deg", "F": "N m"}


def test_columns_that_nothing_drives_are_refused_by_the_files_name() -> None:
    with pytest.raises(BadLog, match=r"^run 1\.csv: no column moves"):
        proposed(("time ms", 1e3 * T), ("position", Y))
