"""`workbench identify`: logs -> model.json and report.html."""

import time
from pathlib import Path
from typing import Literal

import click

from workbench import options
from workbench.course import Course, watched
from workbench.ending import StatusCommand
from workbench.output import JSON_OPTION, OUT_OPTION, progress, results
from workbench.signature import by_signature, option
from workbench.steps.stages import IDENTIFY_STAGES


@click.command(
    cls=StatusCommand,
    refusal="nothing is identifiable from the logs",
    epilog="Example: workbench identify run1.csv run2.csv --card bench-a/card.toml",
)
@by_signature
def command(
    logs: tuple[str, ...] = options.LOGS_ARGUMENT,
    card: str = options.CARD_OPTION,
    drive: Literal["force", "command"] | None = option(
        "What drives the fitted run.  [default: the command where it explains the force]"
    ),
    orders: str | None = option(
        "Orders of the ARX plant.  [default: chosen]", metavar="NA,NB,NK"
    ),
    design_period: float | None = option(
        "Sampling period of the ARX plant [s].  [default: 0.01, or the log's if longer]",
        type=options.POSITIVE, metavar="S",
    ),
    budget: float = options.BUDGET_OPTION,
    posterior: bool = option("Sample the posterior of the parameters too."),
    seed: int = options.SEED_OPTION,
    as_json: bool = JSON_OPTION,
    out: Path | None = OUT_OPTION,
) -> None:  # fmt: skip
    """Find friction, plant and actuator of a machine from its logs.

    Writes model.json (every parameter with its 95 % interval, or why it is not identifiable)
    and report.html. LOG is a path, or a file name of the card's set.
    """
    begun = time.monotonic()
    from workbench.logs.sources import card_of_velocity, read_sources
    from workbench.report.next_steps import after_identify, check_of_refused
    from workbench.report.reports import identified_view
    from workbench.report.view import show
    from workbench.steps.identify import Options
    from workbench.steps.identify_sources import identify_sources

    velocity = card_of_velocity(card)
    if velocity:
        from workbench.report.velocity import after_velocity, velocity_view
        from workbench.steps.velocity import identify_velocity

        options.refuse_for_velocity("drive", "orders", "design_period", "posterior", "seed")
    wanted = Options(drive=drive, orders=options.parse_orders(orders), design_period=design_period)
    with results("identify", out, check_of_refused(logs, card)) as folder:
        with progress("identifying", 1.0, as_json=as_json) as bar:
            sources = read_sources(logs, card, velocity=velocity)
            _refuse_force_of_motor(drive, sources.rig.kind)
            left = budget - (time.monotonic() - begun)
            course = Course(bar, IDENTIFY_STAGES, time.monotonic, left, bar.describe)
            with watched(course):
                if velocity:
                    valve = identify_velocity(sources, keep_going=course.keep_going)
                else:
                    found = identify_sources(
                        sources, wanted, seed, posterior=posterior, on_progress=course.report,
                        keep_going=course.keep_going,
                    )  # fmt: skip
        view = velocity_view(valve) if velocity else identified_view(found)
        view.write(folder)
    if velocity:
        show(view, folder.final, as_json, after_velocity(valve, logs, card, folder.final))
    else:
        then = after_identify(found.model, logs, card, folder.final)
        show(view, folder.final, as_json, then, remarks=found.remarks)


def _refuse_force_of_motor(drive: str | None, kind: str) -> None:
    if drive == "force" and kind == "motor":
        raise click.UsageError(
            "--drive force: the rig is a motor, whose force is its command times a constant; leave"
            " --drive out."
        )
