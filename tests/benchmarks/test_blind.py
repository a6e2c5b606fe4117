"""The blind benchmark: one short run whole, its sealed truths, and its tables."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.blind import ROOT, run
from benchmarks.blind_cases import Case, case_of, effect_keys, make
from benchmarks.blind_effects import ABSORBED, SIZES, acting, place_of, right_signals, shows
from benchmarks.blind_machines import MACHINES, lively, machine, simulated, stream
from benchmarks.blind_report import clopper_pearson, judged, print_report
from identification.effects._library import built_in

SECONDS = 15.0


@pytest.mark.method
@pytest.mark.slow
def test_a_run_from_case_to_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "blind.jsonl"
    case = Case("single", "table2", ("spring",), 0.4, 0)
    run([case], file, jobs=1, seconds=SECONDS)
    run([case], file, jobs=1, seconds=SECONDS)  # held already: nothing is made again
    lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    assert case_of(lines[0]["case"]) == case
    assert [line["case"] for line in lines] == ["single:table2:spring:0.4:0"]
    assert set(lines[0]["truth"]["effects"]) == {"spring"}
    assert lines[0]["trace"]["verdict"] != "fault", lines[0]["trace"]
    print_report(file)
    assert "spring" in capsys.readouterr().out


@pytest.mark.slow
def test_the_tracing_process_cannot_open_a_truth(tmp_path: Path) -> None:
    (tmp_path / "truth.json").write_text("{}", encoding="utf-8")
    script = (
        "import sys, pathlib; from benchmarks.blind_child import seal\n"
        "p = pathlib.Path(sys.argv[1]); seal(p)\n"
        "for ask in (lambda: (p / 'truth.json').read_text(), lambda: list(p.iterdir())):\n"
        "    try: ask()\n"
        "    except PermissionError: print('refused')\n"
    )
    asked = [sys.executable, "-c", script, str(tmp_path)]
    said = subprocess.run(asked, capture_output=True, text=True, check=True, cwd=ROOT)
    assert said.stdout.split() == ["refused", "refused"], said.stderr


@pytest.mark.parametrize("name", MACHINES)
def test_machines_slide_and_rest(name: str) -> None:
    one = machine(name, 0)
    assert lively(simulated(one, (), 0, "train").true)


def test_every_effect_has_a_size_on_every_machine_that_shows_it() -> None:
    assert set(effect_keys()) == set(built_in()) - ABSORBED == set(SIZES)
    for name in ("table1", "motor", "force"):
        one = machine(name, 0)
        at = place_of(one, simulated(one, (), 0, "train"))
        for key in effect_keys():
            if shows(key, one):
                acting(key, 0.4, at, built_in(), stream(0, key))  # refuses values out of bounds


def test_train_and_test_differ_and_a_case_is_the_same_twice() -> None:
    case = Case("single", "motor", ("stribeck",), 0.2, 3)
    one, again = make(case, SECONDS), make(case, SECONDS)
    np.testing.assert_array_equal(one.train.log["y"], again.train.log["y"])
    assert not np.array_equal(one.train.log["r"], one.test.log["r"])


def test_answers_are_judged() -> None:
    def answer(verdict: str, *keys: str) -> str:
        effects = [{"key": key} for key in keys]
        found = {"verdict": verdict, "effects": effects, "rivals": []}
        return judged({"truth": {"effects": {"spring": {}}}, "trace": found})

    assert answer("effect", "spring") == "right"
    assert answer("effect", "spring", "stribeck") == "and more"
    assert answer("unknown", "spring") == "and more"
    assert answer("effect", "cogging") == "wrong"
    assert answer("none") == "none"
    assert answer("unknown") == "unknown"
    assert answer("fault") == "refused"


def test_exact_interval() -> None:
    # 0 of 10: 1 - 0.025^(1/10); textbook value of the exact interval.
    assert clopper_pearson(0, 10) == pytest.approx((0.0, 0.30849710), abs=1e-7)
    assert clopper_pearson(10, 10) == pytest.approx((0.69150290, 1.0), abs=1e-7)


def test_signals_that_stand_for_one_another() -> None:
    assert "p_p" in right_signals(("F",))
    assert "v" not in right_signals(("y",))
