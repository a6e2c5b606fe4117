"""A trace as plain values, as trace.json has it."""

from typing import Any

from design.identified.trace_logs import Traced, effect_estimates
from design.machine.plain import plain
from design.machine.source import fingerprints
from design.machine.versions import versions

TRACE_SCHEMA = "trace/1"


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
