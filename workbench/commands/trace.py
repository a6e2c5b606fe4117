"""`workbench trace`: logs and held-out logs -> trace.json, model.json and report.html."""

import time
from pathlib import Path

import click

from workbench import options
from workbench.course import Course, watched
from workbench.ending import StatusCommand
from workbench.output import JSON_OPTION, OUT_OPTION, progress, results
from workbench.signature import argument, by_signature, option
from workbench.steps.stages import TRACE_STAGES


@click.command(
    cls=StatusCommand,
    done="done, whatever the verdict",
    refusal="too little slides",
    epilog="Example: workbench trace day1.csv day2.csv --test day3.csv --card bench-a/card.toml",
)
@by_signature
def command(
    logs: tuple[str, ...] = argument("[LOG...]", shell_complete=options.complete_file),
    tests: tuple[str, ...] = option(
        "Held-out log, used by neither fit nor model selection; may be given several times.",
        "--test", metavar="LOG", shell_complete=options.complete_file,
    ),
    card: str = options.CARD_OPTION,
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
    budget: float = options.BUDGET_OPTION,
    seed: int = options.SEED_OPTION,
    as_json: bool = JSON_OPTION,
    out: Path | None = OUT_OPTION,
) -> None:  # fmt: skip
    """Find the physical effect that the model of a machine lacks, and what it is worth.

    Writes trace.json (verdict, errors before and after, effects, rivals), model.json with the
    effects in it, and report.html. Without --test, stretches of the logs are left out in turn;
    without LOG, the card's [split] names the logs of both kinds. Ended by --budget or Ctrl-C, it
    says what was not tried.
    """
    begun = time.monotonic()
    from workbench.cards.own_effects import library
    from workbench.logs.sources import card_of_velocity, read_sources
    from workbench.report.next_steps import check_of_refused
    from workbench.report.trace import traced_view
    from workbench.report.view import show
    from workbench.steps.trace import named_logs, trace_sources

    velocity = card_of_velocity(card)
    if velocity:
        from workbench.report.velocity import velocity_view
        from workbench.steps.velocity import trace_velocity

        options.refuse_for_velocity("effects", "seed")
    known = library(effects)
    with results("trace", out, check_of_refused([*logs, *tests], card)) as folder:
        with progress("trace", 1.0, as_json=as_json) as bar:
            names, held_out = named_logs(logs, tests, card)
            train = read_sources(names, card, velocity=velocity)
            test = read_sources(held_out, card, velocity=velocity) if held_out else None
            left = budget - (time.monotonic() - begun)
            course = Course(bar, TRACE_STAGES, time.monotonic, left, bar.describe)
            going = course.keep_going
            with watched(course):
                view = (
                    velocity_view(trace_velocity(train, test, keep_going=going))
                    if velocity
                    else traced_view(
                        trace_sources(train, test, known, seed, course.report, keep_going=going)
                    )
                )
        view.write(folder)
    show(view, folder.final, as_json)
