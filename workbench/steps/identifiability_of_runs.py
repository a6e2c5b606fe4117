"""The gate before a fit: what runs can identify of each parameter.

The rule is the estimator's own: doctor runs the first part of its fit, and what that identifies is
called identifiable; `identify` says the same of its whole fit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from identification.effects._library import built_in
from identification.errors import BadLog, NotIdentifiable
from identification.estimation.first_look import FirstLook, first_look
from identification.estimation.recorded_logs import led_by_rig, recorded_logs
from identification.estimation.regression.standstill import MEAN, breakaways, rest_stretches
from identification.estimation.regression.three_step import first_estimate
from identification.experiment.identifiability import tellable_effects
from identification.log import Log, Rig
from identification.model.estimates import NORMAL_95, Drive, KarnoppFit
from identification.model.surroundings import NO_SURROUNDINGS, Surroundings
from identification.signals.differentiate import Motion, differentiate
from identification.signals.sampling import samples
from identification.velocity.fit import fit
from identification.velocity.record import recorded
from identification.velocity.valve_estimates import units, valve_estimates
from workbench.documents.model import Identifiable
from workbench.steps.identifiable_by_log import Ways, identifiable_by_log, ways_of
from workbench.steps.surrounding_lines import surrounding_lines


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
        if rig.kind == "motor" and not rig.force_per_command:  # forces in units of the command
            runs = [run.with_signals(F=run["u"]) for run in runs]
            rig = replace(rig, force_per_command=1.0)
        first = first_look(runs, rig, drive) if fit is None else FirstLook(fit)
        around = first.fit.surroundings
        runs = [around.taken_out(run) for run in runs]
        recorded = recorded_logs(runs, rig, drive)
        m = max(float(first_estimate(one.log, held=recorded.held).nine[0]) for one in recorded.logs)
    except (BadLog, NotIdentifiable) as error:
        return RunsIdentifiability(motion, reason=str(error))
    events = [breakaways(one, m) for one in recorded.logs]
    rests = [rest_stretches(one, samples(MEAN, one.log.h)) for one in recorded.logs]
    ways = ways_of(recorded.logs, events, rests)
    seen = identifiable_by_log(recorded, ways, first.fit, open_run=first.open)
    shown = None
    if effects and not led_by_rig(recorded):
        shown = tellable_effects(recorded, built_in())
    said = surrounding_lines(around, rig)
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
