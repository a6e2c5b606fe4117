"""Traces made by hand, with effects, as `identification.tracing.trace` would tell them."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from design.identified.trace_logs import Traced, traced_model
from design.machine.source import Source
from design.simulated.record import record
from identification.arrays import Array
from identification.effects._library import built_in
from identification.estimation.estimates import of_effect
from identification.estimation.latent_force import LatentForce, LatentForces, Rougher
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from identification.model.plant import Actuator, Plant
from identification.tracing.result import (
    Change,
    Dependence,
    EffectRival,
    Errors,
    FoundEffect,
    MissingForce,
    Residual,
    Trace,
    TraceVerdict,
)
from tests.chain import TABLES, short_recipe
from workbench.logs.sources import Sources

ROWS = 400
NINE = TABLES["paper_table1"]
UNITS = ("kg", "N", "N", "N s/m", "N s/m", "m/s", "m/s", "N", "N")
VALUES = {
    "stribeck": {"F_s": 3.5, "v_s": 0.05, "asymmetry": 0.0, "delta": 2.0},
    "spring": {"k": 40.0, "k_3": 0.0},
    "valve_dead_zone": {"u_d": 0.2, "asymmetry": 0.0},
    "rising_stiction": {"F_r": 2.0, "tau": 3.0, "asymmetry": 0.0},
}


@cache
def sources(file: str = "a.csv", letter: str = "a") -> Sources:
    """One simulated run as if read from a file of that name."""
    card, recipe = short_recipe()
    log = record("short", recipe)
    source = Source(log, file, letter * 64, len(log))
    return Sources(card, card.rig(), (source,), ("a log was repaired",))


def estimate(value: float, unit: str) -> Estimate:
    sd = 0.01 * abs(value)
    return Estimate(value, unit, sd, value - 1.96 * sd, value + 1.96 * sd)


def found_effect(key: str) -> FoundEffect:
    effect = built_in()[key]
    values = VALUES[key]
    sd = {name: 0.01 * abs(value) for name, value in values.items()}
    params = {p.name: of_effect(p, values[p.name], sd[p.name]) for p in effect.params}
    return FoundEffect(effect, params, 0.987, 0.005, 0.97)


def residual(equation: str, keys: Sequence[str]) -> Residual:
    """Rows of two logs in which the effects `keys` are missing before, and noise is left after."""
    rng = np.random.default_rng(3)
    v = np.where(np.arange(ROWS) % 2, 1.0, -1.0) * rng.uniform(0.01, 0.3, ROWS)
    y, t = rng.uniform(-0.1, 0.1, ROWS), np.linspace(0.1, 40.0, ROWS)
    noise = np.full(ROWS, 0.05)
    after = noise * rng.standard_normal(ROWS)
    before = after.copy()
    if "stribeck" in keys:
        before += 3.5 * np.sign(v) * np.exp(-((v / 0.05) ** 2))
    if "spring" in keys:
        before += 40.0 * y
    signals = {"v": v, "y": y, "t": t % 20.0, "F": 30.0 * v, "u": v}
    return Residual(equation, t, np.floor(t / 20.1), before, after, noise, signals)


def missing_force(keys: Sequence[str]) -> MissingForce:
    """What the rows of `residual` say of two logs, over time."""
    sliding = residual("mechanical", keys)

    def of(left: Array, sigma: float) -> LatentForces:
        parts = []
        for own in (sliding.log == 0.0, sliding.log == 1.0):
            t, y, force = sliding.t[own] % 20.0, sliding.signals["y"][own], -left[own]
            slides = np.ones(len(t), dtype=np.bool_)
            parts.append(LatentForce(t, y, force, np.full(len(t), 0.01), slides, 0.0 * t))
        return LatentForces(sigma, 0.06, sigma, Rougher(), tuple(parts))

    before, after = of(sliding.before, 1.5), of(0.01 * sliding.after, 1e-3)
    return MissingForce(before, after, replace(sliding, after=0.01 * sliding.after))


def trace_of(
    verdict: TraceVerdict = "effect", keys: Sequence[str] = ("stribeck",), *, actuator: bool = False
) -> Trace:
    """A trace of that verdict with these effects."""
    before = {n: estimate(v, u) for n, v, u in zip(NAMES, NINE.array, UNITS, strict=True)}
    before |= {"k1": estimate(19530.0, "N/(V s)"), "k2": estimate(10405.0, "N/m")}
    after = before | {"F_cp": estimate(11.0, "N")} if keys else before
    worse, better = Errors(1.83, 0.06, 4e-4, 5.0), Errors(0.07, 0.002, 1e-5, 5.0)
    library = built_in()
    acting = tuple(library[key].acting(VALUES[key]) for key in keys)
    drift = (Change("F_cp", "N", 12.0, 14.4, 0.1),) if verdict == "drift" else ()
    rivals = (
        EffectRival("nonlinear_viscous", 0.9, "gains 70 % of what stribeck does"),
        EffectRival("cogging", None, "gains 2 % of what stribeck does"),
        EffectRival("spring", 0.5, "explains as much as stribeck on these logs"),
    )
    unknown = Dependence(("y",), 0.4) if verdict == "unknown" else Dependence((), 0.0)
    residuals = [residual("mechanical", keys)]
    if actuator:
        residuals.append(residual("actuator", ()))
    return Trace(
        verdict=verdict,
        before={"train": worse, "test": worse} if keys else {"train": better, "test": better},
        after={"train": better, "test": better},
        noise_y=1e-5,
        noise_F=1e-2,
        noise_force=0.069,
        noise_actuator=4.9,
        effects=tuple(found_effect(key) for key in keys),
        rivals=rivals if keys else (),
        unknown=unknown,
        drift=drift,
        next_experiment="the same stroke at several places" if verdict == "unknown" else "",
        parameters_before=before,
        parameters_after=after,
        plant=Plant(NINE, Actuator(19530.0, 10405.0), acting),
        residuals=tuple(residuals),
        remarks=("a remark of the trace",),
        complete=verdict != "unknown",
        missing_force=missing_force(keys),
    )


def traced(found: Trace, *, rotary: bool = False, tested: bool = True) -> Traced:
    """The trace with model and runs, as `trace_logs` gives it."""
    train = sources()
    if rotary:
        train = replace(train, rig=replace(train.rig, motion="rotary"))
    test = sources("b.csv", "b").runs if tested else ()
    return Traced(
        found, traced_model(found, train.logs, built_in()), train.runs, test, train.remarks
    )
