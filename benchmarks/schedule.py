"""Gain schedules on machines with friction of place or load, and without: taken where they win?

    python benchmarks/schedule.py [--first 100] [--machines 10] [--kinds place load plain]

Axes with a motor, drawn at random, friction by a slope, a bend or a sine along the travel, a tight
spot, or by the load, of 0.1 to 1 times the Coulomb level; a `plain` one has the effect too, of at
most a twentieth of it. The model is the truth but for errors as an identification leaves them (1 %,
of an effect's size 5 %). `design` makes the fixed PID and P-PI and their schedules; both are then
run on the truth, along a path that the design has not seen. An answer is right where "take it" is
better there (rms error below 0.9 of the fixed one, the largest force not above 1.2 of it), or where
"leave it" misses no more than 0.7 of it. Seeds below 100 served to choose.
"""

import argparse
import time
from dataclasses import dataclass
from typing import Literal

import numpy as np

from design.closed_loop.driven_loop import DrivenLoop, driven_loop, run_plant, scheduled_loop
from design.controllers.design import design
from design.controllers.schedule import scheduled
from design.machine.model import FitSummary, LogEntry, Model
from identification.arrays import Array
from identification.effects._base import Acting
from identification.effects._library import built_in
from identification.errors import UserError
from identification.log import Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES, UNITS, Karnopp
from identification.model.plant import Motor, Plant

Kind = Literal["place", "load", "plain"]
KINDS: tuple[Kind, ...] = ("place", "load", "plain")
BETTER_ON_TRUTH, MISSED, NO_MORE_FORCE = 0.9, 0.7, 1.2
PARAMETER_ERROR, EFFECT_ERROR = 0.01, 0.05
K_A, LIMIT = 20.0, 10.0


@dataclass(frozen=True)
class Axis:
    """A machine, the model that an identification would leave of it, and a path [m], every h."""

    truth: Plant
    model: Model
    speed: float
    travel: float


