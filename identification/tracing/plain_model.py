"""The plain model: what the nine parameters and the actuator alone make of the rows."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from identification.effects._library import Library
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import MECHANICAL
from identification.estimation.regression.inertia import inertia_has_no_part
from identification.estimation.regression.row_fit import RowFit, base_fits, mean_square
from identification.estimation.structure_fit import (
    FittedStructure,
    band,
    by_exact_force,
    plain_structure,
)
from identification.estimation.windowed_run.run_errors import misfit
from identification.thresholds import ADEQUATE, ASTRAY, COMPLETE
from identification.tracing.recorded_rows import (
    RecordedRows,
    prescribed_rows,
    without_load_dependent,
    without_speed_effects,
)

REFINEMENT = "the refinement of the plain model to its end"


@dataclass(frozen=True, eq=False)
class PlainModel:
    """The model without effects and what it leaves.

    rows: the logs, prescribed where a rig moves them; start, first: its regression and fits of the
    equations; model: refined on its free run; library: the effects that are worth a trial, none
    where it leaves nothing but noise; recorded: the logs as the estimator takes them.
    """

    rows: RecordedRows
    start: EffectRows
    first: Mapping[str, RowFit]
    model: FittedStructure
    library: Library
    recorded: RecordedLogs


def plain_model(rows: RecordedRows, library: Library, rng: np.random.Generator) -> PlainModel:
    """The plain model of the rows; raises NotIdentifiable where these identify nothing.

    Halted, it is the best so far.
    """
    recorded, halt = rows.recorded, rows.recorded.halt
    recorded, model = by_exact_force(recorded, plain_structure(recorded, rng), rng.spawn(1)[0])
    rows = replace(rows, recorded=recorded)
    # Prescribed, and the inertia not only hidden by what is missing.
    prescribed = model.prescribed and inertia_has_no_part(rows.logs)
    if rows.refused is not None and not prescribed:
        raise rows.refused
    if prescribed:
        rows = prescribed_rows(rows)
        model = plain_structure(rows.recorded, rng)
        library, said = without_speed_effects(without_load_dependent(library, rows.logs), rows.logs)
        rows = replace(rows, remarks=(*rows.remarks, *said))
    if halt.reached():
        halt.left_out(REFINEMENT)
    start = model.stage
    if model.prescribed:
        return PlainModel(rows, start, model.outcomes, model, library, recorded)
    logs = rows.logs
    if model.misfit <= ADEQUATE:  # else its stops are not the machine's
        logs = tuple(replace(one, reference=model.plant.friction) for one in logs)
    # A run that is not followed may have swollen its band in place of what is missing.
    slow = band(model) if model.misfit <= ASTRAY else 0.0
    start = replace(start, band=slow, sliding=model.plant.friction)
    first = base_fits(start)
    with halt.closing():  # or it would be open whether an effect is worth a trial at all
        follows = misfit(model.plant, logs, rows.drive, every=True) <= COMPLETE
    # Breakaways as they were before a band was known, which may be another effect's.
    explained = {**model.outcomes, **{e: o for e, o in first.items() if e == MECHANICAL}}
    if follows and all(mean_square(o) <= ADEQUATE for o in explained.values()):
        library = {}  # neither the plain plant's run nor its equations leave anything but noise
    rows = replace(rows, recorded=replace(rows.recorded, logs=logs))
    return PlainModel(rows, start, first, model, library, recorded)
