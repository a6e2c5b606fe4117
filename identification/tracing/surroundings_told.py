"""A trace of logs whose surroundings were taken out, told of the logs as they were recorded."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.effects._base import Acting
from identification.errors import NotIdentifiable
from identification.estimation.fit import fit_plant
from identification.estimation.surroundings import explains as explains_much
from identification.estimation.surroundings import lag_explains, surrounding_estimates
from identification.estimation.turn_orders import orders_explain
from identification.log import Log, Rig
from identification.model.plant import Plant
from identification.model.surroundings import Surroundings
from identification.thresholds import CHANCE_LEVEL
from identification.tracing.result import Dependence, Errors, FoundEffect, Left, Trace

DELAY = "input_delay"


def with_surroundings(
    of: Trace, around: Surroundings, train: Sequence[Log], test: Sequence[Log], rig: Rig
) -> Trace:
    """The trace with what acts beside the applied force in its plant.

    A command that acts late is an effect of its actuator, and orders of a turn are cogging: both
    are named among the effects, and the errors before are then those of the plain model on the
    logs as they were recorded.
    """
    plant = replace(of.plant, effects=(*of.plant.effects, *around.effects))
    of = replace(of, plant=plant, surroundings=around)
    for named in _named(around):
        of = _with_named(of, named, around, (train, test or train), rig)
    return of


def orders_alone(
    refused: NotIdentifiable, around: Surroundings, train: Sequence[Log], test: Sequence[Log],
    rig: Rig, rng: np.random.Generator,
) -> Trace:  # fmt: skip
    """What is known where the logs show the orders of a turn and too little beside them, as motion
    one way, for a plain model to be traced; refused: why. Raises it where the orders explain
    nothing of the test logs either."""
    fit = fit_plant(train, rng, rig=rig)
    left = {
        name: Errors(orders_explain(logs or train, rig, around)[1], None, None, None)
        for name, logs in (("train", train), ("test", test))
    }
    plain = Trace(
        verdict="none", before=left, after=left,
        noise_y=fit.noise_y, noise_F=fit.noise_F, noise_force=fit.noise_F, noise_actuator=None,
        effects=(), rivals=(), unknown=Dependence((), 0.0), drift=(),
        next_experiment="motion both ways, at several speeds", parameters_before=fit.estimates,
        parameters_after=fit.estimates,
        plant=Plant(fit.friction, fit.actuator), residuals=(), complete=False,
        left=Left(1.0, ()), remarks=(*fit.remarks, str(refused)),
    )  # fmt: skip
    told = with_surroundings(plain, around, train, test, rig)
    if not told.effects:
        raise refused
    return replace(told, verdict="effect", complete=False)


def _named(around: Surroundings) -> list[tuple[Acting, ...]]:
    """What is told as effects that were missing: orders of a turn, and a command that acts late."""
    delay = tuple(one for one in around.effects if one.key == DELAY)
    return [one for one in (delay, around.cogging) if one]


def _with_named(
    of: Trace, named: tuple[Acting, ...], around: Surroundings,
    logs: tuple[Sequence[Log], Sequence[Log]], rig: Rig,
) -> Trace:  # fmt: skip
    """The trace with these effects first among its own; as it is where the test logs do not
    slide enough to tell what they explain."""
    orders = named[0].key != DELAY
    explains = orders_explain if orders else lag_explains
    try:
        errors = {
            name: explains(own, rig, around)
            for name, own in zip(("train", "test"), logs, strict=True)
        }
    except NotIdentifiable:
        return of
    without, left = errors["test"]
    if orders and not explains_much(without**2, left**2):
        return of
    before = {name: _with_left(of.before[name], *errors[name]) for name in errors}
    known = surrounding_estimates(around)
    found = tuple(
        FoundEffect(
            one.effect,
            {p.name: known[f"{one.key}.{p.name}"] for p in one.effect.params},
            1.0 - (left / without) ** 2,
            CHANCE_LEVEL,
        )
        for one in named
    )
    nothing_else = of.verdict in ("none", "drift")
    return replace(
        of, before=before, effects=(*found, *of.effects),
        verdict="effect" if nothing_else else of.verdict,
        complete=of.complete or of.verdict == "none",
        left=replace(of.left, share=of.left.share * (left / without) ** 2),
    )  # fmt: skip


def _with_left(errors: Errors, without: float, left: float) -> Errors:
    """Errors of the plain model with what is left without such an effect; by the equation."""
    if errors.force_rms is None or not left > 0.0:
        return errors
    worse = without / left
    relative = errors.force_relative
    return replace(
        errors, force_rms=worse * errors.force_rms, position_rms=None,
        force_relative=None if relative is None else min(worse * relative, 1.0),
    )  # fmt: skip
