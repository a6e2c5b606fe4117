"""Plants and logs that the tests of the fit share, made by free runs with a known truth."""

import tomllib
from pathlib import Path

import numpy as np

from identification.arrays import Array
from identification.log import Log
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Plant
from identification.simulation.free_run import free_run

ACTUATOR = Actuator(19530.0, 10405.0)
NOISE_Y, NOISE_F = 1e-5, 1e-2


def table(number: int) -> Karnopp:
    """The nine of the paper's table 1, 2 or 3."""
    path = Path(__file__).parents[1] / "reference" / "tables.toml"
    values = tomllib.loads(path.read_text())[f"table{number}"]
    return Karnopp(**{name: float(values[name]) for name in Karnopp.__dataclass_fields__})


def command(t: Array, seed: int) -> Array:
    """A command [V] whose integral pushes the plant to and fro, with rests in between."""
    rng = np.random.default_rng(seed)
    u = np.zeros(len(t))
    for f in (0.3, 0.9, 2.1):
        u += 0.06 * np.sin(2 * np.pi * f * t + rng.uniform(0, 2 * np.pi))
    return u * (np.sin(2 * np.pi * 0.4 * t) > -0.3) + 0.002 * rng.standard_normal(len(t))


def made_log(
    friction: Karnopp,
    seed: int = 0,
    *,
    seconds: float = 12.0,
    h: float = 1e-3,
    noise: float = 1.0,
    u: Array | None = None,
) -> Log:
    """A log of the plant driven by a command, with the paper's noise times `noise`."""
    t = np.arange(round(seconds / h), dtype=np.float64) * h
    drive = command(t, seed) if u is None else u
    zero = np.zeros(len(t))
    blank = Log("made", {"t": t, "y": zero, "u": drive})
    run = free_run(Plant(friction, ACTUATOR), blank, (0.0, 0.0, 0.0), "command")
    rng = np.random.default_rng(seed + 1)
    y = run.y + noise * NOISE_Y * rng.standard_normal(len(t))
    force = run.F + noise * NOISE_F * rng.standard_normal(len(t))
    return Log("made", {"t": t, "y": y, "F": force, "u": drive})