def drawn(kind: Kind, seed: int) -> Axis:
    """The machine of a seed."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    speed, travel, coulomb = between(0.1, 0.5), between(0.1, 0.4), between(5.0, 40.0)
    f_c = coulomb * rng.uniform(0.85, 1.15, 2)
    f_v = coulomb * between(0.1, 0.6) / speed * rng.uniform(0.9, 1.1, 2)
    band = speed * between(0.005, 0.02)
    f_s = f_c * rng.uniform(1.1, 1.3, 2)
    m = between(1.0, 15.0)
    nine = Karnopp(m, f_c[0], f_c[1], f_v[0], f_v[1], band, -band, f_s[0], -f_s[1])
    share = between(0.02, 0.05) if kind == "plain" else between(0.1, 1.0)
    effect = _effect(kind, rng, share * coulomb, travel)
    most = 2.5 * (coulomb * (1.0 + share) + f_v[0] * speed + m * 10.0 * speed)
    truth = Plant(nine, Motor(most / LIMIT), (effect,))
    return Axis(truth, _model(truth, rng, speed, travel, most), speed, travel)


def _effect(kind: Kind, rng: np.random.Generator, size: float, travel: float) -> Acting:
    library, half = built_in(), 0.5 * travel
    if kind == "load":
        return library["load_dependent_friction"].acting({"mu": float(rng.uniform(0.1, 0.35))})
    which = int(rng.integers(4))
    if which == 0:
        place = float(rng.uniform(-half, half))
        width = float(rng.uniform(0.05, 0.2)) * travel
        return library["tight_spot"].acting({"size": size, "y_0": place, "width": width})
    along = {"c1": 0.5 * size / half} if which == 1 else {"c2": size / half**2}
    period = float(rng.uniform(0.3, 1.0)) * travel
    along = {"a": 0.5 * size} if which == 3 else along
    return library["position_dependent_friction"].acting({"period": period, **along})


def _model(
    truth: Plant, rng: np.random.Generator, speed: float, travel: float, most: float
) -> Model:
    """What an identification would tell of it."""

    def estimate(value: float, unit: str, error: float) -> Estimate:
        found = value * float(1.0 + error * rng.standard_normal())
        sd = abs(value) * error
        return Estimate(found, unit, sd, found - 2.0 * sd, found + 2.0 * sd)

    (effect,) = truth.effects
    values = {
        p.name: estimate(v, p.unit, EFFECT_ERROR if p.linear else 0.0)
        for p, v in zip(effect.effect.params, effect.p, strict=True) if v or not p.optional
    }  # fmt: skip
    h = float(rng.choice([2.5e-4, 5e-4, 1e-3]))
    ends = (-0.5 * travel, 0.5 * travel)
    entry = LogEntry(
        "a.csv",
        "0" * 64,
        60_000,
        (0.0, 0.0, 0.0),
        ends,
        0.6 * most,
        60.0,
        h,
        1e-6,
        None,
        1.0,
        speed,
    )
    assert isinstance(truth.actuator, Motor)
    k_a, noise = truth.actuator.k_a, float(np.exp(rng.uniform(np.log(1e-7), np.log(3e-6))))
    rig = Rig("motor", force_per_command=k_a, control_limit=LIMIT)
    nine = {n: estimate(getattr(truth.friction, n), UNITS[n], PARAMETER_ERROR) for n in NAMES}
    return Model(
        card="axis", rig=rig, friction=nine, actuator={"k_a": Estimate(k_a, "N/V")}, plant=None,
        plant_reason="none was fitted", log=(entry,), versions={}, effects={effect.key: values},
        fit=FitSummary("command", 0.0, noise, 1e-2, 1.0, True, 1, 0.01, 0.1, ()),
    )  # fmt: skip


def path(axis: Axis, h: float, seed: int) -> Array:
    """Three sines, faded in, over most of the travel and no faster than the logs [m], (n,)."""
    rng = np.random.default_rng([seed, 7])
    t = h * np.arange(round(12.0 / h))
    r = np.sin(2.0 * np.pi * np.outer(t, rng.uniform(0.05, 0.6, 3)) + rng.uniform(0, 6.3, 3)).sum(1)
    r = r * np.clip(t / 2.0, 0.0, 1.0) ** 2 * (3.0 - 2.0 * np.clip(t / 2.0, 0.0, 1.0))
    fastest = float(np.max(np.abs(np.diff(r)))) / h
    size = min(0.45 * axis.travel / float(np.max(np.abs(r))), axis.speed / fastest)
    return np.asarray(size * r, dtype=np.float64)


def judged(kind: Kind, seed: int) -> list[tuple[bool, bool]]:
    """Of PID and P-PI whether the schedule is taken, and whether that is right."""
    axis, begun = drawn(kind, seed), time.process_time()
    over: Literal["place", "load"] = "load" if kind == "load" else "place"
    fixed = design(axis.model, structures=("pid", "p-pi"))
    try:
        found = scheduled(axis.model, fixed, over)
    except UserError as error:
        print(f"{kind:5s} {seed}: leave it ({str(error)[:110]})", flush=True)
        return [(False, kind == "plain")]
    assert found.schedule is not None
    out = []
    for name, one in found.schedule.controllers.items():
        loops = (driven_loop(axis.model, found, found.controllers[name]),
                 scheduled_loop(axis.model, found, name))  # fmt: skip
        (before, force), (after, more) = (_ride(axis, loop, seed) for loop in loops)
        wins = after / before
        harder = more / force
        if one.recommended:
            right = wins < BETTER_ON_TRUTH and harder < NO_MORE_FORCE
        else:
            right = wins > MISSED or harder > NO_MORE_FORCE
        out.append((one.recommended, right))
        print(
            f"{kind:5s} {seed} {axis.truth.effects[0].key} {len(found.schedule.at)} points,"
            f" {name:4s}: {'take it ' if one.recommended else 'leave it'}"
            f" {'right' if right else 'WRONG'}: rms error on the truth {1e6 * before:.1f} ->"
            f" {1e6 * after:.1f} um ({wins:.2f}), force {force:.0f} -> {more:.0f} N;"
            f" {one.why[:150]}; {time.process_time() - begun:.0f} s",
            flush=True,
        )
    return out


def _ride(axis: Axis, loop: DrivenLoop, seed: int) -> tuple[float, float]:
    """Root mean square error [m] and largest force [N] on the truth."""
    r = path(axis, loop.h, seed)
    run = run_plant(axis.model, axis.truth, loop, r, np.random.default_rng(seed))
    return float(np.sqrt(np.mean((run.r - run.y) ** 2))), float(np.max(np.abs(run.F)))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--machines", type=int, default=10, help="seeds a kind")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    asked = parser.parse_args()
    for kind in asked.kinds:
        found = [
            one for seed in range(asked.first, asked.first + asked.machines)
            for one in judged(kind, seed)
        ]  # fmt: skip
        taken, right = sum(one for one, _ in found), sum(one for _, one in found)
        print(f"{kind}: {taken} of {len(found)} taken, {right} right", flush=True)


if __name__ == "__main__":
    main()
