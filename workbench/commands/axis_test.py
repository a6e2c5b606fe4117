"""`workbench axis-test`: one log of an axis -> a light, its numbers with limits, one page."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from workbench import options
from workbench.output import Step, results, step
from workbench.signature import option

if TYPE_CHECKING:
    from design.measured.axis_test import AxisTest


@options.command(
    done="green",
    refusal="yellow or red, or nothing is identifiable from the log; the first line says why",
    epilog="Example: workbench axis-test run1.csv --card bench-a/card.toml --registry registry.db",
)
def command(
    log: str = options.LOG_ARGUMENT,
    card: str = options.CARD_OPTION,
    where: str | None = option(
        "SQLite file or postgresql://... whose last 30 sound logs of the machine give its limits.",
        "--registry", metavar="FILE|URL",
    ),
    machine: str | None = option(
        "The machine's name in the registry.  [default: the card's]", metavar="NAME"
    ),
    seed: int = options.SEED_OPTION,
    out: Path | None = options.OUT_OPTION,
) -> int:  # fmt: skip
    """Test an axis by one log: friction and breakaway each way, their difference, mass, backlash.

    Each number has its limits, of the card's [limits], else the mean +- 3 sd of the machine's last
    sound logs in the registry. Green: within; red: surely beyond; yellow: not sure on which side,
    or nothing to test against. Writes axis_test.json, and report.html to be printed on one page.
    """
    from workbench.interface.logs import axis_test
    from workbench.report.next_steps import check_of_refused

    if where is None and machine is not None:
        raise click.UsageError("--machine is a name in a registry; give --registry too.")
    with results("axis-test", out, check_of_refused([log], card)) as folder:
        found = axis_test(log, card, registry=where, machine=machine, seed=seed)
        found.view.write(folder)
    found.view.show(folder.final, after_axis_test(found.found, log, card, where))
    return 0 if found.light == "green" else 1


def after_axis_test(test: "AxisTest", log: str, card: str, where: str | None) -> Step | None:
    """What to type where the light is not green."""
    from workbench.registry.database import location

    if test.light == "green":
        return None
    if test.of("explained").light in ("yellow", "red") or test.of("explained").light == "":
        return step("what else acts", "trace", log, "--card", card)
    if where is None:
        own = location(None)
        if test.untested and ("://" in own or Path(own).exists()):
            return step("limits of its own logs", "axis-test", log, "--card", card,
                        "--registry", own)  # fmt: skip
        first = "a first version for a registry, whose logs give limits"
        why = first if test.untested else "what has changed"
        return step(why, "identify", log, "--card", card)
    return step("what its logs have shown", "registry", "show", test.machine, "--registry", where)
