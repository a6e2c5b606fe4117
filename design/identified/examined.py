"""What a log shows before any fit: clock, sensors, bad samples, what moves, what that identifies.

Nothing here has rules of its own: whether a parameter can be identified is asked of the same
thresholds as in `identify`, with the events that the measured motion shows in place of those of a
fitted run.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from design.identified.hardly_identifiable import hardly_identifiable, without_direction
from design.identified.identifiable_by_log import RunsIdentifiability, identifiability_of_runs
from design.machine.model import Identifiable
from design.machine.plausible import read_in
from identification.columns.clock import counts_thousandths
from identification.log import Log, Rig
from identification.model.karnopp import NAMES
from identification.remarks import left_out
from identification.signals.bad_samples import BadSamples
from identification.signals.clean import limits
from identification.signals.delays import Delay, delays_of, exchanged_columns
from identification.signals.sensor_state import Clock, SensorState, sensor_state

DOCTOR_SCHEMA = "doctor/1"
DECIMALS_OF_SECONDS = ", though decimals to the thousandth are mostly those of s"
LIMITED = ("u", "F", "p_p", "p_n")  # signals whose range may end


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


def with_limits(found: CheckedLog) -> CheckedLog:
    """The same with the ends of a sensor's or a command's range in its recorded signals."""
    raw, reported = found.raw, {one.signal for one in found.bad if one.kind == "saturated"}
    named = [name for name in LIMITED if name in raw and name not in reported]
    ends = [one for name in named for one in limits(raw, name)]
    return replace(found, bad=tuple(dict.fromkeys([*found.bad, *ends])))


def examined(found: CheckedLog, units: Sequence[str], *, effects: bool = False) -> Examined:
    """What the log shows; units: lines on units of the card that are those of no machine, or not
    the header's; effects: also which effects it could show."""
    log, runs = found.log, found.runs
    seen = (
        identifiability_of_runs(runs, found.rig, effects=effects)
        if runs and not found.refused
        else RunsIdentifiability(reason=found.refused)
    )
    remarks = list(found.remarks)
    late = max(seen.surroundings.lag.value, 0.0) if found.rig.kind == "motor" else None
    if log is not None and not found.refused:
        remarks += without_direction(runs, found.rig) + hardly_identifiable(runs, found.rig)
    sensors = tuple(sensor_state(name, x) for name, x in found.raw.signals.items() if name != "t")
    delays = delays_of(log, seen.motion, late) if log is not None and seen.motion else ()
    exchanged = "" if log is None else exchanged_columns(delays, sensors, log.h)
    in_s = "t" in found.raw and counts_thousandths(found.raw["t"])
    by_decimals = [one for one in units if in_s and one.startswith(read_in("t", "s"))]
    said = [f"{one}{DECIMALS_OF_SECONDS}" if one in by_decimals else one for one in units]
    remarks = [*([exchanged] if exchanged else []), *said, *remarks]
    reason = "; ".join([seen.reason, *left_out(remarks)]) if seen.reason else ""
    known = {
        **vars(seen),
        **vars(found),
        "refused": found.refused or reason,
        "remarks": tuple(dict.fromkeys([*remarks, *seen.remarks])),
    }
    return Examined(
        **known,
        sensors=sensors,
        delays=delays,
        exchanged=bool(exchanged),
        other_units=len(units) > len(by_decimals),
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
