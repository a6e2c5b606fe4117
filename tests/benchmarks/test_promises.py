"""What doctor says is identifiable, compared with what identify reports."""

import os
from typing import Any

import pytest

from benchmarks.promises import print_table, promises
from benchmarks.real import ROOT, answered
from benchmarks.real_cases import every_case
from identification.model.karnopp import NAMES
from workbench.logs.sources import DATA_VARIABLE


def answers(said: dict[str, Any], kept: dict[str, Any]) -> dict[str, Any]:
    """Of one log."""
    return {
        "case": "one",
        "said_alone": {"identifiable": said, "refused": ""},
        "alone": {"kept": kept},
    }


def test_what_differs_is_counted_both_ways(capsys: pytest.CaptureFixture[str]) -> None:
    said = {
        "m": {"can": True, "why": "a"},
        "F_cp": {"can": True, "why": "b"},
        "F_sp": {"can": False, "why": "c", "only_if": "the run follows"},
    }
    kept = {"m": {"value": 1.0}, "F_cn": {"value": 2.0}, "F_cp": {"value": None, "why": "d"}}
    found = answers(said, kept)
    every = {one.name: (one.said, one.identifiable, one.kept) for one in promises(found)}
    assert every["m"] == ("yes", True, True)
    assert every["F_cp"] == ("yes", False, False)
    assert every["F_cn"] == ("no", True, False)
    assert every["F_sp"] == ("if", False, False)
    assert every["dv_p"] == ("no", False, True)
    print_table([found])
    said_lines = capsys.readouterr().out
    assert '2 of 9 parameters over 1 differ; "only if" of 1' in said_lines
    assert "| one | alone | F_cp | yes | no | b | d |" in said_lines


def test_a_refused_log_tells_nothing() -> None:
    found = answers({"m": {"can": True}}, {})
    found["said_alone"]["refused"] = "it does not move"
    assert all(one.said == "no" and one.kept for one in promises(found))
    assert len(list(promises(found))) == len(NAMES)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cogging_one_way", "two_masses", "rests_in_test"])
def test_doctor_and_identify_say_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    data = os.environ.get(DATA_VARIABLE) or str(ROOT.parent / "shared" / "data")
    monkeypatch.setenv(DATA_VARIABLE, data)
    case = next(one for one in every_case() if one.name == name)
    if not case.there:
        pytest.skip("its files are not there")
    found = list(promises(answered(case, 200.0, "promise")))
    assert found and all(one.kept for one in found), [one for one in found if not one.kept]
