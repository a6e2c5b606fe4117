"""Machines of the blind benchmark, their position loops, and the runs that they log.

Every machine runs 60 s at 500 Hz in the loop of the paper's figure 5 (a motor: figure 1, upper
part). The reference strings together multisines, faded in and out, and moves at a constant rate to
random places, each with a dwell of 0.3 to 3 s. Noise: 1e-5 m and 1e-2 N (the paper's variances),
10 Pa.

Electro-pneumatic machines log both chamber pressures. Their common level is not held: supply and
exhaust let it wander by three slow waves (8 to 40 s) of together at most 35 % around 3 bar, the
same in both chambers but for what the areas ask. Nothing but `pressure_dependent_friction` feels
it.
"""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from design.effect_loop import simulate_effect_loop
from design.force_pi import ForcePI
from design.loop import Cascade, LoopNoise, LoopRun
from design.loop_signals import OfForce
from design.pid import pid_to_rst
from design.rst import RST
from identification.arrays import Array
from identification.effects._base import Acting
from identification.log import Log, Rig, RigKind
from identification.model.karnopp import Karnopp
from identification.model.plant import Actuator, Motor, Plant

H, SECONDS = 2e-3, 60.0
NOISE_Y, NOISE_F, NOISE_P = 1e-5, 1e-2, 10.0
AREA_P, AREA_N, MEAN, SUPPLY, SWAY = 12.6e-4, 10.0e-4, 3e5, 5e5, 0.35
FORCE = ForcePI(0.02, 0.05)
PAPER = Actuator(19530.0, 10405.0)
TABLES = {
    "table1": Karnopp(1.0, 12.0, 15.0, 300.0, 200.0, 0.04, -0.04, 20.6, -23.0),
    "table2": Karnopp(3.5, 16.97, 18.13, 289.0, 287.4, 0.009, -0.01, 20.76, -21.8),
    "table3": Karnopp(6.5, 12.54, 7.35, 147.01, 113.05, 0.015, -0.02, 24.03, -10.18),
}
MACHINES = (*TABLES, "motor", "force", "random")
CALM = 0.5  # rad, phase that a late command may cost at the force loop's gain of one
TRIES = 200  # draws of a random machine until it moves and rests as it should
FAST, FASTEST, LEAST_RESTS = 0.06, 1.0, 8  # m/s, m/s, rests of 0.1 s and more


@dataclass(frozen=True)
class PID:
    """k_R (1 + 1/(T_i s) + T_d s/(eps s + 1)); k_R [N/m], times [s]."""

    k_R: float
    T_i: float
    T_d: float
    eps: float


@dataclass(frozen=True)
class Machine:
    """A plant without effects, its loop, and how far [m] and fast [m/s] its reference goes."""

    name: str
    kind: RigKind
    friction: Karnopp
    drive: Actuator | Motor
    position: PID
    force: ForcePI | None
    limit: float
    travel: float = 0.06
    speed: float = 0.15

    @property
    def coulomb(self) -> float:
        """Mean of both directions' Coulomb levels [N]."""
        return 0.5 * (self.friction.F_cp + self.friction.F_cn)

    @property
    def rig(self) -> Rig:
        """What its card would say."""
        if isinstance(self.drive, Motor):
            return Rig("motor", force_per_command=self.drive.k_a)
        if self.kind == "force":
            return Rig("force")
        return Rig(self.kind, area_p=AREA_P, area_n=AREA_N, supply_pressure=SUPPLY)

    def controller(self, h: float) -> RST:
        """The position controller at period h [s]; volts for a motor."""
        one = self.position
        found = pid_to_rst(one.k_R, one.T_i, one.T_d, one.eps, h)
        if isinstance(self.drive, Motor):
            return RST(found.R / self.drive.k_a, found.S, found.T / self.drive.k_a, h)
        return found


@dataclass(frozen=True, eq=False)
class Run:
    """What a machine logs, and what only its maker knows of it: the loop's own run."""

    log: Log
    true: LoopRun
    pressures: Mapping[str, Array]


def stream(seed: int, *names: str) -> np.random.Generator:
    """Random numbers of a seed for one purpose."""
    return np.random.default_rng([seed, *(zlib.crc32(name.encode()) for name in names)])


