"""`workbench trace`: logs and held-out logs -> trace.json, model.json and report.html."""

from pathlib import Path
from typing import TYPE_CHECKING

from workbench import options
from workbench.course import running
from workbench.output import results
from workbench.signature import argument, option
from workbench.steps.asked import TRACE_STAGES

if TYPE_CHECKING:
    from design.machine.model import Model
    from design.machine.velocity import VelocityModel
    from workbench.report.view import View


@options.command(
    done="done, whatever the verdict",
    refusal="too little slides",
    epilog="Example: workbench trace day1.csv day2.csv --test day3.csv --card bench-a/card.toml",
)
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
    out: Path | None = options.OUT_OPTION,
) -> None:  # fmt: skip
    """Find the physical effect that the model of a machine lacks, and what it is worth.

    Writes trace.json (verdict, errors before and after, effects, rivals), model.json with the
    effects in it, and report.html. Without --test, stretches of the logs are left out in turn;
    without LOG, the card's [split] names the logs of both kinds. Ended by --budget or Ctrl-C, it
    says what was not tried.
    """
    from workbench.interface.models import trace
    from workbench.logs.sources import card_of_velocity
    from workbench.report.next_steps import after_trace, check_of_refused
    from workbench.steps.trace import named_logs

    model: Model | VelocityModel
    with results("trace", out, check_of_refused([*logs, *tests], card)) as folder:
        names, held_out = named_logs(logs, tests, card)
        if card_of_velocity(card):
            options.refuse_for_velocity("effects", "seed")
            shown, model, verdict, named = _of_velocity(names, held_out, card, budget)
        else:
            found = trace(names, held_out or None, card, effects=effects, budget=budget, seed=seed)
            shown, model = found.view, found.model
            verdict, named = found.verdict, found.effects
        shown.write(folder)
    newer = held_out or names
    shown.show(folder.final, after_trace(verdict, named, model, newer, card, folder.final))


def _of_velocity(
    names: tuple[str, ...], held_out: tuple[str, ...], card: str, budget: float
) -> tuple["View", "VelocityModel", str, tuple[str, ...]]:
    """The same of a rig whose velocity follows the command."""
    from design.identified.velocity import trace_velocity
    from workbench.logs.sources import read_sources
    from workbench.report.view import view

    train = read_sources(names, card, velocity=True).logs
    test = read_sources(held_out, card, velocity=True).logs if held_out else None
    with running("trace", TRACE_STAGES, budget) as course:
        found = trace_velocity(train, test, keep_going=course.keep_going)
        return view(found), found.model, found.left.verdict, tuple(found.model.effects)
