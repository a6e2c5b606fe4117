"""The paper in simulation, each figure and number beside ours: `make paper`."""

import sys
from datetime import datetime
from pathlib import Path

import click

from studies.paper.document import paper_document, paper_screen
from studies.paper.report import paper_report
from studies.paper.study import study
from workbench import options
from workbench.cli import verdict
from workbench.output import OutputFolder, emit, progress
from workbench.signature import option


@options.command(epilog="Example: python -m studies.paper --out paper")
def command(
    seed: int = option(
        "First of the noise's seeds; what is tuned is tuned on this one + 100.",
        type=click.IntRange(min=0), default=1,
    ),
    runs: int = option(
        "Seeds over which every figure is a mean.", type=click.IntRange(min=1, max=50), default=3
    ),
    out: Path | None = options.OUT_OPTION,
) -> None:  # fmt: skip
    """Run the paper in simulation: its figures and printed numbers beside ours, and our design.

    Identifies the rig before and after its drift from simulated logs, compares old, new and no
    compensation under PD, PID and RST, the countermeasures that the paper names, and the
    sensitivity to N_c, e_T, noise and wrong parameters. Writes paper.json and report.html. Takes
    one to two minutes.
    """
    with OutputFolder("paper", out, now=datetime.now()) as folder:
        with progress("paper", 1.0) as advance:
            done = 0.0

            def report(_stage: str, share: float) -> None:
                nonlocal done
                advance(share - done)
                done = share

            found = study(range(seed, seed + runs), report)
        document = paper_document(found)
        folder.write_json("paper.json", document)
        folder.write("report.html", paper_report(found))
    emit({**document, "out": folder.final}, lambda: paper_screen(found, folder.final))


def main() -> int:
    """Exit status; an error as one line, as every command of the workbench has it."""
    try:
        command.main(prog_name="python -m studies.paper", standalone_mode=False)
    except (Exception, KeyboardInterrupt) as error:
        status, message = verdict(error)
        click.echo(message, err=True)
        return status
    return 0


if __name__ == "__main__":
    sys.exit(main())
