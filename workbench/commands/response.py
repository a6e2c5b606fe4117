"""`workbench response`: logs -> frequency responses, resonances, margins of the open loop."""

from pathlib import Path

from workbench import options
from workbench.output import results
from workbench.signature import option


@options.command(
    refusal="the logs show the machine at no frequency",
    epilog="Example: workbench response run1.csv run2.csv --card bench-a --model model.json",
)
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
    out: Path | None = options.OUT_OPTION,
) -> None:  # fmt: skip
    """Show a machine over frequency: plant, controller and open loop, resonances, margins.

    Friction and whatever else of the model is not linear is taken off the force first, and the
    reference is the instrument, so that noise in the loop does not bend the curves. Where the logs
    do not reach, nothing is drawn. Writes response.json, response.csv (the curves with their 95 %
    bands and coherence) and report.html (Bode).
    """
    from workbench.interface.logs import responded
    from workbench.interface.models import load_model
    from workbench.logs.sources import read_sources
    from workbench.report.next_steps import check_of_refused

    known = None if model_file is None else load_model(model_file, effects)
    left_in = "asked for" if friction_left_in else None
    with results("response", out, check_of_refused(logs, card)) as folder:
        found = responded(read_sources(logs, card), known, left_in, lowest, seed, budget)
        found.view.write(folder)
    found.view.show(folder.final)
