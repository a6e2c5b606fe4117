"""What the motion in a log will hardly let any fit tell, said before one is made.

Quick, and of the motion and the work alone: `init` says it with the first card, doctor with the
rest of what it sees.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.errors import BadLog
from identification.estimation.fit import ONE_WAY_WHY
from identification.estimation.imposed_motion import is_one_way
from identification.log import Log, Rig
from identification.signals.check import work_share
from identification.signals.differentiate import Motion, differentiate, low_pass
from identification.signals.relations import FEWEST_MOVING, moving

SLOWEST_RATE = 50.0  # Hz, below which starts and stops lie between two samples
NO_WORK = 0.03  # of the work that a force exchanges with a body, that it does on the whole at least
SLOWED = 0.7  # of its speed at first, that a body which coasts keeps at most
ALWAYS_SLOWER = -0.9  # correlation of its speed with time
IDLE = 0.3  # correlation of a drive with velocity and acceleration, of one that does nothing
ENDS = 0.1  # of the motion, over which its first and last speed are taken


@dataclass(frozen=True, eq=False)
class _Moved:
    """A run: its motion, the samples in which it surely moves, and what is logged of its drive."""

    h: float
    motion: Motion
    sure: Array
    y: Array
    drive: Array | None
    name: str


def hardly_tells(runs: Sequence[Log], rig: Rig) -> tuple[str, ...]:
    """A line for each thing that the runs will hardly tell; nothing where there is no run."""
    if not runs:
        return ()
    log = max(runs, key=len)
    return tuple([*_of_rate(log), *_of_motion(log, rig)])


def _of_rate(log: Log) -> Iterator[str]:
    rate = 1.0 / log.h
    if rate < 0.999 * SLOWEST_RATE:
        yield (
            f"sampled at {rate:.3g} Hz, slower than {SLOWEST_RATE:g} Hz: starts and stops lie"
            " between two samples, so bands and breakaway forces will hardly be told; log faster"
        )


def _of_motion(log: Log, rig: Rig) -> Iterator[str]:
    try:
        found = _moved(log, rig)
    except BadLog:
        return
    count = int(np.sum(found.sure))
    if count < FEWEST_MOVING:
        yield (
            f"hardly anything moves: {count} of {len(log)} samples are surely in motion, which"
            " tells no friction; log a run with strokes in both directions"
        )
        return
    v = found.motion.v[found.sure]
    up = float(np.mean(v > 0.0))
    if is_one_way(up):
        side = "+" if up > 0.5 else "-"
        yield f"{ONE_WAY_WHY} ({max(up, 1.0 - up):.0%} of it goes towards {side}); log both ways"
    if found.drive is None:
        return
    if _coasts(found):
        yield (
            f"the body coasts: it only slows down, and the {found.name} has no part in it; so what"
            " is told is friction over inertia, neither alone; log a run that is driven"
        )
        return
    work = None if is_one_way(up) else work_share(found.y, found.drive)
    if work is not None and work < NO_WORK:
        yield (
            f"the {found.name} does hardly any work on the body ({work:.0%} of what the two"
            " exchange), so something else moves it, by hand or a load: then no friction is"
            " told; log a run in which the machine moves itself"
        )


def _moved(log: Log, rig: Rig) -> _Moved:
    motion = differentiate(log["y"], log.h)
    name = "u" if rig.kind in ("motor", "velocity") and "u" in log else "F"
    drive = log.signals.get(name)
    words = {"u": "command", "F": "force"}[name]
    return _Moved(log.h, motion, moving(motion), log["y"], drive, words)


def _coasts(found: _Moved) -> bool:
    """Whether the body slows down all the time, and its drive goes with neither speed nor its
    change."""
    at = np.flatnonzero(found.sure)
    v, a = found.motion.v[at], found.motion.a[at]
    speed = np.abs(v)
    few = max(2, int(ENDS * len(at)))
    if speed[-few:].mean() > SLOWED * speed[:few].mean():
        return False
    if float(np.corrcoef(at, speed)[0, 1]) > ALWAYS_SLOWER:
        return False
    assert found.drive is not None
    smooth = low_pass(found.drive, found.h, found.motion.cutoff)[at]
    if np.ptp(smooth) == 0.0:
        return True
    return all(abs(float(np.corrcoef(smooth, x)[0, 1])) < IDLE for x in (v, a))
