"""`workbench reidentify`: one pass over the machines that have new logs."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from workbench import options
from workbench.jobs.options import JobOptions
from workbench.output import Step, emit, step
from workbench.verdicts import counted

if TYPE_CHECKING:
    from workbench.jobs.alarms import Delivery
    from workbench.jobs.passes import PassReport
    from workbench.screen import Screen

MOST_LINES = 6  # of one screen on machines left for later, and on alarms


@options.command(
    refusal="an alarm: drift, a changed structure, an excluded log",
    epilog="Example: workbench reidentify machines --registry fleet.db",
)
def command(given: JobOptions) -> int:
    """Test each new log of each machine once; where friction has drifted, re-tune.

    ROOT holds a folder a machine: ROOT/<machine>/card.toml and ROOT/<machine>/logs/*. A new log is
    tested against the active model ('workbench registry add' puts the first there); on drift a
    new model and design are made, where the structure has changed the log is traced; what is new
    replaces the old only if it wins on held-out data and in simulation. Safe to run at any time
    and many at once; what a killed run left, the next does. A log older than one behind the active
    model is tested and recorded, and changes nothing. Progress is written as JSON lines on standard
    error. Exit status 2 also where a machine could not be handled or is in another worker's hands,
    the registry is away, or the webhook has not taken an alarm. Such an alarm is tried again by
    later passes, less and less often, and given up after a day.
    """
    from workbench.jobs.worker import worker

    with worker(given) as found:
        judged, alarms = found.once()
    then = after_pass(judged, given.where)
    emit({**vars(judged), "alarms": alarms}, lambda: pass_screen(judged), then)
    errors = [f"{name}: {line}" for name, line in judged.failed.items()]
    errors += [f"{name}: not tested, {line}; run again" for name, line in judged.held.items()]
    if alarms is not None and (alarms.waiting or alarms.given_up):
        errors.append(undelivered(alarms))
    for line in errors:
        click.echo(f"error: {line}", err=True)
    if errors:
        return 2
    return 0 if then is None else 1


def after_pass(done: "PassReport", where: str | None) -> Step | None:
    """Check the first machine with an alarm."""
    from design.judgement import ALARMING
    from workbench.addresses import shown

    alarmed = [one for one in done.outcomes if one.verdict in ALARMING]
    if not alarmed:
        return None
    registry = ("--registry", shown(where)) if where else ()
    return step("what was found, and why", "registry", "show", alarmed[0].machine, *registry)


def undelivered(alarms: "Delivery") -> str:
    """What the webhook has not taken, in one line."""
    counts = {
        "not taken yet, tried again by later passes": alarms.waiting,
        "given up after a day": alarms.given_up,
    }
    said = ", ".join(f"{counted(count, 'alarm')} {what}" for what, count in counts.items() if count)
    why = f" ({alarms.reason})" if alarms.reason else ""
    return f"--webhook: {said}{why}; check the receiver"


def pass_screen(done: "PassReport") -> "Screen":
    """What a pass did, for a terminal: alarms first."""
    from workbench.registry.views import outcomes_table
    from workbench.screen import listed, screen

    judged = f"{counted(done.machines, 'machine')}, {counted(len(done.outcomes), 'log')} tested"
    return screen(
        judged,
        listed(remarks(done), MOST_LINES),
        outcomes_table(done.outcomes, alarms_first=True),
    )


def remarks(done: "PassReport") -> Sequence[str]:
    """What a pass left for a later one, in words."""
    out = []
    if done.growing:
        growing = counted(done.growing, "file")
        out.append(f"{growing} still being written (--settle), left for later")
    if done.no_logs:
        out.append(f"no log, without a line of numbers: {', '.join(done.no_logs)}")
    for name in done.without_model:
        out.append(f"{name}: no active model; 'workbench registry add {name} ...', or --first")
    return out
