"""`workbench design`: a model -> design.json and report.html."""

from datetime import datetime
from pathlib import Path
from typing import Literal

import click

from workbench.ending import StatusCommand, refused_with
from workbench.options import POSITIVE, effects_option, present_card_option
from workbench.output import OutputFolder, emit, output_options, progress


@click.command(
    cls=StatusCommand,
    refusal="the model carries no design, or no controller keeps the goals (design.json then says"
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
@present_card_option
@effects_option
@output_options
def command(
    model_file: Path,
    poles: str | None,
    auxiliary: str | None,
    integrator: bool,
    source: Literal["physical", "arx"] | None,
    design_period: float | None,
    modulus: float,
    delay: float,
    card: str | None,
    effects: tuple[Path, ...],
    as_json: bool,
    out: Path | None,
) -> int:
    """Design PID and RST controllers by pole placement, with margins and the compensator.

    Writes design.json and report.html. Where no poles are asked, the fastest loop is searched that
    keeps the margins.
    """
    from design.tune import Asked, Goals
    from workbench.cards.own_effects import library
    from workbench.documents.design import design_document
    from workbench.documents.model import read_model
    from workbench.options import parse_auxiliary, parse_poles
    from workbench.report.design_tables import design_view
    from workbench.report.next_steps import after_design, without_design
    from workbench.report.reports import design_report
    from workbench.steps.design import design, effort_limit
    from workbench.steps.present import with_card

    model = with_card(read_model(model_file, library(effects)), card)
    asked = Asked(parse_poles(poles), parse_auxiliary(auxiliary), integrator)
    goals = Goals(modulus, delay, effort_limit(model))
    kept = _kept(integrator, source, design_period, card, effects)
    with (
        refused_with(without_design(model, card)),
        OutputFolder("design", out, now=datetime.now()) as folder,
    ):
        with progress("designing", as_json=as_json):
            found = design(model, asked, goals=goals, source=source, period=design_period)
        document = design_document(found)
        folder.write_json("design.json", document)
        folder.write_text("report.html", design_report(found, model.rotary))
    emit(
        {**document, "out": folder.final},
        as_json,
        lambda: design_view(found, folder.final, model.rotary),
        after_design(found, model_file, poles is not None, kept),
    )
    return 1 if found.recommended == "none" else 0


def _kept(
    integrator: bool,
    source: str | None,
    period: float | None,
    card: str | None,
    effects: tuple[Path, ...],
) -> tuple[str, ...]:
    """The options that another try keeps."""
    return (
        *(() if integrator else ("--no-integrator",)),
        *(("--from", source) if source else ()),
        *(("--design-period", f"{period:g}") if period else ()),
        *(("--card", card) if card else ()),
        *(word for folder in effects for word in ("--effects", str(folder))),
    )
