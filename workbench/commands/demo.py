"""`workbench demo`: the whole chain on a shipped recipe, and one folder with all its results."""

from pathlib import Path

import click

from workbench import options
from workbench.course import running
from workbench.output import emit, results
from workbench.signature import option
from workbench.steps.asked import TRACE_STAGES

RECIPE = "demo"
DEMO_STAGES = {stage: (0.85 * a, 0.85 * b) for stage, (a, b) in TRACE_STAGES.items()}
DEMO_STAGES["designing"] = (0.85, 1.0)


@options.command(
    refusal="the effect is not found, or the recommended controller does not meet the limits",
    epilog="Example: workbench demo --out demo",
)
def command(
    seed: int = option(
        "Of the search and the simulated check; the log is of the recipe's own seed.",
        type=click.IntRange(min=0), default=0,
    ),
    out: Path | None = options.OUT_OPTION,
) -> int:  # fmt: skip
    """Run the whole chain on a shipped recipe and write a report.

    Simulates two runs of the paper's rig (table 2) with an effect that is declared nowhere but in
    the truth file, finds that effect from one log, tests it on the other, designs PID and RST on
    the model found, and checks them in simulation.
    """
    from workbench.cards.card import load_card
    from workbench.logs.sources import card_path
    from workbench.report.next_steps import after_demo
    from workbench.report.validation import demo_screen, missed
    from workbench.report.view import view
    from workbench.steps.demo import demonstrate
    from workbench.steps.kernels_ahead import fits_compiled_ahead

    card = load_card(card_path(RECIPE))
    with results("demo", out) as folder:
        with running("demo", DEMO_STAGES) as course, fits_compiled_ahead():
            found = demonstrate(card, folder.path, seed, course.report)
        traced, validation = found.traced, found.validation
        view(traced).write(folder)
        view(found.design).write(folder, "design.html")
        view(validation, found.traces, traced.model.display).write(folder, "validation.html")
    result = {
        "recipe": RECIPE,
        "seed": seed,
        "verdict": traced.trace.verdict,
        "effects": [e.effect.key for e in traced.trace.effects],
        "worst_error": found.worst_error,
        "recommended": found.design.recommended,
        "passed": validation.passed,
        "reason": missed(validation),
        "out": folder.final,
    }
    then = after_demo(found, folder.final, seed)
    emit(result, lambda: demo_screen(found, folder.final), then)
    return 0 if then is None else 1
