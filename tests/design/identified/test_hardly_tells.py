"""What a log will hardly tell, said before a fit: of each kind, and of a sound log nothing."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.init_real_tables import machine
from benchmarks.init_table_words import KINDS
from design.identified.hardly_identifiable import (
    _turns_hidden,
    braked_by_its_voltage,
    hardly_identifiable,
    without_direction,
)
from design.machine.readable import Display
from identification.arrays import Array
from identification.log import Log, Rig
from identification.signals.differentiate import differentiate

T: Array = np.asarray(2e-3 * np.arange(5000), dtype=np.float64)
FORCE = Rig("force", motion="rotary")
MOTOR = Rig("motor", motion="rotary")


def noise(size: float) -> Array:
    return np.asarray(size * np.random.default_rng(7).standard_normal(len(T)))


def said(rig: Rig, t: Array, y: Array, drive: Array) -> str:
    name = "F" if rig.kind == "force" else "u"
    return " ".join(hardly_identifiable([Log("run", {"t": t, "y": y, name: drive})], rig))


SWING: Array = 0.9 * np.sin(1.9 * T) + 0.5 * np.sin(4.8 * T + 1.0)
STOPPED: Array = np.clip(1.4 * np.sin(1.9 * T), -1.0, 1.0)  # by stops, against which it is pushed
PUSHED: Array = np.cos(1.9 * T) + np.where(np.abs(STOPPED) < 1.0, 0.0, 8.0 * np.sign(STOPPED))
ONWARDS: Array = np.cumsum(0.5 + 0.2 * np.sin(4.4 * T)) * 2e-3


@pytest.mark.parametrize(
    ("words", "rig", "t", "y", "drive"),
    [
        ("hardly anything moves", FORCE, T, noise(1e-5), noise(0.1)),
        ("slower than 50 Hz", FORCE, 15.0 * T, SWING, np.gradient(SWING, T)),
        ("motion in one direction", FORCE, T, ONWARDS + noise(1e-5), np.cos(4.4 * T)),
        ("rests at 1 rad though the force pushes it on", FORCE, T, STOPPED + noise(1e-5), PUSHED),
        ("coasts:", MOTOR, T, np.cumsum(np.maximum(9.0 - 0.8 * T, 0.4)) * 2e-3, noise(0.02)),
        ("at one speed", MOTOR, T, 50.0 * T + 0.01 * np.sin(300.0 * T), 0.1 + noise(0.04)),
        ("perhaps by hand", FORCE, T, SWING + noise(1e-5), 2.5 * np.sin(SWING) + noise(0.01)),
        ("hardly any work", FORCE, T, SWING + noise(1e-5), 0.9 + noise(0.01)),
        ('kind = "velocity"', MOTOR, T, SWING + noise(1e-5), 3.0 * np.gradient(SWING, T)),
        ("a motor that the body turns makes such a current", replace(MOTOR, command_unit="A"), T,
         SWING + noise(1e-5), 3.0 * np.gradient(SWING, T)),
    ],
)  # fmt: skip
def test_what_is_hardly_identifiable_is_said(
    words: str, rig: Rig, t: Array, y: Array, drive: Array
) -> None:
    assert words in said(rig, t, y, drive)


@pytest.mark.parametrize("seed", range(4))
def test_of_a_sound_log_nothing_is_said(seed: int) -> None:
    found = machine(np.random.default_rng(seed), T, KINDS["choose"][0])
    assert said(FORCE, T, found["y"], found["F"]) == ""


def test_nearly_one_way_is_reported_by_its_share() -> None:
    y = np.concatenate([-0.02 * T[:200], -0.02 * T[200] + 0.3 * (T[200:] - T[200])])
    assert "nearly one way (9" in said(FORCE, T, y + 1e-3 * np.sin(T), np.gradient(y) + noise(1e-6))


@pytest.mark.parametrize("constant", [-2.0, None])
def test_a_command_of_the_other_sign_does_its_work(constant: float | None) -> None:
    """What counts is the force; where its constant is not known, nor is its sign."""
    found = machine(np.random.default_rng(0), T, KINDS["choose"][0])
    log = Log("run", {"t": T, "y": found["y"], "u": -found["F"]})
    rig = replace(MOTOR, force_per_command=constant, command_unit="1")
    assert "hardly any work" not in " ".join(hardly_identifiable([log], rig))
    turned = replace(rig, force_per_command=2.0)
    assert "hardly any work" in " ".join(hardly_identifiable([log], turned))


def test_where_nothing_is_said_no_run_is_needed() -> None:
    assert hardly_identifiable([], FORCE) == ()


def test_a_motor_driven_by_its_voltage_is_braked_by_its_own() -> None:
    """Of 2 ohm, k_t 30 N/A and k_e 20 V s/m: friction of 16 N and 25 N s/m lies beside 300."""
    v = np.gradient(SWING, T)
    force = 2.0 * np.gradient(v, T) + 16.0 * np.sign(v) + 25.0 * v
    voltage = 2.0 * force / 30.0 + 20.0 * v
    log = Log("run", {"t": T, "y": SWING + noise(1e-6), "u": voltage + noise(0.02)})
    (line,) = braked_by_its_voltage([log], MOTOR)
    assert "% of the command is the velocity; if it is the motor's voltage, F_vp and F_vn" in line
    assert "k_t k_e / R" in line
    assert "k_t k_e / R" in " ".join(hardly_identifiable([log], MOTOR))
    for rig in (replace(MOTOR, command_unit="A"), FORCE):
        assert braked_by_its_voltage([log], rig) == ()
        assert "k_t k_e" not in " ".join(hardly_identifiable([log.with_signals(F=voltage)], rig))
    counts = " ".join(hardly_identifiable([log], replace(MOTOR, command_unit="1")))
    assert "of a valve, use kind" in counts and "of a motor by its current, log quick" in counts
    by_force = Log("run", {"t": T, "y": SWING + noise(1e-6), "u": np.gradient(v, T)})
    assert braked_by_its_voltage([by_force], MOTOR) == ()


def steps(*forces: float) -> list[Log]:
    """Runs from rest by steps of a motor's command, to a speed that friction ends."""
    t = T[:1000]
    y = 4.0 * (t + 0.3 * (np.exp(-t / 0.3) - 1.0)) + 1e-5 * noise(1.0)[: len(t)]
    return [Log(f"{F:g}", {"t": t, "y": F * y, "u": np.full(len(t), F)}) for F in forces]


