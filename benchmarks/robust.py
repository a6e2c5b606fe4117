"""Robust designs on machines that they have not seen: is what they promise kept?

    python benchmarks/robust.py [--first 700] [--machines 40] [--draws 60] [--seconds 6] [--slow]

Every seed draws a machine (of `blind_machines`: electro-pneumatic, motor, measured force) and gives
it a poor log, a few moves under ten times the usual noise. From its model come a robust design and,
beside it, the nominal one and the machine's own controller. The true machine then runs the same
motions, with noise.

- promised: mean over the machines of the share of drawn machines that keep a limit.
- share: share of the true machines that keep it; a promise holds where the two are alike.
- staircase: on a ramp at half the narrowest stick band; times: of the PID alone over the robust
  design, on each true machine. scale: the band times the period, about one step of a body that
  cannot slide more slowly and is moved once a period; with an actuator at least (F_s - F_c)/k_2,
  over which its own stiffness takes the force back after a breakaway.
- seconds: of a processor, for the search and its promise, at so many draws.

--slow asks each design for a staircase of at most a fifth of that of the PID alone on the model.

Seeds below 700 served to choose the candidates; those from 700 on judge them.
"""

import argparse
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.blind_machines import Machine, random_machine, stream
from benchmarks.experiment import model_of, poor_log
from design.asked import RobustAsked
from design.closed_loop.drawn_plants import in_loop
from design.closed_loop.driven_loop import DrivenLoop, driven_loop, present_loop
from design.closed_loop.loop_figures import PRESENT
from design.controllers.design import design
from design.machine.model import Model
from design.robust.outcomes import DrawnMachines, Outcomes, limits_by_name, outcomes
from design.robust.robust import NOMINAL, ROBUST, Robust, one_motion, robust_design
from identification.errors import UserError
from identification.model.plant import Actuator, Plant

PID = "PID alone"
FIFTH = 0.2


@dataclass(frozen=True, eq=False)
class Judged:
    """One machine: the promises by measure, and what each loop came to on the true machine."""

    seed: int
    kind: str
    passed: bool
    compensator: str
    processor: float
    scale: float
    promised: Mapping[str, float]
    true: Mapping[str, Outcomes]


def judged(seed: int, draws: int, seconds: float, slow: bool) -> Judged:
    """A machine's log, model, design, and the loops on the machine itself."""
    one = random_machine(seed)
    model = model_of(one, poor_log(one, seed, seconds=seconds), seed)
    staircase = FIFTH * staircase_of_pid(model, seed) if slow else None
    began = time.process_time()
    found = robust_design(model, RobustAsked(draws=draws, staircase=staircase, seed=seed))
    spent = time.process_time() - began
    promised = {
        name: measure.share
        for name, measure in found.promises[ROBUST].measures.items()
        if measure.share is not None
    }
    own = found.design.compensator
    word = "none" if not found.promises[ROBUST].compensator else "excess" if own.excess else "whole"
    true = dict(on_truth(one, model, found, seed))
    h = found.design.force.h if found.design.force else found.design.plant.h
    scale = least_stair(one, h)
    return Judged(seed, one.kind, found.passed, word, spent, scale, promised, true)


def least_stair(one: Machine, h: float) -> float:
    """About the staircase [m] that no controller of period h [s] avoids: see the module."""
    p = one.friction
    step = h * min(p.dv_p, -p.dv_n)
    if not isinstance(one.drive, Actuator) or one.kind == "force":
        return step
    return max(step, (p.F_sp - p.F_cp) / one.drive.k2, (-p.F_sn - p.F_cn) / one.drive.k2)


def staircase_of_pid(model: Model, seed: int) -> float:
    """That of the nominal PID alone [m] on the model's machine, infinite where there is none."""
    nominal = design(model, source="physical")
    if nominal.pid is None:
        return np.inf
    loop = driven_loop(model, nominal, nominal.pid, None)
    motion, _ = one_motion(model, nominal, loop.h)
    own = DrawnMachines(model, (in_loop(model),))
    found = outcomes(own, loop, motion, [stream(seed, "robust model")])
    return float(found.values["staircase"][0])


