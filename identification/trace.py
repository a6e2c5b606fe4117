"""From residual to missing effect: what the plain model leaves, which effect explains it, and the
error before and after on data that neither the fit nor the choice has seen.

The choice is made on the two equations in weak form and on rest and breakaway (`choice`); the
plant with the effects found is then refined on its free run (`refit`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array, BoolArray
from identification.candidates import (
    ACTUATOR,
    BREAKAWAY,
    MECHANICAL,
    Candidate,
    Outcome,
    Stage,
    one_way,
    with_sizes,
)
from identification.choice import (
    FAR,
    MATERIAL,
    Choice,
    Step,
    absorb,
    choose,
    first_stage,
    merit,
    share,
    spread,
)
from identification.dependence import dependence
from identification.effects._base import Effect
from identification.errors import NotIdentifiable
from identification.evidence import BLOCKS, Moving, Rows, actuator, moving, solve, stacked
from identification.karnopp import NAMES, ROTARY_UNITS, UNITS, Karnopp
from identification.library import Library
from identification.log import Log, Rig
from identification.plant import Actuator, Motor, Plant
from identification.refit import position_rms, refit
from identification.result import Drive, Estimate
from identification.trace_result import (
    Change,
    Dependence,
    Errors,
    FoundEffect,
    Residual,
    Rival,
    Trace,
    Verdict,
)

Progress = Callable[[str, float], None]
FEWEST_ROWS = 30
SHARE_LEFT = 0.002  # of what was missing, that may be left with structure
ROUGH_LEFT = 0.05  # the same, on machines that no model follows down to the sensors' noise
STRUCTURED = 0.3  # square, in noise units, from which what is left is structure
ALIKE = 10.0  # gain by which two effects that explain equally may differ
LINEAR_ACTUATOR = 0.97  # share of dF/dt that a linear actuator may leave, to be one at all
DRIFT_GAIN = 30.0  # chi-square that a parameter freed has to gain
DRIFT_SHARE = 0.1  # of the test logs' square error that it has to take away
DRIFT_LEAST = 0.01  # of its value, that it changes at least
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
INERT = 2.0  # times what is left, below which inertia does not show
OVERLAP = 2.5  # rows that share samples are worth one in so many
SHAPE = 0.03  # relative trust in a searched parameter
OUT_OF_LOGS = ("sensor", "command", "delay")
NOT_SIGNALS = frozenset({"d", "a", "smooth", "r", "F_logged"})
SHOWN = 6  # rivals of each effect
MUCH = 2.0  # times the sensors' noise, at which something is missing whatever it is
RESTLESS = 3.0  # square in noise units from which rest or breakaway are not as they should be
OWN = 0.02  # of the applied force, from which a residual is judged without it
STRETCHES = 64  # of a log, every eighth of which is left out together
BEYOND = 1.3  # times the band, above which sliding friction is judged
LEFT_LEAST = {MECHANICAL: MATERIAL, BREAKAWAY: 0.1}  # of the Coulomb level, structure of account
FIVE = ("m", "F_cp", "F_cn", "F_vp", "F_vn")


@dataclass(frozen=True, eq=False)
class Model:
    """A structure with its numbers: outcomes by equation, the plant, standard deviations by name.

    led: the motion is imposed, so the plant has no free run to be refined on.
    """

    stage: Stage
    outcomes: Mapping[str, Outcome]
    plant: Plant
    sd: Mapping[str, float]
    led: bool


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
    by_command = _by_command(train, rig, remarks)
    held = rig.kind == "motor"
    logs = [moving(log, held=held, by_command=by_command) for log in train]
    _enough(logs)
    report("tracing", 0.0)
    drive: Drive = "command" if by_command or held else "force"
    start, first = first_stage(logs, by_command)
    before = _model(start, first, (), logs, drive, rig)
    start = replace(start, band=_band(before))
    choice = choose(start, first, library, rng, report)
    report("refitting", 0.5)
    after = before
    if choice.steps:
        after = _model(choice.end, choice.base, choice.steps, logs, drive, rig)
    report("judging", 0.0)
    seen = [moving(log, held=held, by_command=by_command) for log in test]
    left = _left_over(choice, after)
    drift = _drift(after, choice.steps, seen, rig) if seen else ()
    verdict = _verdict(choice, left, drift)
    if verdict == "none" and _too_much(choice, after):
        verdict = "unknown"
    slowest = choice.base[MECHANICAL].slowest
    if after.led:
        remarks.append("the motion is imposed (inertia is of no account): no free run is judged")
    if not seen:
        remarks.append("no test log: the test errors are those of stretches left out in turn")
    return Trace(
        verdict=verdict,
        before=_errors(before, slowest, (), logs, seen, drive),
        after=_errors(after, slowest, choice.steps, logs, seen, drive),
        noise_y=float(np.mean([one.noise_y for one in logs])),
        noise_F=float(np.mean([one.noise_F for one in logs])),
        noise_force=_noise(choice.base, MECHANICAL) or 0.0,
        noise_actuator=_noise(choice.base, ACTUATOR),
        effects=tuple(_found(s, after, choice) for s in choice.steps),
        rivals=_rivals(choice),
        unknown=left,
        drift=drift,
        next_experiment=_next_experiment(verdict, choice, left),
        parameters_before=_parameters(before, rig),
        parameters_after=_parameters(after, rig),
        plant=after.plant,
        residuals=_residuals(choice.start, choice.first, choice.end, choice.base),
        remarks=tuple(remarks),
    )


def _by_command(train: Sequence[Log], rig: Rig, remarks: list[str]) -> bool:
    """Whether a linear actuator with a logged command is to be judged too."""
    if rig.kind == "motor" or not all("u" in log and np.ptp(log["u"]) > 0 for log in train):
        return False
    logs = [moving(log, held=False, by_command=True) for log in train]
    rows = stacked([actuator(one, np.array([1.0, 0.0, 0.0])) for one in logs])
    found = solve(rows)
    left = float(np.std(found.residual * rows.sd) / max(float(np.std(rows.b)), 1e-300))
    if left > LINEAR_ACTUATOR or found.theta[0] <= 0:
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


def _model(
    stage: Stage, outcomes: Mapping[str, Outcome], steps: Sequence[Step], logs: Sequence[Moving],
    drive: Drive, rig: Rig,
) -> Model:  # fmt: skip
    """The plant of a structure: the regression's numbers, refined on the free run."""
    five = dict(zip(FIVE, np.maximum(stage.theta, 1e-9).tolist(), strict=True))
    prior: dict[str, float] = {}
    sliding = outcomes[MECHANICAL]
    deviation = _deviations(sliding)
    prior |= dict(zip(FIVE, deviation[:5].tolist(), strict=True))
    stick_p, stick_n = 1.2 * five["F_cp"], -1.2 * five["F_cn"]
    if BREAKAWAY in outcomes:
        found = outcomes[BREAKAWAY].fit.theta
        stick_p = float(found[0]) if found[0] > 0 else stick_p
        stick_n = -float(found[1]) if found[1] > 0 else stick_n
    slow = max(sliding.slowest, float(np.min([5.0 * one.v_noise for one in stage.logs])))
    nine = Karnopp(**five, dv_p=slow, dv_n=-slow, F_sp=stick_p, F_sn=stick_n)
    drives: Actuator | Motor | None = None
    if ACTUATOR in outcomes:
        k1, k2 = (float(x) for x in outcomes[ACTUATOR].fit.theta[:2])
        drives = Actuator(max(k1, 1e-9), max(k2, 0.0))
        prior |= dict(zip(("k1", "k2"), _deviations(outcomes[ACTUATOR])[:2].tolist(), strict=True))
    elif rig.kind == "motor" and rig.force_per_command is not None:
        drives = Motor(rig.force_per_command)
    acting = []
    for step in steps:
        effect = step.candidate.effect
        values = inside(effect, with_sizes(effect, step.candidate.values, outcomes))
        acting.append(effect.acting(values))
        prior |= {f"{effect.key}.{k}": x for k, x in _effect_sd(effect, values, outcomes).items()}
    plant = Plant(nine, drives, tuple(acting))
    if led(outcomes[MECHANICAL]):
        return Model(stage, outcomes, plant, prior, True)
    done = refit(plant, logs, drive, band=max(slow, 1e-4), prior=prior)
    return Model(stage, outcomes, done.plant, done.sd, False)


