"""What is exported, under which name, and what is refused."""

import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from design.generated.exported import exported, identifier, lead_of, rows, title_of
from design.machine.compensator import CompensatorValues
from design.machine.drive import Present
from identification.errors import BadModel
from tests.workbench.export.designs import case


@given(st.text(max_size=60))
def test_an_identifier_is_one_in_every_language(name: str) -> None:
    try:
        found = identifier(name)
    except BadModel:
        assert not re.search("[A-Za-z0-9]", name)
        return
    assert re.fullmatch("[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*", found)
    assert len(found) <= 40


def test_the_recommended_controller_is_taken() -> None:
    found = case("limited").design
    assert exported(found).controller == found.recommended
    other = next(name for name in found.controllers if name != found.recommended)
    assert any("recommends" in line for line in exported(found, other).remarks)
    with pytest.raises(BadModel, match=r"recommends no controller; choose one .*rst, pid"):
        exported(replace(found, recommended="none"))


def test_the_compensator_goes_along_as_recommended() -> None:
    found = case("limited").design
    advised = found.recommendation
    assert advised is not None
    for beside in (True, False):
        one = replace(found, recommendation=replace(advised, compensator=beside))
        assert (exported(one).loop.compensation is not None) == beside
        assert not any("the compensator" in line for line in exported(one).remarks)
        against = exported(one, compensated=not beside).remarks
        assert any("recommends it with" in line for line in against)
    assert exported(replace(found, recommendation=None)).loop.compensation is not None


def test_what_is_not_there_is_refused() -> None:
    found = case("limited").design
    with pytest.raises(BadModel, match="too slow"):
        exported(replace(found, pid=None, refused={"pid": "too slow"}), "pid")
    with pytest.raises(BadModel, match="'pid': workbench design MODEL --structure pid makes one"):
        exported(replace(found, pid=None), "pid")
    with pytest.raises(BadModel, match="no present controller"):
        exported(found, "present")
    with pytest.raises(BadModel, match="run 'workbench design' again"):
        exported(replace(found, command=None))


def test_the_present_controller_is_exported_as_it_is() -> None:
    found = case("emps").design
    assert found.rst is not None and found.command is not None
    law = found.rst.law(found.command)
    what = exported(replace(found, present=Present("RST", {}, "command", law)), "present")
    assert (what.loop.law, what.loop.rate) == (law, None)
    assert "present controller" in title_of(what)
    assert not any("recommends" in line for line in what.remarks)


def test_what_to_know_of_it_stands_in_every_file() -> None:
    found = case("paper_table1").design
    values = found.compensator
    blank = replace(values.friction["F_sn"], value=None, reason="no breakaway", assumed=-23.0)
    advised = replace(
        found,
        compensator=CompensatorValues(
            values.N_c, values.e_T, {**values.friction, "F_sn": blank}, values.filters
        ),
    )
    lead = "\n".join(lead_of(exported(advised, compensated=True)))
    assert "F_sn" in lead and "not clipped" in lead
    assert "F_sn" not in "\n".join(lead_of(exported(advised, compensated=False)))


def test_a_motor_needs_no_force_and_a_force_loop_does() -> None:
    assert [one.name for one in exported(case("emps").design, compensated=True).program.inputs] == [
        "r",
        "y",
    ]
    above = exported(case("limited").design, compensated=False).program
    assert [one.name for one in above.inputs] == ["r", "y", "F_e"]
    assert above.output.unit == "V" and above.ratio == 5


@given(st.lists(st.text("0123456789.", min_size=1, max_size=30), max_size=40))
def test_numbers_stand_in_lines(values: list[str]) -> None:
    lines = rows(values)
    assert ", ".join(values) == " ".join(lines)
    assert all(len(line) <= 100 for line in lines)
