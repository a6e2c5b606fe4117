"""`workbench experiment`: a model -> the run to make next, as CSV, JSON and a page."""

from pathlib import Path

from design.asked import Wanted
from workbench import options
from workbench.output import results
from workbench.signature import option
from workbench.steps.asked import EXPERIMENT_OPTIONS

SEARCH_SECONDS = 30.0


@options.command(
    refusal="no run stays within the limits on every machine drawn from the model's uncertainty, or"
    " none identifies anything",
    epilog="Example: workbench experiment runs/.../model.json --stroke -0.1 0.1 --time 20",
)
def command(
    wanted: Wanted = EXPERIMENT_OPTIONS,
    model_file: Path = options.MODEL_ARGUMENT,
    design_file: Path | None = option(
        "A design whose recommended controller moves the machine.  [default: its present one]",
        "--design", metavar="DESIGN",
    ),
    trace_file: Path | None = option(
        "trace.json whose rivals (or, of an unknown effect, all of the library) the run is to"
        " discriminate.",
        "--rivals", metavar="TRACE",
    ),
    budget: float = option(
        "End the search after so long with the best so far; the first Ctrl-C does the same.",
        type=options.POSITIVE, default=SEARCH_SECONDS, metavar="SECONDS",
    ),
    card: str | None = options.PRESENT_CARD_OPTION,
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
    out: Path | None = options.OUT_OPTION,
) -> None:  # fmt: skip
    """Find the run to make next: the reference, within the machine's limits, that is most
    informative.

    Writes reference.csv (t, r at the controller's rate), experiment.json with what it promises, and
    report.html. The run begins with the machine at rest at the first r.
    """
    from workbench.interface.loops import experiment
    from workbench.interface.models import load_model
    from workbench.steps.present import with_card

    model = with_card(load_model(model_file, effects), card)
    with results("experiment", out) as folder:
        found = experiment(
            model, design=design_file, wanted=wanted, rivals=trace_file, budget=budget
        )
        found.view.write(folder)
    found.view.show(folder.final)
