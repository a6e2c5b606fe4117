"""The gate before a fit: what the motion in logs can identify of each parameter, by its events and
the estimator's word."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from design.machine.model import Identifiable
from design.machine.surrounding_lines import surrounding_lines
from identification.effects._library import built_in
from identification.errors import BadLog, NotIdentifiable
from identification.estimation.estimates import Events, silent_reason
from identification.estimation.preliminary_fit import PreliminaryFit, preliminary_fit
from identification.estimation.prescribed_motion import WHY_NOT
from identification.estimation.recorded_logs import (
    RecordedLogs,
    commanded,
    is_prescribed,
    recorded_logs,
)
from identification.estimation.regressed_plant import first_plant
from identification.estimation.regression.breakaway import breakaway_limits, with_shown_band
from identification.estimation.regression.equation_rows import FIVE, MotionLog
from identification.estimation.regression.standstill import MEAN, rest_stretches
from identification.experiment.identifiability import identifiability, tellable_effects
from identification.log import Log, Rig
from identification.model.estimates import NORMAL_95, Drive, Estimate, KarnoppFit
from identification.model.karnopp import NAMES, Karnopp
from identification.model.surroundings import NO_SURROUNDINGS, Surroundings
from identification.signals.differentiate import Motion, differentiate
from identification.signals.sampling import samples
from identification.thresholds import EVENTS_NEEDED, HALF
from identification.velocity.fit import fit
from identification.velocity.record import recorded
from identification.velocity.valve_estimates import units, valve_estimates

QUICK_SPEED, SLOW_SPEED = 0.95, 0.05  # quantiles of the speeds of a direction
MEND = {
    "m": "add faster reversals, in which inertia matters",
    "F_c": "add slow strokes both ways",
    "F_v": "add strokes at other speeds, at least four times apart",
    "dv_": "add starts and stops, and log them faster",
    "F_s": "add slow reversals, each after a rest",
    "k": "log the command while it moves the body",
}
NO_RUN_FOLLOWED = "no free run is followed, and the equation of motion does not hold it"
MEND_OF_RUN = "log the body driven by a force, from rest"
OPEN = "the run follows the log, which is near and which the whole fit alone can say"


@dataclass(frozen=True)
class Way:
    """One direction: seconds of sure motion, slowest and fastest speed (5 and 95 %), starts from
    rest, and breakaways of which the force can be read."""

    seconds: float
    slow: float
    fast: float
    starts: int
    breakaways: int


@dataclass(frozen=True)
class Ways:
    """Both directions, reversals, rests and their seconds in all, and the events as the estimates
    count them."""

    positive: Way
    negative: Way
    reversals: int
    rests: int
    rested: float
    events: Events


def _ways(logs: Sequence[MotionLog], friction: Karnopp) -> Ways:
    """What moved, in which direction, from the measured motion; friction: of sliding, or its first
    estimate."""
    h, ways = logs[0].log.h, [one.signals["d"] for one in logs]
    events = [breakaway_limits(one, with_shown_band(one, friction)) for one in logs]
    rests = [(one, at) for one in logs for at in rest_stretches(one, samples(MEAN, one.log.h))]
    sides = []
    for sign in (1.0, -1.0):
        speed = np.concatenate([np.abs(one.signals["v"])[one.signals["d"] == sign] for one in logs])
        slow, fast = np.quantile(speed, [SLOW_SPEED, QUICK_SPEED]) if len(speed) else (0.0, 0.0)
        starts = sum(
            one.signals["d"][after] == sign for one, (_, after) in rests if after < len(one.log)
        )
        count = sum(int(np.sum(one.direction == sign)) for one in events)
        sides.append(Way(len(speed) * h, float(slow), float(fast), int(starts), count))
    up, down = sides
    return Ways(
        positive=up,
        negative=down,
        reversals=sum(int(np.count_nonzero(np.diff(d[d != 0]))) for d in ways),
        rests=len(rests),
        rested=float(sum(end - begin for _, (begin, end) in rests)) * h,
        events=Events(
            breakaways=(up.breakaways, down.breakaways),
            crossings=(2 * up.starts, 2 * down.starts),
            sliding=(round(up.seconds / h), round(down.seconds / h)),
            fastest=(up.fast, down.fast),
        ),
    )


def identifiable_by_log(
    recorded: RecordedLogs, ways: Ways, fit: KarnoppFit, *, open_run: bool = False
) -> tuple[Identifiable, ...]:
    """Whether each of the nine, and of the actuator's parameters, is identified by a fit of the
    logs.

    fit: the fit itself, or its first part; open_run: whether its run may be followed or not.
    """
    run = {} if fit.prescribed else identifiability(recorded)
    prescribed = is_prescribed(recorded)
    out = []
    for name in NAMES:
        found, by_run = fit.estimates.get(name), open_run and name not in FIVE
        lacks = None  # a path that a rig leads has no breakaways, however it is run
        if by_run or not prescribed:
            lacks = silent_reason(name, ways.events, recorded.name)
        if found is None:
            why = "fixed at a value that does not matter for this log"
            out.append(Identifiable(name, False, why))
        elif by_run and lacks is None:  # no promise, where the run may be followed or not
            why = _events(name, ways, fit)
            out.append(Identifiable(name, False, why, MEND[name[:3]], only_if=OPEN))
        elif found.value is not None and not by_run:
            out.append(_identifiable(name, found, fit, ways, run.get(name), prescribed=prescribed))
        else:
            out.append(_not_identifiable(name, found, recorded.name, lacks))
    if fit.actuator is not None and "k1" in fit.estimates:
        for name in ("k1", "k2"):
            one = fit.estimates[name]
            why = one.reason or "the force follows the command as a linear actuator's"
            out.append(Identifiable(name, one.value is not None, why))
    elif not recorded.zoh:
        why, add = "no command is logged", MEND["k"]
        if commanded(recorded.plain):
            why, add = "the force does not follow the command as a linear actuator's", ""
        out += [Identifiable(name, False, why, add) for name in ("k1", "k2")]
    return tuple(out)


def _identifiable(
    name: str, found: Estimate, fit: KarnoppFit, ways: Ways, run: float | None,
    *, prescribed: bool,
) -> Identifiable:  # fmt: skip
    """By what a parameter is identified, and within what share of it."""
    assert found.value is not None and found.low is not None and found.high is not None
    half = 0.5 * (found.high - found.low) / abs(found.value)
    if fit.prescribed:
        which = "the force equation" if prescribed else "the equation of motion alone"
        return Identifiable(name, True, f"to {half:.1%} by {which}", within=half)
    within = run if run is not None and run <= HALF else half
    why = f"{_events(name, ways, fit)}; within {within:.1%} of it by the free run"
    return Identifiable(name, True, why, within=within)


def _events(name: str, ways: Ways, fit: KarnoppFit) -> str:
    """What carries a parameter, of the measured motion or of the fit's run, which may show more."""
    side = 1 if name.endswith("n") else 0
    if name.startswith("F_s"):
        count = max(ways.events.breakaways[side], fit.breakaways[side])
        return f"{count} breakaways ({EVENTS_NEEDED} needed)"
    if name.startswith("dv"):
        count = ways.events.crossings[side]
        seen = f"{count} starts and stops" if count >= EVENTS_NEEDED else "stops of the run itself"
        return f"{seen} ({EVENTS_NEEDED} needed)"
    if name == "m":
        return f"{ways.reversals} reversals"
    way = (ways.positive, ways.negative)[side]
    return f"{way.seconds:.3g} s of motion that way"


