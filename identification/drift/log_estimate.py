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
    """What one log says of the parameters (d,) of the active model.

    change (d,): of each in its scale, positive where the size grows, 0 of what the log's fit does
    not have; covariance (d, d): of its errors, without the model's own. not_identifiable:
    parameters that the log does not identify, with the reason. chi_square: what the best fit leaves
    per value; as_usual: the equation of motion of a motor, whose run is not followed, leaves about
    as much as that of the model's logs.
    """

    change: Array
    covariance: Array
    not_identifiable: Mapping[str, str]
    chi_square: float
    as_usual: bool = False


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
        return _beside(model, fit_prescribed(recorded, "as the active model"))
    found = fit_plant([log], rng, rig=model.rig, drive=drive, prior=model.plant)
    if not found.prescribed:
        return _beside(model, found)
    # The equation has less error, or no run of this structure is followed.
    recorded = recorded_logs([log], model.rig, drive)
    own = Plant(found.friction, model.plant.actuator, found.effects)
    left = min(misfit(one, recorded.logs, recorded.drive) for one in (own, model.plant))
    estimate, usual = _beside(model, replace(found, chi_square=left)), model.force_relative
    if not recorded.zoh or usual is None or found.left is None:
        return estimate
    return replace(estimate, as_usual=found.left[0] <= TWICE * usual)


def allowed_misfit(active: float) -> float:
    """Misfit up to which a log's run is followed; active: what the model left of its own."""
    return ADEQUATE if active <= ADEQUATE else ASTRAY * active


def _beside(model: ReferenceModel, found: KarnoppFit) -> LogEstimate:
    """A log's fit in the scales of the active model."""
    change, covariance = np.zeros(len(model.names)), np.zeros((len(model.names),) * 2)
    rows = [i for i, name in enumerate(model.names) if name in found.free]
    columns = [found.free.index(model.names[i]) for i in rows]
    factor = np.where(model.values[rows] < 0, -1.0, 1.0) / model.scales[rows]
    values = values_of(Plant(found.friction, found.actuator, found.effects), found.free)
    change[rows] = (values[columns] - model.values[rows]) * factor
    own = found.covariance[np.ix_(columns, columns)]
    covariance[np.ix_(rows, rows)] = own * np.outer(factor, factor)
    why = f"{found.logs[0].log}: not identifiable from this log"
    not_identifiable = {name: why for name in model.names if name not in found.free}
    not_identifiable |= {n: e.reason or "" for n, e in found.estimates.items() if not e.known}
    return LogEstimate(change, covariance, not_identifiable, found.chi_square)
