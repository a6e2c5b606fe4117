"""Drift test: run length without drift, what it finds, and after how many logs.

    python benchmarks/drift.py [stable] [jump] [slow] [structure] [length] [lacking] [unseen]
        [--first 9000] [--streams 60] [--logs 25] [--machines table2,motor] [--jobs 1] [--verbose]

Machines and loops are those of the blind benchmark (benchmarks/blind_machines.py): the paper's
three tables, a motor, a machine that logs no command, and random ones. Every stream identifies a
model from one log of 40 s, makes it active, and tests further logs of 10, 20 and 40 s at 500 Hz
with other references. In every second stream each friction parameter varies from log to log by a
standard deviation of 1 % by itself, which is no drift. Seeds below 9000 served to choose.

stable: logs without drift; the mean run length up to an alarm (any verdict but "none"), with its
95 % interval (Poisson). jump: one log after a change of table, or
of the friction by 20 and 50 %. slow: 2 % a log of a parameter.
structure: an effect of 20 % of the Coulomb level joins. length: the same change in logs of 20, 60
and 200 s. lacking: a motor stage with a Stribeck dip under a model of three logs that has none; six
logs of it as it was, six with friction 20 % up. unseen: a rotary motor whose Coulomb friction grows
by 5 % over ten logs that hardly tell it. Both by other machines (benchmarks/drift_machines.py), at
most LONG streams of them.
"""

import argparse
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.stats import chi2

from benchmarks.blind_effects import SIZES, acting, place_of, shows
from benchmarks.blind_machines import MACHINES, Machine, drifted, machine, simulated, stream
from benchmarks.drift_machines import STAGE_RIG, TURNED_RIG, active, stage, turned
from identification.drift.drift_result import DriftTest
from identification.drift.drift_test import drift_test
from identification.drift.own_logs import with_own_logs
from identification.drift.reference_model import ReferenceModel
from identification.effects._base import Acting
from identification.effects._library import built_in
from identification.errors import BadModel, UserError
from identification.estimation.fit import fit_plant
from identification.log import Log
from identification.model.karnopp import COULOMB_NAMES, Karnopp

PARTS = ("stable", "jump", "slow", "structure", "length", "lacking", "unseen")
OWN_MACHINES = {"lacking": "stage", "unseen": "rotary"}
LONG = 3  # streams of those, of minutes each
WORN, CREPT = 1.2, 1.05
LENGTHS = (10.0, 20.0, 40.0)  # s
MODEL = 40.0  # s
VARIATION = 0.01
STRENGTH = 0.2
RATE = 0.02
MOST = 15  # logs of a slow drift
JUMPS = (0.2, 0.5)  # of stick and Coulomb friction; viscous by half of it the other way
TABLES = ("table1", "table2", "table3")
SLOW = {
    "F_cp and F_cn": ("F_cp", "F_cn"),
    "F_cp": ("F_cp",),
    "F_vp and F_vn": ("F_vp", "F_vn"),
    "m": ("m",),
}


@dataclass(frozen=True)
class Outcome:
    """One log's test: what was done to the machine, the verdict, what moved, and the time [s]."""

    machine: str
    seed: int
    what: str
    log: int
    verdict: str
    moved: tuple[str, ...]
    found_by: str | None
    chi_square: float | None
    seconds: float
    judged: int = 0
    seen: float = np.inf  # smallest change of both Coulomb levels that could have been seen


def activated(one: Machine, seed: int) -> ReferenceModel:
    """The model of one log of the machine as it is."""
    log = simulated(one, (), seed, "model", MODEL).log
    fit = fit_plant([log], np.random.default_rng(seed), rig=one.rig)
    fastest = float(np.quantile(np.abs(np.gradient(log["y"], log.h)), 0.99))
    model = active(fit, one.rig, key=f"{one.name}{seed}", fastest=fastest)
    return with_own_logs(model, [log], np.random.default_rng(seed))


def varied(nine: Karnopp, rng: np.random.Generator, share: float) -> Karnopp:
    """Friction as it happens to be on the day of a log; the mass stays."""
    factors = 1.0 + share * np.clip(rng.standard_normal(9), -3.0, 3.0)
    factors[0] = 1.0
    return Karnopp.from_array(nine.array * factors)


def scaled(nine: Karnopp, names: Sequence[str], factor: float) -> Karnopp:
    """The nine with these parameters multiplied."""
    return replace(nine, **{name: getattr(nine, name) * factor for name in names})


def tested(
    model: ReferenceModel,
    one: str,
    log: Log,
    seed: int,
    what: str,
    number: int,
    last: DriftTest | None,
) -> tuple[Outcome, DriftTest]:
    """The test of a log after the one before."""
    begin = time.perf_counter()
    state = last.state if last else None
    found = drift_test(model, log, np.random.default_rng([seed, number]), state=state)
    seconds = time.perf_counter() - begin
    names = tuple(sorted(shift.name for shift in found.moved))
    outcome = Outcome(
        one, seed, what, number, found.verdict, names, found.found_by, found.chi_square,
        seconds, len(found.shifts),
        max(found.could_have_seen.get(name, np.inf) for name in COULOMB_NAMES),
    )  # fmt: skip
    return outcome, found