def _not_identifiable(name: str, found: Estimate, log: str, lacks: str | None) -> Identifiable:
    """Why a parameter is not identified, and what run would identify it; lacks: what the measured
    motion has too little of, which says more than how a fit came out."""
    said = (lacks or found.reason or "not identifiable from this log").removeprefix(f"{log}: ")
    if said == WHY_NOT["stick"]:
        said = f"{NO_RUN_FOLLOWED}; {MEND_OF_RUN}"
    why, _, add = said.partition("; ")
    key = name if name in MEND else name[:3]
    if not add and found.at_most is None:
        add = MEND[key]
    return Identifiable(name, False, why, "" if add.startswith("see ") else add)


@dataclass(frozen=True, eq=False)
class RunsIdentifiability:
    """What the motion of the runs identifies, or the reason why nothing.

    motion: of the longest run; effects: by how many deviations of the noise each effect would show
    at a size that matters, None where that was not asked.
    """

    motion: Motion | None = None
    ways: Ways | None = None
    identifiability: tuple[Identifiable, ...] = ()
    reason: str = ""
    remarks: tuple[str, ...] = ()
    effects: Mapping[str, float] | None = None
    surroundings: Surroundings = NO_SURROUNDINGS


def identifiability_of_runs(
    runs: Sequence[Log], rig: Rig, drive: Drive | None = None, *, effects: bool = False,
    fit: KarnoppFit | None = None,
) -> RunsIdentifiability:  # fmt: skip
    """Motion, directions and what they identify of each parameter, of at least one run.

    drive: what the fit is asked to be driven by; effects: also which effects the runs could show;
    fit: that of the runs, where there is one already.
    """
    log = max(runs, key=len)
    motion = differentiate(log["y"], log.h)
    if rig.kind == "velocity":
        return _identifiability_of_valve(runs, rig, motion)
    try:
        scaled = rig.kind != "motor" or bool(rig.force_per_command)
        if not scaled:  # forces in units of the command
            runs = [run.with_signals(F=run["u"]) for run in runs]
            rig = replace(rig, force_per_command=1.0)
        first = preliminary_fit(runs, rig, drive) if fit is None else PreliminaryFit(fit)
        around = first.fit.surroundings
        runs = [around.taken_out(run) for run in runs]
        recorded = recorded_logs(runs, rig, drive)
        friction = first_plant(recorded).friction
    except (BadLog, NotIdentifiable) as error:
        return RunsIdentifiability(motion, reason=str(error))
    ways = _ways(recorded.logs, friction)
    seen = identifiable_by_log(recorded, ways, first.fit, open_run=first.open)
    shown = None
    if effects and not is_prescribed(recorded):
        shown = tellable_effects(recorded, built_in())
    said = surrounding_lines(around, rig, scaled=scaled)
    return RunsIdentifiability(motion, ways, seen, remarks=said, effects=shown, surroundings=around)


def _identifiability_of_valve(runs: Sequence[Log], rig: Rig, motion: Motion) -> RunsIdentifiability:
    """The same of a rig whose velocity follows the command, by its fit, which is quick."""
    try:
        record = recorded(runs)
        found = valve_estimates(record, fit(record), units(rig.motion, rig.command_unit))
    except NotIdentifiable as error:
        return RunsIdentifiability(motion, reason=str(error))
    half = {n: NORMAL_95 * e.sd / abs(e.value) for n, e in found.items() if e.value and e.sd}
    return RunsIdentifiability(
        motion,
        identifiability=tuple(
            Identifiable(n, e.known, e.reason or "", within=half.get(n)) for n, e in found.items()
        ),
    )