def machine(name: str, seed: int) -> Machine:
    """A machine by name; "random" draws it from the seed."""
    paper = PID(1754.0, 0.072, 0.018, 0.2)
    if name in TABLES:
        return Machine(name, "electro-pneumatic", TABLES[name], PAPER, paper, FORCE, 5.0)
    if name == "force":
        return Machine(name, "force", TABLES["table2"], PAPER, paper, FORCE, 5.0)
    if name == "motor":
        nine = Karnopp(10.0, 12.0, 11.0, 60.0, 66.0, 0.01, -0.012, 15.0, -14.0)
        return Machine(name, "motor", nine, Motor(35.0), PID(2500.0, 0.5, 0.1, 0.01), None, 10.0)
    return random_machine(seed)


def random_machine(seed: int) -> Machine:
    """The first draw of the seed that moves, rests and stays in bounds without effects."""
    rng = stream(seed, "random machine")
    for _ in range(TRIES):
        one = drawn(rng)
        if lively(simulated(one, (), seed, "train").true):
            return one
    raise RuntimeError(f"seed {seed}: no machine in {TRIES} draws moves and rests as it should")


def drawn(rng: np.random.Generator) -> Machine:
    """A machine with a controller that places its sliding loop at 12 to 25 rad/s."""

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    m, coulomb, viscous, band = between(0.5, 8), between(5, 40), between(30, 400), between(4, 30)
    f_c = coulomb * rng.uniform(0.85, 1.15, 2)
    f_v = viscous * rng.uniform(0.85, 1.15, 2)
    dv = 1e-3 * np.clip(band * rng.uniform(0.8, 1.25, 2), 4.0, 30.0)
    f_s = f_c * rng.uniform(1.1, 1.6, 2)
    nine = Karnopp(m, f_c[0], f_c[1], f_v[0], f_v[1], dv[0], -dv[1], f_s[0], -f_s[1])
    kind = cast(RigKind, str(rng.choice(["electro-pneumatic"] * 2 + ["motor", "force"])))
    w = rng.uniform(12.0, 25.0)
    k_p = max(m * w**2, 6.0 * viscous, 40.0 * coulomb)
    damping = max(1.6 * np.sqrt(k_p * m) - viscous, 0.0)
    position = PID(k_p, rng.uniform(0.2, 0.6), damping / k_p, 0.01)
    travel, speed = rng.uniform(0.04, 0.1), rng.uniform(0.1, 0.2)
    if kind == "motor":
        k_a = between(5.0, 50.0)
        limit = 20.0 * (coulomb + 0.4 * viscous) / k_a
        return Machine("random", kind, nine, Motor(k_a), position, None, limit, travel, speed)
    drive = Actuator(between(1e4, 4e4), between(5e3, 2e4))
    loop = ForcePI(390.0 / drive.k1, 0.05)
    return Machine("random", kind, nine, drive, position, loop, 5.0, travel, speed)


def lively(run: LoopRun) -> bool:
    """Whether a run has fast slides, enough rests, and neither ran away nor stood still."""
    speed = np.abs(run.v)
    fast = float(np.quantile(speed, 0.97))
    return bool(
        fast > FAST and np.max(speed) < FASTEST and np.max(np.abs(run.y)) < 0.5
        and len(rest_lengths(run)) >= LEAST_RESTS and np.mean(speed > 0.02) > 0.3
    )  # fmt: skip


def usable(run: LoopRun) -> bool:
    """Whether a run with effects still slides for a fifth of its time, and stays in bounds."""
    length = round(0.06 / H)
    far = np.where(np.abs(run.v) > 0.02, np.sign(run.v), 0.0)
    slides = np.abs(np.lib.stride_tricks.sliding_window_view(far, length).sum(axis=1)) == length
    return bool(np.mean(slides) > 0.2 and np.max(np.abs(run.y)) < 0.6)


def calmed(one: Machine, late: float) -> Machine:
    """The machine with its force loop slow enough for a command that is late by so much [s]."""
    if one.force is None or not isinstance(one.drive, Actuator) or late == 0.0:
        return one
    k_i = min(one.force.k_i, CALM / (one.drive.k1 * late))
    return replace(one, force=ForcePI(k_i, one.force.T_i))


def rest_lengths(run: LoopRun, least: float = 0.1) -> Array:
    """Lengths [s] of the rests of at least `least`."""
    still = np.concatenate([[0], (run.v == 0.0).astype(np.int8), [0]])
    edges = np.flatnonzero(np.diff(still))
    lengths = (edges[1::2] - edges[::2]) * float(run.t[1])
    return np.asarray(lengths[lengths >= least], dtype=np.float64)


def reference(one: Machine, n: int, rng: np.random.Generator) -> Array:
    """r [m], (n,): multisines and moves with dwells, one after the other."""
    parts, count, level = [np.zeros(round(0.3 / H))], 0, 0.0
    while count < n:
        if rng.random() < 0.45:
            part = level + sines(one, rng)
        else:
            to = float(rng.uniform(-one.travel, one.travel))
            part = move(level, to, one.speed * np.exp(rng.uniform(np.log(0.3), np.log(2.0))), rng)
            level = to
        parts.append(part)
        count += len(part)
    return np.concatenate(parts)[:n]


