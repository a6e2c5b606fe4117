"""A trace that could not tell which effect a machine has: does the run to make next decide it?

    python benchmarks/experiment_traces.py [--first 700] [--cases 50] [--seconds 30] [--budget 30]

Every seed draws a machine and an effect of the library (of `blind_effects`, at 20 %), and logs a
few moves of 5 s, under five times the usual noise. Where `trace` of that log ends "inseparable" or
"unknown", the search makes a run of at most 30 s that tells its rivals apart, within limits of the
machine's own; the true machine runs it, and both logs are traced together. Decided: the verdict is
"effect", and the effect is the right one, alone or with others. Seeds below 700 served to choose.
"""

import argparse
import time
from dataclasses import dataclass

import numpy as np

from benchmarks.blind_cases import effect_keys
from benchmarks.blind_effects import acting, place_of, shows
from benchmarks.blind_machines import Machine, random_machine, simulated, stream
from benchmarks.experiment import limits_of, logged, model_of, poor_log
from design.asked import Wanted
from design.experiment.plan import experiment
from design.experiment.planned import rivals_of
from identification.effects._base import Acting
from identification.effects._library import built_in
from identification.errors import UserError
from identification.log import Log
from identification.progress import quiet
from identification.tracing.result import Trace
from identification.tracing.trace import trace

STRENGTH = 0.2
POOR, WORSE = 5.0, 5.0  # s of the poor log, and times its noise
SIGNALS = "pressure_dependent_friction"  # which these logs, without pressures, cannot show


@dataclass(frozen=True)
class Case:
    """A machine with the effect that it has."""

    seed: int
    machine: Machine
    effect: Acting


def case_of(seed: int) -> Case:
    """The machine and the effect of a seed."""
    one, rng = random_machine(seed), stream(seed, "effect")
    keys = [key for key in effect_keys() if shows(key, one) and key != SIGNALS]
    at = place_of(one, simulated(one, (), seed, "train", 20.0))
    key = keys[int(rng.integers(len(keys)))]
    return Case(seed, one, acting(key, STRENGTH, at, built_in(), rng))


def traced(case: Case, logs: list[Log]) -> Trace:
    """What a trace of logs of the case's machine finds."""
    rng = np.random.default_rng(case.seed)
    return trace(logs, [], case.machine.rig, built_in(), rng, on_progress=quiet)


def open_question(found: Trace) -> dict[str, object]:
    """What trace.json would say of it, as far as the search for a run needs it."""
    return {
        "verdict": found.verdict,
        "effects": [{"key": one.effect.key} for one in found.effects],
        "rivals": [{"key": one.key, "why_not": one.why_not} for one in found.rivals],
    }


def judged(seed: int, seconds: float, budget: float) -> bool | None:
    """Whether one case is decided; None where its trace left nothing open."""
    case = case_of(seed)
    key, effects = case.effect.key, (case.effect,)
    before = poor_log(case.machine, seed, effects, seconds=POOR, worse=WORSE)
    first = traced(case, [before])
    said = f"{seed:5d} {case.machine.kind:17s} {key:28s} {first.verdict:11s}"
    if first.verdict not in ("inseparable", "unknown"):
        print(f"{said} {' '.join(one.effect.key for one in first.effects)}", flush=True)
        return None
    model = model_of(case.machine, before, seed)
    rivals = rivals_of(open_question(first), model, built_in())
    limits = limits_of(case.machine, seconds)
    wanted = Wanted((), limits.stroke, limits.speed, limits.force, None, seconds, seed, rivals)
    begin = time.process_time()
    plan = experiment(model, wanted, None, quiet, lambda: time.process_time() < begin + budget)
    spent = time.process_time() - begin
    rng = stream(seed, "settles")
    run, used = logged(case.machine, plan.r, rng, effects=effects)
    after = traced(case, [before, run])
    found = [one.effect.key for one in after.effects]
    decided = after.verdict == "effect" and key in found
    print(
        f"{said} -> {after.verdict:11s} {' '.join(found):30s} {'decided' if decided else 'OPEN'}"
        f"  {spent:5.1f} s of a processor, {len(rivals)} rivals"
        f" {' '.join(used.exceeded(plan.limits))}",
        flush=True,
    )
    return decided


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=700)
    parser.add_argument("--cases", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--budget", type=float, default=30.0)
    asked = parser.parse_args()
    decided: list[bool] = []
    seed = asked.first
    while len(decided) < asked.cases:
        try:
            found = judged(seed, asked.seconds, asked.budget)
        except UserError as error:
            print(f"{seed:5d} {type(error).__name__}: {error}"[:150], flush=True)
            found = None
        decided += [] if found is None else [found]
        seed += 1
    print(f"{sum(decided)} of {len(decided)} decided by one run (seeds to {seed - 1})")


if __name__ == "__main__":
    main()