def led(o: Outcome) -> bool:
    """Whether the motion is imposed: inertia is of no account beside what the model leaves."""
    keep = o.rows.speed >= o.slowest
    inertia = float(np.std((o.rows.X[:, 0] * o.fit.theta[0])[keep]))
    left = float(np.std((o.fit.residual * o.rows.sd)[keep]))
    return inertia < INERT * left


def inside(effect: Effect, values: Mapping[str, float]) -> dict[str, float]:
    """The values, those out of bounds put at the bound."""
    return {p.name: float(np.clip(values[p.name], p.low, p.high)) for p in effect.params}


def _deviations(o: Outcome) -> Array:
    """Standard deviations of theta, (k,), widened by what the rows leave and their overlap."""
    keep = o.rows.speed >= o.slowest
    A = (o.rows.X / o.rows.sd[:, np.newaxis])[keep]
    size = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    inverse = np.linalg.pinv((A / size).T @ (A / size), rcond=1e-12)
    left = float(np.mean(o.fit.residual[keep] ** 2)) if np.any(keep) else 1.0
    return np.asarray(np.sqrt(np.maximum(np.diag(inverse), 0.0) * OVERLAP * max(left, 1.0)) / size)


def _effect_sd(
    effect: Effect, values: Mapping[str, float], outcomes: Mapping[str, Outcome]
) -> dict[str, float]:
    """Standard deviations of an effect's parameters for the prior; 0 holds one at its value."""
    out: dict[str, float] = {}
    for p in effect.params:
        if p.name == "asymmetry" and values[p.name] == 0.0:
            out[p.name] = 0.0
        else:
            out[p.name] = SHAPE * abs(values[p.name]) if values[p.name] else 0.0
    for o in outcomes.values():
        spreads = dict(zip(o.rows.names, _deviations(o).tolist(), strict=True))
        for name in effect.linear:
            full = f"{effect.key}.{name}"
            if full in spreads:
                out[name] = spreads[full]
            elif f"{full}+" in spreads:
                out[name] = 0.5 * float(np.hypot(spreads[f"{full}+"], spreads[f"{full}-"]))
                out["asymmetry"] = out[name] / max(abs(values[name]), 1e-300)
    return out


