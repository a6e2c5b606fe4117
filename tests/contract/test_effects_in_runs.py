"""Every effect in a run: it opposes motion, vanishes with its size, needs no finer step."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from identification import simulate
from identification.arrays import Array
from identification.effect_table import EffectTable, pieces
from identification.effects._base import Acting, Effect
from identification.errors import BadModel
from identification.library import built_in
from identification.log import Log
from identification.plant import Motor, Plant
from identification.simulate import FreeRun, free_run
from identification.stepping import SLIP_N, SLIP_P
from tests.identification.plants import ACTUATOR, table

REST = (0.0, 0.0, 0.0)
FRICTION = ("slip", "stiction", "friction")
HYDRAULIC, ELECTRIC = Plant(table(1), ACTUATOR), Plant(table(1), Motor(900.0))
# Parameters as large as they may well be, of a sign that would drive if it were not held back.
DRIVING: Mapping[str, Mapping[str, float]] = {
    "position_dependent_friction": {"c1": -5e3, "a": -60.0, "period": 0.01, "asymmetry": 0.5},
    "warmup": {"a": -0.95, "b": -900.0, "tau": 0.5, "asymmetry": 0.8},
    "frictional_lag": {"tau": 0.05},
}


EVERY = list(built_in().values())
every_effect = pytest.mark.parametrize("effect", EVERY, ids=lambda e: e.key)
every_friction = pytest.mark.parametrize(
    "effect", [e for e in EVERY if e.acts in FRICTION], ids=lambda e: e.key
)
every_bristle = pytest.mark.parametrize(
    "effect", [e for e in EVERY if e.acts == "bristle"], ids=lambda e: e.key
)
# A bristle replaces sticking, whatever its stiffness.
every_size = pytest.mark.parametrize(
    "effect", [e for e in EVERY if e.acts != "bristle"], ids=lambda e: e.key
)


def log_of(seconds: float, seed: int = 1) -> Log:
    """A log whose command steps at random every 0.2 s; the pressures swing."""
    t = np.arange(round(seconds * 1000), dtype=np.float64) * 1e-3
    levels = np.random.default_rng(seed).uniform(-0.12, 0.12, len(t) // 200 + 1)
    u = np.repeat(levels, 200)[: len(t)]
    p_p, p_n = 3e5 + 1e5 * np.sin(t), 3e5 - 1e5 * np.sin(t)
    return Log("made", {"t": t, "y": 0.0 * t, "u": u, "p_p": p_p, "p_n": p_n})


def typical(effect: Effect) -> Acting:
    """The effect as it may be; cushions within the stroke of the test's runs."""
    values = {p.name: p.typical for p in effect.params}
    return effect.acting(values)


def run(plant: Plant, log: Log, *effects: Acting) -> FreeRun:
    """Its free run by command, from rest."""
    return free_run(replace(plant, effects=effects), log, REST, "command")


def taken(run: FreeRun, m: float) -> Array:
    """Energy [J] that a motor has given in each sample beyond what the mass has gained."""
    work = run.F[:-1] * np.diff(run.y)
    return np.asarray(work - 0.5 * m * np.diff(run.v**2))


@every_friction
def test_friction_never_drives(effect: Effect) -> None:
    log = log_of(10.0)
    for acting in (typical(effect), effect.acting(DRIVING.get(effect.key, typical(effect).values))):
        moved = run(ELECTRIC, log, acting)
        assert np.ptp(moved.y) > 0.05
        # In the band eq. (1) itself has the friction of the force's direction, not of the motion's.
        sliding = np.isin(moved.mode, (SLIP_P, SLIP_N))
        whole = sliding[:-1] & (moved.mode[1:] == moved.mode[:-1])
        assert np.count_nonzero(whole) > 1000
        assert np.min(taken(moved, ELECTRIC.friction.m)[whole]) > -1e-10


@every_bristle
def test_a_bristle_gives_back_no_more_than_it_took(effect: Effect) -> None:
    for stiffness in (1e3, 1e5, 1e7):
        moved = run(ELECTRIC, log_of(10.0), effect.acting({"sigma_0": stiffness}))
        assert np.ptp(moved.y) > 0.05
        assert np.min(np.cumsum(taken(moved, ELECTRIC.friction.m))) > -1e-9


@every_size
def test_of_no_size_it_changes_nothing(effect: Effect) -> None:
    small = {p.name: 0.0 if p.linear else p.typical for p in effect.params}
    if not effect.linear:
        small[effect.names[0]] = effect.params[0].low
    log = log_of(10.0)
    for plant in (HYDRAULIC, ELECTRIC):
        plain, found = run(plant, log), run(plant, log, effect.acting(small))
        exact = not effect.evolve or effect.acts == "sensor" or bool(effect.linear)
        assert np.max(np.abs(found.y - plain.y)) < (1e-9 if exact else 3e-5)
        assert np.max(np.abs(found.shown - found.y)) < 1e-12


@every_effect
def test_at_its_typical_size_it_shows(effect: Effect) -> None:
    log = log_of(40.0)
    plain, found = run(HYDRAULIC, log), run(HYDRAULIC, log, typical(effect))
    assert np.max(np.abs(found.shown - plain.y)) > 1e-5


@every_effect
def test_half_the_sub_step_gives_the_same(effect: Effect, monkeypatch: pytest.MonkeyPatch) -> None:
    log, acting = log_of(40.0), typical(effect)
    found = run(HYDRAULIC, log, acting)

    def halved(table: EffectTable, h: float, bristle: float) -> int:
        return 2 * pieces(table, h, bristle)

    monkeypatch.setattr(simulate, "pieces", halved)
    assert np.max(np.abs(run(HYDRAULIC, log, acting).y - found.y)) < 1e-5


def test_all_at_once() -> None:
    library = built_in()
    log = log_of(10.0)
    every = [typical(e) for e in library.values() if e.acts != "bristle"]
    for effects in (every, [*every, typical(library["presliding"])]):
        found = run(HYDRAULIC, log, *effects)
        assert 0.001 < np.ptp(found.y) < 1.0
    with pytest.raises(BadModel, match="replaces sticking"):
        run(HYDRAULIC, log, typical(library["presliding"]), typical(library["presliding"]))


def test_a_measured_force_has_its_leakage_in_it() -> None:
    leak = built_in()["leakage"].acting({"leak": 50.0})
    log = log_of(5.0)
    seen = run(HYDRAULIC, log)
    log = log.with_signals(F=seen.F, y=seen.y)
    plain = free_run(HYDRAULIC, log, REST, "force")
    found = free_run(replace(HYDRAULIC, effects=(leak,)), log, REST, "force")
    assert np.max(np.abs(found.y - plain.y)) < 1e-12
