"""Selection and refinement: effects that the equations call for, and that the run confirms."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from identification.effects._base import Effect
from identification.estimation.fit import finished
from identification.estimation.latent_force import LatentForces, latent_forces
from identification.estimation.prediction_error import prediction_error_fit, significant
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regressed_plant import regressed_plant
from identification.estimation.regression.effect_columns import Values
from identification.estimation.regression.effect_rows import EffectRows
from identification.estimation.regression.equation_rows import MECHANICAL
from identification.estimation.regression.row_fit import RowFit
from identification.estimation.run_or_equation import (
    LIKELIEST,
    by_equation_if_surer,
    shown_sliding,
)
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.parameters import plant_with, values_of
from identification.estimation.windowed_run.run_errors import misfit
from identification.model.plant import Plant
from identification.progress import Progress
from identification.tracing.free_run.backward_elimination import (
    Setting,
    fewest,
    suffices,
    with_band,
)
from identification.tracing.free_run.forward_selection import judged_forward
from identification.tracing.plain_model import PlainModel
from identification.tracing.regression.stepwise import Choice, choose

INTERVALS = "the last step of the plain model's fit, with its intervals"


def selection(
    plain: PlainModel, rng: np.random.Generator, report: Progress
) -> tuple[Setting, Choice]:
    """The effects that the equations call for, the first and others beside it one after the other,
    and what trying them needs."""
    setting = Setting(plain, rng.spawn(1)[0])
    first = choose(plain.start, plain.first, plain.library, rng, report, most=1)
    first = with_band(first, setting)
    if not first.steps or suffices(first, setting):
        return setting, first
    return setting, choose(plain.start, plain.first, plain.library, rng, report, first)


def refinement(
    choice: Choice, setting: Setting, report: Progress
) -> tuple[Choice, FittedStructure]:
    """The effects refined on the free run, without those that it does without, with those that
    only it shows; and the model."""
    model = setting.plain.model
    if choice.steps:
        choice, model = fewest(choice, setting)
    report("judging", 0.0)
    choice, model = judged_forward(choice, model, setting, report)
    return choice, likelier(choice, model, setting)


def likelier(choice: Choice, model: FittedStructure, setting: Setting) -> FittedStructure:
    """The model, with sliding friction and effects as they make what was measured while sliding
    likeliest, or as the equations identify them where more is missing, if that is significantly
    likelier than as the run has them.

    A run begins and ends its stops by the noise of a measured force, and is bent by those that it
    loses. By the likelihood ratio, Wilks, Ann. Math. Stat. 9 (1938) 60, of the position measured
    under a latent force (`latent_force`, (1)); prediction-error method, Ljung (1999), 7.2.
    """
    if model.prescribed or not choice.steps:
        return model
    slowest = choice.base[MECHANICAL].slowest
    model, names, bent, lacks = _by_equations(
        model, choice.end, choice.base, choice.effects, setting.recorded, slowest
    )
    drifts = any(one.has_random_walk(setting.drive) for one in setting.logs)
    if not (bent or drifts):
        return model
    best = setting.halt.tried(
        LIKELIEST,
        lambda: prediction_error_fit(model.plant, names, setting.logs, slowest, lacks),
        None,
    )
    if best is None or not best.is_known:
        return model
    if drifts and best.is_likelier:
        return replace(model, plant=best.plant, sd={**model.sd, **best.sd})
    if not bent:
        return model
    # The rows know deviations for given shapes alone.
    rows = {n: x for n, x in model.sd.items() if n not in _searched(model.plant)}
    own = {name: max(sd, rows.get(name, 0.0)) for name, sd in best.sd.items()}
    return replace(model, plant=best.plant, sd={**model.sd, **own})


def _by_equations(
    model: FittedStructure, stage: EffectRows, base: Mapping[str, RowFit],
    effects: Sequence[tuple[Effect, Values]], recorded: RecordedLogs, slowest: float,
) -> tuple[FittedStructure, list[str], bool, LatentForces]:  # fmt: skip
    """The model with sliding friction and effects as the equations identify them, if that is
    significantly likelier than as its run has them; the parameters of sliding that it identifies,
    whether it is, and what the model then lacks."""
    found = regressed_plant(stage, base, effects, recorded)
    known = {name for name, sd in found.prior.items() if name in model.sd and sd > 0.0}
    names = [name for name in shown_sliding(model.plant) if name in known]
    given = [*names, *(name for name in ("k1", "k2") if name in known)]
    plant = plant_with(model.plant, given, values_of(found.plant, given))
    lacks, other = (latent_forces(one, recorded.logs, slowest) for one in (model.plant, plant))
    if not significant(2.0 * (other.log_likelihood - lacks.log_likelihood), len(names)):
        return model, names, False, lacks
    sd = {**model.sd, **{n: found.prior[n] for n in given}}
    return replace(model, plant=plant, sd=sd), names, True, other


def likelier_plain(plain: PlainModel, slowest: float) -> FittedStructure:
    """The plain model as effects are tested against it: as its equations have it, where those
    are likelier than its run, so that what this bent is not laid to an effect. As `likelier`."""
    if plain.model.prescribed:
        return plain.model
    return _by_equations(plain.model, plain.start, plain.first, (), plain.rows.recorded, slowest)[0]


def _searched(plant: Plant) -> set[str]:
    """Names of effects' parameters that are shapes, found by a search, whose rows know none of
    their deviations."""
    return {
        f"{acting.key}.{p.name}"
        for acting in plant.effects
        for p in acting.effect.params
        if not p.linear and p.name != "asymmetry"
    }


def finished_plain(plain: PlainModel, rng: np.random.Generator, report: Progress) -> PlainModel:
    """The plain model as the estimator gives it, where no effect was found.

    Its run is then that of the fit, if this is driven as the logs are tested.
    """
    recorded = plain.recorded
    asking = recorded.halt.asking(report)
    fit = recorded.halt.tried(INTERVALS, lambda: finished(plain.model, recorded, rng, asking), None)
    if recorded.halt.reached():  # a fit that is halted in its last steps gives the best so far
        recorded.halt.left_out(INTERVALS)
    if fit is None:  # at least no worse than the equation of motion by itself
        with recorded.halt.closing():
            fit = by_equation_if_surer(plain.model.plant.friction, recorded)
    if fit is None:
        return plain
    model = replace(plain.model, fit=fit)
    if fit.drive == recorded.drive and not fit.prescribed:
        plant = Plant(fit.friction, fit.actuator)
        with recorded.halt.closing():
            left = misfit(plant, recorded.logs, recorded.drive)
        # Numbers of largest likelihood may lose a stop that the run itself has followed.
        left = min(left, fit.chi_square) if fit.adequate else left
        model = replace(model, plant=plant, misfit=left)
    return replace(plain, model=model)