def _seen(stage: Stage, steps: Sequence[Step], logs: Sequence[Moving]) -> Stage:
    """The stage of other logs with the same structure and effects taken out of their signals."""
    own = replace(stage, logs=tuple(logs), chosen=(), taken=(), scales={})
    for step in steps:
        if step.candidate.effect.acts in OUT_OF_LOGS:
            own = absorb(own, step.candidate)
    return replace(own, chosen=stage.chosen)


def _residual(stage: Stage, equation: str, theta: Array, slowest: float) -> tuple[Array, Array]:
    """Residual (r,) of the rows that count with these parameters, and their left side."""
    rows = stacked(stage.parts[equation])
    keep = rows.speed >= slowest
    return (rows.b - rows.X @ theta)[keep], rows.b[keep]


def _left_out(stage: Stage, equation: str, slowest: float) -> tuple[Array, Array]:
    """As `_residual`, each stretch of time with the parameters of all others."""
    rows = stacked(stage.parts[equation])
    keep = rows.speed >= slowest
    r = np.zeros(len(rows.b))
    for block in np.unique(rows.block):
        out = rows.block == block
        theta = solve(rows, keep & ~out).theta
        r[out] = rows.b[out] - rows.X[out] @ theta
    return r[keep], rows.b[keep]


def _rms(r: Array) -> float:
    """Root mean square; 0 of nothing."""
    return float(np.sqrt(np.mean(r**2))) if len(r) else 0.0


