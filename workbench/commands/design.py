"""`workbench design`: a model -> design.json and report.html."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from design.asked import RobustAsked
from workbench import options
from workbench.output import results
from workbench.signature import option
from workbench.steps.asked import ROBUST_OPTIONS

if TYPE_CHECKING:
    from design.machine.design import Structure
    from design.machine.model import Model

# Options, by the names of their values, that only --robust has.
ROBUST_ONLY = (
    "draws", "probability", "staircase", "standstill", "tracking", "overshoot", "force", "machine",
    "where", "seed",
)  # fmt: skip
NOT_WITH_ROBUST = ("structures", "response_file", "over")
NOT_FOR_VELOCITY = (
    *(name for name in ROBUST_ONLY if name != "overshoot"),
    "robust", "poles", "auxiliary", "source", "card", "effects", *NOT_WITH_ROBUST,
)  # fmt: skip


@dataclass(frozen=True)
class DesignOptions:
    """What the command line says of a design."""

    model_file: Path = options.MODEL_ARGUMENT
    poles: tuple[float, float] | None = option(
        "Dominant poles [rad/s, -].  [default: searched]",
        type=options.Parsed(options.parse_poles), metavar="W_N,ZETA",
    )  # fmt: skip
    auxiliary: tuple[complex, ...] | None = option(
        "Other poles of the RST loop, values of z.  [default: searched]",
        type=options.Parsed(options.parse_auxiliary), metavar="Z,...",
    )  # fmt: skip
    integrator: bool = option("", "--integrator/--no-integrator", default=True)
    structures: "tuple[Structure, ...]" = option(
        "Controllers to design; may be given several times.  [default: rst and pid; p-pi too where"
        " two masses swing or the machine has one now]",
        "--structure", type=click.Choice(["rst", "pid", "p-pi"]), multiple=True,
    )  # fmt: skip
    response_file: Path | None = option(
        "response.json whose lowest anti-resonance and resonance the plant has.  [default: the"
        " model's own]",
        "--response", metavar="FILE",
    )  # fmt: skip
    over: Literal["place", "load", "direction"] | None = option(
        "Also PID and P-PI as a table over this, where the model's friction changes with it.",
        "--schedule",
    )
    source: Literal["physical", "arx"] | None = option(
        "Plant to design on.  [default: physical where the mass is identified]", "--from"
    )
    design_period: float | None = option(
        "Period of the position loop [s].", type=options.POSITIVE, metavar="S"
    )
    robust: bool = option("Choose by the loops of machines drawn from the model's uncertainty.")
    wanted: RobustAsked = ROBUST_OPTIONS
    machine: str | None = option(
        "Machine in the registry by whose drift so far the machines differ, with --robust.",
        metavar="NAME",
    )
    where: str | None = options.REGISTRY_OPTION
    card: str | None = options.PRESENT_CARD_OPTION
    effects: tuple[Path, ...] = options.EFFECTS_OPTION
    out: Path | None = options.OUT_OPTION


@options.command(
    refusal="the model carries no design, or no controller meets the goals (design.json then says"
    " what each misses, and recommends none)",
    epilog="Example: workbench design runs/.../model.json --poles 20,0.9",
)
def command(given: DesignOptions) -> int:
    """Design PID and RST controllers by pole placement, and P-PI cascades, with their margins.

    Writes design.json and report.html. Where no poles are asked, the fastest loop is searched that
    keeps the margins; against a resonance the cascade gets a notch or a low-pass where that pays.

    With --robust: the poles, the integrator and the compensator that do best over the machines that
    the model's errors (and the machine's drift so far) allow; robust.json holds what that promises.
    """
    from workbench.documents.velocity import is_velocity_model
    from workbench.interface.models import load_model
    from workbench.steps.elastic import with_response
    from workbench.steps.present import with_card

    if is_velocity_model(given.model_file):
        options.refuse_for_velocity(*NOT_FOR_VELOCITY)
        return _velocity(given)
    model = with_card(load_model(given.model_file, given.effects), given.card)
    _refuse_beside(given)
    if given.robust:
        return _robust(given, model)
    return _nominal(given, with_response(model, given.response_file))


def _nominal(given: DesignOptions, model: "Model") -> int:
    from design.controllers.design import effort_limit
    from design.tune import Asked, Goals
    from workbench.interface.loops import design
    from workbench.report.next_steps import after_design, without_design
    from workbench.steps.elastic import beyond_response

    limits, asked = given.wanted.limits, _asked(given)
    goals = Goals(limits.modulus, limits.delay, effort_limit(model))
    with results("design", given.out, without_design(model, given.card)) as folder:
        found = design(model, goals=goals, structures=given.structures or None, **asked)
        found = replace(found, design=beyond_response(found.design, given.response_file))
        if given.over:
            poles = Asked(asked["poles"], asked["auxiliary"], given.integrator)
            found = found.scheduled(given.over, poles, goals)
        found.view.write(folder)
    options_kept = _repeated_options(given)
    asked_poles, out = given.poles is not None, folder.final
    then = after_design(found.design, given.model_file, asked_poles, options_kept, out)
    found.view.show(out, then)
    return 1 if found.recommended == "none" else 0


def _asked(given: DesignOptions) -> dict[str, Any]:
    """What a nominal and a robust design are asked alike."""
    return {
        "poles": given.poles,
        "auxiliary": given.auxiliary,
        "integrator": given.integrator,
        "source": given.source,
        "period": given.design_period,
    }


def _velocity(given: DesignOptions) -> int:
    """The same of a rig whose velocity follows the command."""
    from design.controllers.velocity_loop import design_velocity
    from workbench.documents.velocity import read_velocity_model
    from workbench.report.next_steps import in_simulation, without_design
    from workbench.report.view import view

    model = read_velocity_model(given.model_file)
    with results("design", given.out, without_design(model, None)) as folder:
        found = design_velocity(
            model, given.wanted.limits, integrator=given.integrator, period=given.design_period
        )
        shown = view(found)
        shown.write(folder)
    shown.show(folder.final, in_simulation(given.model_file, folder.final))
    return 0


def _refuse_beside(given: DesignOptions) -> None:
    """Raises a usage error where options are given that do not go together."""
    if "p-pi" in given.structures and not given.integrator:
        raise click.UsageError("a P-PI cascade has an integrator; leave out --no-integrator.")
    if given.robust:
        options.refuse_given("{} has no meaning with --robust; leave it out.", *NOT_WITH_ROBUST)
    else:
        options.refuse_given(
            "{} has no meaning without --robust; add it, or leave it out.", *ROBUST_ONLY
        )


def _robust(given: DesignOptions, model: "Model") -> int:
    from design.machine.documents import design_document
    from workbench.interface.loops import robust_design
    from workbench.report.next_steps import after_robust, without_design

    drift = _drift(given.where, given.machine) if given.machine else None
    wanted = replace(given.wanted, drift=drift)
    with results("design", given.out, without_design(model, None)) as folder:
        found = robust_design(model, wanted, **_asked(given))
        found.view.write(folder)
    then = after_robust(found.found, given.model_file, folder.final)
    found.view.show(folder.final, then, design=design_document(found.found.design))
    return 0 if found.passed else 1


def _drift(where: str | None, machine: str) -> dict[str, float]:
    """By how much the machine's parameters have changed between its active models."""
    from pydantic import TypeAdapter

    from design.robust.outcomes import drift_found
    from identification.model.estimates import Estimate
    from workbench.registry.database import location
    from workbench.registry.store import Registry
    from workbench.registry.values import MOVES

    with Registry(location(where), create=False) as store:
        numbers = [one.number for one in store.decisions(machine) if one.kind in MOVES]
        models = [store.document(store.version(machine, n), "model") for n in numbers]
    friction = TypeAdapter(dict[str, Estimate])
    return drift_found([friction.validate_python(model["friction"]) for model in models])


def _repeated_options(given: DesignOptions) -> tuple[str, ...]:
    """The options that another try keeps."""
    period = given.design_period
    return (
        *(word for one in given.structures for word in ("--structure", one)),
        *(("--schedule", given.over) if given.over else ()),
        *(("--response", str(given.response_file)) if given.response_file else ()),
        *(() if given.integrator else ("--no-integrator",)),
        *(("--from", given.source) if given.source else ()),
        *(("--design-period", f"{period:g}") if period else ()),
        *(("--card", given.card) if given.card else ()),
    )
