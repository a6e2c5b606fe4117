"""Bad samples put into sound logs: do they move a parameter beyond its 95 % interval?

    python benchmarks/bad_samples.py [--first 100] [--seeds 2] [--machine motor] [--kind jump]

Three machines in closed loop (a rotary motor, an electro-pneumatic one driven by force and command,
a stage by its measured force), each logged once without a fault and then with one of each kind, on
each signal, at a random time: in motion, at rest, in a reversal. `moved` is the largest difference
of a reported parameter from the sound log's value, over the half-width of the sound log's interval;
`own` over that of the spoilt log's. The method was chosen on seeds below 100; those from 100 on
judge it. How often something is found in sound logs: `sound_logs.py`.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.euler_loop import closed_loop
from benchmarks.random_plants import drawn_reference
from design.simulated.record import record
from identification.arrays import Array
from identification.errors import UserError
from identification.estimation.fit import fit_plant
from identification.log import Log, Rig
from identification.model.estimates import KarnoppFit
from identification.signals.clean import prepare
from workbench.cards.card import load_card
from workbench.logs.sources import card_path

SPOILT_SECONDS = 12.0
FAULT_PLACES = ("motion", "rest", "reversal")
Change = Callable[[Array, int, np.random.Generator], None]


@dataclass(frozen=True)
class Machine:
    """A sound log, its rig, and the standard deviation of each signal's noise (u: a count)."""

    log: Log
    rig: Rig
    noise: dict[str, float]


def in_loop(
    nine: Array, k_a: float, gains: Array, r: Array, noise_y: float, seed: int, h: float
) -> tuple[Array, Array]:
    """Run (4, n) of a motor in its loop, and its position behind a sensor (n,)."""
    rng = np.random.default_rng([seed, 4])
    n_y = noise_y * rng.standard_normal(len(r))
    out = closed_loop(nine, k_a, 0.0, True, gains, r, n_y, 0.0 * n_y, h, round(h / 2e-7))
    return out, out[0] + noise_y * rng.standard_normal(len(r))


def motor(seed: int) -> Machine:
    """A small rotary motor."""
    rng, h, noise = np.random.default_rng([seed, 1]), 2e-3, 3e-4
    nine = np.array([2.1e-4, 0.010, 0.009, 4e-4, 4.5e-4, 1.0, -0.9, 0.014, -0.013])
    t = h * np.arange(round(SPOILT_SECONDS / h), dtype=np.float64)
    r = drawn_reference("sine and steps", 3.0, 20.0, t, rng)
    gains = np.array([0.02, 2e-3, 0.02, 0.0, 0.0])
    out, y = in_loop(nine * rng.uniform(0.9, 1.1, 9), 0.05, gains, r, noise, seed, h)
    rig = Rig("motor", force_per_command=0.05, motion="rotary")
    log = Log("motor", {"t": t, "r": r, "y": y, "u": out[3], "F": out[2]})
    return Machine(log, rig, {"y": noise, "u": 1e-3 * float(np.std(out[3]))})


def stage(seed: int) -> Machine:
    """A linear stage, whose force is measured."""
    rng, h, noise = np.random.default_rng([seed, 2]), 1e-3, 1e-5
    nine = np.array([3.0, 10.0, 9.0, 100.0, 110.0, 0.01, -0.009, 14.0, -13.0])
    t = h * np.arange(round(SPOILT_SECONDS / h), dtype=np.float64)
    r = drawn_reference("ramps", 0.05, 0.2, t, rng)
    gains = np.array([1200.0, 30.0, 1500.0, 0.0, 0.0])
    out, y = in_loop(nine * rng.uniform(0.9, 1.1, 9), 1.0, gains, r, noise, seed, h)
    F = out[2] + 0.02 * rng.standard_normal(len(t))
    return Machine(Log("stage", {"t": t, "y": y, "F": F}), Rig("force"), {"y": noise, "F": 0.02})


