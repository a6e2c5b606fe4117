"""What every effect must hold to in a run: it opposes motion, vanishes with its size, needs no
finer step. On the plant of the paper's table 1, behind its actuator and behind a motor.
"""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from identification.arrays import Array
from identification.effect_contract.declaration import Broken
from identification.effects._base import Acting, Effect
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor, Plant
from identification.simulation.free_run import FreeRun, free_run
from identification.simulation.karnopp_step import SLIP_N, SLIP_P

TABLE_1 = Karnopp(1.0, 12.0, 15.0, 300.0, 200.0, 0.04, -0.04, 20.6, -23.0)  # the paper's
HYDRAULIC = Plant(TABLE_1, Actuator(19530.0, 10405.0))  # section 3.2
ELECTRIC = Plant(TABLE_1, Motor(900.0))
LARGE_COMMANDS = Plant(TABLE_1, Motor(10.0))  # moved by volts, not by tenths of them
START_AT_REST = (0.0, 0.0, 0.0)
SMALL = 0.12  # V, of the valve
LEAST_SHOWN = 1e-5  # m that an effect of typical size moves what is shown, at least
DRIVES = -1e-10  # J that friction may give back in a sample, by rounding
BRISTLE_STIFFNESSES = (1e3, 1e5, 1e7)  # N/m, of a bristle


def trial_log(seconds: float, seed: int = 1, h: float = 1e-3, most: float = SMALL) -> Log:
    """A log whose command steps at random every 0.2 s, up to `most` [V]; the pressures swing."""
    t = np.arange(round(seconds / h), dtype=np.float64) * h
    each = round(0.2 / h)
    levels = np.random.default_rng(seed).uniform(-most, most, len(t) // each + 1)
    u = np.repeat(levels, each)[: len(t)]
    p_p, p_n = 3e5 + 1e5 * np.sin(t), 3e5 - 1e5 * np.sin(t)
    return Log("made", {"t": t, "y": 0.0 * t, "u": u, "p_p": p_p, "p_n": p_n})


def typical(effect: Effect) -> Acting:
    """The effect at its typical size."""
    return effect.acting({p.name: p.typical for p in effect.params})


def run_with(plant: Plant, log: Log, *effects: Acting) -> FreeRun:
    """The plant's free run by command, from rest, with these effects."""
    return free_run(replace(plant, effects=effects), log, START_AT_REST, "command")


def energy_taken(run: FreeRun, m: float) -> Array:
    """Energy [J] that a motor gives in each sample beyond what the mass gains, (n - 1,)."""
    work = run.F[:-1] * np.diff(run.y)
    return np.asarray(work - 0.5 * m * np.diff(run.v**2))


def check_signals(effect: Effect) -> None:
    """It runs on a log that holds every signal that it needs."""
    log = trial_log(1.0)
    missing = sorted(set(effect.needs) - set(log.signals))
    if missing:
        raise Broken(
            f"it needs {', '.join(missing)}, which no check can simulate; the checks on runs are"
            " left out"
        )


def check_never_drives(effect: Effect, values: Mapping[str, float] = MappingProxyType({})) -> None:
    """Friction takes energy while the body slides; values: of its parameters, else typical."""
    acting = effect.acting(values) if values else typical(effect)
    if effect.place.rubs or effect.place.holds:
        moved = run_with(ELECTRIC, trial_log(10.0), acting)
        # In the band eq. (1) itself has the friction of the force's direction, not the motion's.
        sliding = np.isin(moved.mode, (SLIP_P, SLIP_N))
        whole = sliding[:-1] & (moved.mode[1:] == moved.mode[:-1])
        taken = energy_taken(moved, ELECTRIC.friction.m)[whole]
        if taken.size and np.min(taken) < DRIVES:
            raise Broken(f"as friction it gives the body {-np.min(taken):.3g} J in one sample")
    if effect.place.elastic:
        for stiffness in BRISTLE_STIFFNESSES:
            one = acting.values | {effect.params[0].name: stiffness}
            moved = run_with(ELECTRIC, trial_log(10.0), effect.acting(one))
            taken = np.cumsum(energy_taken(moved, ELECTRIC.friction.m))
            if np.min(taken) < -1e-9:
                raise Broken(f"it gives back {-np.min(taken):.3g} J more than it took")


def check_vanishes(effect: Effect) -> None:
    """Of no size it changes nothing (a bristle replaces sticking, whatever its stiffness)."""
    if effect.place.elastic:
        return
    small = {p.name: 0.0 if p.linear else p.typical for p in effect.params}
    if not effect.linear:
        small[effect.names[0]] = effect.params[0].low
    exact = not effect.evolve or effect.place.shows or bool(effect.linear)
    log = trial_log(10.0)
    for plant in (HYDRAULIC, ELECTRIC):
        plain, found = run_with(plant, log), run_with(plant, log, effect.acting(small))
        off = float(np.max(np.abs(found.y - plain.y)))
        if off >= (1e-9 if exact else 3e-5):
            raise Broken(
                f"at its least size ({_said(small)}) it still moves the body by {off:.3g} m"
            )
        if np.max(np.abs(found.shown - found.y)) >= 1e-12:
            raise Broken(f"at its least size ({_said(small)}) it still changes what is shown")


def check_shows(effect: Effect) -> None:
    """At its typical size it changes the run of a plant or what the transducer shows."""
    for plant, most in ((HYDRAULIC, SMALL), (LARGE_COMMANDS, 10.0)):
        log = trial_log(40.0, most=most)
        plain, found = run_with(plant, log), run_with(plant, log, typical(effect))
        if np.max(np.abs(found.shown - plain.y)) > LEAST_SHOWN:
            return
    raise Broken("at its typical size it changes nothing of a run; raise the typical values")


def check_sampling(effect: Effect) -> None:
    """The run is the same where every sample is cut in two: the effect needs no finer step."""
    coarse, fine = trial_log(20.0), trial_log(20.0, h=5e-4)
    acting = typical(effect)
    one, two = run_with(HYDRAULIC, coarse, acting), run_with(HYDRAULIC, fine, acting)
    off = float(np.max(np.abs(one.y - two.y[::2])))
    if off >= 1e-5:
        raise Broken(f"with half the step the run differs by {off:.3g} m: it changes too quickly")


def _said(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:g}" for name, value in values.items())
