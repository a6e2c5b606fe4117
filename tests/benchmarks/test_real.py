"""The judge of real logs: its least squares, its measure of a model, its counting."""

from typing import Any

import numpy as np
import pytest

from benchmarks.real_cases import Case, Part, Right, Truth, every_case
from benchmarks.real_judge import false_proof, intervals, questions
from benchmarks.real_report import row, summary, worse
from benchmarks.real_shares import command_for
from benchmarks.yardstick import (
    Record,
    Terms,
    fitted,
    own_share,
    record,
    run_errors,
    share_left,
)
from identification.arrays import Array
from identification.effects._library import built_in

MASS, UP, DOWN, VISCOUS, OFFSET, COG = 2.0, 3.0, 4.0, 5.0, 1.5, 2.0  # kg, N, N, N s/m, N, N
COUNT = 30.0  # 1/m
H = 2e-3  # s


def machine(late: float, seed: int = 0) -> Record:
    """A log whose position is read `late` [s], of a motion that needs exactly the force logged."""
    rng = np.random.default_rng(seed)
    t = H * np.arange(4000, dtype=np.float64)
    parts = [(0.05, 3.1), (0.02, 7.3), (0.1, 1.0 + 0.1 * seed)]

    def moved(at: Array) -> tuple[Array, Array, Array]:
        y = np.sum([a * np.sin(w * at) for a, w in parts], axis=0)
        v = np.sum([a * w * np.cos(w * at) for a, w in parts], axis=0)
        return y, v, np.sum([-a * w * w * np.sin(w * at) for a, w in parts], axis=0)

    y, v, a = moved(t)
    force = MASS * a + np.where(v > 0, UP, -DOWN) + VISCOUS * v + OFFSET
    force += COG * np.sin(COUNT * y)
    seen = moved(t - late)[0] + 1e-6 * rng.standard_normal(len(t))
    return record(t + 1e-4 * rng.random(len(t)), seen, force)


@pytest.mark.parametrize("late", [0.0, -3e-3, 8e-3])
def test_least_squares_find_parameters_and_lag(late: float) -> None:
    fit = fitted([machine(late)], Terms(counts=(COUNT,)))
    assert fit is not None
    assert fit.lag == pytest.approx(late, abs=0.3 * H)
    # A constant and unequal Coulomb levels are one thing: their sums are what is identifiable.
    estimated = [fit.values["m"], fit.values["F_cp"] + fit.values["c"]]
    estimated += [fit.values["F_cn"] - fit.values["c"], fit.values["F_vp"], fit.values["F_vn"]]
    estimated += [fit.values["sin 30"]]
    true = [MASS, UP + OFFSET, DOWN - OFFSET, VISCOUS, VISCOUS, COG]
    assert estimated == pytest.approx(true, rel=0.02)
    share = own_share([machine(late, 1)], fit)
    assert share is not None and share < 0.03
    error = run_errors([machine(late, 1)], fit, 0.2)
    assert error is not None and error < 1e-3


def test_a_log_that_rests_has_no_yardstick() -> None:
    t = H * np.arange(3000, dtype=np.float64)
    noise = 1e-4 * np.random.default_rng(0).standard_normal(len(t))
    assert fitted([record(t, noise, np.zeros(len(t)))], Terms()) is None


def test_what_needs_no_force_leaves_all_of_it() -> None:
    log = machine(0.0)
    assert share_left([log], 8, 0.0, [(np.zeros(len(log.t)), 1e-9)]) == pytest.approx(1.0)
    twice = share_left([log], 8, 0.0, [(2.0 * log.signal, 0.0)])
    assert twice == pytest.approx(1.0, abs=0.02)


def test_a_dead_zone_as_wide_as_the_command_explains_nothing_of_it() -> None:
    u = np.where(np.arange(1000) // 50 % 2 == 0, 4.0, -4.0)
    wide = built_in()["valve_dead_zone"].acting({"u_d": 4.0})
    assert np.max(np.abs(command_for(np.zeros(len(u)), u, (wide,)))) < 1e-6
    narrow = built_in()["valve_dead_zone"].acting({"u_d": 0.5})
    reached = np.sign(u) * (np.abs(u) - 0.5)
    assert command_for(reached, u, (narrow,)) == pytest.approx(u, rel=0.02)


def case(name: str, **right: Any) -> Case:
    """A case with what is right of it."""
    defaults: dict[str, Any] = {
        "init": None, "doctor": None, "truth": (), "verdicts": (), "must": (), "must_not": (),
    }  # fmt: skip
    return Case(
        name, "case", "a.toml", "", "", (Part("a.csv"),), (), Terms(), False, False,
        Right(**{**defaults, **right}),
    )  # fmt: skip


def answers(shares: tuple[float, float, float], runs: tuple[float, float]) -> dict[str, Any]:
    """Answers with these shares of yardstick, identify, trace and runs of the latter two."""
    mass = {"m": {"value": 1.0, "low": 0.9, "high": 1.1}}
    return {
        "yardstick": {"share": shares[0], "measured": "u", "seconds": 1.0},
        "identify": {
            "share": shares[1], "run_0.2": runs[0], "run_2": runs[0],
            "parameters": mass, "seconds": 2.0,
        },
        "trace": {
            "share": shares[2], "run_0.2": runs[1], "run_2": runs[1], "verdict": "effect",
            "effects": ["spring"], "parameters": mass, "seconds": 3.0,
        },
    }  # fmt: skip


def test_the_summary_counts_what_is_right() -> None:
    mass = (Truth("m", 0.98, 1.02, 1.0),)
    right = case("right", truth=mass, verdicts=("effect",), must=("spring|gravity",))
    wrong = case("wrong", truth=(Truth("m", 1.9, 2.1, 2.0),), verdicts=("none",))
    found = [
        (right, {"case": "right", **answers((0.1, 0.104, 0.05), (1e-3, 1e-3))}),
        (wrong, {"case": "wrong", **answers((0.1, 0.2, 0.3), (1e-3, 2e-3))}),
        (case("refused"), {"case": "refused", "identify": {"refused": "x", "seconds": 1.0}}),
    ]
    assert worse(found, "identify") == (["wrong"], 2)
    assert worse(found, "trace") == (["wrong"], 2)
    text = "\n".join(summary(found))
    assert "questions right: 2 of 4" in text
    assert "false proofs: 1 of 2 reported (wrong (run_0.2 0.001 to 0.002))" in text
    assert "intervals that hold: 1 of 2" in text
    assert "identify refused: refused" in text
    assert "median processor seconds: 6" in text
    assert row(*found[0])[3] == "10 / 10.4 / 5"
    assert [one.why for one in questions(*found[1])] == ["1, not 1.9 to 2.1", "effect, not none"]
    assert intervals(*found[0]) == [True]


def test_a_force_that_is_made_proves_nothing() -> None:
    made = answers((0.1, 0.1, 0.2), (1e-3, 1e-3))
    assert false_proof(made, force_is_measured=False) == ""
    assert false_proof(made, force_is_measured=True) == "share 0.1 to 0.2"


def test_every_entry_of_the_table_is_read() -> None:
    names = [one.name for one in every_case()]
    assert len(names) == len(set(names)) > 25


def test_another_split_of_a_rig_has_its_card_and_files_of_its_own() -> None:
    named = {one.name: one for one in every_case()}
    split, rig = named["pk_one_log"], named["seals_PK_3bar"]
    assert (split.group, split.card, split.prescribed) == ("split", rig.card, rig.prescribed)
    assert split.train != rig.train
    assert (split.right.must, split.right.verdicts) == ((), rig.right.verdicts)
