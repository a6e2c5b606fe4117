"""The bench of probabilities reads what traces named, and finds the curve that made its cases."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.probability import FOLDS, Named, fitted, fold_of, left_out, named_in
from identification.tracing.probability import evidence


def line(mode: str, true: list[str], named: list[str]) -> str:
    terms = evidence(0.1, len(named)) if named else ()
    found = {"effects": [{"key": key} for key in named], "evidence": terms}
    truth: dict[str, object] = {"effects": {key: {} for key in true}}
    return json.dumps({"case": f"{mode}:{true}", "mode": mode, "truth": truth, "trace": found})


def test_an_effect_is_right_where_the_log_has_it_and_the_library_too(tmp_path: Path) -> None:
    file = tmp_path / "blind.jsonl"
    lines = [
        line("single", ["spring"], ["spring", "cogging"]),
        line("removed", ["spring"], ["tight_spot"]),
        line("clean", [], []),
        json.dumps({"case": "x", "mode": "single", "failed": "no loop"}),
    ]
    file.write_text("\n".join(lines), encoding="utf-8")
    assert [(one.key, one.right) for one in named_in([file])] == [
        ("spring", True), ("cogging", False), ("tight_spot", False),
    ]  # fmt: skip


def test_the_fit_finds_the_curve_that_made_the_cases() -> None:
    rng, true = np.random.default_rng(0), np.array([-1.0, -2.0, -3.0])
    named = []
    for i in range(4000):
        terms = evidence(10 ** rng.uniform(-4, 0), int(rng.integers(1, 3)))
        right = bool(rng.random() < 1.0 / (1.0 + np.exp(-true @ terms)))
        named.append(Named(str(i), "spring", terms, right))
    assert fitted(named) == pytest.approx(true, abs=0.4)
    assert {fold_of(one.run) for one in named} == set(range(FOLDS))
    as_they_are = np.array([one.right for one in named], dtype=np.float64)
    by_all = 1.0 / (1.0 + np.exp(-np.array([one.terms for one in named]) @ true))
    errors = [np.mean((said - as_they_are) ** 2) for said in (left_out(named), by_all)]
    assert errors[0] < 1.02 * errors[1]
