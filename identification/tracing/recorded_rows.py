"""Rows: the logs with their motion, and which equations and effects they can show at all."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.effects._library import Library
from identification.errors import NotIdentifiable
from identification.estimation.recorded_logs import (
    RecordedLogs,
    commanded,
    left_by_actuator,
    left_share,
    needed,
    slower_remarks,
    with_clocks,
)
from identification.estimation.regression.equation_rows import ACTUATOR, MotionLog
from identification.estimation.regression.inertia import speed_ratio
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.regression.row_fit import first_stage
from identification.log import Log, Rig
from identification.model.estimates import Drive
from identification.progress import Halt
from identification.thresholds import FOURFOLD, WORSE
from identification.tracing.regression.candidates import best_of
from identification.tracing.remaining_structure import FEWEST_ROWS

SLIDES, MANY_ROWS = 0.03, 100  # of the log in sliding, and stretches of it, of which one is needed
OF_SPEED = frozenset({"v", "reversal"})


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


def recorded_rows(
    train: Sequence[Log], rig: Rig, library: Library, halt: Halt | None = None,
    share: float | None = None,
) -> RecordedRows:  # fmt: skip
    """The training logs as rows; raises NotIdentifiable where too little of the motion slides.

    halt: asked before whatever is made of them; share: of the command's step to the next sample, by
    default what a machine without effects shows of it.
    """
    remarks: list[str] = []
    slower = needed(train, rig)
    said = slower_remarks(train, slower)
    train = slower
    driven = rig.kind == "motor" or _by_command(train, rig, library, remarks)
    drive: Drive = "command" if driven else "force"
    recorded = RecordedLogs((), rig, drive, halt=halt or Halt()).of(train)
    recorded, refused = _prescribed_if_needed(recorded)
    recorded = with_clocks(recorded, said, share)
    return RecordedRows(recorded, refused, (*recorded.remarks, *remarks))


def imposed_rows(rows: RecordedRows) -> RecordedRows:
    """The same logs as a rig's that prescribes the motion; raises NotIdentifiable as above."""
    recorded = _imposed(rows.recorded)
    _enough(recorded.logs)
    return RecordedRows(recorded, None, rows.remarks)


def _imposed(recorded: RecordedLogs) -> RecordedLogs:
    return replace(recorded, imposed=True).of(recorded.plain)


def _by_command(train: Sequence[Log], rig: Rig, library: Library, remarks: list[str]) -> bool:
    """Whether an actuator with a logged command is to be tested too: a linear one, or one that
    some effect of the library makes linear."""
    if rig.kind == "motor" or not commanded(train):
        return False
    left = left_by_actuator(train)
    if left * WORSE > 1.0:
        logs = [motion_log(log, held=False, by_command=True) for log in train]
        stage, first = first_stage(logs, True)
        own = [e for e in library.values() if e.place.in_actuator]
        tried = [best_of(stage, effect, first) for effect in own if ACTUATOR in first]
        rows = first[ACTUATOR].rows if ACTUATOR in first else None
        fits = [c.outcomes[ACTUATOR].fit for c in tried if c is not None]
        left = min([left, *(left_share(one, rows.sd, rows.b) for one in fits if rows is not None)])
    if left * WORSE > 1.0:
        remarks.append(
            f"the command explains little of the force (a linear actuator leaves {100 * left:.0f}"
            " % of"
            " its rate), so effects between command and force were not tried"
        )
        return False
    return True


def _prescribed_if_needed(recorded: RecordedLogs) -> tuple[RecordedLogs, NotIdentifiable | None]:
    """The logs; prescribed where only a rig's slow motion may hold enough, and then the error that
    they are otherwise."""
    try:
        _enough(recorded.logs)
    except NotIdentifiable as error:
        if recorded.drive != "force":
            raise
        moved = _imposed(recorded)
        try:
            _enough(moved.logs)
        except NotIdentifiable:
            raise error from None
        return moved, error
    return recorded, None


def told_by_speed(library: Library, logs: Sequence[MotionLog]) -> tuple[Library, tuple[str, ...]]:
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
