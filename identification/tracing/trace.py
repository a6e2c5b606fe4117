"""From residual to missing effect: what the plain model leaves, which effect explains it, and the
error before and after on data that neither the fit nor the choice has seen.

Five stages: the logs as rows; the plain model; the effects that the equations call for (candidates
and selection); those that the free run confirms, refined; the verdict.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.effects._library import Library
from identification.errors import NotIdentifiable
from identification.estimation.late_position import what_acts_beside
from identification.estimation.prescribed_motion import way_of
from identification.estimation.recorded_logs import acts_directly
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.run_or_equation import STEPS_WHY
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.two_masses import of_two_masses, position_errors, two_masses
from identification.log import Log, Rig
from identification.model.estimates import Estimate
from identification.model.surroundings import Surroundings
from identification.progress import Halt, KeepGoing, Progress, quiet, without_end
from identification.remarks import MinorRemark
from identification.signals.check import are_steps, check_driven
from identification.signals.weak_form import WeakWindows
from identification.thresholds import ADEQUATE, COMPLETE
from identification.tracing.free_run.backward_elimination import Setting, only
from identification.tracing.held_out import HeldOut
from identification.tracing.judgement import judgement
from identification.tracing.levels_refitted import LENGTH
from identification.tracing.plain_model import plain_model
from identification.tracing.recorded_rows import recorded_rows
from identification.tracing.regression.stepwise import Choice
from identification.tracing.remaining_structure import FEWEST_ROWS
from identification.tracing.restored_surroundings import orders_alone, with_surroundings
from identification.tracing.result import Trace
from identification.tracing.structure_search import (
    finished_plain,
    refinement,
    selection,
)

OF_AN_ANGLE = ("gravity",)  # effects of rotary machines alone
MOVE_IT = "a held-out run in which the body slides for longer in one direction at a time"
FEW_WINDOWS = ": {} windows of {:.2g} s of such sliding found in one, {} needed to test an effect"
ONE_WAY_ALONE = (
    "motion in one direction, in which only cogging is distinguishable from friction and a constant"
    " force"
)
BY_HALVES = (
    "the training logs lack nothing, the test logs do: the effect is fitted on the first half of"
    " these too, and the errors are those of the second half"
)
ELASTIC_ERRORS = (
    "two masses predict the position of the test logs, in windows of half a second within which the"
    " body goes one way, within {1:.3g} {2} rms, one body within {0:.3g}; the table of errors is of"
    " one body"
)
FOR_NOW = "for now, since the trace ended early"
REST_FIRST = "first the rest of this trace, which ended early: give it more time"


def trace(
    train: Sequence[Log], test: Sequence[Log], rig: Rig, library: Library,
    rng: np.random.Generator, *, on_progress: Progress | None = None,
    keep_going: KeepGoing = without_end,
) -> Trace:  # fmt: skip
    """What the logs call for beyond the plain model, and the errors before and after.

    train: logs for choice and fit; test: logs that neither sees (where there are none, stretches
    of the training logs are left out in turn, and a remark says so). Each has y [m], F [N] and,
    where the command is logged, u [V], on an even clock. keep_going: asked before every run; once
    it says no, the best so far is the result, and `not_tried` says what is not in it. Raises BadLog
    where a signal is missing, NotIdentifiable where too little of the motion slides.
    """
    check_driven(train)
    check_driven((*train, *test))
    if are_steps(train):  # the equations in which effects are sought hold nothing of them
        raise NotIdentifiable(f"{train[0].name}: {STEPS_WHY}")
    report = on_progress or quiet
    halt = Halt(keep_going)
    beside = what_acts_beside(train, rig, halt)
    recorded_as = train, test
    train, test = ([beside.taken_out(log) for log in logs] for logs in (train, test))
    if rig.motion == "linear":
        library = {key: effect for key, effect in library.items() if key not in OF_AN_ANGLE}
    still = bool(test) and not any(_slides(log, rig) for log in test)
    if still:  # nothing could be proved of an effect
        library = {}
    if beside.orders and way_of(train, zoh=rig.kind == "motor") is not None:
        return orders_alone(NotIdentifiable(ONE_WAY_ALONE), beside, *recorded_as, rig, rng)
    try:
        traced = _traced(train, test, rig, library, rng, report, halt)
    except NotIdentifiable as refused:
        if not beside.orders:
            raise
        return orders_alone(refused, beside, *recorded_as, rig, rng)
    by_command = rig.kind != "motor" and _actuator_lacks(traced)
    nothing_found = not (traced.effects or traced.complete or _is_followed(traced))
    if (traced.verdict == "unknown" or nothing_found) and by_command and not halt.reached():
        traced = _by_force(traced, train, test, rig, library, rng, report, halt)
    if still:
        slid = max((_sliding(log, rig) for log in test), key=lambda one: len(one.start))
        few = FEW_WINDOWS.format(len(slid.start), slid.length * test[0].h, FEWEST_ROWS)
        traced = replace(traced, verdict="unknown", complete=False, next_experiment=MOVE_IT + few)
    if not beside.none:
        traced = with_surroundings(traced, beside, *recorded_as, rig)
    if beside.sampled:  # a measured current, which no period holds
        traced = replace(traced, command_period=0.0)
    elastic = traced.verdict == "unknown" and not traced.effects and not halt.reached()
    if elastic and acts_directly(train, rig):
        return _of_two_masses(traced, beside, train, test, rig)
    return traced


def _of_two_masses(
    traced: Trace, beside: Surroundings, train: Sequence[Log], test: Sequence[Log], rig: Rig
) -> Trace:
    """The trace with the resonance, mass and friction of two masses, where these show, and what
    one body and two leave of the position of the test logs."""
    resonance = two_masses(train, rig)
    if resonance is None:
        return traced
    plant = traced.plant
    friction, sizes = of_two_masses(resonance, plant.friction, traced.parameters_after)
    errors = position_errors(resonance, train, test, rig) if test else None
    said = () if errors is None else (ELASTIC_ERRORS.format(*errors, LENGTH[rig.motion]),)
    return replace(
        traced,
        remarks=(*said, *traced.remarks),
        surroundings=replace(beside, resonance=resonance),
        plant=replace(plant, friction=friction),
        parameters_after=sizes,
        missing_force=None,  # which is of one body
        next_experiment="",
    )


def _actuator_lacks(traced: Trace) -> bool:
    """Whether a linear actuator leaves more than noise of the training logs' rate of force: only
    then is it the actuator for which a run by the command fails."""
    left, noise = traced.before["train"].actuator_rms, traced.noise_actuator
    return left is not None and noise is not None and left**2 > COMPLETE * noise**2


def _is_followed(traced: Trace) -> bool:
    """Whether nothing is named and the run leaves hardly more of the position of the test logs than
    noise: then the command says more of the parameters than the measured force, whatever the
    equation leaves."""
    error = traced.after["test"].position_rms
    followed = error is not None and error**2 <= ADEQUATE * traced.noise_y**2
    return traced.verdict == "none" and followed


def _by_force(
    traced: Trace, train: Sequence[Log], test: Sequence[Log], rig: Rig, library: Library,
    rng: np.random.Generator, report: Progress, halt: Halt,
) -> Trace:  # fmt: skip
    """The trace by the measured force, where it knows what that by the command does not: an
    actuator that is not linear leaves its error in every run by the command."""
    alone = [[_without_command(log) for log in logs] for logs in (train, test)]
    try:
        again = _traced(alone[0], alone[1], rig, library, rng, report, halt)
    except NotIdentifiable:
        return traced
    if again.verdict not in ("none", "effect"):
        return traced
    known = {one.effect.key for one in again.effects}
    like = (one.effect.key for one in traced.effects if one.effect.key not in known)
    return replace(again, actuator_like=tuple(like))


def _without_command(log: Log) -> Log:
    return replace(log, signals={key: x for key, x in log.signals.items() if key != "u"})


def _traced(
    train: Sequence[Log], test: Sequence[Log], rig: Rig, library: Library,
    rng: np.random.Generator, report: Progress, halt: Halt, *, halves: bool = True,
) -> Trace:  # fmt: skip
    """The trace of logs on which nothing acts but the applied force and what the library has;
    halves: where the test logs alone lack something, by those of them."""
    begin, last, choose, other = rng.spawn(4)
    setting, choice = _chosen(train, rig, library, (begin, choose), report, halt)
    plain = setting.plain
    report("refitting", 0.0)
    choice, model = refinement(choice, setting, report)
    doubt = ""
    with halt.closing():
        held_out = HeldOut(plain, choice, model, tuple(map(plain.rows.recorded.given, test)))
        if choice.steps and (against := held_out.against):
            names = " and ".join(step.candidate.effect.key for step in choice.steps)
            doubt = f"the equations call for {names}, but with it {against}: not named"
            choice = only(choice, ())
    report("converging", 0.0)
    if not choice.steps:
        plain = finished_plain(plain, last, report)
        held_out = HeldOut(plain, choice, plain.model, held_out.seen)
    with halt.closing():
        alone = halves and held_out.shows_more_than_training
    if alone and not halt.reached():
        found = _by_halves(train, test, rig, library, other, report, halt)
        if found is not None:
            return found
    report("reporting", 0.0)
    with halt.closing():
        traced = judgement(held_out)
        traced = _for_now(traced, held_out, halt.not_tried) if halt.not_tried else traced
    return replace(traced, remarks=(doubt, *traced.remarks)) if doubt else traced


def _by_halves(
    train: Sequence[Log], test: Sequence[Log], rig: Rig, library: Library,
    rng: np.random.Generator, report: Progress, halt: Halt,
) -> Trace | None:  # fmt: skip
    """The trace with the first half of every test log beside the training logs, judged on the
    second; None where it names no effect, or a half slides too little.

    An effect of slow motion does not act in quick training logs: then nothing shows it but logs
    that are held out. Ours.
    """
    halves = [(log.part(0, len(log) // 2), log.part(len(log) // 2, len(log))) for log in test]
    if not all(_slides(half, rig) for both in halves for half in both):
        return None
    first, second = zip(*halves, strict=True)
    try:
        traced = _traced((*train, *first), second, rig, library, rng, report, halt, halves=False)
    except NotIdentifiable:
        return None
    return replace(traced, remarks=(BY_HALVES, *traced.remarks)) if traced.effects else None


def _slides(log: Log, rig: Rig) -> bool:
    """Whether the body slides in a log, for long enough to judge."""
    return len(_sliding(log, rig).start) >= FEWEST_ROWS


def _sliding(log: Log, rig: Rig) -> WeakWindows:
    """The windows of a log in which the body slides."""
    return motion_log(log, zoh=rig.kind == "motor", by_command=False).sliding


def _chosen(
    train: Sequence[Log], rig: Rig, library: Library,
    rngs: tuple[np.random.Generator, np.random.Generator], report: Progress, halt: Halt,
) -> tuple[Setting, Choice]:  # fmt: skip
    """The effects that the equations call for, and what trying them needs.

    rngs: of the plain model, which is begun as `fit_plant` begins, and of the choice of effects.
    """
    begin, choose = rngs
    report("recording", 0.0)
    rows = recorded_rows(train, rig, halt)
    report("refining", 0.0)
    plain = plain_model(rows, library, begin)
    report("tracing", 0.0)
    return selection(plain, choose, report)


def _for_now(traced: Trace, held_out: HeldOut, not_tried: tuple[str, ...]) -> Trace:
    """A trace that was halted: what was not looked for may be missing; a null is one for now."""
    before, after = held_out.plain.model, held_out.model
    unsure = traced.verdict in ("none", "drift") and after.misfit > COMPLETE
    rest_first = traced.verdict in ("none", "unknown")
    # The verdict's sentence says it too.
    early = MinorRemark(f"the trace ended early; not tried: {'; '.join(not_tried)}")
    return replace(
        traced,
        verdict="unknown" if unsure else traced.verdict,
        complete=False,
        next_experiment=REST_FIRST if rest_first else traced.next_experiment,
        not_tried=not_tried,
        parameters_before=_null_for_now(traced.parameters_before, before),
        parameters_after=_null_for_now(traced.parameters_after, after),
        remarks=(*traced.remarks, early),
    )


def _null_for_now(
    found: Mapping[str, Estimate], model: FittedStructure
) -> Mapping[str, Estimate]:  # fmt: skip
    """Parameters of a model whose fit may not have come to its end."""
    if model.fit is not None:
        return found
    return {
        k: e if e.value is not None else replace(e, reason=f"{FOR_NOW}: {e.reason}")
        for k, e in found.items()
    }
