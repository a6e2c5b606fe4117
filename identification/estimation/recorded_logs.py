"""Logs as the estimator takes them: with their motion, and with what drives a run of them."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identification.arrays import Array
from identification.errors import BadLog, NotIdentifiable
from identification.estimation.regression.equation_rows import (
    ACTUATOR,
    MECHANICAL,
    MotionLog,
    actuator,
    integral,
)
from identification.estimation.regression.force_terms import unseen_lag
from identification.estimation.regression.inertia import inertia_has_no_part
from identification.estimation.regression.intersample_command import (
    UNSEEN,
    between_samples,
    could_show,
    is_faster_loop,
    period_of,
    rate_column,
    share_between,
    unseen,
)
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.regression.motion_rows import converged_rows
from identification.estimation.regression.row_fit import first_stage
from identification.estimation.regression.weighted_rows import Fitted, solve_rows, stacked
from identification.log import Log, Rig
from identification.model.estimates import Drive
from identification.model.plant import units_of
from identification.model.size import NOT_SHOWN, Size
from identification.progress import Halt
from identification.remarks import MinorRemark
from identification.signals.check import are_steps, check_driven
from identification.signals.thin import at_needed_rate
from identification.thresholds import WORSE


@dataclass(frozen=True, eq=False)
class RecordedLogs:
    """Logs of one machine with their motion.

    drive: what drives their runs; prescribed: the motion is prescribed by a rig; halt: whether
    whatever is made of them is to go on; share: of the step of the command to the next sample, by
    which its mean between them is another than the logged one: it is in these logs, and `given`
    puts it into others; share_sd: its deviation; exact: a motor's force has no noise. remarks: what
    became of logs whose clock is faster than their motion.
    """

    logs: tuple[MotionLog, ...]
    rig: Rig
    drive: Drive
    prescribed: bool = False
    halt: Halt = field(default_factory=Halt)
    share: float = 0.0
    share_sd: float = 0.0
    exact: bool = False
    remarks: tuple[str, ...] = ()

    @property
    def by_motor(self) -> bool:
        """Whether a motor drives them, whose force is that of its command."""
        return self.rig.kind == "motor"

    @property
    def zoh(self) -> bool:
        """Whether the force is a zero-order hold: a motor's, or one that the logs show to be so."""
        return self.by_motor or any(one.zoh for one in self.logs)

    @property
    def may_change_between(self) -> bool:
        """Whether a motor drives them whose force changes between their samples, or may do so for
        all that they show; an exact zero-order hold does not."""
        seen = self.exact or could_show(Size(self.share, self.share_sd))
        return self.by_motor and (is_faster_loop(self.share) or not seen)

    @property
    def by_command(self) -> bool:
        """Whether an actuator's equation is fitted beside the mechanical one."""
        return self.drive == "command" and not self.by_motor

    @property
    def steps(self) -> bool:
        """Whether the force is constant in every log, and differs from one to the next at most."""
        return are_steps(self.plain)

    @property
    def command_period(self) -> float | None:
        """Time [s] after which the loop gives its next command, or for which a measured force is
        held; None where it is the samples', and of a force that is no such hold."""
        h = self.logs[0].log.h
        return period_of(self.share, h) or (h if self.zoh and not self.by_motor else None)

    @property
    def instant_sd(self) -> float:
        """Deviation [s] of the instants at which the force of these logs acts: of a zero-order hold
        by the share above, of another as likely anywhere within half a sample of its row."""
        h = self.logs[0].log.h
        return self.share_sd * h if self.zoh else unseen_lag(h)

    @property
    def moved(self) -> tuple[int, int]:
        """Samples in which the body surely moves, in positive and negative direction."""
        d = np.concatenate([one.signals["d"] for one in self.logs])
        return int(np.count_nonzero(d > 0)), int(np.count_nonzero(d < 0))

    @property
    def name(self) -> str:
        """The log's name, or how many there are."""
        return self.logs[0].log.name if len(self.logs) == 1 else f"{len(self.logs)} logs"

    @property
    def noise(self) -> tuple[float, float]:
        """Noise of the position [m] and of the force [N], medians over the logs."""
        y, F = zip(*((one.noise.y, one.noise.F) for one in self.logs), strict=True)
        return float(np.median(y)), float(np.median(F))

    @property
    def plain(self) -> tuple[Log, ...]:
        """The logs without their motion."""
        return tuple(one.log for one in self.logs)

    def record(self, log: Log) -> MotionLog:
        """Another log of the machine with its motion."""
        one = motion_log(
            log, zoh=self.by_motor, by_command=self.by_command,
            rotary=self.rig.motion == "rotary", prescribed=self.prescribed,
            between=None if self.exact else self._unseen(log),
        )  # fmt: skip
        return replace(one, halt=self.halt)

    def _unseen(self, log: Log) -> float:
        """Noise of a zero-order-hold force [N] that the loop adds between the samples of a log."""
        return unseen(log, self.share) if self.by_motor or log.zoh else 0.0

    def given(self, log: Log) -> MotionLog:
        """A log as it was read, with its motion."""
        (slower,) = needed([log], self.rig)
        return self.record(between_samples(slower, self.share, self.zoh))

    def with_exact_force(self) -> "RecordedLogs":
        """The logs of a motor with a force that has no noise."""
        return replace(self, exact=True).of(self.plain)

    def of(self, logs: Sequence[Log]) -> "RecordedLogs":
        """These logs recorded in the same way."""
        return replace(self, logs=tuple(self.record(log) for log in logs))