def _errors(
    model: Model, slowest: float, steps: Sequence[Step], logs: Sequence[Moving],
    seen: Sequence[Moving], drive: Drive,
) -> dict[str, Errors]:  # fmt: skip
    """Errors of a model on the training and the test logs; `slowest` [m/s]: rows that count."""
    own, found = model.stage, model.outcomes
    out = {}
    other = _seen(own, steps, seen) if seen else own
    for name, stage, over in (("train", own, logs), ("test", other, seen or logs)):
        errors: dict[str, tuple[Array, Array]] = {}
        for equation in (MECHANICAL, ACTUATOR):
            if equation not in found:
                continue
            low = slowest if equation == MECHANICAL else 0.0
            if name == "test" and not seen:
                errors[equation] = _left_out(stage, equation, low)
            else:
                errors[equation] = _residual(stage, equation, found[equation].fit.theta, low)
        force = errors[MECHANICAL]
        whole = _rms(force[1])
        size = _rms(force[0])
        out[name] = Errors(
            force_rms=size,
            force_relative=size / whole if whole else None,
            position_rms=None if model.led else position_rms(model.plant, over, drive),
            actuator_rms=_rms(errors[ACTUATOR][0]) if ACTUATOR in errors else None,
        )
    return out


def _noise(base: Mapping[str, Outcome], equation: str) -> float | None:
    """What the sensors alone leave in an equation's rows (one sigma, root mean square)."""
    return float(np.sqrt(np.mean(base[equation].rows.sd ** 2))) if equation in base else None


def _excess(o: Outcome) -> float:
    """Square in noise units beyond the noise itself."""
    return max(spread(o) - 1.0, 0.0)


def _signals_at(stage: Stage, equation: str) -> dict[str, Array]:
    """Signals that vary, at the middle of an equation's rows over all logs."""
    out: dict[str, list[Array]] = {}
    for i, one in enumerate(stage.logs):
        if equation == MECHANICAL:
            middle = one.sliding.middle
        elif equation == ACTUATOR and one.whole is not None:
            middle = one.whole.middle
        elif equation == BREAKAWAY:
            middle = stage.events[i].at
        else:
            middle = stage.at_rest[i].start
        s = one.signals
        own = {k: v[middle] for k, v in s.items() if k not in NOT_SIGNALS}
        own["t"] = s["t"][middle] - s["t"][0]
        own["reversal"] = since_reversal(s["d"], one.log.h)[middle]
        if equation == ACTUATOR:
            own["du"] = np.gradient(s["u"], one.log.h)[middle]
        if equation == BREAKAWAY:
            own["rest"] = stage.events[i].rested
        for k, v in own.items():
            out.setdefault(k, []).append(v)
    joined = {k: np.concatenate(v) for k, v in out.items() if len(v) == len(stage.logs)}
    return {k: v for k, v in joined.items() if len(v) and np.ptp(v) > 0}


def since_reversal(d: Array, h: float) -> Array:
    """Time since the direction last changed or the body stood still [s], (n,)."""
    n = len(d)
    changed = np.concatenate([[True], d[1:] != d[:-1]])
    at = np.maximum.accumulate(np.where(changed, np.arange(n), 0))
    return np.asarray((np.arange(n) - at) * h, dtype=np.float64)


