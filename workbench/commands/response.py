"""`workbench response`: logs -> frequency responses, resonances, margins of the open loop."""

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from workbench import options
from workbench.course import running
from workbench.ending import StatusCommand
from workbench.output import JSON_OPTION, OUT_OPTION, progress, results
from workbench.signature import by_signature, option
from workbench.steps.stages import IDENTIFY_STAGES

if TYPE_CHECKING:
    from workbench.documents.model import Model
    from workbench.logs.sources import Sources


@click.command(
    cls=StatusCommand,
    refusal="the logs show the machine at no frequency",
    epilog="Example: workbench response run1.csv run2.csv --card bench-a --model model.json",
)
@by_signature
def command(
    logs: tuple[str, ...] = options.LOGS_ARGUMENT,
    card: str = options.CARD_OPTION,
    model_file: Path | None = option(
        "model.json whose friction is subtracted.  [default: identified from the logs]",
        "--model", metavar="MODEL",
    ),
    friction_left_in: bool = option("Subtract nothing from the force."),
    lowest: float | None = option(
        "Lowest frequency wanted: the lower, the fewer averages.  [default: by the logs' length]",
        type=options.POSITIVE, metavar="HZ",
    ),
    budget: float = options.BUDGET_OPTION,
    seed: int = options.SEED_OPTION,
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
    as_json: bool = JSON_OPTION,
    out: Path | None = OUT_OPTION,
) -> None:  # fmt: skip
    """Show a machine over frequency: plant, controller and open loop, resonances, margins.

    Friction and whatever else of the model is not linear is taken off the force first, and the
    reference is the instrument, so that noise in the loop does not bend the curves. Where the logs
    do not reach, nothing is drawn. Writes response.json, response.csv (the curves with their 95 %
    bands and coherence) and report.html (Bode).
    """
    begun = time.monotonic()
    from workbench.cards.own_effects import library
    from workbench.documents.model_file import read_model
    from workbench.logs.sources import read_sources
    from workbench.report.next_steps import check_of_refused
    from workbench.report.response import response_view
    from workbench.report.view import show
    from workbench.steps.response import respond

    known = None if model_file is None else read_model(model_file, library(effects))
    left_in = "asked for" if friction_left_in else None
    with results("response", out, check_of_refused(logs, card)) as folder:
        sources = read_sources(logs, card)
        if known is None and left_in is None:
            left = budget - (time.monotonic() - begun)
            known, left_in = _identified(sources, seed, left, as_json)
        with progress("averaging spectra", as_json=as_json):
            found = respond(
                sources.runs, sources.rig, sources.card.name, known, lowest, left_in=left_in,
                read=sources.remarks,
            )  # fmt: skip
        view = response_view(found)
        view.write(folder)
    show(view, folder.final, as_json)


def _identified(
    sources: "Sources", seed: int, budget: float, as_json: bool
) -> "tuple[Model | None, str | None]":
    """The model that the logs themselves give, or None and why they give none."""
    from workbench.steps.response import identified_or_not

    with running("identifying", IDENTIFY_STAGES, as_json=as_json, budget=budget) as course:
        return identified_or_not(sources, seed, course.report, course.keep_going)
