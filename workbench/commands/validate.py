"""`workbench validate`: a design on its model in simulation -> validation.json and report.html."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from workbench import options
from workbench.ending import StatusCommand
from workbench.output import JSON_OPTION, OUT_OPTION, progress, results
from workbench.signature import argument, by_signature, option

if TYPE_CHECKING:
    from workbench.steps.loop_figures import Limits


@click.command(
    cls=StatusCommand,
    refusal="the recommended controller does not meet the limits on every plant",
    epilog="Example: workbench validate runs/.../model.json runs/.../design.json",
)
@by_signature
def command(
    model_file: Path = options.MODEL_ARGUMENT,
    design_file: Path = argument("DESIGN"),
    plant_file: Path | None = option(
        "Another machine on which the design has to work too.", "--plant", metavar="MODEL"
    ),
    modulus: float = options.MODULUS_OPTION,
    delay: float = options.DELAY_OPTION,
    standstill: float = options.STANDSTILL_OPTION,
    tracking: float = options.TRACKING_OPTION,
    overshoot: float = options.OVERSHOOT_OPTION,
    force: float = options.FORCE_OPTION,
    seed: int = options.SEED_OPTION,
    card: str | None = options.PRESENT_CARD_OPTION,
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
    as_json: bool = JSON_OPTION,
    out: Path | None = OUT_OPTION,
) -> int:
    """Check a design on a plant in simulation: margins, steps, a smooth reference, limit cycles.

    Tested too: overshoot, largest force, and whether the command reaches the card's limit.

    Writes validation.json and report.html.
    """
    import numpy as np

    from workbench.cards.own_effects import library
    from workbench.documents.design_file import read_design
    from workbench.documents.model_file import read_model
    from workbench.documents.velocity import is_velocity_model
    from workbench.report.next_steps import after_validate
    from workbench.report.reports import validation_view
    from workbench.report.view import show
    from workbench.steps.loop_figures import Limits
    from workbench.steps.present import with_card
    from workbench.steps.validate import validate

    if is_velocity_model(model_file):
        options.refuse_for_velocity("force", "card", "effects")
        limits = Limits(modulus, delay, standstill, tracking, overshoot, force)
        return _velocity((model_file, design_file, plant_file), limits, seed, as_json, out)
    known = library(effects)
    model, found = with_card(read_model(model_file, known), card), read_design(design_file)
    plant = read_model(plant_file, known) if plant_file else None
    limits = Limits(modulus, delay, standstill, tracking, overshoot, force)
    with results("validate", out) as folder:
        with progress("simulating the loop", as_json=as_json):
            rng = np.random.default_rng(seed)
            result, traces = validate(model, found, rng, plant=plant, limits=limits)
        view = validation_view(result, traces, model.rotary)
        view.write(folder)
    then = after_validate(result, found, model, model_file, plant_file, card)
    show(view, folder.final, as_json, then)
    return 0 if result.passed else 1


def _velocity(
    files: tuple[Path, Path, Path | None], limits: "Limits", seed: int, as_json: bool,
    out: Path | None,
) -> int:  # fmt: skip
    """The same of a rig whose velocity follows the command; files: model, design, plant."""
    import numpy as np

    from workbench.documents.velocity import read_velocity_design, read_velocity_model
    from workbench.report.velocity import after_velocity_validation, velocity_view
    from workbench.report.view import show
    from workbench.steps.velocity_loop import validate_velocity

    model, design = read_velocity_model(files[0]), read_velocity_design(files[1])
    plant = read_velocity_model(files[2]) if files[2] else None
    with results("validate", out) as folder:
        with progress("simulating the loop", as_json=as_json):
            rng = np.random.default_rng(seed)
            found = validate_velocity(model, design, rng, limits, plant)
        view = velocity_view(found)
        view.write(folder)
    show(view, folder.final, as_json, after_velocity_validation(found, files[0]))
    return 0 if found.passed else 1
