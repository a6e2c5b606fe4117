"""A trace of logs whose surroundings were taken out, reported of the logs as they were recorded."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.effects._base import Acting
from identification.errors import NotIdentifiable
from identification.estimation.fit import fit_plant
from identification.estimation.latent_force import LatentForce
from identification.estimation.regression.equation_rows import MECHANICAL
from identification.estimation.surroundings import explains as explains_much
from identification.estimation.surroundings import (
    lag_explains,
    surrounding_estimates,
    widened_friction,
)
from identification.estimation.turn_orders import orders_explain
from identification.log import Log, Rig
from identification.model.karnopp import NAMES
from identification.model.plant import Plant
from identification.model.surroundings import Surroundings
from identification.thresholds import CHANCE_LEVEL
from identification.tracing.probability import evidence, probability
from identification.tracing.result import (
    Dependence,
    Errors,
    FoundEffect,
    Left,
    Residual,
    Trace,
)

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
    after = {**of.parameters_after, **widened_friction(of.parameters_after, around, train)}
    of = replace(of, plant=plant, surroundings=around, parameters_after=after)
    delay = tuple(one for one in around.effects if one.key == DELAY)
    for named, explain in ((delay, lag_explains), (around.cogging, orders_explain)):
        if not named:
            continue
        try:
            left = {
                name: explain(logs, rig, around)
                for name, logs in (("train", train), ("test", test or train))
            }
        except NotIdentifiable:  # the test logs do not slide enough to show what they explain
            continue
        without, with_them = left["test"]
        if named is delay or explains_much(without**2, with_them**2):
            of = _with_named(of, named, around, left)
            of = of if named is delay else _with_orders(of, around)
    return of


def _with_orders(of: Trace, around: Surroundings) -> Trace:
    """The trace whose residuals, before, have the orders' force that was taken out of the logs."""
    residuals = tuple(_less_orders(one, around) for one in of.residuals)
    missing = of.missing_force
    if missing is not None:
        before = replace(
            missing.before, logs=tuple(_by_orders(one, around) for one in missing.before.logs)
        )
        sliding = _less_orders(missing.sliding, around)
        missing = replace(missing, before=before, sliding=sliding)
    return replace(of, residuals=residuals, missing_force=missing)


def _by_orders(one: LatentForce, around: Surroundings) -> LatentForce:
    """The latent force of a plain model that lacks the orders too."""
    return replace(one, force=one.force + sum(order.force(one.y) for order in around.orders))


def _less_orders(one: Residual, around: Surroundings) -> Residual:
    """The residual, before with the orders' force."""
    if one.equation != MECHANICAL or "y" not in one.signals:
        return one
    force = sum(order.force(one.signals["y"]) for order in around.orders)
    return replace(one, before=one.before - force)


def orders_alone(
    refused: NotIdentifiable, around: Surroundings, train: Sequence[Log], test: Sequence[Log],
    rig: Rig, rng: np.random.Generator,
) -> Trace:  # fmt: skip
    """What is known where the logs show the orders of a turn and too little beside them, as motion
    one way, for a plain model to be traced; refused: why. Raises it where the orders explain
    nothing of the test logs either."""
    fit = fit_plant(train, rng, rig=rig)
    own = {name: one for name, one in fit.estimates.items() if name in (*NAMES, "k1", "k2")}
    left = {
        name: Errors(orders_explain(logs or train, rig, around)[1], None, None, None)
        for name, logs in (("train", train), ("test", test))
    }
    plain = Trace(
        verdict="none", before=left, after=left,
        noise_y=fit.noise_y, noise_F=fit.noise_F, noise_force=fit.noise_F, noise_actuator=None,
        effects=(), rivals=(), unknown=Dependence((), 0.0), drift=(),
        next_experiment="motion both ways, at several speeds",
        parameters_before=own, parameters_after=own,
        plant=Plant(fit.friction, fit.actuator), residuals=(), complete=False,
        left=Left(1.0, ()), remarks=(*fit.remarks, str(refused)),
    )  # fmt: skip
    found = with_surroundings(plain, around, train, test, rig)
    if not found.effects:
        raise refused
    return replace(found, verdict="effect", complete=False)


def _with_named(
    of: Trace, named: tuple[Acting, ...], around: Surroundings,
    left: Mapping[str, tuple[float, float]],
) -> Trace:  # fmt: skip
    """The trace with these effects first among its own; left: of "train" and "test", what the
    equation leaves without them and with them.

    `explained` and `probability` are of all of them together. Each stood out of 0 by so many
    deviations that chance would not, so its p-value is at most the level asked for. An order has
    no other rival than chance: nothing else repeats a whole number of times in a turn.
    """
    without, with_them = left["test"]
    known, share = surrounding_estimates(around), (with_them / without) ** 2
    late, still_missing = named[0].key == DELAY, 0.0 if of.complete else with_them / without
    sure = probability(evidence(still_missing, 1)) if late else 1.0 - CHANCE_LEVEL
    found = tuple(
        FoundEffect(
            one.effect,
            {p.name: known[f"{one.key}.{p.name}"] for p in one.effect.params},
            1.0 - share,
            CHANCE_LEVEL,
            sure,
        )
        for one in named
    )
    nothing_else = of.verdict in ("none", "drift")
    return replace(
        of,
        before={name: _with_left(of.before[name], *own) for name, own in left.items()},
        effects=(*found, *of.effects),
        verdict="effect" if nothing_else else of.verdict,
        complete=of.complete or of.verdict == "none",
        left=replace(of.left, share=of.left.share * share),
    )


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
