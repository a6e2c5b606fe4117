"""`workbench demo`: the whole chain on a shipped recipe, and one folder with all its results."""

from datetime import datetime
from pathlib import Path

import click

from workbench.commands.identify import staged
from workbench.output import OutputFolder, emit, output_options, progress

RECIPE = "paper_table2"


@click.command(epilog="Example: workbench demo --out demo")
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True,
    help="Of the search and the simulated check; the log is of the recipe's own seed.",
)  # fmt: skip
@output_options
def command(seed: int, as_json: bool, out: Path | None) -> int:
    """Run the whole chain on a shipped recipe and write a report.

    Simulates the paper's rig (table 2) in its PID loop, identifies it from that log alone, designs
    PID and RST, checks them in simulation. Tracing a residual to its effect is not part of it yet.
    Exit status 1: the recommended controller does not keep the limits.
    """
    from workbench.card import load_card
    from workbench.demonstration import demo_view, demonstrate
    from workbench.design_values import design_document
    from workbench.fetch import card_path
    from workbench.model import model_document
    from workbench.report.reports import design_report, identification_report, validation_report
    from workbench.validating import validation_document
    from workbench.validation_views import missed

    card = load_card(card_path(RECIPE))
    with OutputFolder("demo", out, now=datetime.now()) as folder:
        with progress("demo", 1.0, as_json=as_json) as advance:
            found = demonstrate(card, folder.path, seed, staged(advance))
        identified, validation = found.identified, found.validation
        folder.write_json("model.json", model_document(identified.model))
        folder.write_json("design.json", design_document(found.design))
        folder.write_json("validation.json", validation_document(validation))
        rotary = identified.model.rotary
        folder.write_text("identification.html", identification_report(identified))
        folder.write_text("design.html", design_report(found.design, rotary))
        folder.write_text("report.html", validation_report(validation, found.traces, rotary))
    result = {
        "recipe": RECIPE,
        "seed": seed,
        "worst_error": found.worst_error,
        "recommended": found.design.recommended,
        "passed": validation.passed,
        "reason": missed(validation),
        "out": folder.final,
    }
    emit(result, as_json, lambda: demo_view(found, folder.final))
    return 0 if validation.passed else 1
