"""What was found beside the plain model, on logs that neither the choice nor the fit has seen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identification.estimation.prediction_error import significant
from identification.estimation.regression.equation_rows import ACTUATOR, MECHANICAL, MotionLog
from identification.estimation.regression.row_fit import RowFit
from identification.estimation.regression.weighted_rows import Rows, stacked
from identification.estimation.structure_fit import FittedStructure, band
from identification.model.estimates import Drive
from identification.thresholds import ADEQUATE, MATERIAL, OF_ACCOUNT
from identification.tracing.model_errors import (
    OnTest,
    errors_of,
    lacks,
    on_test,
    row_noise,
    seen_by,
    share_left,
)
from identification.tracing.parameter_drift import (
    ParameterDrift,
    parameter_drift,
    with_changes,
)
from identification.tracing.plain_model import PlainModel
from identification.tracing.predictive_check import predicts_worse
from identification.tracing.probability import Evidence, evidence
from identification.tracing.regression.stepwise import Choice
from identification.tracing.residuals import missing_force
from identification.tracing.result import Change, Errors, MissingForce
from identification.tracing.structure_search import likelier_plain
from identification.tracing.verdict import explains_most

AS_LARGE_AS_FRICTION = (
    "what is left of the force is larger than friction itself, by these logs' noise or by what it"
    " hides"
)


@dataclass(frozen=True, eq=False)
class HeldOut:
    """What the plain model and the refined one leave of the test logs, and of the training logs.

    seen: the test logs, recorded as the others; where there are none, the training logs stand for
    them.
    """

    plain: PlainModel
    choice: Choice
    model: FittedStructure
    seen: tuple[MotionLog, ...]

    @property
    def drive(self) -> Drive:
        """What drives the runs."""
        return self.plain.rows.drive

    @property
    def logs(self) -> tuple[MotionLog, ...]:
        """The training logs."""
        return self.plain.rows.logs

    @property
    def unseen(self) -> tuple[MotionLog, ...]:
        """The logs that judge."""
        return self.seen or self.logs

    @cached_property
    def before(self) -> Mapping[str, Errors]:
        """Errors of the plain model by "train" and "test"."""
        slowest = self.choice.base[MECHANICAL].slowest
        return errors_of(self.plain.model, slowest, (), self.logs, self.seen, self.drive)

    @cached_property
    def after(self) -> Mapping[str, Errors]:
        """The same of the refined one."""
        slowest = self.choice.base[MECHANICAL].slowest
        steps, logs = self.choice.steps, self.logs
        return errors_of(self.model, slowest, steps, logs, self.seen, self.drive)

    @cached_property
    def was(self) -> OnTest:
        """What the plain model leaves of the test logs."""
        plain = self.plain.model
        if self.model is plain:
            return self.now
        return on_test(plain, self.before["test"], self.unseen, self.drive, self.model)

    @cached_property
    def now(self) -> OnTest:
        """What the refined one leaves of the test logs."""
        return on_test(self.model, self.after["test"], self.unseen, self.drive)

    @property
    def noise(self) -> Errors:
        """What the sensors alone leave of the equations."""
        base = self.choice.base
        return Errors(row_noise(base, MECHANICAL) or 0.0, None, None, row_noise(base, ACTUATOR))

    @property
    def coulomb(self) -> float:
        """The larger Coulomb level of the plain model [N]."""
        friction = self.plain.model.plant.friction
        return max(friction.F_cp, friction.F_cn)

    @cached_property
    def share(self) -> float:
        """Share of what was missing on the test logs, that is left: of the force where it was of
        account, since a run may lose its way at a stop by chance, else of an error."""
        plain = self.plain.model
        of_force = None if plain is self.model else self._force_left(self.missing)
        if of_force is not None:
            return of_force**2
        if self._of_equation is not None:
            return self._of_equation
        runs = plain is not self.model and not plain.prescribed and not self.model.prescribed
        by_run = runs and plain.misfit > ADEQUATE
        return share_left(self.was, self.now, self.noise, by_run)

    @cached_property
    def _of_equation(self) -> float | None:
        """Share that effects leave of what the equation of motion lacks on the test logs, beyond
        the sensors' noise, where they are effects of that equation, leave the measured force as it
        is and make the position significantly likelier that was measured while sliding; else None.

        By the likelihood ratio, Wilks, Ann. Math. Stat. 9 (1938) 60, as `prediction_error`: an
        effect that seldom acts lacks hardly any force on the whole.
        """
        missing, noise = self.missing, self.noise.force_rms or 0.0
        was, now = (one["test"].force_rms for one in (self.before, self.after))
        effects = [step.candidate.effect for step in self.choice.steps]
        elsewhere = any(one.place.in_actuator or one.place.at_rest for one in effects)
        of_motion = self._as_measured and not elsewhere
        if missing is None or not of_motion or was is None or now is None or was <= noise:
            return None
        sizes = sum(len(one.params) for one in effects)
        if not significant(2.0 * missing.gained, sizes):
            return None
        return max(now**2 - noise**2, 0.0) / (was**2 - noise**2)

    @cached_property
    def drift(self) -> ParameterDrift:
        """Parameters that are others on the test logs, and how far these then lie off."""
        if not self.seen:
            return ParameterDrift((), 0.0)
        return parameter_drift(self.model, self.choice.steps, self.seen, self.plain.recorded.rig)

    @property
    def changed(self) -> tuple[Change, ...]:
        """Parameters that are others on the test logs."""
        return self.drift.changes

    @cached_property
    def lacking(self) -> bool:
        """Whether something of account is missing on the training logs."""
        return lacks(self.model, self.after["train"], self.noise)

    @cached_property
    def lacks_force(self) -> bool:
        """Whether the plain model, with the parameters that have changed, lacks a force of account
        on the test logs, however noisy the rows of its equation are, or these leave more there than
        of the training logs: then more has changed; with effects, whether they leave one says their
        evidence."""
        if self.model is not self.plain.model:
            return False
        if self.changed and self.drift.misfit > ADEQUATE:
            return True
        found = self._missing(self.changed) if self.changed else self.missing
        if found is None or found.after.is_a_bound:
            return False
        return (found.after.share(self.coulomb) or 0.0) > OF_ACCOUNT

    @property
    def shows_more_than_training(self) -> bool:
        """Whether the plain model lacks a force of account on the test logs, whatever parameters
        have changed, and nothing on the training logs."""
        force, floor = self.before["test"].force_rms, self.noise.force_rms or 0.0
        if not self.seen or self.choice.steps or self.lacking or force is None:
            return False
        beyond = force**2 - floor**2 > (MATERIAL * self.coulomb) ** 2
        # 0: too little of them slides fast enough to show which parameters have changed.
        return self.lacks_force or (beyond and not 0.0 < self.drift.misfit <= ADEQUATE)

    @property
    def choice_on_test(self) -> Choice:
        """The choice with what it leaves of the test logs in place of the training logs."""
        end = seen_by(self.choice.end, self.choice.steps, self.seen)
        base = {
            equation: _left_of(found, stacked(end.parts[equation]))
            for equation, found in self.choice.base.items()
            if equation in (MECHANICAL, ACTUATOR)
        }
        return replace(self.choice, end=end, base=base)

    @property
    def hides_friction(self) -> bool:
        """Whether what is left of the force, however much of it is noise, is larger than friction
        itself, so that an effect of its size would not show."""
        left = self.after["test"]
        if left.force_rms is None or left.force_relative is None:
            return False
        return left.force_rms > self.coulomb and left.force_relative > OF_ACCOUNT

    @property
    def against(self) -> str:
        """What the test logs hold against the effects found, "" where these explain most of what
        was missing there and do not predict the position worse.

        Of a machine that changed beside more is left, but no more than before.
        """
        beside = bool(self.changed) and self.share < 1.0 and not self.lacking
        if not (explains_most(self.share) or beside):
            return "more than half of what was missing on the test logs is left"
        if self.hides_friction:
            return AS_LARGE_AS_FRICTION
        plain = self.plain.model
        if (
            not self.seen
            or plain.prescribed
            or self.model.prescribed
            or self._measured_force_is_explained
        ):
            return ""
        worse = predicts_worse(plain.plant, self.model.plant, self.seen, self.drive)
        if worse is None:
            return ""
        return (
            f"the position of the test logs is predicted worse over {worse.seconds:g} s"
            f" ({worse.before:.3g} -> {worse.after:.3g} times its noise)"
        )

    @property
    def _measured_force_is_explained(self) -> bool:
        """Whether effects that leave the measured force as it is leave next to nothing of what was
        missing on the test logs: then it was predicted, and a run that loses its way at a stop says
        nothing against them."""
        return self._as_measured and self.share <= OF_ACCOUNT

    @property
    def _as_measured(self) -> bool:
        """Whether there are effects, which all leave force and position as they were measured."""
        steps = self.choice.steps
        return bool(steps) and not any(one.candidate.effect.place.on_signals for one in steps)

    @cached_property
    def missing(self) -> MissingForce | None:
        """The force that either model lacks on the test logs."""
        return self._missing(())

    @cached_property
    def _likelier_plain(self) -> FittedStructure:
        """The plain model against which effects, where there are any, are tested."""
        plain = self.plain.model
        if self.model is plain:
            return plain
        return likelier_plain(self.plain, self.choice.base[MECHANICAL].slowest)

    def _missing(self, changed: Sequence[Change]) -> MissingForce | None:
        """The same with the parameters that have changed as they are on the test logs."""
        slowest = max(self.choice.base[MECHANICAL].slowest, band(self.model))
        before = with_changes(self._likelier_plain, changed)
        after = before if self.model is self.plain.model else with_changes(self.model, changed)
        return missing_force(before, after, self.unseen, slowest)

    @property
    def evidence(self) -> Evidence:
        """Of the effects found, by the share of the missing force that they leave; of those that
        act in stops alone, of which the force while sliding says nothing, by the error if that is
        less, and by it where hardly any force was missing. Of a machine that changed between the
        logs with what has changed in both models, since no effect is to explain that."""
        steps = self.choice.steps
        of_error = float(np.sqrt(self.share))
        missing = self._missing(self.changed) if self.changed and steps else self.missing
        of_force = self._force_left(missing)
        if of_force is None:
            of_force = of_error
        elif all(step.candidate.effect.place.at_rest for step in steps):
            of_force = min(of_force, of_error)
        return evidence(of_force, len(steps))

    def _force_left(self, missing: MissingForce | None) -> float | None:
        """Share of the missing force that is left, None where neither model lacks one of account,
        the logs only bound it, or all effects are an actuator's, whose force is measured."""
        effects = [step.candidate.effect for step in self.choice.steps]
        of_actuator = not self.plain.recorded.by_motor and all(
            one.place.in_actuator for one in effects
        )
        if missing is None or (effects and of_actuator):
            return None
        lacked = [
            one.share(self.coulomb) or 0.0
            for one in (missing.before, missing.after)
            if not one.is_a_bound
        ]
        return missing.share_left if max(lacked, default=0.0) > MATERIAL else None


def _left_of(found: RowFit, rows: Rows) -> RowFit:
    """What a fit leaves of other rows."""
    residual = (rows.b - rows.X @ found.fit.theta) / rows.sd
    return replace(found, rows=rows, fit=replace(found.fit, residual=residual))
