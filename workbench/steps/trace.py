"""The logs that a trace is made of, by their card, and trace.json."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from design.identified.trace_logs import Traced, effect_estimates, trace_logs
from design.machine.plain import plain
from design.machine.source import fingerprints
from design.machine.versions import versions
from identification.effects._library import Library
from identification.errors import BadLog
from identification.progress import KeepGoing, Progress, quiet, without_end
from workbench.cards.card import load_card
from workbench.logs.sources import Sources, card_path
from workbench.steps.present import present_of_card

TRACE_SCHEMA = "trace/1"


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
    """The trace of the machine that the sources are of, with the controller of its card.

    keep_going: whether it is to go on. Raises as `trace_logs` does, and BadCard where the
    controller does not fit the rig.
    """
    found = trace_logs(
        train.logs, test.logs if test else None, library, seed, on_progress, keep_going=keep_going
    )
    now = present_of_card(train.card, train.rig, found.model.period)
    return replace(found, model=replace(found.model, controller=now))


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