def needed(logs: Sequence[Log], rig: Rig) -> list[Log]:
    """The logs at the rates that their motion needs; those with a command or a zero-order hold as
    they are: what it does between its samples is in no mean, and makes other stops
    (`benchmarks/drives.py`, 4 kHz)."""
    if rig.kind == "motor" or commanded(logs) or any(log.zoh for log in logs):
        return list(logs)
    return [at_needed_rate(log) for log in logs]


def with_clocks(recorded: RecordedLogs, said: Sequence[str]) -> RecordedLogs:
    """Logs, recorded as they were read, with what is known and said of their clocks; said: of their
    rates."""
    recorded = replace(recorded, remarks=(*said, *clock_remarks(recorded.logs)))
    return with_share(recorded, plain_share(recorded))


def clock_remarks(logs: Sequence[MotionLog]) -> tuple[str, ...]:
    """A line on each log whose clock jitters, or seems to, so that it shows."""
    return tuple(
        MinorRemark(
            f"{one.log.name}: in motion the position errs by {1e6 * one.noise.jitter:.2g} us times"
            " its speed, as by a clock that jitters"
        )
        for one in logs
        if one.noise.jitter > 0.0
    )


def slower_remarks(logs: Sequence[Log], slower: Sequence[Log]) -> tuple[str, ...]:
    """A line on each log that was brought to a slower clock."""
    return tuple(
        MinorRemark(
            f"{log.name}: of its samples every {log.h:.4g} s a mean was taken every"
            f" {less.h:.4g} s: nothing but noise lies between"
        )
        for log, less in zip(logs, slower, strict=True)
        if less is not log
    )


def with_share(recorded: RecordedLogs, found: Size) -> RecordedLogs:
    """Logs, recorded as they were read, with the command between their samples."""
    recorded, share = replace(recorded, share_sd=found.sd), found.value
    if share == 0.0:
        return recorded
    means = [between_samples(one.log, share, recorded.zoh) for one in recorded.logs]
    said = (
        f"the command changes between the samples of {recorded.name}, as of a loop that is faster:"
        f" taken as its mean until the next sample ({share:.2g} of the step to it)"
        if is_faster_loop(share)
        else f"the positions of {recorded.name} lie {share:.2g} of a sample behind the steps of its"
        " command: taken into account"
    )
    return replace(recorded, share=share, remarks=(*recorded.remarks, MinorRemark(said))).of(means)


def plain_share(recorded: RecordedLogs) -> Size:
    """Share of the command's step to the next sample, as a machine without effects shows it; of a
    motor by windows of sliding one way, or by those that may hold reversals, whose width the logs
    choose, whichever show it better. Ours: `regression/README.md`, (13)."""
    logs, motor = recorded.logs, recorded.zoh
    if not (motor or recorded.by_command):
        return NOT_SHOWN
    # Near standstill a fine encoder shows what the equation of sliding does not hold.
    stage = first_stage(logs, recorded.by_command, (MECHANICAL, ACTUATOR))[1]
    shown, found = stage.get(MECHANICAL if motor else ACTUATOR), UNSEEN
    if shown:
        rates = [rate_column(one) for one in logs]
        found = share_between(shown.rows, np.concatenate(rates), motor, shown.slowest)
    if motor:
        made = converged_rows(logs)
        rates = [rate_column(one, of.windows) for one, of in zip(logs, made, strict=True)]
        other = share_between(stacked([of.rows for of in made]), np.concatenate(rates), motor)
        found = min(found, other, key=lambda one: one.sd)
    return found


