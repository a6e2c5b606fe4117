"""The simulator of `drives`: the equation of motion holds, and the package's own run agrees."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.drives import Case
from benchmarks.drives_report import errors, line, print_report, wilson
from benchmarks.drives_rig import (
    EFFECTS,
    FAMILIES,
    PAIRS,
    STRANGE,
    Machine,
    Made,
    drawn,
    make,
    shown,
    simulated,
    sizes,
    stream,
    truth,
)
from identification.arrays import Array
from identification.effects._library import built_in
from identification.log import Log
from identification.model.plant import Actuator, Motor, Plant
from identification.simulation.free_run import free_run

SECONDS = 12.0


def bare(family: str, rate: int, loop_rate: int = 1000, seed: int = 0) -> Machine:
    """A machine without noise, count, bits and jitter."""
    one = drawn(family, seed, stream(seed, "tests", family))
    how = replace(
        one.how, seconds=SECONDS, log_rate=rate, loop_rate=loop_rate, noise_y=0.0,
        noise_force=0.0, noise_u=0.0, bits=0, count=0.0, jitter=0.0,
    )  # fmt: skip
    return replace(one, how=how, paths=("mixed", "mixed"))


def slip(v: Array, one: Machine) -> Array:
    """Friction of the nine in sliding [N]."""
    p = one.nine
    return np.asarray(np.where(v > 0.0, p.F_cp + p.F_vp * v, -p.F_cn + p.F_vn * v))


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_momentum_is_what_driving_force_and_friction_leave(family: str) -> None:
    rate = 64000
    one = bare(family, rate)
    _, (y, v, F, _) = simulated(one, 0, "train", {})
    p = one.nine
    slides = (np.minimum(v[1:], v[:-1]) > p.dv_p) | (np.maximum(v[1:], v[:-1]) < p.dv_n)
    middle = 0.5 * (v[1:] + v[:-1])
    force = F[:-1] if family == "motor" else 0.5 * (F[1:] + F[:-1])
    left = p.m * np.diff(v) * rate - force + slip(middle, one)
    assert np.mean(slides) > 0.2
    assert np.max(np.abs(left[slides])) < 1e-4 * one.coulomb
    assert np.max(np.abs(np.diff(y) * rate - middle)[slides]) < 1e-6 * one.speed


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_a_stuck_body_stands_still_within_its_limits(family: str) -> None:
    one = bare(family, 64000)
    _, (y, v, F, _) = simulated(one, 0, "train", {})
    rests = (v[:-1] == 0.0) & (v[1:] == 0.0)
    assert np.mean(rests) > 0.01
    assert np.all(np.diff(y)[rests] == 0.0)
    at = F[:-1][rests]
    slack = 1e-3 * one.coulomb  # a force sampled within the step in which the body breaks away
    assert np.min(at) >= one.nine.F_sn - slack and np.max(at) <= one.nine.F_sp + slack


@pytest.mark.parametrize("family", ["motor", "pneumatic"])
def test_the_packages_run_of_the_truth_is_the_log(family: str) -> None:
    one = bare(family, 1000)
    log, motion = simulated(one, 0, "train", {})
    drive = Motor(one.actuator[0]) if family == "motor" else Actuator(*one.actuator[:2])
    run = free_run(Plant(one.nine, drive), log, (0.0, 0.0, 0.0), "command")
    assert np.ptp(log["y"]) > one.travel
    assert np.max(np.abs(run.y - log["y"])) < 2e-7
    assert np.mean(np.abs(run.F - motion[2])) < 1e-4 * one.coulomb


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("stribeck", {"F_s": "dip", "v_s": "dip_speed"}),
        ("cogging", {"a": "cog", "period": "cog_period"}),
        ("spring", {"k": "k"}),
        ("position", {"c1": "slope", "period": "length"}),
        ("load", {"mu": "mu"}),
        ("warmup", {"a": "warm", "tau": "warm_tau"}),
        ("backlash", {"width": "play"}),
        ("dead_zone", {"u_d": "dead"}),
        ("delay", {"tau": "late"}),
    ],
)
def test_effects_are_those_of_the_library(effect: str, values: dict[str, str]) -> None:
    one = bare("motor", 4000, 4000)
    _, plain = simulated(one, 0, "train", {})
    e = sizes(one, effect, 0.2, plain)
    if effect == "delay":
        e["late"] = round(e["late"] * 4000) / 4000  # a whole number of the loop's ticks
    e["length"] = 0.05
    log, (y, v, _, _) = simulated(one, 0, "train", e)
    acting = built_in()[EFFECTS[effect]].acting({key: e[name] for key, name in values.items()})
    at = np.arange(0, len(log), len(log) // 50)
    begun = None if effect in ("backlash", "delay", "dead_zone") else (at, y[at], v[at])
    start, motor = (0.0, 0.0, 0.0), Motor(one.actuator[0])
    shown_by = [
        free_run(Plant(one.nine, motor, effects), log, start, "command", restarts=begun).shown
        for effects in ((acting,), ())
    ]
    # The median: a window in which cogging decides by a hair where the body stops may go apart.
    with_it, without = (float(np.median(np.abs(x - log["y"]))) for x in shown_by)
    assert with_it < 0.01 * without


def test_a_clock_that_jitters_reads_another_instant() -> None:
    one = bare("motor", 500)
    even, motion = simulated(one, 0, "train", {})
    how = replace(one.how, jitter=0.02)
    uneven, other = simulated(replace(one, how=how), 0, "train", {})
    assert np.array_equal(even["t"], uneven["t"]) and np.array_equal(motion[3], other[3])
    off = uneven["y"] - even["y"]
    assert 0.0 < np.std(off[np.abs(motion[1]) > 0.05]) < 3.0 * 0.02 / 500 * np.max(motion[1])


@pytest.mark.method
def test_every_effect_has_a_size_and_shows_in_the_log() -> None:
    for family in FAMILIES:
        one = bare(family, 500)
        log, plain = simulated(one, 0, "train", {})
        for effect in (*EFFECTS, *STRANGE):
            if shown(effect, family):
                e = sizes(one, effect, 0.2, plain)
                with_it, _ = simulated(one, 0, "train", e)
                assert np.all(np.isfinite(with_it["y"]))
                assert np.max(np.abs(with_it["y"])) < 3.0 * one.travel, (family, effect)
                assert np.std(with_it["y"] - log["y"]) > 0.0
    assert set(EFFECTS.values()) <= set(built_in())
    assert all(one in EFFECTS for pair in PAIRS for one in pair)


def test_a_bristle_has_no_band_of_its_own() -> None:
    one = bare("motor", 500)
    empty = Log("x", {"t": np.zeros(2)})
    made = Made(one, empty, empty, {"sigma_0": 1e5}, np.zeros((4, 2)))
    assert truth(made)["dv_p"] is None and truth(made)["m"] == one.nine.m


@pytest.mark.method
@pytest.mark.slow
def test_a_seed_is_always_the_same_machine() -> None:
    first, second = (make("force", ("none",), 0, 0.2) for _ in range(2))
    assert np.array_equal(first.train["F"], second.train["F"])
    assert not np.array_equal(first.train["y"], first.test["y"])


def test_lines_and_tables(capsys: pytest.CaptureFixture[str]) -> None:
    one = {"value": 2.0, "low": 1.0, "high": 3.0}
    keys = ("m", "F_cp", "F_cn", "F_vp", "F_vn", "dv_p", "dv_n", "F_sp", "F_sn")
    nine = {key: dict(one) for key in keys}
    fit = {"nine": nine, "chi_square": 1.0, "drive": "force", "seconds": 1.0}
    said = {"verdict": "none", "effects": [], "depends_on": [], "seconds": 2.0,
            "after": {"force_rms": 1.0}, "noise_force": 0.5}  # fmt: skip
    found = {"part": "clean", "family": "motor", "effects": ["none"], "keys": [], "seed": 1,
             "truth": {key: 2.5 for key in nine}, "fit": fit, "trace": said}  # fmt: skip
    assert errors(found)["m"] == -0.5
    assert "F/noise 2.00" in line(found) and not line(found).endswith("X")
    print_report([found, {**found, "trace": {}, "fit": {}, "failed": "over 300 s"}])
    assert "50 %" in capsys.readouterr().out
    assert wilson(0, 0) == "-" and wilson(1, 2).startswith("50 % [9, 91]")
    assert Case("clean", "motor", ("none",), 1).asked == "both"
