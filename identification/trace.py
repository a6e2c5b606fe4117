"""From residual to missing effect: what the plain model leaves, which effect explains it, and the
error before and after on data that neither the fit nor the choice has seen.

The choice is made on the two equations in weak form and on rest and breakaway (`choice`); the
plant with the effects found is then refined on its free run (`refit`).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.approach import SHORT
from identification.before_after import errors_of, noise_of
from identification.candidates import Candidate, best_of
from identification.choice import (
    SHARE,
    Choice,
    Step,
    choose,
    first_stage,
    merit,
    rough,
    share,
)
from identification.constant import beyond_friction
from identification.constant import remark as constant_remark
from identification.drift import drift
from identification.effects._base import Param
from identification.errors import NotIdentifiable, UserError
from identification.evidence import (
    ACTUATOR,
    IN_ACTUATOR,
    MECHANICAL,
    Fitted,
    Moving,
    actuator,
    moving,
    shortened,
    solve,
    stacked,
)
from identification.forward import judged_forward, most_left
from identification.held_out import left_out
from identification.karnopp import NAMES
from identification.left_over import (
    ASTRAY,
    FEWEST_ROWS,
    MUCH,
    in_run,
    left_over,
    signals_at,
    too_much,
)
from identification.library import Library
from identification.log import Log, Rig
from identification.needed import DECISIVE, NEAR, Setting, doubted, fewest
from identification.outcome import Outcome, base_outcomes, rms, spread
from identification.output_error import searched_plant
from identification.plant import Actuator, units_of
from identification.refit import COMPLETE, loose, misfit, refit
from identification.result import Drive, Estimate
from identification.stage import Stage
from identification.structure import Model, band, led, model_of, untold
from identification.trace_result import (
    Change,
    Dependence,
    FoundEffect,
    Residual,
    Rival,
    Trace,
    Verdict,
)

Progress = Callable[[str, float], None]
ALIKE = 10.0  # gain by which two effects that explain equally may differ
LINEAR_ACTUATOR = 0.97  # share of dF/dt that a linear actuator may leave, to be one at all
BRAKES = 0.005  # of the sliding, in which the force has to oppose it for its share to show
HUNDREDTH = 0.01  # of the square that is missing, left by effects that are there without a doubt
SLIDES, MANY_ROWS = 0.03, 100  # of the log in sliding, and stretches of it, of which one is needed
HELPS = 0.75  # of the run's excess misfit, that effects which leave much may leave at most
RUNS = {
    "v": "strokes at several constant speeds",
    "y": "the same short stroke at several places",
    "t": "the same motion cold and, after running warm, once more",
    "F": "the same motion with and without an added load, and hard braking",
    "u": "a slow triangle of the command through zero",
    "p_p": "the same motion at several chamber pressures",
    "p_n": "the same motion at several chamber pressures",
    "rest": "breakaways after rests of 0.1 s to 30 s",
    "reversal": "small slow reversals below and just above breakaway",
}
SHOWN = 6  # rivals of each effect


def trace(
    train: Sequence[Log], test: Sequence[Log], rig: Rig, library: Library,
    rng: np.random.Generator, *, on_progress: Progress | None = None,
) -> Trace:  # fmt: skip
    """What the logs call for beyond the plain model, and the errors before and after.

    train: logs for choice and fit; test: logs that neither sees (where there are none, stretches
    of the training logs are left out in turn, and a remark says so). Each has y [m], F [N] and,
    where the command is logged, u [V], on an even clock. Raises BadLog where a signal is missing,
    NotIdentifiable where too little of the motion slides.
    """
    report = on_progress or (lambda _stage, _share: None)
    remarks: list[str] = []
    by_command = _by_command(train, rig, library, remarks)
    held = rig.kind == "motor"
    logs = [moving(log, held=held, by_command=by_command) for log in train]
    _enough(logs)
    report("tracing", 0.0)
    drive: Drive = "command" if by_command or held else "force"
    start, first = first_stage(logs, by_command)
    before = model_of(start, first, (), logs, drive, rig, rng.spawn(1)[0])
    free = not before.led and loose(before.plant, drive)
    if not (before.led or free or rough(first)) and before.misfit > COMPLETE:
        before = searched(before, train, logs, drive, rig, rng)
    if not before.led:
        logs = [replace(one, reference=before.plant.friction) for one in logs]
        # A run that is not followed may have swollen its band in place of what is missing.
        known = band(before) if before.misfit <= ASTRAY else 0.0
        start = replace(start, band=known, sliding=before.plant.friction)
        first = base_outcomes(start)
    if not before.led and misfit(before.plant, logs, drive, every=True) <= COMPLETE:
        library = {}  # the plain plant's run leaves nothing but noise
    choice = choose(start, first, library, rng, report)
    report("refitting", 0.5)
    sliding = choice.base[MECHANICAL]
    # What was missing may have hidden the inertia.
    imposed = before.led and (led(sliding) or spread(sliding) > MUCH**2)
    free = free or (before.led and not imposed)
    unsure = start.band == 0.0 and not imposed
    setting = Setting(logs, logs, drive, rig, library, start, first, before, rng.spawn(1)[0])
    after = before
    if choice.steps:
        choice, after = fewest(choice, setting, unsure)
    short = [shortened(one, SHORT) for one in logs]
    if free and not choice.steps and before.misfit <= NEAR:
        short = [most_left(before.plant, one, drive, SHORT) for one in logs]
    setting = replace(setting, short=short)
    if unsure:
        choice, after = doubted(choice, after, setting)
    report("judging", 0.0)
    choice, after = judged_forward(choice, after, setting, report)
    if useless(choice, before, after):
        choice, after = Choice(start, first, (), start, first, choice.tried), before
    seen = [moving(log, held=held, by_command=by_command) for log in test]
    enough = DECISIVE if choice.steps else COMPLETE  # a refinement may end short of its minimum
    left = Dependence((), 0.0) if after.misfit <= enough else left_over(choice, after)
    changed = drift(after, choice.steps, seen, rig) if seen else ()
    verdict = _verdict(choice, left, changed)
    if verdict != "unknown" and too_much(choice, after):
        verdict = "unknown"
        left = left_over(choice, after, any_size=True)
        if not left.depends_on and not after.led:
            left = in_run(after, logs, drive)
    slowest = choice.base[MECHANICAL].slowest
    remarks += _remarks(choice, after, left, logs, seen, rig)
    return Trace(
        verdict=verdict,
        before=errors_of(before, slowest, (), logs, seen, drive),
        after=errors_of(after, slowest, choice.steps, logs, seen, drive),
        noise_y=float(np.mean([one.noise_y for one in logs])),
        noise_F=float(np.mean([one.noise_F for one in logs])),
        noise_force=noise_of(choice.base, MECHANICAL) or 0.0,
        noise_actuator=noise_of(choice.base, ACTUATOR),
        effects=tuple(_found(s, after, choice) for s in choice.steps),
        rivals=_rivals(choice),
        unknown=left,
        drift=changed,
        next_experiment=_next_experiment(verdict, choice, left),
        parameters_before=_parameters(before, rig),
        parameters_after=_parameters(after, rig),
        plant=after.plant,
        residuals=_residuals(choice.start, choice.first, choice.end, choice.base),
        remarks=tuple(remarks),
    )


def _remarks(
    choice: Choice, after: Model, left: Dependence, logs: Sequence[Moving], seen: Sequence[Moving],
    rig: Rig,
) -> Iterator[str]:  # fmt: skip
    """What whoever reads the trace has to know of it."""
    if after.led:
        yield "the motion is imposed (inertia is of no account): no free run is judged"
    elif choice.steps and after.misfit > ASTRAY:
        yield (
            f"the free run still leaves {np.sqrt(after.misfit):.0f} times the position's noise:"
            " band and stick limits are not to be trusted, or more is missing"
        )
    always = beyond_friction(choice.end.theta)
    if always is not None:
        yield constant_remark(always, units_of(rig.motion)["F_cp"])
    if left.swing > 0.0:
        yield (
            f"what is left swings at {left.swing:.3g} Hz whatever the motion does: a vibration from"
            " outside, or another loop"
        )
    if not after.led and driven_only(logs):
        yield (
            "the force hardly ever opposes the motion, so friction in proportion to it would not"
            " show (a run that brakes hard would show it)"
        )
    if not seen:
        yield "no test log: the test errors are those of stretches left out in turn"


def useless(choice: Choice, before: Model, after: Model) -> bool:
    """Whether effects explain neither the run nor, to the sensors' noise, the equations.

    Where no effect of the library is the right one, the nearest stands in for it: it lowers what
    the equations leave (though not to a hundredth), bends the other parameters, and hides on what
    the rest depends.
    """
    if after.led or not choice.steps:
        return False
    told = [e for e in (MECHANICAL, ACTUATOR) if e in choice.base]
    lacked = any(spread(choice.first[e]) > MUCH**2 for e in told)
    if lacked and all(
        spread(choice.base[e]) <= max(MUCH**2, HUNDREDTH * spread(choice.first[e])) for e in told
    ):
        return False
    return after.misfit - 1.0 > HELPS * max(before.misfit - 1.0, 0.0)


def searched(
    model: Model, train: Sequence[Log], logs: Sequence[Moving], drive: Drive, rig: Rig,
    rng: np.random.Generator,
) -> Model:  # fmt: skip
    """The plain model from a global search, where that follows the logs better."""
    try:
        plant = searched_plant(train, rng.spawn(1)[0], rig=rig, drive=drive)
    except UserError:
        return model
    found = refit(plant, logs, drive, prior={}, effort="near")
    if found.misfit >= model.misfit:
        return model
    return replace(model, plant=found.plant, sd=found.sd, misfit=found.misfit)


def driven_only(logs: Sequence[Moving]) -> bool:
    """Whether the force points along the motion in all sliding but a trace of it."""
    against = [
        (one.sliding.mean @ one.log["F"]) * np.where(one.up, 1.0, -1.0) < 0.0 for one in logs
    ]
    return bool(np.mean(np.concatenate(against)) < BRAKES)


def _by_command(train: Sequence[Log], rig: Rig, library: Library, remarks: list[str]) -> bool:
    """Whether an actuator with a logged command is to be judged too: a linear one, or one that
    some effect of the library makes linear."""
    if rig.kind == "motor" or not all("u" in log and np.ptp(log["u"]) > 0 for log in train):
        return False
    logs = [moving(log, held=False, by_command=True) for log in train]
    rows = stacked([actuator(one, np.array([1.0, 0.0, 0.0])) for one in logs])
    found = solve(rows)

    def left_by(one: Fitted) -> float:
        left = float(np.std(one.residual * rows.sd) / max(float(np.std(rows.b)), 1e-300))
        return left if one.theta[0] > 0 else max(left, 1.0)  # nothing follows the command

    left = left_by(found)
    if left > LINEAR_ACTUATOR:
        stage, first = first_stage(logs, True)
        own = [e for e in library.values() if e.acts in IN_ACTUATOR]
        tried = [best_of(stage, effect, first) for effect in own if ACTUATOR in first]
        fits = [c.outcomes[ACTUATOR].fit for c in tried if c is not None]
        left = min([left, *(left_by(fit) for fit in fits)])
    if left > LINEAR_ACTUATOR:
        remarks.append(
            f"a linear actuator leaves {100 * left:.0f} % of the force's rate: effects between"
            " command and force are not judged"
        )
        return False
    return True


def _enough(logs: Sequence[Moving]) -> None:
    rows = sum(len(one.sliding.start) for one in logs)
    if rows < FEWEST_ROWS:
        raise NotIdentifiable(
            f"{logs[0].log.name}: {rows} stretches of sliding in one direction long enough to"
            f" judge ({FEWEST_ROWS} needed); log longer or faster motion"
        )
    share = float(np.mean(np.concatenate([one.signals["d"] != 0 for one in logs])))
    if share < SLIDES and rows < MANY_ROWS:
        raise NotIdentifiable(
            f"{logs[0].log.name}: the body slides for {100 * share:.1f} % of the log, in {rows}"
            f" stretches ({100 * SLIDES:.0f} %, or {MANY_ROWS} stretches, needed to tell its mass"
            " from its friction); drive it harder, or log longer motion"
        )


def _verdict(choice: Choice, left: Dependence, drift: Sequence[Change]) -> Verdict:
    if left.depends_on:
        return "unknown"
    if any(_alike(step) for step in choice.steps):
        return "inseparable"
    if choice.steps:
        return "effect"
    return "drift" if drift else "none"


def _alike(step: Step) -> tuple[Candidate, ...]:
    """Rivals that explain as much as the effect taken, but for luck."""
    mine = merit(step.candidate)
    return tuple(c for c in step.rivals if mine - merit(c) < ALIKE and share(c, step.base) >= SHARE)


def _found(step: Step, after: Model, choice: Choice) -> FoundEffect:
    effect = step.candidate.effect
    acting = next(a for a in after.plant.effects if a.key == effect.key)
    params = {
        p.name: _of_effect(p, acting.values[p.name], after.sd.get(f"{effect.key}.{p.name}"))
        for p in effect.params
    }
    explained = step.explained
    if explained is None:
        explained = share(step.candidate, step.base)
    return FoundEffect(effect, params, explained, step.p_value)


def _of_effect(p: Param, value: float, sd: float | None) -> Estimate:
    if untold(sd, value, p.typical):
        return Estimate(None, p.unit, reason="these logs say nothing of it", assumed=value)
    return _estimate(value, p.unit, sd)


def _estimate(value: float, unit: str, sd: float | None) -> Estimate:
    if sd is None:
        return Estimate(value, unit, reason="held")
    return Estimate(value, unit, sd, value - 1.96 * sd, value + 1.96 * sd)


def _rivals(choice: Choice) -> tuple[Rival, ...]:
    """Rivals of each effect in the order of what they gain."""
    out = []
    for step in choice.steps:
        alike = {c.effect.key for c in _alike(step)}
        for c in step.rivals[:SHOWN]:
            key = c.effect.key
            share = c.gain / step.candidate.gain if step.candidate.gain > 0 else 0.0
            why = (
                f"explains as much as {step.candidate.effect.key} on these logs"
                if key in alike
                else f"gains {100 * max(share, 0.0):.3g} % of what {step.candidate.effect.key} does"
            )
            out.append(Rival(key, _left_out_rms(step, c), why))
    return tuple(out)


def _left_out_rms(step: Step, rival: Candidate) -> float | None:
    """Force error of a rival [N] on stretches left out, over the rows that count for the best."""
    if MECHANICAL not in rival.outcomes:
        return None
    o = rival.outcomes[MECHANICAL]
    return rms(left_out(o.rows, step.candidate.outcomes.get(MECHANICAL, o).slowest)[0])


def _next_experiment(verdict: Verdict, choice: Choice, left: Dependence) -> str:
    if verdict == "inseparable":
        step = next(s for s in choice.steps if _alike(s))
        mine = step.candidate.effect
        other = _alike(step)[0].effect
        apart = [s for s in (*mine.depends_on, *other.depends_on)
                 if (s in mine.depends_on) != (s in other.depends_on)]  # fmt: skip
        how = RUNS.get(apart[0] if apart else mine.depends_on[0], "a run with richer motion")
        return f"to tell {mine.key} from {other.key}: {how}"
    if verdict == "unknown" and not left.depends_on:
        return "to find what is missing: runs that vary speed, place, load and time one by one"
    if verdict == "unknown" and left.swing > 0.0:
        return "to find what swings: a log at standstill, without and with the machines around"
    if verdict == "unknown":
        how = RUNS.get(left.depends_on[0], f"runs in which {left.depends_on[0]} varies by itself")
        return f"to find what depends on {', '.join(left.depends_on)}: {how}"
    return ""


def _parameters(model: Model, rig: Rig) -> dict[str, Estimate]:
    """The nine and the actuator of a model."""
    values = dict(zip(NAMES, model.plant.friction.array.tolist(), strict=True))
    if isinstance(model.plant.actuator, Actuator):
        values |= {"k1": model.plant.actuator.k1, "k2": model.plant.actuator.k2}
    units = units_of(rig.motion)
    return {k: _estimate(v, units[k], model.sd.get(k)) for k, v in values.items()}


def _residuals(
    start: Stage, first: Mapping[str, Outcome], end: Stage, base: Mapping[str, Outcome]
) -> tuple[Residual, ...]:
    """Rows for the pictures."""
    out = []
    for equation in (MECHANICAL, ACTUATOR):
        if equation not in first or len(first[equation].rows.b) != len(base[equation].rows.b):
            continue
        a, b = first[equation], base[equation]
        keep = b.rows.speed >= b.slowest
        windows = [one.sliding if equation == MECHANICAL else one.whole for one in start.logs]
        t, number, offset = [], [], 0.0
        for i, (one, w) in enumerate(zip(start.logs, windows, strict=True)):
            assert w is not None
            t.append(offset + one.log["t"][w.middle] - one.log["t"][0])
            number.append(np.full(len(w.start), float(i)))
            offset += one.log.duration
        signals = {k: v[keep] for k, v in signals_at(start, equation).items()}
        out.append(
            Residual(
                equation,
                np.concatenate(t)[keep],
                np.concatenate(number)[keep],
                (a.fit.residual * a.rows.sd)[keep],
                (b.fit.residual * b.rows.sd)[keep],
                b.rows.sd[keep],
                signals,
            )
        )
    return tuple(out)
