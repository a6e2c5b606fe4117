"""`workbench design`: a model -> design.json and report.html."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from workbench import options
from workbench.course import running
from workbench.ending import StatusCommand, step
from workbench.output import JSON_OPTION, OUT_OPTION, progress, results
from workbench.signature import by_fields, option

if TYPE_CHECKING:
    from design.tune import Asked
    from workbench.documents.design import Structure
    from workbench.documents.model import Model
    from workbench.steps.loop_figures import Limits

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
    poles: str | None = option(
        "Dominant poles [rad/s, -].  [default: searched]", metavar="W_N,ZETA"
    )
    auxiliary: str | None = option(
        "Other poles of the RST loop, values of z.  [default: searched]", metavar="Z,..."
    )
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
    modulus: float = options.MODULUS_OPTION
    delay: float = options.DELAY_OPTION
    robust: bool = option("Choose by the loops of machines drawn from the model's uncertainty.")
    draws: int = option(
        "Machines drawn, with --robust.", type=click.IntRange(20, 10_000), default=200
    )
    probability: float = option(
        "Share of the machines on which each limit has to hold, with --robust.",
        type=options.Finite(0.5, 1.0, max_open=True), default=0.95,
    )  # fmt: skip
    staircase: float | None = option(
        "Largest staircase on a slow ramp [m, rad], with --robust.  [default: any]",
        type=options.POSITIVE, metavar="M",
    )  # fmt: skip
    standstill: float = options.STANDSTILL_OPTION
    tracking: float = options.TRACKING_OPTION
    overshoot: float = options.OVERSHOOT_OPTION
    force: float = options.FORCE_OPTION
    machine: str | None = option(
        "Machine in the registry by whose drift so far the machines differ, with --robust.",
        metavar="NAME",
    )
    where: str | None = options.REGISTRY_OPTION
    seed: int = option(
        "Of the machines drawn, with --robust.", type=click.IntRange(min=0), default=0
    )
    card: str | None = options.PRESENT_CARD_OPTION
    effects: tuple[Path, ...] = options.EFFECTS_OPTION
    as_json: bool = JSON_OPTION
    out: Path | None = OUT_OPTION


@click.command(
    cls=StatusCommand,
    refusal="the model carries no design, or no controller meets the goals (design.json then says"
    " what each misses, and recommends none)",
    epilog="Example: workbench design runs/.../model.json --poles 20,0.9",
)
@by_fields(DesignOptions)
def command(given: DesignOptions) -> int:
    """Design PID and RST controllers by pole placement, and P-PI cascades, with their margins.

    Writes design.json and report.html. Where no poles are asked, the fastest loop is searched that
    keeps the margins; against a resonance the cascade gets a notch or a low-pass where that pays.

    With --robust: the poles, the integrator and the compensator that do best over the machines that
    the model's errors (and the machine's drift so far) allow; robust.json holds what that promises.
    """
    from design.tune import Asked
    from workbench.cards.own_effects import library
    from workbench.documents.model_file import read_model
    from workbench.documents.velocity import is_velocity_model
    from workbench.steps.elastic import with_response
    from workbench.steps.present import with_card

    model_file = given.model_file
    if is_velocity_model(model_file):
        options.refuse_for_velocity(*NOT_FOR_VELOCITY)
        return _velocity(given)
    model = with_card(read_model(model_file, library(given.effects)), given.card)
    asked = Asked(
        options.parse_poles(given.poles), options.parse_auxiliary(given.auxiliary), given.integrator
    )
    _refuse_beside(given)
    if given.robust:
        return _robust(given, model, asked)
    return _nominal(given, with_response(model, given.response_file), asked)


def _nominal(given: DesignOptions, model: "Model", asked: "Asked") -> int:
    from design.tune import Goals
    from workbench.report.next_steps import after_design, without_design
    from workbench.report.reports import design_view
    from workbench.report.view import show
    from workbench.steps.design import design, effort_limit
    from workbench.steps.schedule import scheduled

    goals = Goals(given.modulus, given.delay, effort_limit(model))
    with results("design", given.out, without_design(model, given.card)) as folder:
        with progress("designing", as_json=given.as_json):
            found = design(
                model, asked, goals=goals, source=given.source, period=given.design_period,
                structures=given.structures or None,
            )  # fmt: skip
            if given.over:
                found = scheduled(model, found, given.over, asked, goals)
        view = design_view(found, model.rotary)
        view.write(folder)
    then = after_design(
        found, given.model_file, asked.dominant is not None, _repeated_options(given)
    )
    show(view, folder.final, given.as_json, then)
    return 1 if found.recommended == "none" else 0


def _velocity(given: DesignOptions) -> int:
    """The same of a rig whose velocity follows the command."""
    from workbench.documents.velocity import read_velocity_model
    from workbench.report.next_steps import without_design
    from workbench.report.velocity import velocity_view
    from workbench.report.view import show
    from workbench.steps.velocity_loop import design_velocity

    model = read_velocity_model(given.model_file)
    with results("design", given.out, without_design(model, None)) as folder:
        found = design_velocity(
            model, _limits(given), integrator=given.integrator, period=given.design_period
        )
        view = velocity_view(found)
        view.write(folder)
    design_file = folder.final / "design.json"
    then = step("the loop in simulation", "validate", given.model_file, design_file)
    show(view, folder.final, given.as_json, then)
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


def _limits(given: DesignOptions) -> "Limits":
    from workbench.steps.loop_figures import Limits

    return Limits(
        given.modulus, given.delay, given.standstill, given.tracking, given.overshoot, given.force
    )


def _robust(given: DesignOptions, model: "Model", asked: "Asked") -> int:
    from workbench.documents.design_file import design_document
    from workbench.report.next_steps import after_robust, without_design
    from workbench.report.robust import robust_view
    from workbench.report.view import show
    from workbench.steps.robust.robust import ROBUST_STAGES, RobustAsked, robust_design

    drift = _drift(given.where, given.machine) if given.machine else None
    wanted = RobustAsked(
        given.draws, given.probability, _limits(given), given.staircase, drift, given.seed
    )
    where = (given.source, given.design_period)
    with results("design", given.out, without_design(model, None)) as folder:
        with running("robust design", ROBUST_STAGES, as_json=given.as_json) as course:
            found = robust_design(model, wanted, asked, where=where, report=course.report)
        view = robust_view(found, model.rotary)
        view.write(folder)
    design, then = design_document(found.design), after_robust(found, given.model_file)
    show(view, folder.final, given.as_json, then, design=design)
    return 0 if found.passed else 1


def _drift(where: str | None, machine: str) -> dict[str, float]:
    """By how much the machine's parameters have changed between its active models."""
    from pydantic import TypeAdapter

    from identification.model.estimates import Estimate
    from workbench.registry.database import location
    from workbench.registry.store import MOVES, Registry
    from workbench.steps.robust.outcomes import drift_found

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
        *(word for folder in given.effects for word in ("--effects", str(folder))),
    )
