"""The plain model: what the nine parameters and the actuator alone make of the rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identification.effects._library import Library
from identification.errors import UserError
from identification.estimation.output_error.karnopp_fit import searched_plant
from identification.estimation.regression.equation_rows import MotionLog
from identification.estimation.regression.inertia import inertia_has_no_part
from identification.estimation.windowed_run.refinement import COMPLETE, loose, misfit, refit
from identification.log import Log, Rig
from identification.model.estimates import Drive
from identification.tracing.free_run.fitted_structure import FittedStructure, band, fitted_structure
from identification.tracing.recorded_rows import RecordedRows, imposed_rows, told_by_speed
from identification.tracing.regression.effect_rows import EffectRows
from identification.tracing.regression.row_fit import RowFit, base_fits
from identification.tracing.regression.stepwise import first_stage, rough
from identification.tracing.remaining_structure import ASTRAY


@dataclass(frozen=True, eq=False)
class PlainModel:
    """The model without effects and what it leaves.

    rows: the logs, imposed where a rig leads them; start, first: its regression and fits of the
    equations; model: refined on its free run; library: the effects that are worth a trial, none
    where it leaves nothing but noise.
    """

    rows: RecordedRows
    start: EffectRows
    first: Mapping[str, RowFit]
    model: FittedStructure
    library: Library


def plain_model(
    rows: RecordedRows, rig: Rig, library: Library, rng: np.random.Generator
) -> PlainModel:
    """The plain model of the rows; raises NotIdentifiable where these tell nothing."""
    start, first, model = _regressed(rows, rig, rng)
    # Imposed, and the inertia not only hidden by what is missing.
    imposed = model.imposed and inertia_has_no_part(rows.logs)
    if rows.refused is not None and not imposed:
        raise rows.refused
    if imposed:
        rows = imposed_rows(rows)
        start, first, model = _regressed(rows, rig, rng)
        library, said = told_by_speed(library, rows.logs)
        rows = replace(rows, remarks=(*rows.remarks, *said))
    if model.imposed:
        return PlainModel(rows, start, first, model, library)
    if not (loose(model.plant, rows.drive) or rough(first)) and model.misfit > COMPLETE:
        model = searched(model, rows.logs, rows.drive, rig, rng)
    logs = tuple(replace(one, reference=model.plant.friction) for one in rows.logs)
    # A run that is not followed may have swollen its band in place of what is missing.
    slow = band(model) if model.misfit <= ASTRAY else 0.0
    start = replace(start, band=slow, sliding=model.plant.friction)
    if misfit(model.plant, logs, rows.drive, every=True) <= COMPLETE:
        library = {}  # the plain plant's run leaves nothing but noise
    return PlainModel(replace(rows, logs=logs), start, base_fits(start), model, library)


def _regressed(
    rows: RecordedRows, rig: Rig, rng: np.random.Generator
) -> tuple[EffectRows, dict[str, RowFit], FittedStructure]:
    """The equations' model, and the same refined on its free run."""
    start, first = first_stage(rows.logs, rows.by_command)
    model = fitted_structure(start, first, (), rows.logs, rows.drive, rig, rng.spawn(1)[0])
    return start, first, model


def searched(
    model: FittedStructure, logs: Sequence[MotionLog], drive: Drive, rig: Rig,
    rng: np.random.Generator,
) -> FittedStructure:  # fmt: skip
    """The plain model from a global search, where that follows the logs better."""
    try:
        train: list[Log] = [one.log for one in logs]
        plant = searched_plant(train, rng.spawn(1)[0], rig=rig, drive=drive)
    except UserError:
        return model
    found = refit(plant, logs, drive, prior={}, effort="near")
    if found.misfit >= model.misfit:
        return model
    return replace(model, plant=found.plant, sd=found.sd, misfit=found.misfit)
