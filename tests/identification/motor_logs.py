"""Logs of a simulated motor with Karnopp friction, driven by strokes with rests in between."""

from collections.abc import Mapping

import numpy as np

from identification.arrays import Array
from identification.effects._library import built_in
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.motion_log import motion_log
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Motor, Plant
from identification.simulation.free_run import free_run

H = 2e-3
K_A = 20.0
NOISE = 1e-5
NINE = Karnopp(3.0, 12.0, 10.0, 80.0, 100.0, 0.008, -0.01, 16.0, -14.0)


def plant(
    effects: Mapping[str, Mapping[str, float]] | None = None, friction: Karnopp = NINE
) -> Plant:
    """The motor with these effects."""
    acting = tuple(built_in()[key].acting(values) for key, values in (effects or {}).items())
    return Plant(friction, Motor(K_A), acting)


def strokes(n: int, seed: int) -> Array:
    """Commands [V]: pushes to and fro that rise slowly through breakaway, and none in between."""
    rng = np.random.default_rng(seed)
    parts, way = list[Array](), 1.0
    while sum(len(part) for part in parts) < n:
        size, length = rng.uniform(0.9, 1.8), round(rng.uniform(0.3, 0.8) / H)
        swing = size * np.sin(np.pi * np.arange(length) / length)
        parts += [way * swing, np.zeros(round(rng.uniform(0.1, 0.5) / H))]
        way = -way
    return np.asarray(np.concatenate(parts)[:n], dtype=np.float64)


def made(
    seed: int, effects: Mapping[str, Mapping[str, float]] | None = None, n: int = 10_000,
    friction: Karnopp = NINE, command: Array | None = None,
) -> Log:  # fmt: skip
    """20 s at 500 Hz with the paper's position noise; command: [V], (n,), otherwise strokes."""
    rng, u = np.random.default_rng(seed + 1), strokes(n, seed) if command is None else command
    blank = Log(f"motor{seed}", {"t": H * np.arange(n, dtype=np.float64), "u": u, "y": np.zeros(n)})
    run = free_run(plant(effects, friction), blank, (0.0, 0.0, 0.0), "command")
    return blank.with_signals(y=run.shown + NOISE * rng.standard_normal(n), F=K_A * u)


def seen(log: Log) -> MotionLog:
    """The log as the trace sees it."""
    return motion_log(log, zoh=True, by_command=False)
