"""The posterior of a model's parameters, sampled around its fit, and as model.json holds it."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from design.machine.plain import plain
from design.machine.source import MachineLogs
from identification.estimation.estimates import reported_estimate
from identification.model.estimates import Estimate, KarnoppFit
from identification.model.karnopp import NEGATIVE
from identification.progress import Progress

if TYPE_CHECKING:
    from identification.estimation.posterior import Posterior


def posterior_of(
    logs: MachineLogs, fit: KarnoppFit, seed: int, on_progress: Progress
) -> "Posterior":
    """The posterior sampled around the fit of the logs."""
    from identification.estimation.posterior import sample_posterior

    around = fit.surroundings
    return sample_posterior(
        replace(fit, effects=() if not around.none else fit.effects),
        [around.taken_out(log) for log in logs.logs],
        np.random.default_rng(seed),
        rig=logs.rig,
        on_progress=lambda share: on_progress("posterior", share),
    )


def posterior_document(found: "Posterior", fit: KarnoppFit) -> dict[str, Any]:
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
