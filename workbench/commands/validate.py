"""`workbench validate`: a design on its model in simulation -> validation.json and report.html."""

from pathlib import Path

from design.asked import Limits
from workbench import options
from workbench.output import results
from workbench.signature import argument, option
from workbench.steps.asked import LIMIT_OPTIONS


@options.command(
    refusal="the recommended controller does not meet the limits on every plant",
    epilog="Example: workbench validate runs/.../model.json runs/.../design.json",
)
def command(
    limits: Limits = LIMIT_OPTIONS,
    model_file: Path = options.MODEL_ARGUMENT,
    design_file: Path = argument("DESIGN"),
    plant_file: Path | None = option(
        "Another machine on which the design has to work too.", "--plant", metavar="MODEL"
    ),
    seed: int = options.SEED_OPTION,
    card: str | None = options.PRESENT_CARD_OPTION,
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
    out: Path | None = options.OUT_OPTION,
) -> int:
    """Check a design on a plant in simulation: margins, steps, a smooth reference, limit cycles.

    Tested too: overshoot, largest force, and whether the command reaches the card's limit.

    Writes validation.json and report.html.
    """
    from workbench.documents.result_files import read_design
    from workbench.documents.velocity import is_velocity_model
    from workbench.interface.loops import validate
    from workbench.interface.models import load_model
    from workbench.report.next_steps import after_validate, as_code
    from workbench.steps.present import with_card

    if is_velocity_model(model_file):
        options.refuse_for_velocity("force", "card", "effects")
        return _velocity((model_file, design_file, plant_file), limits, seed, out)
    model = with_card(load_model(model_file, effects), card)
    design = read_design(design_file)
    plant = load_model(plant_file, effects) if plant_file else None
    with results("validate", out) as folder:
        found = validate(model, design, plant=plant, limits=limits, seed=seed)
        found.view.write(folder)
    then = after_validate(found.found, design, model, model_file, plant_file, card)
    found.view.show(folder.final, then or as_code(design_file))
    return 0 if found.passed else 1


def _velocity(
    files: tuple[Path, Path, Path | None], limits: Limits, seed: int, out: Path | None
) -> int:
    """The same of a rig whose velocity follows the command; files: model, design, plant."""
    import numpy as np

    from design.controllers.velocity_loop import validate_velocity
    from workbench.course import working
    from workbench.documents.velocity import read_velocity_design, read_velocity_model
    from workbench.report.velocity import after_velocity_validation
    from workbench.report.view import view

    model, design = read_velocity_model(files[0]), read_velocity_design(files[1])
    plant = read_velocity_model(files[2]) if files[2] else None
    with results("validate", out) as folder:
        with working("simulating the loop"):
            rng = np.random.default_rng(seed)
            found = validate_velocity(model, design, rng, limits, plant)
        shown = view(found)
        shown.write(folder)
    shown.show(folder.final, after_velocity_validation(found, files[0]))
    return 0 if found.passed else 1
