"""Pictures of effects: one machine under one command, with the effect and without it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identification.arrays import Array
from identification.effects._base import Effect
from identification.log import Log
from identification.model.karnopp import Karnopp, friction
from identification.model.plant import Actuator, Plant
from identification.simulation.free_run import FreeRun, free_run
from identification.simulation.karnopp_step import SLIP_N, SLIP_P, STUCK
from workbench.report.chart_figure import MEASURED, MODEL, figure, label, style

TABLE_2 = Karnopp(3.5, 16.97, 18.13, 289.0, 287.4, 0.009, -0.01, 20.76, -21.8)  # the paper's
K1, K2 = 19530.0, 10405.0  # of its simulated actuator
H = 1e-3  # s
SECONDS = 40.0
SHOWN = slice(0, 8000)  # of the run, on the left
STEP = 0.005  # V from sample to sample that is a step of the command
POINTS = 6000  # of a run, at most twice as many
LARGER = 3.0  # commands of effects that act on the command


@dataclass(frozen=True)
class Shown:
    """What the right picture shows of a run: points, and what the axes say."""

    x: Array
    y: Array
    across: str
    up: str


def draw(effect: Effect, path: Path) -> None:
    """Draw a machine with the effect at its typical size, and without it."""
    acting = effect.acting({p.name: p.typical for p in effect.params})
    plain, log = Plant(TABLE_2, Actuator(K1, K2)), _log(LARGER if effect.place.on_command else 1.0)
    start = (0.0, 0.0, 0.0)
    without = free_run(plain, log, start, "command")
    found = free_run(Plant(TABLE_2, plain.actuator, (acting,)), log, start, "command")
    with style():
        drawn = figure(9.0, 3.6)
        axes = drawn.subplot_mosaic([["run", "left"], ["apart", "left"]])
        t = log["t"][SHOWN]
        axes["run"].plot(t, 1e3 * without.shown[SHOWN], color=MEASURED, label="without")
        axes["run"].plot(t, 1e3 * found.shown[SHOWN], "--", color=MODEL, label="with")
        axes["run"].legend(loc="upper right", ncols=2)
        label(axes["run"], "", "position [mm]", "the same command, with it and without")
        axes["apart"].plot(t, 1e3 * (found.shown - without.shown)[SHOWN], color=MODEL)
        label(axes["apart"], "time [s]", "difference [mm]", "")
        size = 5.0 if effect.depends_on == ("rest",) else 1.5
        for run, colour, name in ((without, MEASURED, "without"), (found, MODEL, "with")):
            one = _shown(effect, run, log)
            kept = slice(None, None, max(1, len(one.x) // POINTS))
            axes["left"].plot(
                one.x[kept], one.y[kept], ".", ms=size, color=colour, label=name, rasterized=True
            )
        label(axes["left"], one.across, one.up, "how it shows")
        drawn.savefig(path, dpi=130)


def _log(larger: float) -> Log:
    """A command of two tones that stops for longer and longer; pressures that swing."""
    t = np.arange(round(SECONDS / H), dtype=np.float64) * H
    moving = np.ones_like(t)
    for number, begin in enumerate(np.arange(2.2, SECONDS, 2.7)):
        moving[(t >= begin) & (t < begin + 0.1 + 0.12 * number)] = 0.0
    s = np.cumsum(moving) * H
    slow = 0.3 + 0.7 * np.abs(np.sin(0.11 * s))
    y = slow * (0.05 * np.sin(2 * np.pi * 0.35 * s) + 0.02 * np.sin(2 * np.pi * 0.83 * s))
    u = larger * K2 / K1 * np.gradient(y, H) * moving
    p_p, p_n = 3e5 + 1e5 * np.sin(0.9 * t), 3e5 - 1e5 * np.sin(0.7 * t)
    return Log("made", {"t": t, "y": 0.0 * t, "u": u, "p_p": p_p, "p_n": p_n})


def _shown(effect: Effect, run: FreeRun, log: Log) -> Shown:
    """What is left of the plain equation in which the effect shows, over what it depends on."""
    place = effect.place
    over = effect.depends_on[0] if effect.depends_on else "y"
    if over == "rest":
        return _breakaways(run)
    if over == "reversal":
        return _way_since_reversal(run)
    x, across = _axis(over, run, log)
    if place.shows:
        return Shown(x, 1e3 * (run.shown - run.y), across, "position shown less true [mm]")
    sliding = _same_mode(run) & np.isin(run.mode, (SLIP_P, SLIP_N))
    if place.in_actuator:
        stepped = np.abs(np.diff(log["u"], prepend=0.0)) > STEP
        calm = sliding & (np.convolve(stepped, np.ones(41), "same") < 0.5)
        rate = np.gradient(run.F, H) - (K1 * log["u"] - K2 * run.v)
        if place.delays:
            x, across = np.gradient(log["u"], H), "change of the command [V/s]"
        return Shown(x[calm], rate[calm], across, "dF/dt - k1 u + k2 v [N/s]")
    left = run.F - TABLE_2.m * np.gradient(run.v, H) - friction(run.v, run.F, TABLE_2)
    if place.drives:
        return Shown(x[sliding], -left[sliding], across, "m a + friction - F [N]")
    against = left * np.sign(run.v)
    return Shown(x[sliding], against[sliding], across, "friction beyond the plain model's [N]")


def _axis(over: str, run: FreeRun, log: Log) -> tuple[Array, str]:
    axes: Mapping[str, tuple[Array, str]] = {
        "y": (1e3 * run.y, "position [mm]"),
        "v": (run.v, "velocity [m/s]"),
        "F": (run.F, "force [N]"),
        "u": (log["u"], "command [V]"),
        "t": (log["t"], "time [s]"),
        "p_p": (1e-5 * log["p_p"], "pressure p_p [bar]"),
    }
    return axes[over]


def _same_mode(run: FreeRun) -> NDArray[np.bool_]:
    """Samples whose neighbours are in the same mode, so that differences mean something."""
    same = np.ones(len(run.mode), dtype=bool)
    same[1:] &= run.mode[1:] == run.mode[:-1]
    same[:-1] &= run.mode[:-1] == run.mode[1:]
    return same


def _breakaways(run: FreeRun) -> Shown:
    """The force at each breakaway over the length of the rest before it."""
    stuck = np.concatenate([[0], (run.mode == STUCK).astype(int), [0]])
    begins, ends = np.flatnonzero(np.diff(stuck) == 1), np.flatnonzero(np.diff(stuck) == -1)
    whole = (ends < len(run.F)) & (begins > 0)
    begins, ends = begins[whole], ends[whole]
    forces = np.abs(run.F[np.minimum(ends, len(run.F) - 1)])
    return Shown(
        H * np.asarray(ends - begins, dtype=np.float64),
        forces,
        "length of the rest [s]",
        "force at breakaway [N]",
    )


def _way_since_reversal(run: FreeRun) -> Shown:
    """Friction over the way since the motion reversed, its first part."""
    turns = np.flatnonzero(np.diff(np.sign(run.v)) != 0) + 1
    last = np.zeros(len(run.v), dtype=np.int64)
    last[turns] = turns
    way = 1e6 * np.abs(run.y - run.y[np.maximum.accumulate(last)])
    rubbing = (run.F - TABLE_2.m * np.gradient(run.v, H)) * np.sign(run.v)
    near = (way < 1000.0) & (np.abs(run.v) > 0.0)
    return Shown(
        way[near], rubbing[near], "way since the reversal [um]", "F - m a, along the motion [N]"
    )