def stable(name: str, seed: int, logs: int) -> list[Outcome]:
    """A stream of logs without drift; after an alarm the chart begins anew."""
    one = machine(name, seed)
    model = activated(one, seed)
    share = VARIATION * (seed % 2)
    rng = stream(seed, name, "stable")
    out: list[Outcome] = []
    last: DriftTest | None = None
    for k in range(logs):
        seconds = float(rng.choice(LENGTHS))
        friction = varied(one.friction, rng, share)
        log = simulated(one, (), seed, f"log{k}", seconds, friction).log
        outcome, found = tested(model, one.name, log, seed, f"{share:g}", k, last)
        out.append(outcome)
        last = None if found.verdict == "drift" else found
    return out


def jump(name: str, seed: int) -> list[Outcome]:
    """One log of 40 s after the machine has become that of another table, or has changed a lot."""
    one = machine(name, seed)
    model = activated(one, seed)
    rng = stream(seed, name, "jump")
    after = {f"{name} -> {o}": machine(o, seed).friction for o in TABLES if o != name}
    if name not in TABLES:
        after = {f"friction by {100 * s:.0f} %": drifted(one.friction, s, rng) for s in JUMPS}
    out = []
    for what, friction in after.items():
        log = simulated(one, (), seed, "jump", MODEL, friction).log
        out.append(tested(model, one.name, log, seed, what, 1, None)[0])
    return out


def slow(name: str, seed: int) -> list[Outcome]:
    """Logs of 20 s while a parameter grows by 2 % of its first value a log, up to the alarm."""
    one = machine(name, seed)
    model = activated(one, seed)
    share = VARIATION * (seed % 2)
    out = []
    for what, names in SLOW.items():
        rng = stream(seed, name, what)
        last: DriftTest | None = None
        for k in range(1, MOST + 1):
            day = scaled(varied(one.friction, rng, share), names, 1.0 + RATE * k)
            log = simulated(one, (), seed, f"{what}{k}", 20.0, day).log
            outcome, last = tested(model, one.name, log, seed, what, k, last)
            if last.verdict != "none":
                break
        out.append(outcome)
    return out


def structure(name: str, seed: int) -> list[Outcome]:
    """One log of 40 s with each effect of 20 % of the Coulomb level."""
    one = machine(name, seed)
    model = activated(one, seed)
    place = place_of(one, simulated(one, (), seed, "place", MODEL))
    library = built_in()
    out = []
    for key in SIZES:
        if shows(key, one):
            effect: Acting = acting(key, STRENGTH, place, library, stream(seed, name, key))
            try:
                log = simulated(one, (effect,), seed, key, MODEL).log
            except BadModel:
                continue  # the loop does not bear it
            out.append(tested(model, one.name, log, seed, key, 1, None)[0])
    return out


def length(name: str, seed: int) -> list[Outcome]:
    """The same change of both Coulomb forces in logs of 20, 60 and 200 s."""
    one = machine(name, seed)
    model = activated(one, seed)
    out = []
    for share in (0.0, 0.01, 0.05, 0.1):
        changed = scaled(one.friction, ("F_cp", "F_cn"), 1.0 + share)
        for seconds in (20.0, 60.0, 200.0):
            log = simulated(one, (), seed, f"length{share}", seconds, changed).log
            what = f"{100 * share:.0f} % in {seconds:.0f} s"
            out.append(tested(model, one.name, log, seed, what, 1, None)[0])
    return out


def lacking(seed: int) -> list[Outcome]:
    """Logs of a stage as it was and worn, under a model that lacks its Stribeck dip."""
    logs = [stage(seed, k) for k in range(3)]
    fit = fit_plant(logs, np.random.default_rng(seed), rig=STAGE_RIG)
    model = active(fit, STAGE_RIG, key=f"stage{seed}", fastest=speed_of(logs))
    model = with_own_logs(model, logs, np.random.default_rng(seed))
    tested_share = sum(one.value is not None for one in fit.estimates.values())
    print(f"  stage {seed}: {tested_share} of 9 identified, chi-square {fit.chi_square:.3g}")
    out = []
    for what, factor, first in (("as it was", 1.0, 3), ("worn", WORN, 30)):
        last: DriftTest | None = None
        for k in range(first, first + 6):
            log = stage(seed, k, factor)
            outcome, last = tested(model, "stage", log, seed, what, k, last)
            out.append(outcome)
    return out


