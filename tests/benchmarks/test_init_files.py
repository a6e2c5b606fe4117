"""The bench of `init`: it calls a right card right and notices each kind of wrong one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.init_cases import Case, make_case
from benchmarks.init_judge import wrong_lines
from benchmarks.init_words import WORDS
from design.first_card.proposal import Proposal
from workbench.steps.first_card.proposal import proposed

FORCE = 10  # a seed whose file is of a force-driven machine and has t, r, y, F and u


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Case:
    return make_case(FORCE, "choose", tmp_path_factory.mktemp("files"))


def changed(found: Proposal, name: str, **what: object) -> Proposal:
    one = found.signal(name)
    assert one is not None
    other = replace(one, **what)  # type: ignore[arg-type]
    return replace(found, signals=tuple(other if x is one else x for x in found.signals))


def test_a_file_is_the_same_for_its_seed(case: Case, tmp_path: Path) -> None:
    again = make_case(FORCE, "choose", tmp_path)
    assert again.path.read_bytes() == case.path.read_bytes()
    assert {"t", "y", "r", "F", "u"} <= set(case.truth)


def test_a_right_card_is_right(case: Case) -> None:
    assert wrong_lines(proposed(case.path), case) == {}


def test_each_wrong_line_is_noticed(case: Case) -> None:
    found = proposed(case.path)
    force = found.signal("F")
    assert force is not None
    sign = 1.0 if force.gain == -1.0 else -1.0
    assert wrong_lines(changed(found, "F", gain=sign), case)
    assert "y" in wrong_lines(changed(found, "y", unit="cm"), case)
    assert "t" in wrong_lines(changed(found, "t", unit="min"), case)
    y, r = found.signal("y"), found.signal("r")
    assert y is not None and r is not None
    assert "y" in wrong_lines(changed(found, "y", column=r.column), case)
    assert "motion" in wrong_lines(replace(found, motion="rotary"), case)
    assert "kind" in wrong_lines(replace(found, kind="motor"), case)


def test_words_to_judge_by_are_others(case: Case) -> None:
    for language, words in WORDS["judge"].items():
        for name, ours in words.items():
            same = set(ours) & set(WORDS["choose"][language][name])
            assert len(same) < len(ours) or name in ("t",), (language, name)
    assert np.all(np.diff(case.truth["t"]) > 0)
