"""`workbench design`: a model -> design.json and report.html."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from workbench.course import running
from workbench.ending import StatusCommand, step
from workbench.options import (
    POSITIVE,
    Finite,
    effects_option,
    motion_limits,
    present_card_option,
    refuse_for_velocity,
)
from workbench.output import output_options, progress, results

if TYPE_CHECKING:
    from design.tune import Asked
    from workbench.documents.design import From, Structure
    from workbench.documents.model import Model
    from workbench.steps.loop_figures import Limits
    from workbench.steps.robust.robust import RobustAsked

# Options, by the names of their values, that only --robust has.
ROBUST_ONLY = (
    "draws", "probability", "staircase", "standstill", "tracking", "overshoot", "force", "machine",
    "where", "seed",
)  # fmt: skip
NOT_WITH_ROBUST = ("structures", "response_file")
NOT_FOR_VELOCITY = (
    *(name for name in ROBUST_ONLY if name != "overshoot"),
    "robust", "poles", "auxiliary", "source", "card", "effects", *NOT_WITH_ROBUST,
)  # fmt: skip


@click.command(
    cls=StatusCommand,
    refusal="the model carries no design, or no controller meets the goals (design.json then says"
    " what each misses, and recommends none)",
    epilog="Example: workbench design runs/.../model.json --poles 20,0.9",
)
@click.argument("model_file", metavar="MODEL", type=click.Path(path_type=Path))
@click.option("--poles", metavar="W_N,ZETA", help="Dominant poles [rad/s, -].  [default: searched]")
@click.option(
    "--auxiliary", metavar="Z,...", help="Other poles of the RST loop, values of z.  [default: "
    "searched]",
)  # fmt: skip
@click.option("--integrator/--no-integrator", default=True, show_default=True)
@click.option(
    "--structure", "structures", type=click.Choice(["rst", "pid", "p-pi"]), multiple=True,
    help="Controllers to design; may be given several times.  [default: rst and pid; p-pi too where"
    " two masses swing or the machine has one now]",
)  # fmt: skip
@click.option(
    "--response", "response_file", type=click.Path(path_type=Path), metavar="FILE",
    help="response.json whose lowest anti-resonance and resonance the plant has.  [default: the"
    " model's own]",
)  # fmt: skip
@click.option(
    "--from",
    "source",
    type=click.Choice(["physical", "arx"]),
    help="Plant to design on.  [default: physical where the mass is identified]",
)
@click.option(
    "--design-period", type=POSITIVE, metavar="S", help="Period of the position loop [s]."
)
@click.option(
    "--modulus", type=POSITIVE, default=0.5, show_default=True, help="Least modulus margin."
)
@click.option(
    "--delay", type=POSITIVE, default=2.0, show_default=True, help="Least delay margin, in samples."
)
@click.option(
    "--robust", is_flag=True,
    help="Choose by the loops of machines drawn from the model's uncertainty.",
)  # fmt: skip
@click.option(
    "--draws", type=click.IntRange(20, 10_000), default=200, show_default=True,
    help="Machines drawn, with --robust.",
)  # fmt: skip
@click.option(
    "--probability", type=Finite(0.5, 1.0, max_open=True), default=0.95, show_default=True,
    help="Share of the machines on which each limit has to hold, with --robust.",
)  # fmt: skip
@click.option(
    "--staircase", type=POSITIVE, metavar="M",
    help="Largest staircase on a slow ramp [m, rad], with --robust.  [default: any]",
)  # fmt: skip
@motion_limits
@click.option(
    "--machine", metavar="NAME",
    help="Machine in the registry by whose drift so far the machines differ, with --robust.",
)  # fmt: skip
@click.option(
    "--registry", "where", metavar="FILE|URL",
    help="SQLite file or postgresql://...  [default: WORKBENCH_REGISTRY, or registry.db]",
)  # fmt: skip
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True,
    help="Of the machines drawn, with --robust.",
)  # fmt: skip
@present_card_option
@effects_option
@output_options
def command(
    model_file: Path,
    poles: str | None,
    auxiliary: str | None,
    integrator: bool,
    structures: "tuple[Structure, ...]",
    response_file: Path | None,
    source: Literal["physical", "arx"] | None,
    design_period: float | None,
    modulus: float,
    delay: float,
    robust: bool,
    draws: int,
    probability: float,
    staircase: float | None,
    standstill: float,
    tracking: float,
    overshoot: float,
    force: float,
    machine: str | None,
    where: str | None,
    seed: int,
    card: str | None,
    effects: tuple[Path, ...],
    as_json: bool,
    out: Path | None,
) -> int:
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
    from workbench.options import parse_auxiliary, parse_poles
    from workbench.steps.elastic import with_response
    from workbench.steps.loop_figures import Limits
    from workbench.steps.present import with_card
    from workbench.steps.robust.robust import RobustAsked

    limits = Limits(modulus, delay, standstill, tracking, overshoot, force)
    if is_velocity_model(model_file):
        refuse_for_velocity(*NOT_FOR_VELOCITY)
        return _velocity(model_file, limits, (integrator, design_period), as_json, out)
    model = with_card(read_model(model_file, library(effects)), card)
    asked = Asked(parse_poles(poles), parse_auxiliary(auxiliary), integrator)
    _refuse_beside(click.get_current_context(), robust, "p-pi" in structures and not integrator)
    if robust:
        drift = _drift(where, machine) if machine else None
        wanted = RobustAsked(draws, probability, limits, staircase, drift, seed)
        return _robust(model, model_file, wanted, asked, (source, design_period), as_json, out)
    kept = _kept(integrator, source, design_period, card, effects, structures, response_file)
    given = (model_file, card, kept)
    plant = (source, design_period, structures)
    return _nominal(with_response(model, response_file), given, limits, asked, plant, as_json, out)


def _nominal(
    model: "Model", given: tuple[Path, str | None, tuple[str, ...]], limits: "Limits",
    asked: "Asked", plant: "tuple[From | None, float | None, tuple[Structure, ...]]",
    as_json: bool, out: Path | None,
) -> int:  # fmt: skip
    """given: model file and card, and the options that another try keeps; plant: what it is taken
    from, the period, and the structures."""
    from design.tune import Goals
    from workbench.report.next_steps import after_design, without_design
    from workbench.report.reports import design_view
    from workbench.report.view import show
    from workbench.steps.design import design, effort_limit

    (model_file, card, kept), (source, period, structures) = given, plant
    goals = Goals(limits.modulus, limits.delay, effort_limit(model))
    with results("design", out, without_design(model, card)) as folder:
        with progress("designing", as_json=as_json):
            found = design(
                model, asked, goals=goals, source=source, period=period,
                structures=structures or None,
            )  # fmt: skip
        view = design_view(found, model.rotary)
        view.write(folder)
    then = after_design(found, model_file, asked.dominant is not None, kept)
    show(view, folder.final, as_json, then)
    return 1 if found.recommended == "none" else 0


def _velocity(
    model_file: Path, limits: "Limits", loop: tuple[bool, float | None], as_json: bool,
    out: Path | None,
) -> int:  # fmt: skip
    """The same of a rig whose velocity follows the command; loop: integrator, and period [s]."""
    from workbench.documents.velocity import read_velocity_model
    from workbench.report.next_steps import without_design
    from workbench.report.velocity import velocity_design_view
    from workbench.report.view import show
    from workbench.steps.velocity_loop import design_velocity

    model = read_velocity_model(model_file)
    with results("design", out, without_design(model, None)) as folder:
        found = design_velocity(model, limits, integrator=loop[0], period=loop[1])
        view = velocity_design_view(found)
        view.write(folder)
    then = step("the loop in simulation", "validate", model_file, folder.final / "design.json")
    show(view, folder.final, as_json, then)
    return 0


def _only_robust(context: click.Context) -> None:
    """Raises a usage error where an option is given that has no meaning without --robust."""
    for option in context.command.params:
        given = context.get_parameter_source(option.name or "")
        if option.name in ROBUST_ONLY and given is click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(
                f"{option.opts[0]} has no meaning without --robust; add it, or leave it out."
            )


def _refuse_beside(context: click.Context, robust: bool, without_integrator: bool) -> None:
    """Raises a usage error where options are given that do not go together."""
    if without_integrator:
        raise click.UsageError("a P-PI cascade has an integrator; leave out --no-integrator.")
    for option in context.command.params:
        given = context.get_parameter_source(option.name or "")
        if (
            robust
            and option.name in NOT_WITH_ROBUST
            and given is click.core.ParameterSource.COMMANDLINE
        ):
            raise click.UsageError(f"{option.opts[0]} has no meaning with --robust; leave it out.")
    if not robust:
        _only_robust(context)


def _robust(
    model: "Model", model_file: Path, wanted: "RobustAsked", asked: "Asked",
    plant: "tuple[From | None, float | None]", as_json: bool, out: Path | None,
) -> int:  # fmt: skip
    from workbench.documents.design_file import design_document
    from workbench.report.next_steps import after_robust, without_design
    from workbench.report.robust import robust_view
    from workbench.report.view import show
    from workbench.steps.robust.robust import ROBUST_STAGES, robust_design

    with results("design", out, without_design(model, None)) as folder:
        with running("robust design", ROBUST_STAGES, as_json=as_json) as course:
            found = robust_design(model, wanted, asked, where=plant, report=course.report)
        view = robust_view(found, model.rotary)
        view.write(folder)
    design = design_document(found.design)
    show(view, folder.final, as_json, after_robust(found, model_file), design=design)
    return 0 if found.passed else 1


def _drift(where: str | None, machine: str) -> dict[str, float]:
    """By how much the machine's parameters have changed between its active models."""
    from pydantic import TypeAdapter

    from identification.model.estimates import Estimate
    from workbench.registry.database import location
    from workbench.registry.store import MOVES, Registry
    from workbench.steps.robust.machines import drift_found

    with Registry(location(where), create=False) as store:
        numbers = [one.number for one in store.decisions(machine) if one.kind in MOVES]
        models = [store.document(store.version(machine, n), "model") for n in numbers]
    friction = TypeAdapter(dict[str, Estimate])
    return drift_found([friction.validate_python(model["friction"]) for model in models])


def _kept(
    integrator: bool,
    source: str | None,
    period: float | None,
    card: str | None,
    effects: tuple[Path, ...],
    structures: "tuple[Structure, ...]",
    response_file: Path | None,
) -> tuple[str, ...]:
    """The options that another try keeps."""
    return (
        *(word for one in structures for word in ("--structure", one)),
        *(("--response", str(response_file)) if response_file else ()),
        *(() if integrator else ("--no-integrator",)),
        *(("--from", source) if source else ()),
        *(("--design-period", f"{period:g}") if period else ()),
        *(("--card", card) if card else ()),
        *(word for folder in effects for word in ("--effects", str(folder))),
    )
