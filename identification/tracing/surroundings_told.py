"""A trace of logs whose surroundings were taken out, told of the logs as they were recorded."""

from collections.abc import Sequence
from dataclasses import replace

from identification.errors import NotIdentifiable
from identification.estimation.surroundings import lag_explains, surrounding_estimates
from identification.log import Log, Rig
from identification.model.surroundings import Surroundings
from identification.thresholds import CHANCE_LEVEL
from identification.tracing.result import Errors, FoundEffect, Trace

DELAY = "input_delay"


def with_surroundings(
    of: Trace, around: Surroundings, train: Sequence[Log], test: Sequence[Log], rig: Rig
) -> Trace:
    """The trace with what acts beside the applied force in its plant.

    A command that acts late is an effect of its actuator, and is named among the effects: the
    errors before are then those of the plain model on the logs as they were recorded.
    """
    plant = replace(of.plant, effects=(*of.plant.effects, *around.effects))
    of = replace(of, plant=plant, surroundings=around)
    delay = next((one for one in around.effects if one.key == DELAY), None)
    if delay is None:
        return of
    try:
        errors = {
            name: lag_explains(logs or train, rig, around)
            for name, logs in (("train", train), ("test", test))
        }
    except NotIdentifiable:
        return of
    before = {name: _with_lag_left(of.before[name], *errors[name]) for name in errors}
    without, left = errors["test"]
    known = surrounding_estimates(around)
    found = FoundEffect(
        delay.effect,
        {p.name: known[f"{DELAY}.{p.name}"] for p in delay.effect.params},
        1.0 - (left / without) ** 2,
        CHANCE_LEVEL,
    )
    verdict = "effect" if of.verdict in ("none", "drift") else of.verdict
    return replace(of, before=before, effects=(found, *of.effects), verdict=verdict)


def _with_lag_left(errors: Errors, without: float, left: float) -> Errors:
    """Errors of the plain model with what the lag leaves where it is not known; by the equation."""
    if errors.force_rms is None or not left > 0.0:
        return errors
    worse = without / left
    relative = errors.force_relative
    return replace(
        errors, force_rms=worse * errors.force_rms, position_rms=None,
        force_relative=None if relative is None else min(worse * relative, 1.0),
    )  # fmt: skip