def test_a_body_that_a_step_brings_to_speed_is_driven() -> None:
    assert "coasts" not in " ".join(hardly_identifiable(steps(1.0), MOTOR))


def test_runs_that_go_one_way_each_go_both_ways_together() -> None:
    assert "one direction" in " ".join(hardly_identifiable(steps(1.0, 0.8), MOTOR))
    assert "one direction" not in " ".join(hardly_identifiable(steps(1.0, -0.8), MOTOR))


@pytest.mark.parametrize(
    ("seconds", "middle", "hidden"), [(2.2, 0.0, True), (1.0, 0.0, False), (2.2, 0.5, False)]
)
def test_a_few_turns_or_of_one_count_are_no_motion(
    seconds: float, middle: float, hidden: bool
) -> None:
    """16 turns of two counts and 6; and a sensor that goes from one count to the next."""
    t = T[seconds > T]
    swing = np.sin(8.0 * np.pi * t) * (1.0 + 0.2 * np.sin(3.0 * t))
    y = 0.0175 * np.round(middle + (0.4 if middle else 1.4) * swing)
    motion = differentiate(y, float(t[1]))
    found = list(_turns_hidden(y, motion, Display.of(MOTOR)))
    assert len(found) == hidden


def test_turns_that_an_encoders_step_hides_are_counted() -> None:
    """A relay's swing of two counts; a longer one, or a finer encoder, hides none."""
    swing = np.sin(8.0 * np.pi * T) * (1.0 + 0.2 * np.sin(3.0 * T))
    for size, count, hidden in ((1.4, 1.0, True), (340.0, 1.0, False), (1.4, 1e-3, False)):
        y = 0.0175 * count * np.round(size * swing / count)
        text = said(MOTOR, T, y, np.cos(8.0 * np.pi * T))
        assert ("so much counts as rest" in text) == hidden, text


@pytest.mark.parametrize("seed", range(3))
def test_a_command_without_its_sign_is_said_so_of_motion_both_ways(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rate, size = rng.uniform(1.0, 3.0), rng.uniform(10.0, 90.0)
    v, y = np.cos(rate * T), np.sin(rate * T) / rate + noise(1e-5)
    magnitude = Log("run", {"t": T, "y": y, "u": size * np.abs(v)})
    (line,) = without_direction([magnitude], MOTOR)
    assert "the command u is never negative" in line and "log the command with its sign" in line
    assert without_direction([magnitude.with_signals(u=size * v)], MOTOR) == ()
    onwards = np.cumsum(np.abs(v)) * 2e-3 + noise(1e-5)
    assert without_direction([magnitude.with_signals(y=onwards)], MOTOR) == ()