def recorded_logs(
    logs: Sequence[Log], rig: Rig, drive: Drive | None = None, halt: Halt | None = None
) -> RecordedLogs:
    """The logs with their motion; drive: by default the command where an actuator follows it; halt:
    whether what is made of them is to go on. A command is its mean until the next sample, where
    they show it. Raises BadLog where a signal is missing, or the asked drive is not to be had,
    NotIdentifiable where nothing moves."""
    check_driven(logs)
    slower = needed(logs, rig)
    chosen = chosen_drive(slower, rig, drive)
    found = RecordedLogs((), rig, chosen, halt=halt or Halt()).of(slower)
    for one in found.logs:
        if not np.any(one.signals["d"]):
            speed = units_of(rig.motion)["dv_p"]
            raise NotIdentifiable(
                f"{one.log.name}: no motion above the noise of the velocity"
                f" ({one.noise.v:.3g} {speed}); record a run that moves"
            )
    return with_clocks(found, slower_remarks(logs, slower))


def chosen_drive(logs: Sequence[Log], rig: Rig, drive: Drive | None) -> Drive:
    """The drive asked for, or by default the command where one is logged and explains the force."""
    name = logs[0].name
    if rig.kind == "motor":
        if not rig.force_per_command:
            raise BadLog(
                f"{name}: a motor needs its force_per_command, not 0; set it in the card"
                " (1 where it is not known: a force is then in units of the command)"
            )
        if drive == "force":
            raise BadLog(f"{name}: a motor is driven by its command, not by a force")
        return "command"
    logged = commanded(logs)
    if drive == "command" and not logged:
        raise BadLog(f"{name}: drive by command asked for, but no command u is logged")
    if drive is not None:
        return drive
    return "command" if logged and explains_force(logs) else "force"


def acts_directly(logs: Sequence[Log], rig: Rig, drive: Drive | None = None) -> bool:
    """Whether the force acts on the body without an actuator between: a motor's, or a measured one
    that drives its runs."""
    return rig.kind == "motor" or chosen_drive(logs, rig, drive) == "force"


def commanded(logs: Sequence[Log]) -> bool:
    """Whether every log has a command that is not constant."""
    return all("u" in log and np.ptp(log["u"]) > 0 for log in logs)


def explains_force(logs: Sequence[Log], dead_zones: Sequence[float] = ()) -> bool:
    """Whether a linear actuator with the logged command leaves less than all of the force's rate.

    dead_zones: quantiles of the command's size, behind a dead zone of one of which it may do so.
    Source: the paper's dF/dt = k1 u - k2 v, in weak form (Messenger, Bortz 2021).
    """
    seen = [motion_log(log, zoh=False, by_command=True) for log in logs]
    sizes = np.quantile(np.concatenate([np.abs(log["u"]) for log in logs]), dead_zones)
    return any(_left_by_actuator(seen, size) * WORSE <= 1.0 for size in (0.0, *sizes.tolist()))


def _left_by_actuator(logs: Sequence[MotionLog], dead_zone: float) -> float:
    """Share of the force's rate that a linear actuator behind a dead zone [V] leaves."""
    parts = []
    for one in logs:
        u = np.asarray(one.log["u"])
        beyond = np.sign(u) * np.maximum(np.abs(u) - dead_zone, 0.0)
        parts.append(actuator(one, np.array([1.0, 0.0, 0.0]), u=integral(beyond, one.log.h)))
    rows = stacked(parts)
    return left_share(solve_rows(rows), rows.sd, rows.b)


def left_share(found: Fitted, sd: Array, rate: Array) -> float:
    """Share of the force's rate (r,) that a fit leaves, at least 1 where nothing follows u."""
    left = float(np.std(found.residual * sd) / max(float(np.std(rate)), 1e-300))
    return left if found.theta[0] > 0 else max(left, 1.0)


def is_prescribed(recorded: RecordedLogs) -> bool:
    """Whether the motion is prescribed by a rig, so that no run of its own is to be followed."""
    if recorded.by_motor or commanded(recorded.plain):
        return False
    return inertia_has_no_part(recorded.logs)
