"""`workbench experiment`: a model -> the run to make next, as CSV, JSON and a page."""

from dataclasses import dataclass
from pathlib import Path

from workbench import options
from workbench.output import results
from workbench.signature import option

SEARCH_SECONDS = 30.0


@dataclass(frozen=True)
class ExperimentOptions:
    """What the command line says of an experiment."""

    model_file: Path = options.MODEL_ARGUMENT
    design_file: Path | None = option(
        "A design whose recommended controller moves the machine.  [default: its present one]",
        "--design", metavar="DESIGN",
    )  # fmt: skip
    parameters: str | None = option(
        "Parameters to be identified, as m,F_cp,dv_p.  [default: all]", metavar="NAME,..."
    )
    stroke: tuple[float, float] | None = option(
        "Positions between which it may move [m, rad].  [default: the card's, or the logs']",
        type=(options.Finite(), options.Finite()), metavar="LOW HIGH",
    )  # fmt: skip
    speed: float | None = option(
        "Largest speed [m/s, rad/s].  [default: 1.5 times the logs']", type=options.POSITIVE
    )
    force: float | None = option(
        "Largest force [N, N m].  [default: 1.2 times the logs']", type=options.POSITIVE
    )
    limit: float | None = option(
        "Largest command.  [default: any]", "--command", type=options.POSITIVE
    )
    seconds: float = option(
        "How long the run lasts [s].", "--time", type=options.Finite(min=2, max=600), default=20.0
    )
    trace_file: Path | None = option(
        "trace.json whose rivals (or, of an unknown effect, all of the library) the run is to"
        " discriminate.",
        "--rivals", metavar="TRACE",
    )  # fmt: skip
    budget: float = option(
        "End the search after so long with the best so far; the first Ctrl-C does the same.",
        type=options.POSITIVE, default=SEARCH_SECONDS, metavar="SECONDS",
    )  # fmt: skip
    seed: int = options.SEED_OPTION
    card: str | None = options.PRESENT_CARD_OPTION
    effects: tuple[Path, ...] = options.EFFECTS_OPTION
    out: Path | None = options.OUT_OPTION


@options.command(
    refusal="no run stays within the limits on every machine drawn from the model's uncertainty, or"
    " none identifies anything",
    epilog="Example: workbench experiment runs/.../model.json --stroke -0.1 0.1 --time 20",
)
def command(given: ExperimentOptions) -> int:
    """Find the run to make next: the reference, within the machine's limits, that is most
    informative.

    Writes reference.csv (t, r at the controller's rate), experiment.json with what it promises, and
    report.html. The run begins with the machine at rest at the first r.
    """
    from workbench.interface.loops import experiment
    from workbench.interface.models import load_model
    from workbench.report.view import show
    from workbench.steps.experiment.planned import Wanted
    from workbench.steps.present import with_card

    model = with_card(load_model(given.model_file, given.effects), given.card)
    parts = (given.parameters or "").split(",")
    wanted = Wanted(
        tuple(name.strip() for name in parts if name.strip()), given.stroke, given.speed,
        given.force, given.limit, given.seconds, given.seed,
    )  # fmt: skip
    with results("experiment", given.out) as folder:
        found = experiment(
            model, design=given.design_file, wanted=wanted, rivals=given.trace_file,
            budget=given.budget,
        )  # fmt: skip
        found.view.write(folder)
    show(found.view, folder.final)
    return 0
