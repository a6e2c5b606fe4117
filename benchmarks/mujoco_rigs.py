"""Machines simulated by MuJoCo, which knows nothing of this project: one joint with dry friction.

A machine a seed: a slide driven by a measured force, or a motor, in a loop of its own (PD with the
encoder's noise in it), whose train log follows a sum of sines and whose test log follows strokes
with rests, at speeds a decade apart. Friction loss is made hard (MuJoCo softens it else, so that a
body creeps at rest). What an effect adds is a force on the joint, written here.
"""

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from identification.arrays import Array

DT = 2.5e-5  # s, of the simulation: its integrator errs by the share of a step
SECONDS = 20.0
HARD = 'solimpfriction="0.9999 0.9999 0.001" solreffriction="0.0005 1"'
Extra = Callable[[float, float], float]  # force against the motion by position and speed


@dataclass(frozen=True)
class Machine:
    """A joint, its loop and what its log has.

    extra: a force against the joint beside its friction; on_test: the same of the test log alone;
    load: a second mass behind a spring, inertia and stiffness; delay: of the command, in samples;
    every: rows of the loop that the log has one of; truth: numbers by name, as models have them;
    right: verdicts that an engineer would want, and `names`, effects that have to be named.
    """

    motor: bool
    m: float
    F_c: float
    F_v: float
    amplitude: float
    kp: float
    kd: float
    noise: float
    h: float = 1e-3
    k_a: float = 1.0
    noise_F: float = 0.3
    weight: float = 0.0
    stiffness: float = 0.0
    load: tuple[float, float] | None = None
    extra: Extra | None = None
    on_test: Extra | None = None
    delay: int = 0
    every: int = 1
    force_lag: float = 0.0
    slow_test: bool = False
    truth: Mapping[str, float] = field(default_factory=dict)
    right: tuple[str, ...] = ("none",)
    names: tuple[str, ...] = ()

    @property
    def numbers(self) -> dict[str, float]:
        """What a model should have of mass and friction, and `truth`."""
        friction = {"F_cp": self.F_c, "F_cn": self.F_c, "F_vp": self.F_v, "F_vn": self.F_v}
        sizes = {"m": self.m + (self.load[0] if self.load else 0.0), **friction}
        placed = {"gravity.a": self.weight, "spring.k": self.stiffness}
        return {**sizes, **{key: size for key, size in placed.items() if size}, **self.truth}


SLIDE = Machine(
    motor=False, m=8.0, F_c=20.0, F_v=50.0, amplitude=0.05, kp=8e3, kd=300.0, noise=2e-6
)
MOTOR = Machine(
    motor=True, m=0.02, F_c=0.3, F_v=0.05, amplitude=1.0, kp=40.0, kd=2.0, noise=1e-5, k_a=0.1
)
PENDULUM = replace(
    MOTOR, m=0.0435, F_c=0.08, F_v=0.01, kp=300.0, kd=10.0, weight=1.4715, names=("gravity",)
)


def _stribeck(_y: float, v: float) -> float:
    return float(np.sign(v) * 10.0 * np.exp(-((v / 0.02) ** 2)))


MACHINES: dict[str, Machine] = {
    "slide": SLIDE,
    "slide_200hz": replace(SLIDE, h=5e-3, kp=4e3, kd=150.0),
    "slide_pulled": replace(SLIDE, extra=lambda y, v: 5.0, truth={"F_cp": 25.0, "F_cn": 15.0}),
    "slide_late_force": replace(SLIDE, force_lag=8e-3),
    "motor": MOTOR,
    "motor_500hz": replace(MOTOR, h=2e-3),
    "motor_every_4th": replace(MOTOR, h=2.5e-4, every=4),
    "motor_pendulum": PENDULUM,
    "motor_delay": replace(MOTOR, delay=3, right=("effect",), names=("input_delay",)),
    "motor_spring": replace(MOTOR, stiffness=2.0, right=("effect",), names=("spring",)),
    "motor_cogging": replace(
        MOTOR, extra=lambda y, v: 0.15 * float(np.sin(12.0 * y)), right=("effect",),
        names=("cogging",),
    ),
    "motor_elastic": replace(
        MOTOR, m=0.01, load=(0.02, 60.0), right=("unknown",), names=("two_masses",)
    ),
    "slide_stribeck_on_test": replace(
        SLIDE, extra=_stribeck, slow_test=True, right=("effect",), names=("stribeck",)
    ),
    "slide_worn": replace(SLIDE, on_test=lambda y, v: 3.0 * float(np.sign(v)), right=("drift",)),
    "slide_worn_slow": replace(
        SLIDE, on_test=lambda y, v: 20.0 * v, slow_test=True, right=("drift",)
    ),
}  # fmt: skip


