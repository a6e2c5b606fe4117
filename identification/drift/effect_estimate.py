"""What one new log says of a machine whose model has effects: a refit from the model in force.

Effects are not in the fast kernels of the search, so the whole plant is refined on its free run in
windows, from where it is; and once more with the band looked for, where that leaves too much.
"""

import numpy as np

from identification.drift.karnopp_estimate import DRAWN, LIKE, NOT_FOLLOWED, LogEstimate
from identification.drift.reference_model import InForce
from identification.errors import BadLog, NotIdentifiable
from identification.estimation.output_error.identifiability import estimates, events_of
from identification.estimation.regression.equation_rows import motion_log
from identification.estimation.windowed_run.refinement import RESCUES, refit, values_of
from identification.estimation.windowed_run.windows import starts, window_run
from identification.log import Log
from identification.model.estimates import Drive
from identification.model.karnopp import NAMES
from identification.model.plant import Motor


def estimate_with_effects(model: InForce, log: Log, rng: np.random.Generator) -> LogEstimate:
    """The parameters of a model with effects as this log alone tells them.

    Raises NotIdentifiable where nothing moves or the motion is imposed, BadLog where a signal is
    missing.
    """
    if model.imposed:
        raise NotIdentifiable(
            f"{log.name}: the motion is imposed, and effects then show in the force equation only;"
            " trace this log together with those of the model"
        )
    held = model.rig.kind == "motor"
    drive: Drive = "command" if isinstance(model.plant.actuator, Motor) else model.drive
    for name in ("F", "u") if drive == "command" else ("F",):
        if name not in log:
            raise BadLog(f"{log.name}: no signal {name!r}, by which the model is driven; log it")
    one = motion_log(log, held=held, by_command=drive == "command" and not held)
    if not np.any(one.signals["d"]):
        raise NotIdentifiable(f"{log.name}: no motion above the noise; record a run that moves")
    allowed = NOT_FOLLOWED if model.chi_square <= NOT_FOLLOWED else LIKE * model.chi_square
    found = refit(model.plant, [one], drive, prior={}, effort="near")
    searched = found.misfit > allowed
    if searched:
        p = model.plant.friction
        band = max(p.dv_p, -p.dv_n)
        again = refit(model.plant, [one], drive, prior={}, band=band, rescues=RESCUES)
        found = again if again.misfit < found.misfit else found
    values = values_of(found.plant, found.names)
    samples = rng.multivariate_normal(values, found.covariance, DRAWN, check_valid="ignore")
    nine = [i for i, name in enumerate(found.names) if name in NAMES]
    run = window_run(found.plant, one, drive, starts(one, drive))
    if run is None:
        return LogEstimate(found.names, values, found.covariance, {}, np.inf, allowed, searched)
    events = events_of([run.mode], [run.v])
    rotary = model.rig.motion == "rotary"
    told = estimates(
        [found.names[i] for i in nine], values[nine], samples[:, nine], events, rotary, log.name
    )
    untold = {name: e.reason or "" for name, e in told.items() if e.value is None}
    return LogEstimate(
        found.names, values, found.covariance, untold, found.misfit, allowed, searched
    )
