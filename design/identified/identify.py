"""Runs -> Model: the nine parameters, the actuator, and the ARX plant that a design may start from.

ARX: its input is the applied force F, the stand-in for the force loop's reference of the paper's
plant model, since a force loop has unity gain; where there is no force, the command u. A log at
1 kHz is taken every 10 ms (`design_period`): the output at the samples, the input as its mean in
between, since that is what moves the body. A log from a closed loop is fitted directly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from design.asked import Options
from design.machine.active_model import active_model
from design.machine.arx_plant import ArxPlant, ArxTests
from design.machine.effect_values import relabelled
from design.machine.model import FAST, FitSummary, LogEntry, Model, ParameterCorrelation
from design.machine.readable import Display
from design.machine.source import Source
from design.machine.versions import versions
from design.measured.predict import of_one_instant
from identification.arrays import Array
from identification.arx.design_period import check_period, common_period, decimated, decimation
from identification.arx.model import ArxModel, fit_arx, one_step_errors, simulation_errors
from identification.arx.order_selection import OrderRange, select_arx
from identification.arx.residual_tests import residual_tests
from identification.drift.own_logs import with_own_logs
from identification.errors import BadLog, BadModel, NotIdentifiable
from identification.estimation.fit import fit_plant
from identification.estimation.prescribed_motion import is_unexplained
from identification.estimation.surroundings import lag_estimate, surrounding_estimates
from identification.estimation.two_masses import resonance_estimates
from identification.log import Log, Rig
from identification.model.estimates import Estimate, KarnoppFit
from identification.model.inverse_model import ForceError, Smoothing, force_error
from identification.model.karnopp import NAMES
from identification.model.plant import Actuator, Motor, actuator_units
from identification.model.surroundings import Surroundings
from identification.progress import KeepGoing, Progress, quiet, without_end
from identification.remarks import MinorRemark
from identification.signals.differentiate import differentiate

Orders = tuple[int, int, int]

SPLIT = 0.6
ORDERS = OrderRange(4, 4, 4, min_nk=1)  # tried where none are given
RUNAWAY = 1e30  # m; what goes as far has no error to speak of
TRACKS = 0.5  # correlation of r and y above which a log with r counts as closed-loop
NONE_IDENTIFIABLE = "none of the nine parameters is identifiable"
PART_OF_FORCE = "a linear actuator explains only a part of the force; the value is a regression's"


def identify(
    sources: Sequence[Source],
    rng: np.random.Generator,
    *,
    card: str,
    rig: Rig,
    options: Options | None = None,
    on_progress: Progress = quiet,
    keep_going: KeepGoing = without_end,
) -> tuple[Model, KarnoppFit]:
    """The model of one machine from its runs, and the fit it comes from.

    keep_going: whether it is to go on, else the best so far is the model.
    Raises NotIdentifiable where nothing can be identified, BadLog where a signal is missing.
    """
    options = options or Options()
    logs = [source.log for source in sources]
    for log in logs:  # wrong options are refused before the long part
        check_period(options.design_period, log.name, log.duration)
        decimation(log.h, options.design_period)
    (alone,) = rng.spawn(1)
    fit = fit_plant(
        logs, rng, rig=rig, drive=options.drive, on_progress=on_progress, keep_going=keep_going
    )
    friction = [fit.estimates[n].value for n in NAMES if n in fit.estimates]
    if fit.surroundings.none and all(value is None for value in friction):
        fit = _for_prediction(fit)
    plant, reason = arx_or_reason(logs, options)
    model = Model(
        card=card,
        rig=rig,
        friction=_nine(fit, rig),
        actuator=_actuator(fit, rig, options.drive == "force"),
        plant=plant,
        plant_reason=reason,
        fit=_summary(
            fit,
            _force_error([fit.surroundings.taken_out(log) for log in logs], fit, rig),
            closed_loop_remarks(logs),
        ),
        log=tuple(
            log_entry(source, one.start, one.position_rms, one.force_rms, one.chi_square)
            for source, one in zip(sources, fit.logs, strict=True)
        ),
        versions=versions(),
        correlation=_correlation(fit),
        effects=surrounding_effects(fit.surroundings, rig),
        lag=lag_estimate(fit.surroundings),
        resonance=resonance_of(fit.surroundings, rig),
        falling=fit.falling,
    )
    of_model = [of_one_instant(log, model) for log in logs]
    known = with_own_logs(active_model(model, ""), of_model, alone)
    return replace(model, own_logs=known.own_logs), fit


def _for_prediction(fit: KarnoppFit) -> KarnoppFit:
    """A fit of which no parameter is identifiable, said to be of use for prediction alone; raises
    NotIdentifiable where it leaves most of the force, so that it predicts nothing either."""
    if fit.left is None or is_unexplained(fit.left[0]):
        reasons = {n: fit.estimates[n].reason for n in ("m", "F_cp") if n in fit.estimates}
        first = "; ".join(f"{n}: {reason}" for n, reason in reasons.items())
        raise NotIdentifiable(f"{NONE_IDENTIFIABLE}: {first}")
    remark = f"{NONE_IDENTIFIABLE}; the model predicts the force of motion like this, and no more"
    return replace(fit, remarks=(remark, *fit.remarks))


def surrounding_effects(around: Surroundings, rig: Rig) -> Mapping[str, Mapping[str, Estimate]]:
    """What acts beside the applied force as a model's effects, under the machine's own units."""
    known = surrounding_estimates(around)
    return {
        one.key: relabelled(
            one.effect,
            {p.name: known[f"{one.key}.{p.name}"] for p in one.effect.params},
            rig.motion,
            rig.command_unit,
        )
        for one in around.effects
    }


def resonance_of(around: Surroundings, rig: Rig) -> Mapping[str, Estimate] | None:
    """The resonance of a second mass, None where none shows."""
    return None if around.resonance is None else resonance_estimates(around.resonance, rig)


def _summary(fit: KarnoppFit, errors: ForceError | None, closed: Sequence[str]) -> FitSummary:
    """What the fit left; closed: lines on closed loops."""
    return FitSummary(
        drive=fit.drive,
        stiffness=0.0,
        noise_y=fit.noise_y,
        noise_F=fit.noise_F,
        chi_square=fit.chi_square,
        adequate=fit.adequate,
        evaluations=0,
        force_relative=errors.relative if errors else None,
        force_rms=errors.rms if errors else None,
        remarks=(*fit.remarks, *closed),
        command_period=fit.command_period,
    )


def _correlation(fit: KarnoppFit) -> ParameterCorrelation:
    """How the errors of the fitted parameters go together."""
    sd = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
    size = np.where(sd > 0, sd, 1.0)
    matrix = np.clip(fit.covariance / np.outer(size, size), -1.0, 1.0)
    np.fill_diagonal(matrix, 1.0)
    return ParameterCorrelation(fit.free, tuple(tuple(row) for row in matrix.tolist()))


def _nine(fit: KarnoppFit, rig: Rig) -> Mapping[str, Estimate]:
    """All nine; those that the fit kept fixed have their assumed value."""
    units = Display.of(rig).friction
    unseen = "fixed at a value that does not matter for these logs"
    return {
        name: fit.estimates.get(name)
        or Estimate(None, units[name], reason=unseen, assumed=getattr(fit.friction, name))
        for name in NAMES
    }


def _actuator(fit: KarnoppFit, rig: Rig, by_force: bool) -> Mapping[str, Estimate] | None:
    """k1 and k2, or k_a; None where no command is logged. by_force: was asked for."""
    units = actuator_units(rig.motion, rig.command_unit)
    match fit.actuator:
        case Motor(k_a):
            return {"k_a": Estimate(k_a, units["k_a"], reason="given by the card")}
        case Actuator(k1, k2):
            if "k1" in fit.estimates:
                return {name: fit.estimates[name] for name in ("k1", "k2")}
            why = "the run is by the force, as asked" if by_force else PART_OF_FORCE
            values = {"k1": k1, "k2": k2}
            return {n: Estimate(None, units[n], reason=why, assumed=v) for n, v in values.items()}
        case _:
            return None


def log_entry(
    source: Source, start: tuple[float, float, float], position_rms: float | None,
    force_rms: float | None, chi_square: float,
) -> LogEntry:  # fmt: skip
    """A run as a model has it; the rest as `LogEntry` has it."""
    log = source.log
    return LogEntry(
        file=source.file,
        sha256=source.sha256,
        rows=source.rows,
        start=start,
        travel=(float(np.min(log["y"])), float(np.max(log["y"]))),
        force_peak=float(np.max(np.abs(log["F"]))),
        duration=log.duration,
        h=log.h,
        position_rms=position_rms if np.isfinite(position_rms or 0.0) else None,
        force_rms=force_rms,
        chi_square=chi_square,
        speed=float(np.quantile(np.abs(differentiate(log["y"], log.h).v), FAST)),
        period=source.period,
    )


def _force_error(logs: Sequence[Log], fit: KarnoppFit, rig: Rig) -> ForceError | None:
    """What the mechanical equation leaves of the force on sliding samples; None without any.

    Of a fit by that equation alone as it was fitted, of a fit of a run on the first log.
    """
    if fit.left is not None:
        return ForceError(*fit.left)
    try:
        zoh = rig.kind == "motor" or fit.surroundings.zoh
        return force_error(logs[0], fit.friction, Smoothing(zoh=zoh))
    except (NotIdentifiable, BadLog):
        return None


def closed_loop_remarks(logs: Sequence[Log]) -> list[str]:
    """A line for each log that was taken in a position loop."""
    moved = [log for log in logs if "r" in log and np.ptp(log["r"]) > 0]
    together = [(log.name, float(np.corrcoef(log["r"], log["y"])[0, 1])) for log in moved]
    return [
        MinorRemark(
            f"{name}: logged in a closed loop (r and y correlate by {by:.2f}); the ARX plant is"
            " fitted directly, so noise fed back may bias it"
        )
        for name, by in together
        if by > TRACKS
    ]


def arx_or_reason(
    logs: Sequence[Log], options: Options | None = None
) -> tuple[ArxPlant | None, str | None]:
    """The ARX plant; or None and why not, where it was not asked for by orders."""
    options = options or Options()
    try:
        return arx_plant(logs, options.orders, options.design_period), None
    except (NotIdentifiable, BadLog, BadModel) as error:
        if options.orders is not None:
            raise
        return None, str(error)


def arx_plant(
    logs: Sequence[Log], orders: Orders | None = None, period: float | None = None
) -> ArxPlant:
    """The ARX model from applied force (or else command) to position at the design period [s].

    orders: (na, nb, nk), by default chosen on the last 40 % of every log. Raises NotIdentifiable,
    BadLog, BadModel.
    """
    key: Literal["F", "u"] = "F" if all("F" in log for log in logs) else "u"
    h, steps = common_period(logs, period)
    runs = [decimated(log[key], log["y"], n) for log, n in zip(logs, steps, strict=True)]
    ends = [round(SPLIT * len(y)) for _, y in runs]
    unseen = [(u[n:], y[n:]) for (u, y), n in zip(runs, ends, strict=True)]
    if orders is None:
        choice = select_arx(runs, None, h, orders=ORDERS, split=SPLIT, offset=True)
        orders = (choice.model.na, choice.model.nb, choice.model.nk)
    fitted = [(u[:n], y[:n]) for (u, y), n in zip(runs, ends, strict=True)]
    trial = fit_arx(fitted, *orders, h, offset=True)
    one_step, simulated = _held_out(trial, unseen)
    spread = float(np.std(np.concatenate([y for _, y in unseen])))
    model = fit_arx(runs, *orders, h, offset=True)
    return ArxPlant(
        na=model.na,
        nb=model.nb,
        nk=model.nk,
        A=tuple(model.A.tolist()),
        B=tuple(model.B.tolist()),
        h=h,
        input=key,
        offset=float(model.offset or 0.0),
        sd_a=tuple(model.sd_a.tolist()),
        sd_b=tuple(model.sd_b.tolist()),
        one_step_rms=one_step,
        simulation_rms=simulated,
        simulation_relative=None if simulated is None or spread == 0 else simulated / spread,
        tests=_tests(model, runs),
    )


def _held_out(model: ArxModel, unseen: Sequence[tuple[Array, Array]]) -> tuple[float, float | None]:
    """One-step and free-run errors on runs that the fit has not seen; None: the run diverges."""
    steps = np.concatenate([one_step_errors(model, u, y) for u, y in unseen])
    with np.errstate(over="ignore", invalid="ignore"):
        runs = np.concatenate([simulation_errors(model, u, y) for u, y in unseen])
        free = float(np.sqrt(np.mean(runs**2)))
    return float(np.sqrt(np.mean(steps**2))), free if free < RUNAWAY else None


def _tests(model: ArxModel, runs: Sequence[tuple[Array, Array]]) -> ArxTests | None:
    try:
        found = residual_tests(model, runs, lag_step=None)
    except BadLog:
        return None
    cross: Any = found.cross
    return ArxTests(found.whiteness.p_value, cross.p_value if cross else None, found.lag_step)