def sines(one: Machine, rng: np.random.Generator) -> Array:
    """Six sines of random phase, faded in and out, with the machine's speed as root mean square."""
    t = H * np.arange(round(rng.uniform(3.0, 6.0) / H))
    f = np.exp(rng.uniform(np.log(0.15), np.log(2.0), 6))
    x = np.sum(np.sin(2 * np.pi * f * t[:, np.newaxis] + rng.uniform(0, 6.3, 6)) / f, axis=1)
    fade = np.clip(np.minimum(t, t[-1] - t) / 0.5, 0.0, 1.0)
    x = x * fade**2 * (3.0 - 2.0 * fade)
    wanted = one.speed * rng.uniform(0.5, 1.0)
    x = x * wanted / np.sqrt(np.mean(np.gradient(x, H) ** 2))
    return np.asarray(x * min(1.0, 1.5 * one.travel / np.max(np.abs(x))))


def move(start: float, to: float, rate: float, rng: np.random.Generator) -> Array:
    """From one place to another at a constant rate [m/s], and a dwell there."""
    slide = np.linspace(start, to, max(2, round(abs(to - start) / rate / H)))
    dwell = np.exp(rng.uniform(np.log(0.3), np.log(3.0)))
    return np.concatenate([slide, np.full(round(dwell / H), to)])


def chambers(one: Machine, n: int, rng: np.random.Generator) -> dict[str, OfForce]:
    """Pressures p_p, p_n [Pa] under the force, around a common level that wanders slowly."""
    if one.kind != "electro-pneumatic":
        return {}
    t = H * np.arange(n)
    wave = np.zeros(n)
    for _ in range(3):
        period, phase = rng.uniform(8.0, 40.0), rng.uniform(0.0, 2 * np.pi)
        wave += np.sin(2 * np.pi * t / period + phase) / 3.0
    level = MEAN * (1.0 + SWAY * wave)
    half, offset = 1.0 / (AREA_P + AREA_N), (AREA_P - AREA_N) * (level - SUPPLY)
    at_rest = {"p_p": level - half * offset, "p_n": level + half * offset}
    return {key: OfForce(x, half if key == "p_p" else -half) for key, x in at_rest.items()}


def simulated(
    one: Machine, effects: tuple[Acting, ...], seed: int, part: str, seconds: float = SECONDS,
    friction: Karnopp | None = None,
) -> Run:  # fmt: skip
    """A run with these effects; part: "train" or "test", of another reference, noise and level.

    friction: in place of the machine's own (a drift). Raises BadModel where the loop runs away.
    """
    n = round(seconds / H)
    r = reference(one, n, stream(seed, one.name, part, "reference"))
    noise_rng = stream(seed, one.name, part, "noise")
    noise = LoopNoise.draw(n, NOISE_Y, 0.0 if one.kind == "motor" else NOISE_F, noise_rng)
    at = chambers(one, n, stream(seed, one.name, part, "pressure"))
    plant = Plant(friction or one.friction, one.drive, effects)
    cascade = Cascade(one.controller(H), one.force, one.limit)
    run = simulate_effect_loop(plant, cascade, r, H, noise=noise, signals=at)
    true = {key: np.asarray(of(run.F), dtype=np.float64) for key, of in at.items()}
    signals: dict[str, Array] = {"t": run.t, "r": run.r, "y": run.y_measured}
    # A motor's logged force is its command's: dead zone and delay do not show in it.
    signals["F"] = one.drive.k_a * run.u if isinstance(one.drive, Motor) else run.F_measured
    if one.kind != "force":
        signals["u"] = run.u
    for key, p in true.items():
        signals[key] = p + NOISE_P * noise_rng.standard_normal(n)
    return Run(Log(part, signals), run, true)


def drifted(nine: Karnopp, share: float, rng: np.random.Generator) -> Karnopp:
    """Friction levels changed by this share, viscous by half of it the other way."""
    way = float(rng.choice([-1.0, 1.0]))
    c, v = 1.0 + way * share, 1.0 - 0.5 * way * share
    return replace(
        nine, F_cp=c * nine.F_cp, F_cn=c * nine.F_cn, F_sp=c * nine.F_sp, F_sn=c * nine.F_sn,
        F_vp=v * nine.F_vp, F_vn=v * nine.F_vn,
    )  # fmt: skip