def write(folder: Path, machine: Machine, seed: int) -> None:
    """train.csv, test.csv and card.toml of a machine. Raises ImportError without MuJoCo."""
    unit = "rad" if machine.motor else "m"
    for k, name in enumerate(("train", "test")):
        rng = np.random.default_rng(1000 * seed + k)
        rows = _logged(machine, rng, on_test=k == 1)
        head = "t,y,r,u" if machine.motor else "t,y,r,F"
        np.savetxt(folder / f"{name}.csv", rows, "%.9g", ",", header=head, comments="")
    drive, of_drive = ("u", "A") if machine.motor else ("F", "N")
    kind, motion = ("motor", "rotary") if machine.motor else ("force", "linear")
    per = f'force_per_command = "{machine.k_a} N m/A"' if machine.motor else ""
    reference = f'r = {{ column = "r", unit = "{unit}" }}' if machine.motor else ""
    (folder / "card.toml").write_text(
        f'[card]\nname = "mujoco"\n[rig]\nkind = "{kind}"\nmotion = "{motion}"\n{per}\n[signals]\n'
        f't = {{ column = "t", unit = "s" }}\ny = {{ column = "y", unit = "{unit}" }}\n'
        f'{reference}\n{drive} = {{ column = "{drive}", unit = "{of_drive}" }}\n',
        "utf-8",
    )


def _logged(machine: Machine, rng: np.random.Generator, *, on_test: bool) -> Array:
    """Rows t, y, r and command or force, as the machine's log has them, (n, 4)."""
    mujoco: Any = importlib.import_module("mujoco")
    model = mujoco.MjModel.from_xml_string(_xml(machine))
    data, h = mujoco.MjData(model), machine.h
    t = np.asarray(h * np.arange(round(SECONDS / h)), dtype=np.float64)
    r = _reference(machine, t, rng, on_test=on_test)
    noisy = machine.noise * rng.standard_normal(len(t))
    late, last, rows = [0.0] * machine.delay, 0.0, np.zeros((len(t), 4))
    for i, now in enumerate(t):
        y = float(data.qpos[0]) + noisy[i]
        rate = 0.0 if i == 0 else (r[i] - r[i - 1] - (y - last)) / h
        u, last = machine.kp * (r[i] - y) + machine.kd * rate, y
        rows[i] = now, y, r[i], u
        late.append(u)
        acts = machine.k_a * late.pop(0)
        for _ in range(round(h / DT) if h >= DT else 1):
            at, v = float(data.qpos[0]), float(data.qvel[0])
            against = machine.extra(at, v) if machine.extra else 0.0
            against += machine.on_test(at, v) if machine.on_test and on_test else 0.0
            data.ctrl[0] = acts - against
            mujoco.mj_step(model, data)
    if not machine.motor:
        measured = np.interp(t - machine.force_lag, t, rows[:, 3])
        rows[:, 3] = measured + machine.noise_F * rng.standard_normal(len(t))
    return rows[:: machine.every]


def _reference(
    machine: Machine, t: Array, rng: np.random.Generator, *, on_test: bool
) -> Array:  # fmt: skip
    """Sines to train on; strokes between rests, or slow sines, to test on."""
    a = machine.amplitude
    if not on_test or machine.slow_test:
        lines = (0.04, 0.09, 0.17) if on_test else (0.3, 0.7, 1.5)
        a = 0.6 * a if on_test else a
        each = [
            a / (1 + k) * np.sin(2 * np.pi * f * rng.uniform(0.9, 1.1) * t + rng.uniform(0, 6.28))
            for k, f in enumerate(lines)
        ]
        return np.asarray(np.sum(each, axis=0))
    r, k, at = np.zeros(len(t)), 0, 0.0
    while k < len(t):
        goal = rng.uniform(-a, a)
        stroke = max(2, round(abs(goal - at) / (a * 10 ** rng.uniform(-1.0, 0.5)) / machine.h))
        path = np.append(np.linspace(at, goal, stroke), np.full(round(0.3 / machine.h), goal))
        r[k : k + len(path)] = path[: len(t) - k]
        k, at = k + len(path), goal
    return r


def _xml(machine: Machine) -> str:
    """The machine as MuJoCo reads it: gravity pulls at a rod of 0.25 m, in its plane."""
    kind, axis = ("hinge", "0 1 0") if machine.motor else ("slide", "1 0 0")
    rod = machine.weight / 9.81 / 0.25
    inertia = machine.m - rod * 0.25**2
    body = (
        f'<inertial pos="0 0 {-0.25 if machine.weight else 0.0}" mass="{rod or 1.0}"'
        f' diaginertia="{inertia} {inertia} {inertia}"/>'
        if machine.motor
        else f'<inertial pos="0 0 0" mass="{machine.m}" diaginertia="1 1 1"/>'
    )
    second = ""
    if machine.load:
        own, stiffness = machine.load
        second = (
            f'<body><joint type="hinge" axis="{axis}" stiffness="{stiffness}" damping="0.02"/>'
            f'<inertial pos="0 0 0" mass="1" diaginertia="{own} {own} {own}"/></body>'
        )
    step = min(DT, machine.h)
    return (
        f'<mujoco><option timestep="{step}" gravity="0 0 -9.81" integrator="implicitfast"'
        f' iterations="100" tolerance="1e-12"/><worldbody><body><joint name="j" type="{kind}"'
        f' axis="{axis}" frictionloss="{machine.F_c}" damping="{machine.F_v}"'
        f' stiffness="{machine.stiffness}" {HARD}/>{body}{second}</body></worldbody>'
        '<actuator><motor joint="j"/></actuator></mujoco>'
    )