def unseen(seed: int) -> list[Outcome]:
    """Ten logs of a rotary motor whose Coulomb friction creeps up by 5 %."""
    logs = [turned(seed, k, seconds=12.0) for k in range(3)]
    fit = fit_plant(logs, np.random.default_rng(seed), rig=TURNED_RIG)
    model = active(fit, TURNED_RIG, key=f"rotary{seed}", fastest=speed_of(logs))
    model = with_own_logs(model, logs, np.random.default_rng(seed))
    out = []
    last: DriftTest | None = None
    for k in range(1, 11):
        log = turned(seed, 10 + k, 1.0 + (CREPT - 1.0) * k / 10)
        outcome, last = tested(model, "rotary", log, seed, "5 % over ten logs", k, last)
        out.append(outcome)
    return out


def speed_of(logs: Sequence[Log]) -> float:
    """Speed that 1 % of the logs' exceed."""
    return max(float(np.quantile(np.abs(np.gradient(log["y"], log.h)), 0.99)) for log in logs)


def report(part: str, found: Sequence[Outcome], verbose: bool) -> None:
    """The part's table, and its times."""
    print(f"\n{part}: {len(found)} tests, {' '.join(sorted({o.machine for o in found}))}")
    if part == "stable":
        report_stable(found)
    else:
        for what in dict.fromkeys(o.what for o in found):
            rows = [o for o in found if o.what == what]
            counts = ", ".join(f"{n} {v}" for v, n in Counter(o.verdict for o in rows).items())
            line = f"  {what:28s} {counts}"
            if part == "slow":
                logs = [o.log if o.verdict == "drift" else MOST + 1 for o in rows]
                line += f"; logs: median {np.median(logs):.0f}, worst {max(logs)}"
                line += f"; moved: {Counter(' '.join(o.moved) for o in rows).most_common(3)}"
            elif part in OWN_MACHINES:
                line += f"; seen from {100 * np.median([o.seen for o in rows]):.3g} % on (median)"
                line += f"; moved: {Counter(n for o in rows for n in o.moved).most_common()}"
            elif part == "jump":
                line += f"; moved: {Counter(' '.join(o.moved) for o in rows).most_common(2)}"
            print(line)
    times = [o.seconds for o in found]
    print(f"  a test: median {np.median(times):.2f} s, 95 % {np.quantile(times, 0.95):.2f} s,"
          f" longest {max(times):.1f} s")  # fmt: skip
    if verbose:
        for o in found:
            if part != "stable" or o.verdict != "none":
                print(f"    {o}")


def report_stable(found: Sequence[Outcome]) -> None:
    """Mean run length with its interval, by kind of stream and over all."""
    groups: Iterator[tuple[str, list[Outcome]]] = iter(
        [
            ("all", list(found)),
            *((f"variation {w}", [o for o in found if o.what == w]) for w in ("0", "0.01")),
            *((m, [o for o in found if o.machine == m]) for m in MACHINES),
        ]
    )
    for name, rows in groups:
        judged = [o for o in rows if o.verdict != "not_judged"]
        if not judged:
            continue
        alarms = sum(o.verdict in ("drift", "structure") for o in judged)
        low = 2 * len(judged) / chi2.isf(0.025, 2 * alarms + 2)
        high = 2 * len(judged) / chi2.isf(0.975, 2 * alarms) if alarms else np.inf
        mean = len(judged) / alarms if alarms else np.inf
        kinds = ", ".join(f"{n} {v}" for v, n in Counter(o.verdict for o in rows).items())
        tested_share = np.mean([o.judged for o in judged])
        print(f"  {name:16s} {kinds}; run length {mean:.0f} logs ({low:.0f} to {high:.0f});"
              f" {tested_share:.1f} parameters judged")  # fmt: skip


def run(job: tuple[str, str, int, int]) -> list[Outcome]:
    """One machine and seed of one part; a machine that cannot be identified is left out."""
    part, name, seed, logs = job
    parts: dict[str, Callable[[str, int], list[Outcome]]] = {
        "stable": partial(stable, logs=logs),
        "jump": jump,
        "slow": slow,
        "structure": structure,
        "length": length,
    }
    try:
        if part in OWN_MACHINES:
            return lacking(seed) if part == "lacking" else unseen(seed)
        return parts[part](name, seed)
    except UserError as error:
        print(f"  {part} {name} {seed}: {error}")
        return []


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", default=list(PARTS))
    parser.add_argument("--first", type=int, default=9000)
    parser.add_argument("--streams", type=int, default=60)
    parser.add_argument("--logs", type=int, default=25)
    parser.add_argument("--machines", default=",".join(MACHINES))
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--verbose", action="store_true")
    asked = parser.parse_args()
    names = asked.machines.split(",")
    for part in asked.parts:
        own = OWN_MACHINES.get(part)
        of, count = ([own], min(asked.streams, LONG)) if own else (names, asked.streams)
        jobs = [
            (part, of[i % len(of)], asked.first + i // len(of), asked.logs) for i in range(count)
        ]
        if asked.jobs == 1:
            found = [o for job in jobs for o in run(job)]
        else:
            with ProcessPoolExecutor(asked.jobs) as pool:
                found = [o for outcomes in pool.map(run, jobs) for o in outcomes]
        if found:
            report(part, found, asked.verbose)


if __name__ == "__main__":
    main()
