"""Selection and refinement: effects that the equations call for, and that the run confirms."""

from dataclasses import replace

import numpy as np

from identification.estimation.fit import finished
from identification.estimation.latent_force import latent_forces
from identification.estimation.prediction_error import significant
from identification.estimation.regressed_plant import regressed_plant
from identification.estimation.regression.equation_rows import FIVE
from identification.estimation.run_or_equation import by_equation_if_surer
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.parameters import plant_with, values_of
from identification.estimation.windowed_run.run_errors import misfit
from identification.model.plant import Plant
from identification.progress import Progress
from identification.thresholds import ADEQUATE
from identification.tracing.free_run.backward_elimination import (
    Setting,
    fewest,
    suffices,
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
    return judged_forward(choice, model, setting, report)


def likelier_plain(plain: PlainModel, slowest: float) -> FittedStructure:
    """The plain model as effects are tested against it: with mass and sliding friction as the
    equations identify them, where the position measured while sliding is significantly likelier so
    than as its run has them, so that what this bent is not laid to an effect.

    By the likelihood ratio, Wilks, Ann. Math. Stat. 9 (1938) 60, under a latent force
    (`latent_force`, (1)).
    """
    model, recorded = plain.model, plain.rows.recorded
    if model.prescribed:
        return model
    found = regressed_plant(plain.start, plain.first, (), recorded)
    names = [name for name in (*FIVE, "k1", "k2") if name in found.prior]
    plant = plant_with(model.plant, names, values_of(found.plant, names))
    by_run, by_rows = (
        latent_forces(one, recorded.logs, slowest).log_likelihood for one in (model.plant, plant)
    )
    likelier = significant(2.0 * (by_rows - by_run), len(FIVE))
    return replace(model, plant=plant) if likelier else model


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
    elif fit.prescribed and not model.prescribed and model.misfit > ADEQUATE:
        # The equation answers: what a run that is not followed has made of friction is nobody's.
        model = replace(model, plant=Plant(fit.friction, model.plant.actuator))
    return replace(plain, model=model)
