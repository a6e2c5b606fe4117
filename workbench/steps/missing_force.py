"""Model + its logs -> the force that the model lacks on them, over time."""

from collections.abc import Sequence

import numpy as np

from identification.estimation.latent_force import LatentForces, latent_forces
from identification.estimation.regression.motion_log import motion_log
from identification.estimation.structure_fit import ABOVE_BAND
from identification.log import Log
from workbench.documents.model import Model
from workbench.steps.predict import of_one_instant
from workbench.steps.predicted_force import seen_moving, with_applied_force


def missing_force(model: Model, logs: Sequence[Log]) -> LatentForces | None:
    """The latent force of a model on logs of its machine; None where no body slides, and where two
    masses swing behind each other, of which the one body of a latent force is none. A slope by
    which friction falls with speed is no viscous friction, so it is among what is missing."""
    if model.resonance is not None:
        return None
    held = model.rig.kind == "motor"
    given = [of_one_instant(with_applied_force(log, model.rig), model) for log in logs]
    moved = [
        motion_log(
            log, held=held, by_command=False, rotary=model.rotary, imposed=model.prescribed_motion
        )
        for log in given
    ]
    plants = [seen_moving(model, log) for log in given]
    plant = max(plants, key=lambda one: one.friction.dv_p - one.friction.dv_n)
    p = plant.friction
    found = latent_forces(plant, moved, ABOVE_BAND * max(p.dv_p, -p.dv_n))
    return found if any(np.any(one.slides) for one in found.logs) else None