def on_truth(
    one: Machine, model: Model, found: Robust, seed: int
) -> Iterator[tuple[str, Outcomes]]:
    """Each loop on the true machine."""
    drive = None if one.kind == "force" else one.drive
    truth = DrawnMachines(model, (Plant(one.friction, drive),))
    nominal = design(model, source="physical")
    for name, loop in loops(model, found):
        motion, _ = one_motion(model, nominal, loop.h)
        yield name, outcomes(truth, loop, motion, [stream(seed, "robust truth")])


def loops(model: Model, found: Robust) -> Iterator[tuple[str, DrivenLoop]]:
    """The loops that are compared; the nominal ones from the design that knows of no spread."""
    nominal = design(model, source="physical")
    chosen, kept = found.promises[ROBUST], found.design
    value = kept.compensator.value if chosen.compensator else None
    yield ROBUST, driven_loop(model, kept, kept.controllers[chosen.controller], value)
    if nominal.recommendation is not None and nominal.recommended != "none":
        own = nominal.recommendation
        value = nominal.compensator.value if own.compensator else None
        yield NOMINAL, driven_loop(model, nominal, nominal.controllers[own.controller], value)
    if nominal.pid is not None:
        yield PID, driven_loop(model, nominal, nominal.pid, None)
    if model.controller is not None:
        yield PRESENT, present_loop(model, model.controller)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--first", type=int, default=700)
    arguments.add_argument("--machines", type=int, default=40)
    arguments.add_argument("--draws", type=int, default=60)
    arguments.add_argument("--seconds", type=float, default=6.0, help="of the poor log")
    arguments.add_argument("--slow", action="store_true")
    given = arguments.parse_args()
    done: list[Judged] = []
    refused = 0
    for seed in range(given.first, given.first + given.machines):
        try:
            one = judged(seed, given.draws, given.seconds, given.slow)
        except UserError as error:
            refused += 1
            print(f"{seed}: refused, {error}", flush=True)
            continue
        done.append(one)
        stairs = {name: 1e6 * found.values["staircase"][0] for name, found in one.true.items()}
        print(
            f"{seed} {one.kind:18} {'passed' if one.passed else 'missed'} {one.compensator:7}"
            f" {one.processor:5.1f} s  staircases [um] "
            + ", ".join(f"{name} {value:.0f}" for name, value in stairs.items())
            + f", scale {1e6 * one.scale:.0f}",
            flush=True,
        )
    summary(done, refused)


def summary(done: list[Judged], refused: int) -> None:
    """Promised and kept by limit, staircases, limit cycles."""
    limits = limits_by_name(RobustAsked().limits)
    print(f"\n{len(done)} machines, {refused} refused, {sum(one.passed for one in done)} passed")
    for words, chosen in (("all", done), ("passed", [one for one in done if one.passed])):
        print(f"{words}: limit, promised, kept by robust / nominal / PID alone / present")
        for name in limits:
            promising = [one for one in chosen if name in one.promised]
            if not promising:
                continue
            promised = np.mean([one.promised[name] for one in promising])
            kept = [share(promising, loop, name) for loop in (ROBUST, NOMINAL, PID, PRESENT)]
            print(f"  {name:12} {100 * promised:6.1f} %  " + " / ".join(kept))
    for kind in sorted({one.kind for one in done}):
        own = [one for one in done if one.kind == kind and PID in one.true]
        times = [
            one.true[PID].values["staircase"][0] / one.true[ROBUST].values["staircase"][0]
            for one in own
        ]
        five = np.mean(np.array(times) >= 5.0)
        print(
            f"{kind}: staircase of the PID alone over robust: median {np.median(times):.1f} times,"
            f" at least 5 on {100 * five:.0f} % of {len(own)}"
        )
    print(f"processor: median {np.median([one.processor for one in done]):.0f} s")


def share(promising: list[Judged], loop: str, name: str) -> str:
    """Share of the true machines on which the loop keeps the limit, in words."""
    limits = limits_by_name(RobustAsked().limits)
    kept = [
        bool(one.true[loop].within({name: limits[name]})[name][0])
        for one in promising
        if loop in one.true and name in one.true[loop].values
    ]
    return f"{100 * np.mean(kept):.0f} %" if kept else "-"


if __name__ == "__main__":
    main()