def pneumatic(seed: int) -> Machine:
    """The plant of table 1, by force and command."""
    recipe = load_card(card_path("paper_table1_rich")).recipe
    assert recipe is not None
    log = record("pneumatic", replace(recipe, duration=SPOILT_SECONDS), seed)
    seen = Log("pneumatic", {key: log[key] for key in ("t", "y", "F", "u")})
    noise = {"y": recipe.noise_y, "F": recipe.noise_F, "u": 1e-3 * float(np.std(log["u"]))}
    return Machine(seen, Rig("force"), noise)


SOUND_MACHINES = {"motor": motor, "pneumatic": pneumatic, "stage": stage}


def place(log: Log, where: str, rng: np.random.Generator) -> int:
    """A sample of the log in motion, at rest or in a reversal."""
    n, half = len(log), max(4, round(0.01 / log.h))
    y = np.convolve(log["y"], np.ones(half) / half, mode="same")
    v = np.abs(np.gradient(y, log.h))
    own = np.arange(n // 10, n - n // 10)
    if where == "motion":
        own = own[v[own] > np.quantile(v, 0.7)]
    elif where == "rest":
        own = own[v[own] <= np.quantile(v, 0.15)]
    else:
        turns = own[np.gradient(y)[own] * np.gradient(y)[own + 2 * half] < 0.0]
        own = turns if len(turns) else own
    return int(rng.choice(own))


def jump(x: Array, at: int, rng: np.random.Generator, size: float) -> None:
    """A step that stays."""
    x[at:] += size * rng.choice([-1, 1])


def spike(x: Array, at: int, rng: np.random.Generator, size: float, length: int = 1) -> None:
    """One or few samples that are off."""
    x[at : at + length] += size * rng.choice([-1, 1])


def dropout(x: Array, at: int, _rng: np.random.Generator, value: float, length: int) -> None:
    """Samples that are not there, or 0."""
    x[at : at + length] = value


def frozen(x: Array, at: int, _rng: np.random.Generator, length: int, lost: bool = False) -> None:
    """A counter that stands still for a while; lost: the counts of the while are."""
    after = x[at + length] - x[at]
    x[at : at + length] = x[at]
    if lost:
        x[at + length :] -= after


def tails(x: Array, _at: int, rng: np.random.Generator, noise: float, share: float) -> None:
    """Single outliers of 5 to 50 deviations."""
    off = rng.random(len(x)) < share
    x[off] += noise * rng.choice([-1, 1], len(x))[off] * rng.uniform(5, 50, len(x))[off]


def wrapped(x: Array, _at: int, _rng: np.random.Generator, noise: float, turn: bool) -> None:
    """A counter of too few bits, or an angle that begins anew at each turn."""
    count = 0.25 * noise
    period = count * 2.0 ** round(np.log2(0.6 * float(np.ptp(x)) / count))
    x[:] = np.mod(x, 2.0 * np.pi) if turn else np.mod(count * np.round(x / count), period)


def clipped(x: Array, _at: int, _rng: np.random.Generator) -> None:
    """A command logged by a converter that ends too early."""
    limit = float(np.quantile(np.abs(x), 0.995))
    x[:] = np.clip(x, -limit, limit)


def faults(machine: Machine) -> Iterator[tuple[str, str, Change]]:
    """Kind, signal, and how it spoils the signal."""
    for name, noise in machine.noise.items():
        for size in (5, 10, 30, 100, 1000):
            if name == "y":
                yield f"jump {size}", name, partial(jump, size=size * noise)
            yield f"spike {size}", name, partial(spike, size=size * noise)
        yield "spike of 3", name, partial(spike, size=100 * noise, length=3)
        yield "dropout, NaN", name, partial(dropout, value=np.nan, length=2)
        yield "long dropout, NaN", name, partial(dropout, value=np.nan, length=30)
        yield "dropout, 0", name, partial(dropout, value=0.0, length=1)
        yield "long dropout, 0", name, partial(dropout, value=0.0, length=15)
        yield "frozen", name, partial(frozen, length=40)
        if name == "y":
            yield "frozen, lost", name, partial(frozen, length=40, lost=True)
            yield (
                "wrapped",
                name,
                partial(wrapped, noise=noise, turn=machine.rig.motion == "rotary"),
            )
        if name == "u":
            yield "clipped", name, clipped
        else:
            yield "tails, 1 %", name, partial(tails, noise=noise, share=0.01)
            yield "tails, 3 %", name, partial(tails, noise=noise, share=0.03)


def fitted(log: Log, rig: Rig) -> tuple[KarnoppFit, str]:
    """The fit of a log as a command reads it, and what was said of it."""
    if rig.kind == "motor" and rig.force_per_command is not None:
        log = log.with_signals(F=rig.force_per_command * log["u"])
    made = prepare(log, rig)
    fit = fit_plant(made.runs, np.random.default_rng(0), rig=rig)
    return fit, "; ".join((*made.remarks, *fit.remarks))


def moved(clean: KarnoppFit, spoilt: KarnoppFit) -> tuple[float, float, str, int]:
    """Largest difference over the sound log's half-width, over the own, of which, and how many
    that the sound log identifies are not reported any more."""
    worst, own, name, lost = 0.0, 0.0, "-", 0
    for key, one in clean.estimates.items():
        other = spoilt.estimates.get(key)
        if one.value is None or one.low is None or one.high is None:
            continue
        if other is None or other.value is None or other.low is None or other.high is None:
            lost += 1
            continue
        off = abs(other.value - one.value)
        share = off / (0.5 * (one.high - one.low))
        if share > worst:
            worst, name = share, key
        own = max(own, off / (0.5 * (other.high - other.low)))
    return worst, own, name, lost


def judged(machine: Machine, clean: KarnoppFit, fault: tuple[str, str, Change], seed: int) -> bool:
    """One line of the table; whether no parameter moved beyond its interval."""
    kind, name, change = fault
    rng = np.random.default_rng([seed, *kind.encode(), *name.encode()])
    where = str(rng.choice(FAULT_PLACES))
    x = np.array(machine.log[name])
    at = place(machine.log, where, rng)
    change(x, at, rng)
    begin = time.perf_counter()
    head = f"{machine.log.name:10s}{seed:4d} {name} {kind:18s}{where:9s}{machine.log['t'][at]:7.3f}"
    try:
        fit, said = fitted(machine.log.with_signals(**{name: x}), machine.rig)
    except UserError as error:
        print(f"{head}  REFUSED: {error}"[:150], flush=True)
        return False
    worst, own, which, lost = moved(clean, fit)
    verdict = "" if own < 1.0 else "MOVED"
    print(
        f"{head} moved {worst:9.3g} own {own:8.3g} {which:5s} {lost} lost, chi-square"
        f" {fit.chi_square:7.3g} {time.perf_counter() - begin:6.1f} s {verdict:6s}{said}"[:190],
        flush=True,
    )
    return own < 1.0


def spoilt(asked: argparse.Namespace) -> int:
    """The table of spoilt logs; how many moved a parameter."""
    passed = total = 0
    for name in [asked.machine] if asked.machine else SOUND_MACHINES:
        for seed in range(asked.first, asked.first + asked.seeds):
            machine = SOUND_MACHINES[name](seed)
            clean, said = fitted(machine.log, machine.rig)
            print(f"{name} {seed}: chi-square {clean.chi_square:.3g} {said}", flush=True)
            for fault in faults(machine):
                if asked.kind in f"{fault[1]} {fault[0]}":
                    passed += judged(machine, clean, fault, seed)
                    total += 1
    print(f"{passed} of {total} spoilt logs move no parameter beyond its interval")
    return total - passed


def main() -> int:
    """Run the benchmark; exit status 1 where a parameter moved."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--machine", choices=tuple(SOUND_MACHINES))
    parser.add_argument("--kind", default="", help="of faults, a part of signal and kind")
    asked = parser.parse_args()
    return int(spoilt(asked) > 0)


if __name__ == "__main__":
    sys.exit(main())
