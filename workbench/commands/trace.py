"""`workbench trace`: logs and held-out logs -> trace.json, model.json and report.html."""

from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path

import click

from workbench.options import card_option, effects_option
from workbench.output import OutputFolder, emit, output_options, progress

TRACE_STAGES = {"tracing": (0.0, 0.6), "refitting": (0.6, 0.9), "judging": (0.9, 1.0)}


@click.command(
    epilog="Example: workbench trace day1.csv day2.csv --test day3.csv --card bench-a/card.toml"
)
@click.argument("logs", nargs=-1, metavar="[LOG...]")
@click.option(
    "--test",
    "tests",
    multiple=True,
    metavar="LOG",
    help="Held-out log, which neither fit nor choice sees; may be given several times.",
)
@card_option
@effects_option
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@output_options
def command(
    logs: tuple[str, ...],
    tests: tuple[str, ...],
    card: str,
    effects: tuple[Path, ...],
    seed: int,
    as_json: bool,
    out: Path | None,
) -> None:
    """Find the physical effect that the model of a machine lacks, and what it is worth.

    Writes trace.json (verdict, errors before and after, effects, rivals), model.json with the
    effects in it, and report.html. Without --test, stretches of the logs are left out in turn;
    without LOG, the card's [split] names the logs of both kinds. Exit status 0 whatever the
    verdict.
    """
    from workbench.cards.own_effects import library
    from workbench.documents.model import model_document
    from workbench.logs.sources import read_sources
    from workbench.report.trace import trace_report
    from workbench.report.trace_tables import trace_view
    from workbench.steps.trace import named_logs, trace_document, trace_sources

    known = library(effects)
    with OutputFolder("trace", out, now=datetime.now()) as folder:
        with progress("tracing", 1.0, as_json=as_json) as advance:
            names, held_out = named_logs(logs, tests, card)
            train = read_sources(names, card)
            test = read_sources(held_out, card) if held_out else None
            found = trace_sources(train, test, known, seed, staged(advance, TRACE_STAGES))
        document = trace_document(found)
        folder.write_json("trace.json", document)
        folder.write_json("model.json", model_document(found.model))
        folder.write_text("report.html", trace_report(found))
    emit({**document, "out": folder.final}, as_json, lambda: trace_view(found, folder.final))


def staged(
    advance: Callable[[float], None], stages: Mapping[str, tuple[float, float]]
) -> Callable[[str, float], None]:
    """Progress by stages as steps of one bar that only moves forward."""
    reached = 0.0

    def report(stage: str, share: float) -> None:
        nonlocal reached
        low, high = stages.get(stage, (0.0, 1.0))
        place = low + (high - low) * min(max(share, 0.0), 1.0)
        if place > reached:
            advance(place - reached)
            reached = place

    return report
