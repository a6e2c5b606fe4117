"""Runs -> model, with what is to be said of both."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from design.asked import Options
from design.identified.broken_promises import broken_promises
from design.identified.hardly_identifiable import braked_by_its_voltage, without_direction
from design.identified.identifiable_by_log import identifiability_of_runs
from design.identified.identify import identify
from design.identified.sampled_posterior import posterior_document, posterior_of
from design.identified.velocity import looks_like_velocity
from design.machine.model import Model
from design.machine.plausible import model_remarks
from design.machine.source import MachineLogs, Source
from design.machine.surrounding_lines import surrounding_lines, unequal_friction
from identification.errors import NotIdentifiable
from identification.model.estimates import KarnoppFit
from identification.progress import KeepGoing, Progress, quiet, without_end
from identification.remarks import left_out

if TYPE_CHECKING:
    from identification.estimation.posterior import Posterior


@dataclass(frozen=True)
class Identified:
    """A model, the fit it comes from, the runs it was fitted on, and the posterior sampled around
    the fit that was asked for with the posterior."""

    model: Model
    fit: KarnoppFit
    sources: tuple[Source, ...]
    remarks: tuple[str, ...]
    posterior_samples: "Posterior | None" = None


def identify_logs(
    logs: MachineLogs,
    options: Options | None = None,
    seed: int = 0,
    *,
    posterior: bool = False,
    on_progress: Progress = quiet,
    keep_going: KeepGoing = without_end,
) -> Identified:
    """The model of the machine that the logs are of, with its present controller.

    keep_going: whether it is to go on, else the best so far is the model.
    Raises NotIdentifiable where nothing is identifiable, BadLog where a signal is missing, BadCard
    where the controller does not fit.
    """
    options = options or Options()
    runs, rig = logs.logs, logs.rig
    try:
        model, fit = identify(
            logs.runs,
            np.random.default_rng(seed),
            card=logs.card,
            rig=rig,
            options=options,
            on_progress=on_progress,
            keep_going=keep_going,
        )
    except NotIdentifiable as error:
        said = (*without_direction(runs, rig), *looks_like_velocity(runs, rig))
        raise NotIdentifiable("; ".join([str(error), *said, *left_out(logs.remarks)])) from error
    gate = identifiability_of_runs(runs, rig, options.drive, fit=fit)
    now = logs.present(model.period)
    model = replace(
        model, bad_samples=logs.bad, controller=now, identifiability=gate.identifiability
    )
    posterior_samples = posterior_of(logs, fit, seed, on_progress) if posterior else None
    if posterior_samples is not None:
        model = replace(model, posterior=posterior_document(posterior_samples, fit))
    remarks = (
        *without_direction(runs, rig),
        *looks_like_velocity(runs, rig, model), *braked_by_its_voltage(runs, rig),
        *surrounding_lines(fit.surroundings, rig),
        *unequal_friction(model.friction, model.effects),
        *logs.remarks, *model_remarks(model), *broken_promises(model),
    )  # fmt: skip
    return Identified(model, fit, logs.runs, remarks, posterior_samples)
