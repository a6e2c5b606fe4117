"""What a run of the servo is judged by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from design.closed_loop.loop_motion import LimitCycle, limit_cycle
from design.servo import Servo, ServoRun, simulate_servo
from identification.arrays import Array
from identification.model.karnopp import Karnopp
from studies.paper.settings import NOISE_Y, SetUp

STANDSTILL_SHARE = 0.25  # part of a dwell over which the error at standstill is taken


@dataclass(frozen=True)
class Figures:
    """Means over the seeds, and the squared error's least and most.

    squared_error: sum of (r - y)^2 over the judged samples [m^2]. standstill: largest error at the
    end of a dwell [m], None where the reference never stands. energy: sum of u^2 h [V^2 s].
    chatter: standard deviation of F_comp's change from sample to sample [N] over the judged
    samples. limit_cycle: of the last seed.
    """

    squared_error: float
    least: float
    most: float
    standstill: float | None
    energy: float
    chatter: float
    limit_cycle: LimitCycle | None


@dataclass(frozen=True)
class Case:
    """One servo on one plant: its figures, and the run of the first seed."""

    figures: Figures
    run: ServoRun


def measure(set_up: SetUp, friction: Karnopp, servo: Servo, seeds: Sequence[int]) -> Case:
    """The servo on the set-up's plant with this friction, once for every seed of the noise."""
    plant = set_up.plant(friction)
    start = (float(set_up.reference[0]), 0.0, 0.0)
    runs = [
        simulate_servo(
            plant, servo, set_up.reference, set_up.h, noise=set_up.noise(seed), start=start
        )
        for seed in seeds
    ]
    return Case(figures_of(set_up, runs), runs[0])


def compare(
    set_up: SetUp, friction: Karnopp, servos: Mapping[str, Servo], seeds: Sequence[int]
) -> dict[str, Case]:
    """Every servo, by name, on the same plant and the same noise."""
    return {name: measure(set_up, friction, servo, seeds) for name, servo in servos.items()}


def figures_of(set_up: SetUp, runs: Sequence[ServoRun]) -> Figures:
    """The figures of runs of one servo."""
    first, last = set_up.judged
    errors = [float(np.sum(np.square(run.r - run.y)[first:last])) for run in runs]
    ends = standing(set_up.reference)
    stand = [
        max(float(np.max(np.abs(run.r - run.y)[part])) for part in ends) for run in runs if ends
    ]
    chatter = [float(np.std(np.diff(run.compensation[first:last]))) for run in runs]
    energy = [set_up.h * float(np.sum(np.square(run.u[first:last]))) for run in runs]
    return Figures(
        squared_error=float(np.mean(errors)),
        least=min(errors),
        most=max(errors),
        standstill=float(np.mean(stand)) if stand else None,
        energy=float(np.mean(energy)),
        chatter=float(np.mean(chatter)),
        limit_cycle=limit_cycle(runs[-1], NOISE_Y) if ends else None,
    )


def standing(reference: Array) -> list[slice]:
    """The last part of every dwell of a reference in steps; none where it never stands."""
    edges = [0, *(np.flatnonzero(np.diff(reference)) + 1).tolist(), len(reference)]
    lengths = np.diff(edges)
    if len(edges) > len(reference) // 2:
        return []
    return [
        slice(high - max(1, round(STANDSTILL_SHARE * int(n))), high)
        for high, n in zip(edges[2:], lengths[1:].tolist(), strict=True)
    ]
