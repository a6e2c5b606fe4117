"""How the table judges: what counts as right, as worse and as better, and what is written."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from tests.verdicts.answers import Answer, EvaluationLimit, shortfalls
from tests.verdicts.comparison import change, committed, committed_of, to_plain, written
from tests.verdicts.entries import (
    Entry,
    Right,
    Within,
    entries,
    merged,
    right_answer,
    with_amplitudes,
    within,
)
from tests.verdicts.logs import Absent, sources
from tests.verdicts.plugin import Outcome, lines
from tests.verdicts.rough_machine import Rough, columns

RIGHT = Right(
    ("effect",),
    {"spring": {"k": Within(95.0, 105.0)}},
    may=("stribeck",),
    depends_on=("y",),
    complete=True,
    parameters={"m": Within(0.9, 1.1), "F_cp": Within(4.0, 6.0, open=True)},
)
SAID = Answer(
    "effect", {"spring": {"k": 100.0}}, {"m": 1.0, "F_cp": None}, ("y",), True, False, 500, 2.0
)
ENTRY = Entry("one", {}, RIGHT)
ROUGH = Rough(4.0, 10.0, 13.0, 40.0, 0.005, 20.0, 0.08, 0.25, 4.0, 500.0)


def judged(said: Answer, before: Answer = SAID) -> tuple[int, int]:
    """How many things are worse and better than committed."""
    found = change(ENTRY, committed_of(said, RIGHT), committed_of(before, RIGHT))
    return len(found.worse), len(found.better)


def test_a_tolerance_is_of_the_recipe_or_written_out() -> None:
    assert within("m", "5 %", 2.0) == Within(1.9, 2.1)
    assert within("F_sn", "5 %", -2.0) == Within(-2.1, -1.9)
    assert within("m", "0.5 +- 10 % or not identifiable", None) == Within(0.45, 0.55, True)
    assert within("m", "-2.5 to 4e1", 7.0) == Within(-2.5, 40.0)
    for text, known in (("about 3", 1.0), ("5 %", None)):
        with pytest.raises(ValueError, match="m = "):
            within("m", text, known)


def test_what_is_wrong_is_named_one_by_one() -> None:
    assert shortfalls(SAID, RIGHT) == {}
    wrong = replace(
        SAID,
        verdict="unknown",
        effects={"spring": {"k": 110.0}, "cogging": {}, "stribeck": {}},
        parameters={"m": None, "F_cp": 7.0},
        complete=False,
        depends_on=("t",),
    )
    assert shortfalls(wrong, RIGHT) == {
        "verdict": "unknown",
        "spring.k": 110.0,
        "effect cogging": "false positive",
        "complete": False,
        "depends_on": "t",
        "m": "not identifiable",
        "F_cp": 7.0,
    }
    assert shortfalls(replace(SAID, effects={}), RIGHT) == {"effect spring": "not named"}
    refused = Answer("refused", {}, {}, (), True, False, 1, 1.0)
    assert "m" not in shortfalls(refused, RIGHT)


def test_worse_is_what_was_right_or_is_wrong_in_another_way() -> None:
    unknown = replace(SAID, verdict="unknown")
    assert judged(SAID) == (0, 0)
    assert judged(unknown) == (1, 0)
    assert judged(SAID, unknown) == (0, 1)
    assert judged(unknown, unknown) == (0, 0)
    assert judged(replace(SAID, verdict="none"), unknown) == (1, 0)


def test_a_wrong_number_may_come_nearer_but_not_go_further() -> None:
    def mass(value: float | None) -> Answer:
        return replace(SAID, parameters={"m": value, "F_cp": None})

    assert judged(mass(2.0), mass(2.05)) == (0, 0)
    assert judged(mass(2.0), mass(3.0)) == (0, 1)
    assert judged(mass(3.0), mass(2.0)) == (1, 0)
    assert judged(mass(None), mass(2.0)) == (0, 1)
    assert judged(mass(2.0), mass(None)) == (1, 0)


def test_an_effect_newly_named_is_better_whatever_its_size() -> None:
    missing = replace(SAID, verdict="unknown", effects={})
    off = replace(SAID, verdict="unknown", effects={"spring": {"k": 50.0}})
    assert judged(off, missing) == (0, 2)
    assert judged(missing, off) == (1, 0)


def test_a_dearer_trace_is_reported_and_is_not_worse() -> None:
    dear = committed_of(replace(SAID, evaluations=900), RIGHT)
    found = change(ENTRY, dear, committed_of(SAID, RIGHT))
    assert (found.worse, found.cost) == ((), "500 -> 900 evaluations")
    halted = change(ENTRY, replace(dear, halted=True), dear)
    assert halted.cost == "is halted now"


def test_the_committed_answers_are_read_as_they_are_written(tmp_path: Path) -> None:
    path = tmp_path / "today.toml"
    wrong = committed_of(replace(SAID, verdict="none", parameters={"m": 1e-7}), RIGHT)
    found = {"two": wrong, "one": committed_of(SAID, RIGHT)}
    text = written(found, ["one", "absent", "two"])
    assert text.index("[one]") < text.index("[two]")
    path.write_text(text, encoding="utf-8")
    assert committed(path) == found
    assert committed(tmp_path / "none.toml") == {}


def test_a_machine_lies_beneath_its_entry_and_a_kind_replaces_another() -> None:
    base = {"recipe": {"h": 1, "reference": {"kind": "sum", "parts": [1]}, "loop": {"a": 1}}}
    over = {"recipe": {"reference": {"kind": "steps"}, "loop": {"b": 2}}}
    assert merged(base, over) == {
        "recipe": {"h": 1, "reference": {"kind": "steps"}, "loop": {"a": 1, "b": 2}}
    }
    assert with_amplitudes({"a": 3.0, "b": 4.0})["amplitude"] == 5.0
    assert "amplitude" not in with_amplitudes({"a": -0.25, "tau": 5.0})


def test_every_entry_of_the_table_is_whole_and_has_a_committed_answer() -> None:
    found = entries()
    assert set(committed()) == set(found)
    assert len(found) >= 30


def test_a_word_that_no_right_answer_has_is_refused() -> None:
    with pytest.raises(ValueError, match="complet"):
        right_answer("a", {"verdict": "none", "complet": True}, {})


def test_the_summary_counts_and_shows_only_what_changed() -> None:
    now = committed_of(SAID, RIGHT)
    same = Outcome("same", to_plain(now), [], [], "", 2.0, "500 evaluations")
    worse = replace(same, name="worse", worse=["m: right -> 2"])
    found = list(lines({one.name: one for one in (same, worse)}))
    assert found[:2] == ["worse: newly wrong", "    worse   m: right -> 2"]
    assert found[2].startswith("2 logs: 1 right as committed, 0 newly right, 0 less wrong, 1 newly")
    assert any("same" in line for line in lines({"same": same}, everything=True))
    assert Outcome(**asdict(same)) == same


def test_looks_end_a_trace_at_their_number() -> None:
    going = EvaluationLimit(2)
    assert [going(), going(), going()] == [True, True, False]


def test_data_that_are_not_there_are_said_to_be_absent(tmp_path: Path) -> None:
    files = {"folder": "emps", "train": ["DATA_EMPS.mat"]}
    entry = Entry("emps", {"card": "emps", "files": files}, RIGHT)
    for data in (None, tmp_path):
        with pytest.raises(Absent):
            sources(entry, data, tmp_path)


def test_a_rough_machine_moves_as_it_is_commanded() -> None:
    plain = columns(ROUGH, 1)
    assert len(plain["t"]) == 2000
    assert np.max(np.abs(plain["y"] - plain["r"])) < 0.02
    assert np.max(np.abs(columns(ROUGH, 2)["y"] - plain["y"])) > 0.01
    forwards = columns(replace(ROUGH, one_way=True), 1)["y"]
    assert np.min(np.diff(forwards)) > -1e-4
    others = (
        replace(ROUGH, shake=2.0),
        replace(ROUGH, memory=4.0),
        replace(ROUGH, F_c=5.0),
        replace(ROUGH, m=3.0),
    )
    for other in others:
        assert np.max(np.abs(columns(other, 1)["u"] - plain["u"])) > 1e-3
    counted = columns(replace(ROUGH, count=1e-4), 1)["y"] / 1e-4
    assert np.allclose(counted, np.round(counted))
