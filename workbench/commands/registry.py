"""`workbench registry`: the active version of each machine, the earlier ones, and why."""

import getpass
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from workbench import options
from workbench.jobs.options import clock
from workbench.output import emit, results
from workbench.signature import argument, option

if TYPE_CHECKING:
    from workbench.registry.store import Registry
    from workbench.registry.values import Decision, Version


def _given(ctx: click.Context, param: click.Parameter, value: str) -> str:
    if not value.strip():
        raise click.UsageError("--reason is empty; say why in a few words.", ctx)
    return value.strip()


MACHINE_ARGUMENT = argument()
YOU: dict[str, Any] = {"metavar": "NAME", "callback": lambda _c, _p, by: by or getpass.getuser()}
BY_OPTION = option("Who decides.  [default: you]", **YOU)
REASON_OPTION = option("Why; it is recorded.", required=True, metavar="TEXT", callback=_given)


@click.group(cls=options.StatusGroup, epilog="Example: workbench registry show bench-a --json")
def command() -> None:
    """Models and designs of machines, append-only, with one active version each.

    Every subcommand takes --registry FILE|URL and --json; 'show --out DIR' writes a version's
    files.
    """


@options.command(command, "list", epilog="Example: workbench registry list --registry fleet.db")
def list_machines(where: str | None = options.REGISTRY_OPTION) -> None:
    """List the machines, the active version of each, and how many logs wait."""
    from workbench.registry.views import list_screen

    with opened(where) as found:
        machines = found.machines()
    emit({"machines": machines}, lambda: list_screen(machines))


@options.command(command, epilog="Example: workbench registry show bench-a 2 --out version2")
def show(
    machine: str = MACHINE_ARGUMENT,
    number: int | None = argument(type=click.IntRange(min=1)),
    out: Path | None = option("Write the files of the version too.", metavar="DIR"),
    where: str | None = options.REGISTRY_OPTION,
) -> None:
    """Show a machine: the active version, every decision with its reason, every log's result.

    NUMBER: a version whose files --out writes, by default the active one.
    """
    from workbench.registry.queue import Queue
    from workbench.registry.views import machine_screen

    with opened(where) as found:
        state, decisions = found.machine(machine), found.decisions(machine)
        outcomes = Queue(found.database).outcomes(machine)
        accepted = found.accepted_version(machine)
        if number is not None or out is not None:
            version = _version(found, machine, number)
            decisions = tuple(d for d in decisions if number is None or d.number == number)
            if out is not None:
                with results("registry", out) as folder:
                    for kind, document in found.documents(version).items():
                        if document is not None:
                            folder.write(f"{kind}.json", json.dumps(document, indent=2) + "\n")
    number_accepted = None if accepted is None else accepted.number
    shown = {"machine": state, "decisions": decisions, "logs": outcomes,
             "accepted": number_accepted}  # fmt: skip
    emit(shown, lambda: machine_screen(state, decisions, outcomes, accepted))


@options.command(command, epilog="Example: workbench registry diff bench-a 1 2")
def diff(
    machine: str = MACHINE_ARGUMENT,
    first: int | None = argument(type=click.IntRange(min=1)),
    second: int | None = argument(type=click.IntRange(min=1)),
    where: str | None = options.REGISTRY_OPTION,
) -> None:
    """Show the parameters of two versions side by side, with units and 95 % intervals.

    FIRST: by default the version before SECOND; SECOND: by default the active one.
    """
    from design.machine.difference import difference
    from workbench.registry.values import BadRegistry
    from workbench.registry.views import difference_screen

    with opened(where) as found:
        after = _version(found, machine, second)
        if first is None and after.number == 1:
            raise BadRegistry(
                f"{machine}: no version before {after.number}; name two versions to compare"
            )
        before = found.version(machine, first if first is not None else after.number - 1)
        lines = difference(found.documents(before), found.documents(after))
    names = (f"version {before.number}", f"version {after.number}")
    result = {"machine": machine, "versions": [before, after], "parameters": lines}
    emit(result, lambda: difference_screen(lines, names))


