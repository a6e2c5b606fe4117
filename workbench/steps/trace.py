"""Training and test runs -> trace: what the model lacks, errors before and after, and the model."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from design.machine.effect_values import relabelled
from design.machine.model import FitSummary, Model
from design.machine.plain import plain
from design.machine.plausible import model_remarks, refuse_other_units
from design.machine.source import Source, fingerprints
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
from workbench.cards.card import load_card
from workbench.logs.sources import Sources, card_path, refuse_twins
from workbench.steps.identify import arx_or_reason, log_entry, resonance_of, surrounding_effects
from workbench.steps.present import present_of_card
from workbench.steps.surrounding_lines import surrounding_lines, unequal_friction

TRACE_SCHEMA = "trace/1"


@dataclass(frozen=True)
class Traced:
    """A trace, the model after it, and the runs that it was made of."""

    trace: Trace
    model: Model
    train: tuple[Source, ...]
    test: tuple[Source, ...]
    remarks: tuple[str, ...]
    bad: tuple[BadSamples, ...] = ()


def named_logs(
    logs: Sequence[str], tests: Sequence[str], card_name: str
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the training and the test logs: those given, or without any the card's split.

    Raises BadCard; BadLog where neither the command nor the card names a training log.
    """
    if logs:
        return tuple(logs), tuple(tests)
    card = load_card(card_path(card_name), with_recipe=False)
    train = card.split.get("train", ())
    if not train:
        raise BadLog(
            f"{card.name}: no log to train on is named, and the card has no [split] train = [...];"
            " name a LOG"
        )
    return train, tuple(tests) or card.split.get("test", ())


def trace_sources(
    train: Sources, test: Sources | None, library: Library, seed: int = 0,
    on_progress: Progress = quiet, *, keep_going: KeepGoing = without_end,
) -> Traced:  # fmt: skip
    """The trace of the machine that the sources are of; keep_going: whether it is to go on.

    Raises BadLog where a test log is a training log, has other units, or no row that could be
    judged, NotIdentifiable where too little slides.
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
    train_logs, test_logs = ([source.log for source in of] for of in (train.runs, seen))
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
    if seen and found.after["test"].force_rms is None:
        raise BadLog(
            f"{', '.join(dict.fromkeys(source.file for source in seen))}: no row of it could be"
            " judged, since it nowhere slides long enough; test on a log of motion like that of the"
            " training logs"
        )
    split = train.card.split.get("test", ())
    kept = dict.fromkeys(source.file for source in train.runs if source.file in split)
    remarks = (
        *surrounding_lines(found.surroundings, train.rig),
        *train.remarks, *(test.remarks if test else ()),
        *(f"{name}: trained on, though the card's [split] keeps it for tests" for name in kept),
    )  # fmt: skip
    model = traced_model(found, train, library)
    bad = (*train.bad, *(test.bad if test else ()))
    now = present_of_card(train.card, train.rig, model.period)
    model = replace(model, bad_samples=train.bad, controller=now)
    remarks = (*remarks, *unequal_friction(model.friction, model.effects), *model_remarks(model))
    return Traced(found, model, train.runs, seen, remarks, bad)


def traced_model(found: Trace, sources: Sources, library: Library) -> Model:
    """The model after the trace, as model.json holds it."""
    rig = sources.rig
    actuator = {k: v for k, v in found.parameters_after.items() if k not in NAMES}
    if rig.kind == "motor" and rig.force_per_command is not None:
        unit = actuator_units(rig.motion, rig.command_unit)["k_a"]
        actuator = {"k_a": Estimate(rig.force_per_command, unit, reason="given by the card")}
    errors = found.after["train"]
    plant, reason = arx_or_reason([source.log for source in sources.runs])
    chi = 1.0  # mean square of the equation's residual over that of the sensors' noise
    if errors.force_rms is not None and found.noise_force > 0:
        chi = (errors.force_rms / found.noise_force) ** 2
    starts = [(float(one.log["y"][0]), 0.0, float(one.log["F"][0])) for one in sources.runs]
    return Model(
        card=sources.card.name,
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
            for source, start in zip(sources.runs, starts, strict=True)
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


def trace_document(traced: Traced) -> dict[str, Any]:
    """The trace as trace.json writes it: the keys of the contract, and what it allows beside."""
    found, model = traced.trace, traced.model
    gravity, force = model.effects.get("gravity"), model.effects.get("constant_force")
    shown = not found.surroundings.none  # of what acts beside the applied force
    effects = [
        {"key": e.effect.key, "params": effect_estimates(e, model.rig), "explained": e.explained,
         "p_value": e.p_value, "probability": e.probability}
        for e in found.effects
    ]  # fmt: skip
    curves = [
        {"key": one.effect, "equation": one.equation, "signal": one.signal,
         **({} if one.period is None else {"period": one.period}),
         **{name: getattr(one, name).tolist() for name in ("at", "free", "sd", "law")}}
        for one in found.curves
    ]  # fmt: skip
    document: dict[str, Any] = plain(
        {
            "schema": TRACE_SCHEMA,
            "card": model.card,
            "log": fingerprints(traced.train),
            "test_log": fingerprints(traced.test),
            "verdict": found.verdict,
            "before": found.before,
            "after": found.after,
            "noise_floor": {"force_rms": found.noise_force},
            "effects": effects,
            "gravity": gravity if gravity and shown else None,
            "constant_force": force["F_0"] if force and shown else None,
            "lag": model.lag,
            "resonance": model.resonance,
            "curves": curves,
            "rivals": list(found.rivals),
            "unknown": {
                "depends_on": list(found.unknown.depends_on),
                "explained": found.unknown.explained,
            },
            "complete": found.complete,
            "actuator_like": found.actuator_like,
            "missing_of_friction": dict(
                zip(("before", "after"), found.missing or (None, None), strict=True)
            ),
            "left": {"share": found.left.share, "depends_on": list(found.left.depends_on)},
            "drift": list(found.drift),
            "next_experiment": found.next_experiment,
            "not_tried": list(found.not_tried),
            "parameters": {"before": found.parameters_before, "after": found.parameters_after},
            "bad_samples": list(traced.bad),
            "remarks": [*traced.remarks, *found.remarks],
            "versions": versions(),
        }
    )
    return document
