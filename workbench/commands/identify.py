"""`workbench identify`: logs -> model.json and report.html."""

from pathlib import Path

import click

from design.asked import Options
from workbench import options
from workbench.course import running
from workbench.output import results
from workbench.signature import option
from workbench.steps.asked import FIT_OPTIONS, IDENTIFY_STAGES


@options.command(
    refusal="none of the nine parameters is identifiable from the logs",
    epilog="Example: workbench identify run1.csv run2.csv --card bench-a/card.toml",
)
def command(
    wanted: Options = FIT_OPTIONS,
    logs: tuple[str, ...] = options.LOGS_ARGUMENT,
    card: str = options.CARD_OPTION,
    budget: float = options.BUDGET_OPTION,
    posterior: bool = option("Sample the posterior of the parameters too."),
    seed: int = options.SEED_OPTION,
    out: Path | None = options.OUT_OPTION,
) -> int:  # fmt: skip
    """Find friction, plant and actuator of a machine from its logs.

    Writes model.json (every parameter with its 95 % interval, or why it is not identifiable)
    and report.html. LOG is a path, or a file name of the card's set.
    """
    from workbench.interface.models import identify
    from workbench.logs.sources import card_of_velocity
    from workbench.report.next_steps import after_identify, check_of_refused

    if card_of_velocity(card):
        options.refuse_for_velocity("drive", "orders", "design_period", "posterior", "seed")
        _velocity(logs, card, budget, out)
        return 0
    if wanted.drive == "force":
        _refuse_force_of_motor(card)
    with results("identify", out, check_of_refused(logs, card)) as folder:
        found = identify(logs, card, options=wanted, posterior=posterior, budget=budget, seed=seed)
        found.view.write(folder)
    then = after_identify(found.model, logs, card, folder.final)
    found.view.show(folder.final, then, remarks=found.found.remarks)
    return 0 if found.model.identifies_friction else 1


def _velocity(logs: tuple[str, ...], card: str, budget: float, out: Path | None) -> None:
    """The same of a rig whose velocity follows the command."""
    from design.identified.velocity import identify_velocity
    from workbench.logs.sources import read_sources
    from workbench.report.next_steps import check_of_refused
    from workbench.report.velocity import after_velocity
    from workbench.report.view import view

    with results("identify", out, check_of_refused(logs, card)) as folder:
        sources = read_sources(logs, card, velocity=True)
        with running("identifying", IDENTIFY_STAGES, budget) as course:
            valve = identify_velocity(sources.logs, keep_going=course.keep_going)
        shown = view(valve)
        shown.write(folder)
    shown.show(folder.final, after_velocity(valve, logs, card, folder.final))


def _refuse_force_of_motor(card: str) -> None:
    from workbench.interface.inputs import read_card

    if read_card(card).rig().kind == "motor":
        raise click.UsageError(
            "--drive force: the rig is a motor, whose force is its command times a constant; leave"
            " --drive out."
        )
