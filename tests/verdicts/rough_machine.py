"""A servo in small fixed steps, which shares no line with the package's simulator.

It has what no library of effects holds, and it moves as recipes do not: at rest to rest, also one
way alone.
"""

import math
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array

STEP = 1e-4  # s, of the integration
LONGEST_MEMORY = 2.0  # s, of friction that grows since the last reversal


@dataclass(frozen=True)
class Rough:
    """A motor with friction in a PID loop, how it is moved and logged, and what is strange in it.

    Friction as in Karnopp's model with the same levels both ways: m [kg], F_c, F_s [N], F_v
    [N s/m], band [m/s]; k_a [N/V]. travel [m], speed [m/s] of its moves, one_way: all of them in
    one direction. seconds, rate [Hz] of the log; count of the encoder [m], noise_y [m].

    shake [N] at shake_hz: a force of time alone. memory [N/sqrt(s)]: friction that grows with the
    root of the time since the last reversal.
    """

    m: float
    F_c: float
    F_s: float
    F_v: float
    band: float
    k_a: float
    travel: float
    speed: float
    seconds: float
    rate: float
    bandwidth: float = 40.0  # rad/s
    one_way: bool = False
    count: float = 0.0
    noise_y: float = 0.0
    shake: float = 0.0
    shake_hz: float = 1.0
    memory: float = 0.0


def columns(one: Rough, seed: int) -> dict[str, Array]:
    """The log by columns t, r, y, u."""
    rng = np.random.default_rng(seed)
    r = moves(one, rng)
    y, u = run(one, r)
    every = round(1.0 / (one.rate * STEP))
    at = slice(None, None, every)
    shown = y[at] + one.noise_y * rng.standard_normal(len(y[at]))
    if one.count > 0.0:
        shown = one.count * np.round(shown / one.count)
    return {"t": STEP * np.arange(len(y), dtype=np.float64)[at], "r": r[at], "y": shown, "u": u[at]}


def moves(one: Rough, rng: np.random.Generator) -> Array:
    """Reference at every step [m]: moves from rest to rest, each with a dwell."""
    n = round(one.seconds / STEP)
    parts, here, count = [np.zeros(round(0.2 / STEP))], 0.0, 0
    while count < n:
        there = float(rng.uniform(-one.travel, one.travel))
        if one.one_way:
            there = here + abs(there)
        speed = one.speed * math.exp(rng.uniform(math.log(0.1), 0.0))
        length = max(0.1, 0.5 * math.pi * abs(there - here) / speed)
        s = np.linspace(0.0, 1.0, round(length / STEP))
        parts.append(here + 0.5 * (there - here) * (1.0 - np.cos(math.pi * s)))
        parts.append(np.full(round(rng.uniform(0.1, 0.6) / STEP), there))
        here, count = there, sum(map(len, parts))
    return np.concatenate(parts)[:n]


def run(one: Rough, r: Array) -> tuple[Array, Array]:
    """Position [m] and command [V] at every step; the command is held between the log's samples."""
    every = round(1.0 / (one.rate * STEP))
    w, m = one.bandwidth, one.m
    k_p, k_d, k_i = 2.0 * m * w * w, 2.0 * m * w, 0.5 * m * w**3
    y = v = total = u = slow = 0.0
    turned, way = 0.0, 1.0
    out = np.empty((2, len(r)))
    for k, target in enumerate(r.tolist()):
        t = STEP * k
        if k % every == 0:
            seen = one.count * round(y / one.count) if one.count > 0.0 else y
            error = target - seen
            total += error * every * STEP
            rate = (error - slow) * 10.0 * w  # of the error, behind a low pass
            slow += (error - slow) * (1.0 - math.exp(-10.0 * w * every * STEP))
            u = (k_p * error + k_i * total + k_d * rate) / one.k_a
        out[0, k], out[1, k] = y, u
        drive = one.k_a * u + one.shake * math.sin(2.0 * math.pi * one.shake_hz * t)
        more = one.memory * math.sqrt(min(t - turned, LONGEST_MEMORY))
        before, v = v, slid(one, v, drive, more)
        if v * way < 0.0:
            turned, way = t, -way
        y += 0.5 * STEP * (before + v)
    return out[0], out[1]


def slid(one: Rough, v: float, drive: float, more: float) -> float:
    """Speed after a step under this drive, with so much more friction [N]; 0 where it sticks."""
    if abs(v) <= one.band:
        if abs(drive) <= one.F_s + more:
            return 0.0
        level = math.copysign(one.F_s + more, drive)
    else:
        level = math.copysign(one.F_c + more, v) + one.F_v * v
    net = drive - level
    after = v + STEP * net / one.m
    if v * after < 0.0:  # through standstill: the next step tells whether it stays
        return 0.0
    return after
