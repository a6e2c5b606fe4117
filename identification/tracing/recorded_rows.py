"""Rows: the logs with their motion, and which equations and effects they can show at all."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.effects._library import Library
from identification.errors import NotIdentifiable
from identification.estimation.recorded_logs import (
    RecordedLogs,
    chosen_drive,
    commanded,
    explains_force,
    needed,
    slower_remarks,
    with_clocks,
)
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.inertia import speed_ratio
from identification.log import Log, Rig
from identification.model.estimates import Drive
from identification.progress import Halt
from identification.thresholds import FOURFOLD
from identification.tracing.remaining_structure import FEWEST_ROWS

SLIDES, MANY_ROWS = 0.03, 100  # of the log in sliding, and stretches of it, of which one is needed
DEAD_ZONES = (0.2, 0.4, 0.6, 0.8)  # quantiles of the command's size
BRAKES = 0.005  # of the sliding, in which the force has to oppose it for its share to show
OF_SPEED = frozenset({"v", "reversal"})
COMMAND_SAYS_LITTLE = (
    "the command explains little of the force, so effects between command and force were not tried"
)


@dataclass(frozen=True, eq=False)
class RecordedRows:
    """The training logs as the estimator takes them, and what is to be said of them.

    refused: why they identify nothing unless a rig prescribes their motion, None where they do.
    """

    recorded: RecordedLogs
    refused: NotIdentifiable | None
    remarks: tuple[str, ...]

    @property
    def logs(self) -> tuple[MotionLog, ...]:
        """The logs with their motion."""
        return self.recorded.logs

    @property
    def drive(self) -> Drive:
        """What drives their runs."""
        return self.recorded.drive


def recorded_rows(train: Sequence[Log], rig: Rig, halt: Halt | None = None) -> RecordedRows:
    """The training logs as rows; raises NotIdentifiable where too little of the motion slides.

    halt: asked before whatever is made of them.
    """
    slower = needed(train, rig)
    drive: Drive = "command" if rig.kind == "motor" else chosen_drive(slower, rig, None)
    if drive == "force" and commanded(slower) and explains_force(slower, DEAD_ZONES):
        drive = "command"
    recorded = RecordedLogs((), rig, drive, halt=halt or Halt()).of(slower)
    recorded, refused = _prescribed_if_needed(recorded)
    recorded = with_clocks(recorded, slower_remarks(train, slower))
    remark = (COMMAND_SAYS_LITTLE,) if drive == "force" and commanded(slower) else ()
    return RecordedRows(recorded, refused, (*recorded.remarks, *remark))


def prescribed_rows(rows: RecordedRows) -> RecordedRows:
    """The same logs as a rig's that prescribes the motion; raises NotIdentifiable as above."""
    recorded = _prescribed(rows.recorded)
    _enough(recorded.logs)
    return RecordedRows(recorded, None, rows.remarks)


def _prescribed(recorded: RecordedLogs) -> RecordedLogs:
    return replace(recorded, prescribed=True).of(recorded.plain)


def _prescribed_if_needed(recorded: RecordedLogs) -> tuple[RecordedLogs, NotIdentifiable | None]:
    """The logs; prescribed where only a rig's slow motion may hold enough, and then the error that
    they are otherwise."""
    try:
        _enough(recorded.logs)
    except NotIdentifiable as error:
        if recorded.drive != "force":
            raise
        moved = _prescribed(recorded)
        try:
            _enough(moved.logs)
        except NotIdentifiable:
            raise error from None
        return moved, error
    return recorded, None


def without_speed_effects(
    library: Library, logs: Sequence[MotionLog]
) -> tuple[Library, tuple[str, ...]]:
    """The library without effects of speed alone, where a rig moved at much the same speed; and
    what to say of it.

    There they would be confounded with whatever makes one stroke differ from another.
    """
    ratio = max(
        speed_ratio(np.concatenate([one.speed[one.up == way] for one in logs]))
        for way in (True, False)
    )
    of_speed = [
        k for k, e in library.items() if "v" in e.depends_on and set(e.depends_on) <= OF_SPEED
    ]
    if ratio >= FOURFOLD or not of_speed:
        return library, ()
    said = (
        f"the speeds of each direction are too similar (a factor of {ratio:.2g} at most,"
        f" {FOURFOLD:g} needed) to identify friction that depends on speed alone:"
        f" {', '.join(of_speed)} not tried; add runs at other speeds"
    )
    return {key: effect for key, effect in library.items() if key not in of_speed}, (said,)


def driven_only(logs: Sequence[MotionLog]) -> bool:
    """Whether the force points along the motion in all sliding but a trace of it."""
    against = [
        (one.sliding.mean @ one.log["F"]) * np.where(one.up, 1.0, -1.0) < 0.0 for one in logs
    ]
    return bool(np.mean(np.concatenate(against)) < BRAKES)


def without_load_dependent(library: Library, logs: Sequence[MotionLog]) -> Library:
    """The library without friction in proportion to the force, where a rig moved the body and the
    force never opposes the motion: there the force is friction, and this a scale of all of it."""
    if not driven_only(logs):
        return library
    return {key: effect for key, effect in library.items() if not effect.load_dependent}


def _enough(logs: Sequence[MotionLog]) -> None:
    rows = sum(len(one.sliding.start) for one in logs)
    if rows < FEWEST_ROWS:
        raise NotIdentifiable(
            f"{logs[0].log.name}: {rows} stretches of sliding in one direction long enough to"
            f" test ({FEWEST_ROWS} needed); log longer or faster motion"
        )
    up = np.concatenate([one.up for one in logs])
    if np.all(up) or not np.any(up):
        way = "negative" if up[0] else "positive"
        raise NotIdentifiable(
            f"{logs[0].log.name}: no stretch of sliding in {way} direction is long enough to test;"
            " log motion in both directions (identify takes one direction alone)"
        )
    share = float(np.mean(np.concatenate([one.signals["d"] != 0 for one in logs])))
    if share < SLIDES and rows < MANY_ROWS:
        raise NotIdentifiable(
            f"{logs[0].log.name}: the body slides for {100 * share:.1f} % of the log, in {rows}"
            f" stretches ({100 * SLIDES:.0f} %, or {MANY_ROWS} stretches, needed to separate its"
            " mass from its friction); drive it harder, or log longer motion"
        )
