"""`workbench experiment`: a model -> the run to make next, as CSV, JSON and a page."""

from dataclasses import dataclass
from pathlib import Path

import click

from workbench import options
from workbench.course import running
from workbench.ending import StatusCommand
from workbench.output import JSON_OPTION, OUT_OPTION, results
from workbench.signature import by_fields, option

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
    as_json: bool = JSON_OPTION
    out: Path | None = OUT_OPTION


@click.command(
    cls=StatusCommand,
    refusal="a simulated machine, drawn from the model's uncertainty, exceeds a limit",
    epilog="Example: workbench experiment runs/.../model.json --stroke -0.1 0.1 --time 20",
)
@by_fields(ExperimentOptions)
def command(given: ExperimentOptions) -> int:
    """Find the run to make next: the reference, within the machine's limits, that is most
    informative.

    Writes reference.csv (t, r at the controller's rate), experiment.json with what it promises, and
    report.html. The run begins with the machine at rest at the first r.
    """
    from workbench.cards.own_effects import library
    from workbench.documents.design_file import read_design
    from workbench.documents.model_file import read_model
    from workbench.report.experiment import experiment_view
    from workbench.report.next_steps import after_experiment
    from workbench.report.view import show
    from workbench.steps.experiment.plan import EXPERIMENT_STAGES, experiment
    from workbench.steps.experiment.planned import Wanted, read_rivals
    from workbench.steps.present import with_card

    known, model_file = library(given.effects), given.model_file
    model = with_card(read_model(model_file, known), given.card)
    design = read_design(given.design_file) if given.design_file else None
    parts = (given.parameters or "").split(",")
    names = tuple(name.strip() for name in parts if name.strip())
    rivals = read_rivals(given.trace_file, model, known) if given.trace_file else ()
    wanted = Wanted(
        names, given.stroke, given.speed, given.force, given.limit, given.seconds, given.seed,
        rivals,
    )  # fmt: skip
    as_json, budget = given.as_json, given.budget
    with results("experiment", given.out) as folder:
        with running("experiment", EXPERIMENT_STAGES, as_json=as_json, budget=budget) as course:
            found = experiment(model, wanted, design, course.report, course.keep_going)
        view = experiment_view(found)
        view.write(folder)
    then = after_experiment(found, model_file, given.design_file)
    show(view, folder.final, as_json, then)
    return 0 if then is None else 1
