"""`workbench doctor`: a log checked before any fit; alone, the installation."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from workbench import options
from workbench.output import emit, progress, results, step
from workbench.signature import argument, option

if TYPE_CHECKING:
    from design.identified.examined import Examined


@options.command(
    refusal="nothing can be identified from the log as it is, or something of the installation"
    " does not work",
    epilog="Example: workbench doctor run1.csv --card card.toml --out check",
)
def command(
    log: str | None = argument(shell_complete=options.complete_file),
    card: str | None = option(
        "Path of the card, or the name of a shipped one.", shell_complete=options.complete_card
    ),
    where: str | None = option(
        "Registry to be asked, without LOG.  [default: WORKBENCH_REGISTRY, if set]",
        "--registry", metavar="FILE|URL",
    ),
    effects_shown: bool = option(
        "Also which effects of the library the log could show (takes longer)."
    ),
    out: Path | None = options.OUT_OPTION,
) -> int:  # fmt: skip
    """Check a log before any fit: clock, sensors, bad samples, motion, and what is identifiable.

    With LOG and --card: which of the nine parameters are identifiable and which not, and what run
    to add; with --out also doctor.json and a picture, doctor.png. Alone: versions, compiled
    kernels, folder of data, registry.
    """
    if log is None:
        if card is not None or out is not None:
            raise click.UsageError("LOG is missing: give a log beside --card and --out.")
        return _installation(where)
    if card is None:
        raise click.UsageError(
            f"--card is missing: give the card of {log}; 'workbench init {log}' proposes one."
        )
    return _log(log, card, effects_shown, out)


def _log(name: str, card_name: str, effects: bool, out: Path | None) -> int:
    from design.identified.examined import doctor_document
    from workbench.cards.card import load_card
    from workbench.logs.sources import card_path, find_data
    from workbench.report.doctor import doctor_picture, doctor_screen
    from workbench.report.next_steps import after_doctor
    from workbench.steps.doctor import examine

    card = load_card(card_path(card_name), with_recipe=False)
    path = find_data(name, card)
    with progress("looking"):
        found: Examined = examine(path, card, effects=effects)
    document = doctor_document(found, card.name)
    if out is not None:
        with results("doctor", out) as folder:
            folder.write_json("doctor.json", document)
            doctor_picture(found, folder.path / "doctor.png")
    then = after_doctor(found, name, card_name)
    emit({**document, "out": out}, lambda: doctor_screen(found, out), then)
    return 1 if found.verdict in ("refused", "nothing") else 0


def _installation(where: str | None) -> int:
    from workbench.addresses import shown
    from workbench.registry.database import REGISTRY_VARIABLE
    from workbench.report.doctor import installation_screen
    from workbench.steps.installation import check_installation

    found = check_installation()
    named = where or os.environ.get(REGISTRY_VARIABLE)
    registry = _registry(named) if named else None
    wrong = [*found.wrong]
    if registry and not registry["answers"]:
        wrong.append(str(registry["reason"]))
    result = {"schema": "installation/1", **vars(found), "registry": registry, "wrong": wrong}
    asked = ("--registry", shown(named)) if named else ()
    then = step("once that is put right", "doctor", *asked) if wrong else None
    emit(result, lambda: installation_screen(found, registry, wrong), then)
    return 1 if wrong else 0


def _registry(where: str) -> Mapping[str, Any]:
    """Whether the registry answers, and how many machines it has."""
    from identification.errors import UserError
    from workbench.addresses import shown
    from workbench.registry.store import Registry

    try:
        with Registry(where, create=False) as store:
            machines = store.machines()
    except UserError as error:
        return {"where": shown(where), "answers": False, "machines": None, "reason": str(error)}
    return {"where": shown(where), "answers": True, "machines": len(machines), "reason": None}
