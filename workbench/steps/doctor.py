"""A log checked before any fit: clock, sensors, bad samples, what moves, and what that identifies.

Nothing here has rules of its own: a log is repaired, refused and resampled as for `identify`, and
whether a parameter can be identified is asked of the same thresholds, with the events that the
measured motion shows in place of those of a fitted run.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from design.machine.model import Identifiable
from identification.arrays import Array
from identification.errors import BadLog
from identification.log import Log, Rig
from identification.model.karnopp import NAMES
from identification.signals.bad_samples import BadSamples
from identification.signals.check import check_time
from identification.signals.clean import limits
from identification.signals.differentiate import Motion, low_pass, resolution
from identification.signals.even_clock import LONGEST_GAP, even_clock, rows_lost
from identification.signals.noise import local_noise
from identification.signals.offsets import ROUNDED_OFF
from identification.signals.relations import command_lag, lead
from workbench.cards.card import Card
from workbench.cards.headers import contradicted_units
from workbench.cards.units import conversion
from workbench.documents.log_remarks import log_remarks
from workbench.logs.runs import longest_run, runs_of, table_of, with_force
from workbench.steps.first_card.remarks import are_exchanged
from workbench.steps.hardly_identifiable import hardly_identifiable
from workbench.steps.identifiable_by_log import RunsIdentifiability, identifiability_of_runs

DOCTOR_SCHEMA = "doctor/1"
LIMITED = ("u", "F", "p_p", "p_n")  # signals whose range may end
LONGEST_LAG = 0.1  # s that a command may act late
HALF_A_HOLD, LEAST_LAG = 0.5, 0.5  # samples: of a zero-order hold, and that are reported
SURE_LAG = 0.01  # share of the equation that a lag explains beyond none, to be reported


@dataclass(frozen=True)
class Clock:
    """Rows, duration and period [s], jitter (of a period, rms, gaps apart), gaps and the longest
    [s]; lost: rows that an even clock has lost."""

    rows: int
    duration: float
    h: float
    jitter: float
    gaps: int
    longest_gap: float
    lost: int


@dataclass(frozen=True)
class SensorState:
    """A signal in SI: range, white noise (one sigma) and step, 0 where it has none."""

    name: str
    low: float
    high: float
    noise: float
    step: float


@dataclass(frozen=True)
class Delay:
    """By how much one signal acts late on another [s], None where none shows; alike: of a
    reference, the correlation that it then has with the position."""

    of: str
    on: str
    seconds: float | None
    alike: float | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class CheckedLog:
    """A log as far as it is known without identifiability: the first and quick part of a check.

    raw: signals as recorded; log: the longest run, None where there is none.
    """

    file: str
    rig: Rig
    clock: Clock
    bad: tuple[BadSamples, ...]
    refused: str
    remarks: tuple[str, ...]
    command_unit: str
    raw: Log = field(repr=False)
    runs: tuple[Log, ...] = field(repr=False)

    @property
    def log(self) -> Log | None:
        """The longest run."""
        return max(self.runs, key=len) if self.runs else None


@dataclass(frozen=True, eq=False, kw_only=True)
class Examined(CheckedLog, RunsIdentifiability):
    """What a log shows before any fit, and what it identifies.

    refused: why `identify` would not take the log, empty where it would. exchanged: whether
    position and reference look like each other's columns; other_units: whether a unit of the card
    is that of no machine, or not its header's. motion: None where the log is refused before.
    """

    sensors: tuple[SensorState, ...]
    delays: tuple[Delay, ...]
    exchanged: bool
    other_units: bool

    @property
    def add(self) -> tuple[str, ...]:
        """Runs that would identify the rest."""
        return tuple(dict.fromkeys(one.add for one in self.identifiability if one.add))

    @property
    def main(self) -> tuple[Identifiable, ...]:
        """What is identifiable of the nine, or of all numbers of a rig that has no friction."""
        of_valve = self.rig.kind == "velocity"
        return tuple(one for one in self.identifiability if of_valve or one.name in NAMES)

    @property
    def verdict(self) -> str:
        """ "refused", "ready" (all nine can be identified), "in part", or "nothing" (none can)."""
        if self.refused:
            return "refused"
        can = [one.can for one in self.main]
        return "ready" if all(can) else "in part" if any(can) else "nothing"


def checked_log(path: Path, card: Card) -> CheckedLog:
    """The log in the file, read by its card, repaired and cut into runs.

    A log that `identify` would refuse is looked at as far as it goes. Raises BadLog or BadCard
    where the file cannot be read at all.
    """
    table = table_of(path, card)
    raw, _ = longest_run(table, path, card)
    rig = card.rig(path.name)
    clock, refused = _clock_of(raw["t"]), ""
    bad, remarks = list[BadSamples](), list[str]()
    runs: tuple[Log, ...]
    try:
        made = runs_of(table, path, card)
        bad += made.bad
        runs = made.runs
        remarks += made.remarks
    except BadLog as error:
        refused = str(error)
        runs = _as_far_as_it_goes(raw, path, card)
    reported = {one.signal for one in bad if one.kind == "saturated"}
    bad += [
        one for name in LIMITED if name in raw and name not in reported for one in limits(raw, name)
    ]
    spec = card.signals.get("u")
    units = [unit for unit in ("V", "A") if spec is not None and conversion(spec.unit, unit)]
    return CheckedLog(
        file=path.name,
        rig=rig,
        clock=clock,
        bad=tuple(dict.fromkeys(bad)),
        refused=refused,
        remarks=tuple(remarks),
        command_unit=units[0] if units else "",  # nothing for a share, or where none is logged
        raw=raw,
        runs=runs,
    )


def examine(path: Path, card: Card, *, effects: bool = False) -> Examined:
    """What the log in the file shows, read by its card; effects: also which effects it could show.

    Raises as `looked` does.
    """
    found = checked_log(path, card)
    log, runs = found.log, found.runs
    seen = (
        identifiability_of_runs(runs, found.rig, effects=effects)
        if runs and not found.refused
        else RunsIdentifiability(reason=found.refused)
    )
    units = list(contradicted_units(card.signals, found.rig).values())
    remarks = list(found.remarks)
    late = max(seen.surroundings.lag.value, 0.0) if found.rig.kind == "motor" else None
    if log is not None and not found.refused:
        units += log_remarks(runs, found.rig, card.signals)
        remarks += hardly_identifiable(runs, found.rig)
    sensors = tuple(_sensor(name, x) for name, x in found.raw.signals.items() if name != "t")
    delays = _delays(log, seen.motion, late) if log is not None and seen.motion else ()
    exchanged = "" if log is None else _exchanged(delays, sensors, log.h)
    remarks = [*([exchanged] if exchanged else []), *units, *remarks]
    known = {
        **vars(seen),
        **vars(found),
        "refused": found.refused or seen.reason,
        "remarks": tuple(dict.fromkeys([*remarks, *seen.remarks])),
    }
    return Examined(
        **known,
        sensors=sensors,
        delays=delays,
        exchanged=bool(exchanged),
        other_units=bool(units),
    )


def _as_far_as_it_goes(raw: Log, path: Path, card: Card) -> tuple[Log, ...]:
    """A refused log on an even clock, where that can be had."""
    try:
        check_time(raw)
        return even_clock(with_force(raw, path, card))
    except (BadLog, ValueError):
        return ()


def _clock_of(t: Array) -> Clock:
    step = np.diff(t)
    step = step[np.isfinite(step)]
    h = float(np.median(step)) if len(step) else 0.0
    usual = step[(step > 0.0) & (step < LONGEST_GAP * h)]
    jitter = float(np.std(usual)) / h if h > 0.0 and len(usual) else 0.0
    gaps = step[step > LONGEST_GAP * h] if h > 0.0 else step[:0]
    longest = float(np.max(gaps)) if len(gaps) else 0.0
    return Clock(len(t), float(t[-1] - t[0]), h, jitter, len(gaps), longest, rows_lost(t, h))


def _sensor(name: str, x: Array) -> SensorState:
    good = x[np.isfinite(x)]
    if len(good) < 4:
        return SensorState(name, 0.0, 0.0, 0.0, 0.0)
    low, high, step = float(good.min()), float(good.max()), resolution(good)
    white = float(np.sqrt(max(local_noise(good) ** 2 - step**2 / 12.0, 0.0)))  # but for rounding
    shown = white if white > ROUNDED_OFF * (high - low) else 0.0
    return SensorState(name, low, high, shown, step)


def _delays(log: Log, motion: Motion, late_command: float | None) -> tuple[Delay, ...]:
    """How late the command acts, and how far the position is behind its reference.

    late_command [s]: of a motor, as the equation of motion or its run shows it, 0 where it shows
    none; None of an actuator.
    """
    out = []
    if "u" in log and "F" in log and np.ptp(log["u"]) > 0.0:
        if late_command is None:
            u, F = (low_pass(log[key], log.h, motion.cutoff) for key in ("u", "F"))
            others = np.column_stack([motion.v, np.ones(len(log))])
            longest = max(2, round(LONGEST_LAG / log.h))
            late, gain = command_lag(np.gradient(F, log.h), others, u, longest)
            late -= HALF_A_HOLD  # a zero-order hold acts half of it later on the average
            shown = late * log.h if gain > SURE_LAG and late > LEAST_LAG else None
            out.append(Delay("u", "force", shown))
        else:
            out.append(Delay("u", "motion", late_command or None))
    if "r" in log and np.ptp(log["r"]) > 0.0:
        found = lead(log["r"], log["y"])
        shown = found.samples * log.h if found.likeness > 0.5 else None
        out.append(Delay("r", "y", shown, found.likeness))
    return tuple(out)


def _exchanged(delays: Sequence[Delay], sensors: Sequence[SensorState], h: float) -> str:
    """What is said of a position that comes before its reference, and that has less of a sensor's
    noise than this, or is ahead by more than a sample; else empty."""
    late = next((one.seconds for one in delays if one.of == "r"), None)
    if late is None or late > -LEAST_LAG * h:
        return ""
    noise = {one.name: np.hypot(one.noise, one.step / np.sqrt(12.0)) for one in sensors}
    if not are_exchanged(late / h) and noise["r"] <= noise["y"]:
        return ""
    return (
        f"the position is ahead of its reference by {-1e3 * late:.3g} ms, as no loop makes it: the"
        " columns of r and y look exchanged; exchange them in the card"
    )


def doctor_document(found: Examined, card: str) -> dict[str, Any]:
    """What was seen, as doctor.json holds it; in SI."""
    return {
        "schema": DOCTOR_SCHEMA,
        "card": card,
        "file": found.file,
        "verdict": found.verdict,
        "refused": found.refused or None,
        "clock": asdict(found.clock),
        "signals": {one.name: {k: v for k, v in asdict(one).items() if k != "name"}
                    for one in found.sensors},
        "bad_samples": [one.as_json() for one in found.bad],
        "delays": [asdict(one) for one in found.delays],
        "motion": None if found.ways is None else asdict(found.ways),
        "told": {one.name: {"can": one.can, "why": one.why, "add": one.add or None,
                            "within": one.within, "only_if": one.only_if or None}
                 for one in found.identifiability},
        "effects": found.effects,
        "add": found.add,
        "remarks": found.remarks,
    }  # fmt: skip
