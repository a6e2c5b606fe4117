"""`workbench experiment`: a model -> the run to make next, as CSV, JSON and a page."""

from pathlib import Path

import click

from workbench.course import running
from workbench.ending import StatusCommand
from workbench.options import POSITIVE, Finite, effects_option, present_card_option
from workbench.output import output_options, results

SEARCH_SECONDS = 30.0


@click.command(
    cls=StatusCommand,
    refusal="a simulated machine, drawn from the model's uncertainty, exceeds a limit",
    epilog="Example: workbench experiment runs/.../model.json --stroke -0.1 0.1 --time 20",
)
@click.argument("model_file", metavar="MODEL", type=click.Path(path_type=Path))
@click.option(
    "--design", "design_file", type=click.Path(path_type=Path), metavar="DESIGN",
    help="A design whose recommended controller moves the machine.  [default: its present one]",
)  # fmt: skip
@click.option(
    "--parameters", metavar="NAME,...",
    help="Parameters to be identified, as m,F_cp,dv_p.  [default: all]",
)  # fmt: skip
@click.option(
    "--stroke", type=(Finite(), Finite()), metavar="LOW HIGH",
    help="Positions between which it may move [m, rad].  [default: the card's, or the logs']",
)  # fmt: skip
@click.option(
    "--speed", type=POSITIVE, help="Largest speed [m/s, rad/s].  [default: 1.5 times the logs']"
)
@click.option(
    "--force", type=POSITIVE, help="Largest force [N, N m].  [default: 1.2 times the logs']"
)
@click.option("--command", "limit", type=POSITIVE, help="Largest command.  [default: any]")
@click.option(
    "--time", "seconds", type=Finite(min=2, max=600), default=20.0, show_default=True,
    help="How long the run lasts [s].",
)  # fmt: skip
@click.option(
    "--rivals", "trace_file", type=click.Path(path_type=Path), metavar="TRACE",
    help="trace.json whose rivals (or, of an unknown effect, all of the library) the run is to"
    " discriminate.",
)  # fmt: skip
@click.option(
    "--budget", type=POSITIVE, default=SEARCH_SECONDS, show_default=True, metavar="SECONDS",
    help="End the search after so long with the best so far; the first Ctrl-C does the same.",
)  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@present_card_option
@effects_option
@output_options
def command(
    model_file: Path,
    design_file: Path | None,
    parameters: str | None,
    stroke: tuple[float, float] | None,
    speed: float | None,
    force: float | None,
    limit: float | None,
    seconds: float,
    trace_file: Path | None,
    budget: float,
    seed: int,
    card: str | None,
    effects: tuple[Path, ...],
    as_json: bool,
    out: Path | None,
) -> int:
    """Find the run to make next: the reference, within the machine's limits, that is most
    informative.

    Writes reference.csv (t, r at the controller's rate), experiment.json with what it promises, and
    report.html. The run begins with the machine at rest at the first r.
    """
    from workbench.cards.own_effects import library
    from workbench.documents.design_read import read_design
    from workbench.documents.model_file import read_model
    from workbench.report.experiment import experiment_view
    from workbench.report.next_steps import after_experiment
    from workbench.report.view import show
    from workbench.steps.experiment.plan import EXPERIMENT_STAGES, experiment
    from workbench.steps.experiment.planned import Wanted
    from workbench.steps.experiment.rivals import read_rivals
    from workbench.steps.present import with_card

    known = library(effects)
    model = with_card(read_model(model_file, known), card)
    design = read_design(design_file) if design_file else None
    names = tuple(name.strip() for name in (parameters or "").split(",") if name.strip())
    rivals = read_rivals(trace_file, model, known) if trace_file else ()
    wanted = Wanted(names, stroke, speed, force, limit, seconds, seed, rivals)
    with results("experiment", out) as folder:
        with running("experiment", EXPERIMENT_STAGES, as_json=as_json, budget=budget) as course:
            found = experiment(model, wanted, design, course.report, course.keep_going)
        view = experiment_view(found)
        view.write(folder)
    then = after_experiment(found, model_file, design_file)
    show(view, folder.final, as_json, then)
    return 0 if then is None else 1
