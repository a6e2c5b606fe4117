"""Training and test runs -> trace: what the model lacks, errors before and after, and the model."""

from dataclasses import dataclass, replace

import numpy as np

from design.identified.identify import arx_or_reason, log_entry, resonance_of, surrounding_effects
from design.machine.effect_values import relabelled
from design.machine.model import FitSummary, Model
from design.machine.plausible import model_remarks, refuse_other_units
from design.machine.source import MachineLogs, Source, refuse_twins
from design.machine.surrounding_lines import surrounding_lines, unequal_friction
from design.machine.versions import versions
from identification.effects._library import Library
from identification.errors import BadLog
from identification.estimation.surroundings import lag_estimate
from identification.log import Rig
from identification.model.estimates import Estimate
from identification.model.karnopp import NAMES
from identification.model.plant import actuator_units
from identification.progress import KeepGoing, Progress, quiet, without_end
from identification.signals.bad_samples import BadSamples
from identification.tracing.result import FoundEffect, Trace
from identification.tracing.trace import trace


@dataclass(frozen=True)
class Traced:
    """A trace, the model after it, and the runs that it was made of."""

    trace: Trace
    model: Model
    train: tuple[Source, ...]
    test: tuple[Source, ...]
    remarks: tuple[str, ...]
    bad: tuple[BadSamples, ...] = ()


def trace_logs(
    train: MachineLogs, test: MachineLogs | None, library: Library, seed: int = 0,
    on_progress: Progress = quiet, *, keep_going: KeepGoing = without_end,
) -> Traced:  # fmt: skip
    """The trace of the machine that the logs are of, with its present controller; keep_going:
    whether it is to go on.

    Raises BadLog where a test log is a training log, has other units, or no row that could be
    judged, NotIdentifiable where too little slides, BadCard where the controller does not fit.
    """
    seen = test.runs if test else ()
    if train.rig.kind == "motor" and not train.rig.force_per_command:
        raise BadLog(
            f"{train.runs[0].file}: a motor needs its force_per_command; set it under [rig] of the"
            " card (1 where it is not known: a force is then in units of the command)"
        )
    refuse_twins(train.runs, seen)
    if test and test.rig != train.rig:
        raise BadLog(
            f"{test.runs[0].file}: the card gives it another rig than {train.runs[0].file}; trace"
            " machines one by one"
        )
    train_logs, test_logs = train.logs, test.logs if test else []
    refuse_other_units(test_logs, train_logs, train.rig)
    found = trace(
        train_logs,
        test_logs,
        train.rig,
        library,
        np.random.default_rng(seed),
        on_progress=on_progress,
        keep_going=keep_going,
    )
    untested = found.after["test"].force_rms is None and found.surroundings.resonance is None
    if seen and untested:
        raise BadLog(
            f"{', '.join(dict.fromkeys(source.file for source in seen))}: no row of it could be"
            " judged, since it nowhere slides long enough; test on a log of motion like that of the"
            " training logs"
        )
    kept = dict.fromkeys(source.file for source in train.runs if source.file in train.kept)
    remarks = (
        *surrounding_lines(found.surroundings, train.rig),
        *train.remarks, *(test.remarks if test else ()),
        *(f"{name}: trained on, though the card's [split] keeps it for tests" for name in kept),
    )  # fmt: skip
    model = traced_model(found, train, library)
    bad = (*train.bad, *(test.bad if test else ()))
    model = replace(model, bad_samples=train.bad, controller=train.present(model.period))
    remarks = (*remarks, *unequal_friction(model.friction, model.effects), *model_remarks(model))
    return Traced(found, model, train.runs, seen, remarks, bad)


def traced_model(found: Trace, logs: MachineLogs, library: Library) -> Model:
    """The model after the trace, as model.json holds it."""
    rig = logs.rig
    actuator = {k: v for k, v in found.parameters_after.items() if k not in NAMES}
    if rig.kind == "motor" and rig.force_per_command is not None:
        unit = actuator_units(rig.motion, rig.command_unit)["k_a"]
        actuator = {"k_a": Estimate(rig.force_per_command, unit, reason="given by the card")}
    errors = found.after["train"]
    plant, reason = arx_or_reason(logs.logs)
    chi = 1.0  # mean square of the equation's residual over that of the sensors' noise
    if errors.force_rms is not None and found.noise_force > 0:
        chi = (errors.force_rms / found.noise_force) ** 2
    starts = [(float(one.log["y"][0]), 0.0, float(one.log["F"][0])) for one in logs.runs]
    return Model(
        card=logs.card,
        rig=rig,
        friction={name: found.parameters_after[name] for name in NAMES},
        actuator=actuator or None,
        plant=plant,
        plant_reason=reason,
        fit=FitSummary(
            drive="command" if actuator else "force",
            stiffness=0.0,
            noise_y=found.noise_y,
            noise_F=found.noise_F,
            chi_square=chi,
            adequate=found.complete,
            evaluations=0,
            force_relative=errors.force_relative,
            force_rms=errors.force_rms,
            remarks=found.remarks,
            command_period=found.command_period,
        ),
        log=tuple(
            log_entry(source, start, errors.position_rms, None, chi)
            for source, start in zip(logs.runs, starts, strict=True)
        ),
        versions=versions(),
        effects={
            **surrounding_effects(found.surroundings, rig),
            **{e.effect.key: effect_estimates(e, rig) for e in found.effects},
        },
        lag=lag_estimate(found.surroundings),
        resonance=resonance_of(found.surroundings, rig),
        library=library,
    )


def effect_estimates(found: FoundEffect, rig: Rig) -> dict[str, Estimate]:
    """An effect's parameters under the machine's own units."""
    return relabelled(found.effect, found.params, rig.motion, rig.command_unit)
