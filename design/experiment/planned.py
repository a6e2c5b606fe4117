"""What an experiment is: the document `experiment/1`, and what is asked of it.

Of effects it is to discriminate those that a trace could not.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from design.asked import Wanted
from design.experiment.limits import MotionLimits, Peaks
from design.experiment.segments import Segment
from design.loop import LoopRun
from design.machine.model import Model
from design.machine.plain import plain
from design.machine.readable import Display
from identification.arrays import Array
from identification.effects._library import Library
from identification.errors import BadModel
from identification.log import Motion
from identification.model.estimates import Estimate

Criterion = Literal["D", "T"]
# Times the speed and the force of the logs, that an experiment goes to where no limit is given.
FASTER_THAN_LOGS, STRONGER_THAN_LOGS = 1.5, 1.2
WRITTEN = (
    "schema", "card", "motion", "criterion", "parameters", "limits", "h", "samples", "controller",
    "segments", "promise", "separation", "safety", "efficiency", "loose", "tried", "seed",
    "remarks", "versions",
)  # fmt: skip
SAID_EQUAL = re.compile(r"explains as much as (\w+) on these logs")  # as a trace says it of a rival


@dataclass(frozen=True)
class Promised:
    """A parameter: half its 95 % interval now (None: no log identifies it) and after the run, its
    unit, and how often of the simulated runs it is identified."""

    name: str
    unit: str
    value: float
    before: float | None
    after: float | None
    identified_share: float


@dataclass(frozen=True)
class Separation:
    """Two plants that the run is to discriminate, and by how many deviations of the noise it
    does."""

    one: str
    other: str
    deviations: float


@dataclass(frozen=True)
class Safety:
    """Extremes over so many simulated machines drawn from what is not sure of the model, and how
    many of them exceed a limit; scale: by which the reference was made smaller for it."""

    machines: int
    peaks: Peaks
    exceeding: int
    scale: float


@dataclass(frozen=True, eq=False)
class Experiment:
    """The run to make next.

    h [s]: period of the reference r [m], (n,); criterion: "D" (surest parameters) or "T" (rivals
    discriminated); efficiency: of the best shares of the time, a parameter, that the run's whole
    pieces reach as their sum; chaotic: share of the run that is sensitive to chance; runs: what
    the picture shows, the first of the model, others of machines drawn.
    """

    card: str
    motion: Motion
    command_unit: str
    criterion: Criterion
    parameters: tuple[str, ...]
    limits: MotionLimits
    h: float
    controller: str
    segments: tuple[Segment, ...]
    promise: tuple[Promised, ...]
    separation: tuple[Separation, ...]
    safety: Safety
    efficiency: float | None
    chaotic: float
    tried: tuple[int, int]
    seed: int
    remarks: tuple[str, ...]
    versions: Mapping[str, str]
    r: Array
    runs: tuple[LoopRun, ...]

    @property
    def display(self) -> Display:
        """In which units its numbers are held and shown."""
        return Display(self.motion, self.command_unit)


def limits_of(model: Model, wanted: Wanted) -> MotionLimits:
    """The limits asked for; those not given by the card, or by what the logs have shown.

    Raises BadModel where neither says how fast the machine may go.
    """
    speed = wanted.speed or (FASTER_THAN_LOGS * model.speed if model.speed else None)
    if speed is None:
        raise BadModel("the model's file does not hold the speed of its logs; give --speed")
    return MotionLimits(
        stroke=wanted.stroke or model.rig.stroke or model.travel,
        speed=speed,
        seconds=wanted.seconds,
        force=wanted.force or STRONGER_THAN_LOGS * model.force_peak,
        command=wanted.command or math.inf,
    )


def rivals_of(found: Mapping[str, Any], model: Model, library: Library) -> tuple[str, ...]:
    """Keys of the effects that a trace's document leaves open: its rivals where it calls them
    inseparable, else every effect of the library that the machine's signals allow."""
    if found["verdict"] == "unknown":
        usable = (key for key, one in library.items() if not one.signals)
        return tuple(key for key in usable if key not in model.effects)
    keys = [str(one["key"]) for one in found["effects"]]
    for one in found["rivals"]:
        equal = SAID_EQUAL.match(str(one["why_not"]))
        if equal:
            keys += [equal[1], str(one["key"])]
    return tuple(key for key in dict.fromkeys(keys) if key in library)


def half_width(estimate: Estimate) -> float | None:
    """Half of a parameter's 95 % interval; None where there is none."""
    if estimate.value is None or estimate.low is None or estimate.high is None:
        return None
    return 0.5 * (estimate.high - estimate.low)


def experiment_document(found: Experiment) -> dict[str, Any]:
    """The experiment as experiment.json writes it; infinite limits are null."""
    limits = ("stroke", "speed", "force", "command", "seconds")
    safety = ("machines", "exceeding", "scale", "peaks")
    own = {
        **vars(found),
        "schema": "experiment/1",
        "limits": {name: getattr(found.limits, name) for name in limits},
        "samples": len(found.r),
        "promise": {
            one.name: {k: v for k, v in vars(one).items() if k != "name"} for one in found.promise
        },
        "safety": {name: getattr(found.safety, name) for name in safety},
        "loose": found.chaotic,
        "tried": dict(zip(("segments", "runs"), found.tried, strict=True)),
    }
    return {key: plain(own[key]) for key in WRITTEN}