@options.command(
    command,
    epilog="Example: workbench registry add bench-a model.json design.json --promote --reason"
    " first",
)
def add(
    machine: str = MACHINE_ARGUMENT,
    model_file: Path = options.MODEL_ARGUMENT,
    design_file: Path | None = argument("[DESIGN]"),
    validation: Path | None = option("validation.json of the design.", metavar="FILE"),
    promote: bool = option("Make it the active version as well."),
    effects: tuple[Path, ...] = options.EFFECTS_OPTION,
    reason: str = REASON_OPTION,
    by: str = BY_OPTION,
    where: str | None = options.REGISTRY_OPTION,
) -> None:
    """Add a model, with its design, as a new version of a machine; a new machine is made.

    The active version stays active unless --promote is given. The same files again are the same
    version.
    """
    from design.judgement import Candidate
    from workbench.cards.own_effects import library
    from workbench.documents.reading import read_document, read_raw
    from workbench.documents.result_files import read_design, read_model

    remarks = list(read_model(model_file, library(effects)).read)
    if design_file is not None:
        remarks += read_design(design_file).read
    candidate = Candidate(
        read_document(model_file),
        None if design_file is None else read_document(design_file),
        None if validation is None else read_raw(validation, "validation/1"),
    )
    now = clock()
    with opened(where, create=True) as found:
        version = found.add(machine, candidate, reason=reason, by=by, now=now)
        current = found.active_version(machine)
        if promote and (current is None or current.number != version.number):
            found.promote(machine, version.number, reason=reason, by=by, now=now)
    state = "active" if promote else "not active yet: 'workbench registry promote'"
    said = [f"{machine}: version {version.number}, {state}", *(f"note: {r}" for r in remarks)]
    emit({**asdict(version), "remarks": remarks}, lambda: "\n".join(said))


@options.command(
    command, epilog="Example: workbench registry promote bench-a 2 --reason 'tried on Monday'"
)
def promote(
    machine: str = MACHINE_ARGUMENT,
    number: int = argument(type=click.IntRange(min=1)),
    reason: str = REASON_OPTION,
    by: str = BY_OPTION,
    where: str | None = options.REGISTRY_OPTION,
) -> None:
    """Activate a version of a machine, or accept the one that a worker has activated.

    The limits of `axis-test` by the machine's own logs begin anew with its model.
    """
    with opened(where) as found:
        decision = found.promote(machine, number, reason=reason, by=by, now=clock())
    emit(decision, lambda: _said(decision))


@options.command(command, epilog="Example: workbench registry rollback bench-a --reason 'it hunts'")
def rollback(
    machine: str = MACHINE_ARGUMENT,
    reason: str = REASON_OPTION,
    by: str = BY_OPTION,
    where: str | None = options.REGISTRY_OPTION,
) -> None:
    """Activate the version before the present one; again goes one further back."""
    with opened(where) as found:
        decision = found.rollback(machine, reason=reason, by=by, now=clock())
    emit(decision, lambda: _said(decision))


@options.command(
    command, epilog="Example: workbench registry retry bench-a --reason 'card corrected'"
)
def retry(
    machine: str = MACHINE_ARGUMENT,
    logs: tuple[str, ...] = argument("[LOG...]"),
    reason: str = REASON_OPTION,
    by: str = BY_OPTION,
    where: str | None = options.REGISTRY_OPTION,
) -> None:
    """Have logs tested again by the next pass; their earlier results stay on record.

    LOG: a file name or the beginning of a fingerprint; by default all that were excluded.
    """  # fmt: skip
    from workbench.registry.queue import Queue

    with opened(where) as found:
        files = Queue(found.database).reopen(machine, logs, reason=reason, by=by, now=clock())
    said = f"{machine}: waiting again: {', '.join(files)}" if files else f"{machine}: none excluded"
    emit({"machine": machine, "logs": files}, lambda: said)


def opened(where: str | None, *, create: bool = False) -> "Registry":
    """The registry that --registry names; create: make it where it is not there."""
    from workbench.registry.database import location
    from workbench.registry.store import Registry

    return Registry(location(where), create=create)


def _version(found: "Registry", machine: str, number: int | None) -> "Version":
    """The version of that number, by default the active one."""
    from workbench.registry.values import BadRegistry

    found.machine(machine)
    version = found.active_version(machine) if number is None else found.version(machine, number)
    if version is None:
        raise BadRegistry(f"{machine}: no active version; name a version's number")
    return version


def _said(decision: "Decision") -> str:
    return f"{decision.machine}: version {decision.number} active ({decision.reason})"
