"""What a trace gives: verdict, errors before and after, effects, rivals, what is left."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from identification.arrays import Array
from identification.effects._base import Effect
from identification.estimation.latent_force import LatentForces
from identification.model.estimates import Estimate
from identification.model.plant import Plant
from identification.model.surroundings import NO_SURROUNDINGS, Surroundings

TraceVerdict = Literal["none", "effect", "drift", "unknown", "inseparable"]


@dataclass(frozen=True)
class Errors:
    """Errors of one model on logs or stretches that it has not seen (`test`), or has (`train`).

    force_rms [N] and force_relative: mechanical equation; position_rms [m]: free run in windows of
    2 s; actuator_rms [N/s]: actuator equation. None where there is no such equation or no test.
    """

    force_rms: float | None
    force_relative: float | None
    position_rms: float | None
    actuator_rms: float | None


@dataclass(frozen=True)
class FoundEffect:
    """An effect that was added: its parameters, the share of what was missing that it explains,
    the chance that the largest gain of a model without any effect is as large, and how probable it
    is that the machine has it (`probability`)."""

    effect: Effect
    params: Mapping[str, Estimate]
    explained: float
    p_value: float
    probability: float


@dataclass(frozen=True)
class EffectRival:
    """An effect that was not taken: its error on stretches left out, and why not."""

    key: str
    test_force_rms: float | None
    why_not: str


@dataclass(frozen=True)
class Dependence:
    """What the residual depends on: signals, and the share of it that they explain.

    swing [Hz]: where it depends on t as a vibration does, whatever the motion; else 0.
    """

    depends_on: tuple[str, ...]
    explained: float
    swing: float = 0.0


@dataclass(frozen=True)
class Left:
    """What the effects named leave: the share of the square that was missing on the test logs
    beyond the sensors' noise, of the first error that stood out of it (force, actuator, position),
    and the signals on which that depends."""

    share: float
    depends_on: tuple[str, ...]


@dataclass(frozen=True)
class Change:
    """A parameter that differs between the training and the test logs."""

    name: str
    unit: str
    before: float
    after: float
    sd: float


@dataclass(frozen=True, eq=False)
class Residual:
    """Rows of an equation for the pictures, all (r,): time [s] over all logs in a row, `log` index,
    residual before and after [N, N/s or m], noise (one sigma; of a smoothed force, its own
    deviation), and signals by name at the rows."""

    equation: str
    t: Array
    log: Array
    before: Array
    after: Array
    noise: Array
    signals: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class MissingForce:
    """The latent force of the plain model and of that with the effects, on the test logs (on the
    training logs where there are none), and both while the body slides as a residual: applied force
    less modelled, against the signals there."""

    before: LatentForces
    after: LatentForces
    sliding: Residual

    @property
    def lessened(self) -> bool:
        """Whether effects made a difference to it, so that there is a before and an after."""
        return self.before is not self.after

    @property
    def share_left(self) -> float | None:
        """The force that is still missing with the effects, over that without; None of none."""
        return self.after.rms / self.before.rms if self.before.rms > 0.0 else None

    @property
    def gained(self) -> float:
        """What the effects gain of the log-likelihood of what was measured there [nats], the latent
        force as large as each model needs it."""
        return float(self.after.log_likelihood - self.before.log_likelihood)


@dataclass(frozen=True, eq=False)
class FreeCurve:
    """An effect's part of an equation against a signal, free of its law and by its law.

    at (k,): middles of the pieces in the signal's unit, within `period` of it where a law repeats;
    free, sd (k,): mean of what the model without the effect leaves there and the deviation of that
    mean; law (k,): mean of what the effect gives: friction against the motion, a driving force [N],
    or a rate of the force [N/s].
    """

    effect: str
    equation: str
    signal: str
    at: Array
    free: Array
    sd: Array
    law: Array
    period: float | None = None


@dataclass(frozen=True, eq=False)
class Trace:
    """The result of `trace.trace`.

    before, after: errors by "train" and "test"; noise_y [m], noise_F [N]: of the sensors;
    noise_force [N], noise_actuator [N/s]: what the sensors alone leave in the two equations;
    parameters_before, parameters_after: the nine and k1, k2 by name; plant: the model after, with
    its effects; residuals: of the equations; run: of the position in the free run [m], None where
    it is not followed; next_experiment: one sentence, "" where none is needed; remarks: a line
    each. complete: the model predicts the test logs down to the sensors' noise; left: what is
    missing beside the effects named. not_tried: in words, what a halted trace has not looked
    for, so that its verdict is one for the time being. command_period: as of a fit. curves: of the
    effects named that are a function of a logged signal. surroundings: what acts beside the applied
    force, which is part of the plain model: errors and parameters are of logs without it.
    missing_force: None where no body slides. evidence: terms of `probability`, where effects are
    named. actuator_like: where the command leaves unknown what the measured force does not, the
    effects that this acts like: it lies in the actuator, and all else here is by the force.
    """

    verdict: TraceVerdict
    before: Mapping[str, Errors]
    after: Mapping[str, Errors]
    noise_y: float
    noise_F: float
    noise_force: float
    noise_actuator: float | None
    effects: tuple[FoundEffect, ...]
    rivals: tuple[EffectRival, ...]
    unknown: Dependence
    drift: tuple[Change, ...]
    next_experiment: str
    parameters_before: Mapping[str, Estimate]
    parameters_after: Mapping[str, Estimate]
    plant: Plant
    residuals: tuple[Residual, ...]
    run: Residual | None = None
    complete: bool = True
    left: Left = Left(0.0, ())
    remarks: tuple[str, ...] = field(default=())
    not_tried: tuple[str, ...] = ()
    command_period: float | None = None
    curves: tuple[FreeCurve, ...] = ()
    surroundings: Surroundings = NO_SURROUNDINGS
    missing_force: MissingForce | None = None
    evidence: tuple[float, ...] = ()
    actuator_like: tuple[str, ...] | None = None

    @property
    def missing(self) -> tuple[float, float] | None:
        """Root mean square latent force before and after, as a share of the Coulomb level; None
        where no body slides, or nothing rubs."""
        level = max(self.plant.friction.F_cp, self.plant.friction.F_cn)
        if self.missing_force is None:
            return None
        shares = [one.share(level) for one in (self.missing_force.before, self.missing_force.after)]
        before, after = shares
        return None if before is None or after is None else (before, after)