def _left_over(choice: Choice, after: Model) -> Dependence:
    """The strongest structure that is left in any equation, if there is any."""
    best = Dependence((), 0.0)
    for equation, o in choice.base.items():
        keep = _judged(o, after) if equation == MECHANICAL else o.rows.speed >= o.slowest
        if equation == ACTUATOR and choice.end.play:
            keep = keep & np.concatenate([one_way(one) for one in choice.end.logs])
        if np.count_nonzero(keep) < FEWEST_ROWS or (o.robust and spread(o) < RESTLESS):
            continue
        signals = {k: v[keep] for k, v in _signals_at(choice.end, equation).items()}
        if equation == BREAKAWAY:  # force and command at breakaway are what is judged
            signals = {k: v for k, v in signals.items() if k not in ("F", "u", "v", "reversal")}
        if equation == MECHANICAL and _rms(o.fit.residual * o.rows.sd) > OWN * _rms(o.rows.b):
            signals.pop("F", None)  # a large residual is itself a good part of F
        if any(effect.acts == "bristle" for effect, _ in choice.end.chosen):
            signals.pop("reversal", None)  # its rise is judged in the free run
        r = o.fit.residual[keep]
        if o.robust:
            limit = 3.0 * np.sqrt(max(spread(o), 1.0))
            r = np.clip(r, -limit, limit)
        way = np.asarray(signals.get("v", r) >= 0)
        n = len(r)  # fine stretches in turn, or no function of time could be judged
        found = dependence(r, signals, way, np.arange(n) * STRETCHES // n % BLOCKS)
        left = found.explained * float(np.mean(r**2))
        whole = _excess(choice.first[equation]) if equation in choice.first else 0.0
        rough = bool(choice.steps) and spread(o) > FAR
        part = ROUGH_LEFT if rough else SHARE_LEFT
        if not found.depends_on or left < STRUCTURED or left < part * whole:
            continue
        size = float(np.sqrt(left) * np.median(o.rows.sd[keep]))
        if size < LEFT_LEAST.get(equation, 0.0) * _level(choice):
            continue
        if found.explained > best.explained:
            best = found
    return best


def _judged(o: Outcome, after: Model) -> BoolArray:
    """Rows of sliding above the band that the free run shows (or the regression's, without one)."""
    slowest = o.slowest if after.led else min(o.slowest, _band(after))
    return np.asarray(o.rows.speed >= slowest)


def _band(model: Model) -> float:
    """Speed [m/s] above which the free run shows sliding friction; 0 without a free run."""
    p = model.plant.friction
    return 0.0 if model.led else BEYOND * max(p.dv_p, -p.dv_n)


def _level(choice: Choice) -> float:
    """Coulomb level [N]."""
    return 0.5 * float(np.sum(np.abs(choice.end.theta[1:3])))


def _too_much(choice: Choice, after: Model) -> bool:
    """Whether far more than the sensors' noise is left, of whatever structure."""
    o = choice.base[MECHANICAL]
    r = o.fit.residual[_judged(o, after) & (o.rows.speed >= o.slowest)]
    return bool(len(r) and np.mean(r**2) > MUCH**2)


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
    return tuple(c for c in step.rivals if mine - merit(c) < ALIKE)


def _found(step: Step, after: Model, choice: Choice) -> FoundEffect:
    effect = step.candidate.effect
    acting = next(a for a in after.plant.effects if a.key == effect.key)
    params = {
        p.name: _estimate(acting.values[p.name], p.unit, after.sd.get(f"{effect.key}.{p.name}"))
        for p in effect.params
    }
    return FoundEffect(effect, params, share(step.candidate, step.base), step.p_value)


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
            rms = None
            if MECHANICAL in c.outcomes:
                o = c.outcomes[MECHANICAL]
                low = step.candidate.outcomes.get(MECHANICAL, o).slowest
                rms = _rms((o.fit.residual * o.rows.sd)[o.rows.speed >= low])
            out.append(Rival(key, rms, why))
    return tuple(out)


def _next_experiment(verdict: Verdict, choice: Choice, left: Dependence) -> str:
    if verdict == "inseparable":
        step = next(s for s in choice.steps if _alike(s))
        mine = step.candidate.effect
        other = _alike(step)[0].effect
        apart = [s for s in (*mine.depends_on, *other.depends_on)
                 if (s in mine.depends_on) != (s in other.depends_on)]  # fmt: skip
        how = RUNS.get(apart[0] if apart else mine.depends_on[0], "a run with richer motion")
        return f"to tell {mine.key} from {other.key}: {how}"
    if verdict == "unknown":
        how = RUNS.get(left.depends_on[0], f"runs in which {left.depends_on[0]} varies by itself")
        return f"to find what depends on {', '.join(left.depends_on)}: {how}"
    return ""


def _drift(
    after: Model, steps: Sequence[Step], seen: Sequence[Moving], rig: Rig
) -> tuple[Change, ...]:
    """Parameters that differ between training and test logs, fewest that bring the error down."""
    stage = _seen(after.stage, steps, seen)
    out: list[Change] = []
    for equation, names in ((MECHANICAL, FIVE), (ACTUATOR, ("k1", "k2"))):
        if equation in after.outcomes:
            mine = after.outcomes[equation]
            rows = stacked(stage.parts[equation])
            keep = rows.speed >= mine.slowest
            if np.count_nonzero(keep) >= FEWEST_ROWS:
                out += [
                    Change(name, _unit(name, rig), *change)
                    for name, *change in changes(mine, rows, keep, names)
                ]
    return tuple(out)


def changes(
    mine: Outcome, rows: Rows, keep: BoolArray, names: Sequence[str]
) -> list[tuple[str, float, float, float]]:
    """Name, value before and after, and deviation of the parameters that have changed.

    One is freed at a time, the one that lowers the error most, as long as it lowers it by a
    material share and surely: parameters that a short log cannot tell apart do not all change.
    """
    theta = mine.fit.theta.copy()
    A, b = (rows.X / rows.sd[:, np.newaxis])[keep], (rows.b / rows.sd)[keep]
    r = b - A @ theta
    noise = max(float(np.mean(mine.fit.residual[mine.rows.speed >= mine.slowest] ** 2)), 1.0)
    free: list[int] = []
    best = theta
    while len(free) < len(names):
        now = float(np.sum((b - A @ best) ** 2))
        options = []
        for i in range(len(names)):
            if i not in free:
                at = [*free, i]
                step = np.linalg.lstsq(A[:, at], r, rcond=1e-8)[0]
                options.append((float(np.sum((r - A[:, at] @ step) ** 2)), i, step))
        left, i, step = min(options, key=lambda x: x[0])
        sure = (now - left) / (noise * OVERLAP)
        if sure < DRIFT_GAIN or now - left < DRIFT_SHARE * now:
            break
        free.append(i)
        best = theta.copy()
        best[free] += step
    if not free:
        return []
    inverse = np.linalg.pinv(A[:, free].T @ A[:, free])
    sd = np.sqrt(np.diag(inverse) * noise * OVERLAP)
    return [
        (names[i], float(theta[i]), float(best[i]), float(s))
        for i, s in zip(free, sd, strict=True)
        if abs(best[i] - theta[i]) > DRIFT_LEAST * abs(theta[i])
    ]


def _unit(name: str, rig: Rig) -> str:
    rotary = rig.motion == "rotary"
    actuator_units = {
        "k1": "N m/(V s)" if rotary else "N/(V s)",
        "k2": "N m/rad" if rotary else "N/m",
    }
    return actuator_units.get(name) or (ROTARY_UNITS if rotary else UNITS)[name]


def _parameters(model: Model, rig: Rig) -> dict[str, Estimate]:
    """The nine and the actuator of a model."""
    values = dict(zip(NAMES, model.plant.friction.array.tolist(), strict=True))
    if isinstance(model.plant.actuator, Actuator):
        values |= {"k1": model.plant.actuator.k1, "k2": model.plant.actuator.k2}
    return {k: _estimate(v, _unit(k, rig), model.sd.get(k)) for k, v in values.items()}


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
        signals = {k: v[keep] for k, v in _signals_at(start, equation).items()}
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
