"""The chain, each link callable alone: runs -> model -> design -> validation."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from design.machine.model import Model
from design.machine.plain import plain
from design.machine.plausible import model_remarks
from design.machine.source import Source
from identification.errors import NotIdentifiable
from identification.estimation.estimates import reported_estimate
from identification.model.estimates import NORMAL_95, Estimate, KarnoppFit
from identification.model.karnopp import NEGATIVE
from identification.progress import KeepGoing, Progress, quiet, without_end
from workbench.logs.sources import Sources
from workbench.steps.hardly_identifiable import braked_by_its_voltage
from workbench.steps.identifiable_by_log import identifiability_of_runs
from workbench.steps.identify import Options, identify
from workbench.steps.present import present_of_card
from workbench.steps.surrounding_lines import surrounding_lines, unequal_friction
from workbench.steps.velocity import looks_like_velocity

if TYPE_CHECKING:
    from identification.estimation.posterior import Posterior

BROKEN = 2.0  # times what a log promised before the fit, above which an interval is reported


@dataclass(frozen=True)
class Identified:
    """A model, the fit it comes from, the runs it was fitted on, and the posterior sampled around
    the fit that was asked for with the posterior."""

    model: Model
    fit: KarnoppFit
    sources: tuple[Source, ...]
    remarks: tuple[str, ...]
    posterior_samples: "Posterior | None" = None


def identify_sources(
    sources: Sources,
    options: Options | None = None,
    seed: int = 0,
    *,
    posterior: bool = False,
    on_progress: Progress = quiet,
    keep_going: KeepGoing = without_end,
) -> Identified:
    """The model of the machine that the sources are of.

    keep_going: whether it is to go on, else the best so far is the model.
    Raises NotIdentifiable where nothing is identifiable, BadLog where a signal is missing.
    """
    options = options or Options()
    logs = [source.log for source in sources.runs]
    try:
        model, fit = identify(
            sources.runs,
            np.random.default_rng(seed),
            card=sources.card.name,
            rig=sources.rig,
            options=options,
            on_progress=on_progress,
            keep_going=keep_going,
        )
    except NotIdentifiable as error:
        said = looks_like_velocity(logs, sources.rig)
        raise NotIdentifiable("; ".join([str(error), *said])) from error
    gate = identifiability_of_runs(logs, sources.rig, options.drive, fit=fit)
    now = present_of_card(sources.card, sources.rig, model.period)
    model = replace(
        model, bad_samples=sources.bad, controller=now, identifiability=gate.identifiability
    )
    posterior_samples = _posterior_samples(sources, fit, seed, on_progress) if posterior else None
    if posterior_samples is not None:
        model = replace(model, posterior=_posterior(posterior_samples, fit))
    remarks = (
        *looks_like_velocity(logs, sources.rig, model), *braked_by_its_voltage(logs, sources.rig),
        *surrounding_lines(fit.surroundings, sources.rig),
        *unequal_friction(model.friction, model.effects),
        *sources.remarks, *model_remarks(model), *broken_promises(model),
    )  # fmt: skip
    return Identified(model, fit, sources.runs, remarks, posterior_samples)


def broken_promises(model: Model) -> tuple[str, ...]:
    """A line where intervals are far wider than the logs promised before the fit."""
    wider, known = [], {**model.friction, **(model.actuator or {})}
    for one in model.identifiability:
        found = known.get(one.name)
        if not found or one.within is None or not found.value or found.sd is None:
            continue
        half = NORMAL_95 * found.sd / abs(found.value)
        if half > BROKEN * one.within:
            wider.append(f"{one.name} {100 * half:.2g} % ({100 * one.within:.2g} %)")
    if not wider:
        return ()
    why = "a stop is lost" if model.fit.adequate else "the model lacks an effect"
    return (
        f"intervals are wider than predicted from the logs (in brackets): {', '.join(wider)};"
        f" {why}, or their noise is not the sensors' alone",
    )


def _posterior_samples(
    sources: Sources, fit: KarnoppFit, seed: int, on_progress: Progress
) -> "Posterior":
    from identification.estimation.posterior import sample_posterior

    around = fit.surroundings
    return sample_posterior(
        replace(fit, effects=() if not around.none else fit.effects),
        [around.taken_out(source.log) for source in sources.runs],
        np.random.default_rng(seed),
        rig=sources.rig,
        on_progress=lambda share: on_progress("posterior", share),
    )


def _posterior(found: "Posterior", fit: KarnoppFit) -> dict[str, Any]:
    """What the ensembles found, as model.json holds it: no intervals unless they agree."""
    units = {name: fit.estimates[name].unit for name in found.names}
    estimates = {name: Estimate(None, unit, reason=found.verdict) for name, unit in units.items()}
    spread = dict(zip(found.names, np.std(found.samples, axis=0).tolist(), strict=True))
    bounds = {n: (-np.inf, 0.0) if n in NEGATIVE else (0.0, np.inf) for n in fit.estimates}
    for acting in fit.effects:
        bounds |= {f"{acting.key}.{p.name}": (p.low, p.high) for p in acting.effect.params}
    for name, (low, median, high) in found.interval().items():
        estimates[name] = reported_estimate(
            median, units[name], spread[name], interval=(low, high), bounds=bounds[name]
        )
    return {
        "converged": found.converged,
        "verdict": found.verdict,
        "likelihood": found.way,
        "ensembles": found.ensembles,
        "walkers": found.walkers,
        "steps": found.steps,
        "evaluations": found.evaluations,
        "acceptance": found.acceptance,
        "r_hat": dict(found.r_hat),
        "ess": dict(found.ess),
        "parameters": plain(estimates),
    }
