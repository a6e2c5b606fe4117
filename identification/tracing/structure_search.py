"""Selection and refinement: effects that the equations call for, and that the run confirms."""

from dataclasses import replace

import numpy as np

from identification.estimation.fit import finished
from identification.estimation.recorded_logs import RecordedLogs
from identification.estimation.regressed_plant import regressed_plant
from identification.estimation.regression.equation_rows import ACTUATOR, MECHANICAL
from identification.estimation.regression.held_command import share_between
from identification.estimation.regression.row_fit import mean_square
from identification.estimation.run_or_equation import by_equation_if_surer
from identification.estimation.structure_fit import FittedStructure
from identification.estimation.windowed_run.parameters import plant_with, values_of
from identification.estimation.windowed_run.run_errors import misfit
from identification.model.plant import Plant
from identification.progress import Progress
from identification.thresholds import ADEQUATE, ASTRAY, OF_ACCOUNT
from identification.tracing.free_run.backward_elimination import (
    Setting,
    equations_explained,
    fewest,
    suffices,
)
from identification.tracing.free_run.forward_selection import judged_forward
from identification.tracing.plain_model import PlainModel
from identification.tracing.regression.stepwise import Choice, choose

INTERVALS = "the last step of the plain model's fit, with its intervals"


def first_effect(
    plain: PlainModel, rng: np.random.Generator, report: Progress
) -> tuple[Setting, Choice]:
    """The effect that the equations call for first, and what trying it needs."""
    setting = Setting(plain, rng.spawn(1)[0])
    return setting, choose(plain.start, plain.first, plain.library, rng, report, most=1)


def selection(
    begun: Choice, setting: Setting, rng: np.random.Generator, report: Progress
) -> Choice:
    """The effects that the equations call for beside the first, one after the other."""
    if not begun.steps or suffices(begun, setting):
        return begun
    plain = setting.plain
    return choose(plain.start, plain.first, plain.library, rng, report, begun)


def share_beside(recorded: RecordedLogs, choice: Choice) -> float:
    """Share of the command's step to the next sample, that shows first beside the effects chosen.

    0 where the logs have it already, where no effect was chosen, and without a command.
    """
    base, logs = choice.base, choice.end.logs
    of = MECHANICAL if recorded.held else ACTUATOR
    if recorded.share != 0.0 or recorded.imposed or not choice.steps or of not in base:
        return 0.0
    if not (recorded.held or recorded.by_command):
        return 0.0
    return share_between(logs, base[of].rows, base[of].slowest)


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
    return choice, by_equations(choice, model, setting)


def by_equations(choice: Choice, model: FittedStructure, setting: Setting) -> FittedStructure:
    """The model with sliding friction and effects as the equations identify them, where these are
    explained, or all but, and the run is not followed, which would bend them and make them unsure.
    """
    if model.imposed or model.misfit <= ADEQUATE or not choice.steps:
        return model
    if not (equations_explained(choice.base) or all_but_explained(choice)):
        return model
    told = regressed_plant(choice.end, choice.base, choice.effects, setting.recorded)
    followed = model.misfit <= ASTRAY  # then whichever is surer
    names = [
        name
        for name, sd in told.prior.items()
        if name in model.sd and sd > 0.0 and not (followed and model.sd[name] < sd)
    ]
    plant = plant_with(model.plant, names, values_of(told.plant, names))
    return replace(model, plant=plant, sd={**model.sd, **{n: told.prior[n] for n in names}})


def all_but_explained(choice: Choice) -> bool:
    """Whether the effects leave next to nothing of what the plain equations lack beyond noise."""
    return all(
        mean_square(choice.base[e]) - 1.0 <= OF_ACCOUNT * (mean_square(choice.first[e]) - 1.0)
        for e in (MECHANICAL, ACTUATOR)
        if e in choice.base
    )


def settled_plain(plain: PlainModel, rng: np.random.Generator, report: Progress) -> PlainModel:
    """The plain model as the estimator gives it, where no effect was found.

    Its run is then that of the fit, if this is driven as the logs are judged.
    """
    recorded = plain.recorded
    asking = recorded.halt.asking(report)
    fit = recorded.halt.tried(INTERVALS, lambda: finished(plain.model, recorded, rng, asking), None)
    if fit is None:  # at least no worse than the equation of motion by itself
        with recorded.halt.closing():
            fit = by_equation_if_surer(plain.model.plant.friction, recorded)
    if fit is None:
        return plain
    model = replace(plain.model, fit=fit)
    if fit.drive == recorded.drive and not fit.imposed:
        plant = Plant(fit.friction, fit.actuator)
        with recorded.halt.closing():
            left = misfit(plant, recorded.logs, recorded.drive)
        model = replace(model, plant=plant, misfit=left)
    return replace(plain, model=model)
