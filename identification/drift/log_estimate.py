"""What one new log says of a known machine: the fit of that log, begun from the active model."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from identification.arrays import Array
from identification.drift.reference_model import ReferenceModel
from identification.errors import NotIdentifiable
from identification.estimation.fit import fit_plant
from identification.estimation.prescribed_motion import fit_prescribed
from identification.estimation.recorded_logs import recorded_logs
from identification.estimation.windowed_run.parameters import values_of
from identification.estimation.windowed_run.run_errors import misfit
from identification.log import Log
from identification.model.estimates import KarnoppFit
from identification.model.plant import Plant
from identification.thresholds import ADEQUATE, ASTRAY, TWICE


@dataclass(frozen=True, eq=False)
class LogEstimate:
    """Parameters of one log: values (d,) and covariance (d, d) by `names`.

    not_identifiable: parameters that the log does not identify, with the reason; they are among
    `names` all the same. chi_square: what the best fit leaves per value; allowed: up to which the
    structure fits. as_usual: the equation of motion of a motor, whose run is not followed, leaves
    about as much as that of the model's logs.
    """

    names: tuple[str, ...]
    values: Array
    covariance: Array
    not_identifiable: Mapping[str, str]
    chi_square: float
    allowed: float
    as_usual: bool = False

    @property
    def follows(self) -> bool:
        """Whether the structure of the active model follows the log."""
        return self.as_usual or self.chi_square <= self.allowed


def estimate_log(model: ReferenceModel, log: Log, rng: np.random.Generator) -> LogEstimate:
    """The parameters of an active model, as this log alone identifies them.

    Raises NotIdentifiable where nothing moves, or where effects would have to show under a
    prescribed motion, BadLog where a signal is missing.
    """
    drive = None if model.rig.kind == "motor" else model.drive
    if model.prescribed:
        if model.plant.effects:
            raise NotIdentifiable(
                f"{log.name}: prescribed motion, in which effects show in the force equation"
                " only; trace this log together with those of the model"
            )
        recorded = recorded_logs([log], model.rig, drive)
        found = fit_prescribed(recorded, "as the active model")
        return _of_fit(found, allowed_misfit(model.chi_square))
    found = fit_plant([log], rng, rig=model.rig, drive=drive, prior=model.plant)
    if not found.prescribed:
        return _of_fit(found, allowed_misfit(model.chi_square))
    # The equation has less error, or no run of this structure is followed.
    recorded = recorded_logs([log], model.rig, drive)
    own = Plant(found.friction, model.plant.actuator, found.effects)
    left = min(misfit(one, recorded.logs, recorded.drive) for one in (own, model.plant))
    estimate = _of_fit(replace(found, chi_square=left), allowed_misfit(model.chi_square))
    usual = model.force_relative
    if not recorded.zoh or usual is None or found.left is None:
        return estimate
    return replace(estimate, as_usual=found.left[0] <= TWICE * usual)


def relative_change(model: ReferenceModel, found: LogEstimate) -> tuple[Array, Array]:
    """Change (d,) of the model's parameters in their scales, positive where the size grows, and its
    covariance (d, d) without the model's own error; 0 of what the log's fit does not have."""
    change, covariance = np.zeros(len(model.names)), np.zeros((len(model.names),) * 2)
    rows = [i for i, name in enumerate(model.names) if name in found.names]
    columns = [found.names.index(model.names[i]) for i in rows]
    factor = np.where(model.values[rows] < 0, -1.0, 1.0) / model.scales[rows]
    change[rows] = (found.values[columns] - model.values[rows]) * factor
    own = found.covariance[np.ix_(columns, columns)]
    covariance[np.ix_(rows, rows)] = own * np.outer(factor, factor)
    return change, covariance


def allowed_misfit(active: float) -> float:
    """Misfit up to which a log's run is followed; active: what the model left of its own."""
    return ADEQUATE if active <= ADEQUATE else ASTRAY * active


def _of_fit(found: KarnoppFit, allowed: float) -> LogEstimate:
    plant = Plant(found.friction, found.actuator, found.effects)
    not_identifiable = {name: e.reason or "" for name, e in found.estimates.items() if not e.known}
    values = values_of(plant, found.free)
    return LogEstimate(
        found.free, values, found.covariance, not_identifiable, found.chi_square, allowed
    )
