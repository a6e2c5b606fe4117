"""What `identify`, `design` and `validate` show: which tables and pictures, under which words."""

from collections.abc import Mapping, Sequence
from functools import cache

from identification.estimation.estimates import AT_ZERO
from identification.simulation.free_run import FreeRun
from workbench.documents.design import Design
from workbench.documents.design_file import design_document
from workbench.documents.model import Model, used
from workbench.documents.model_file import model_document
from workbench.report.controllers import (
    bode_section,
    coefficients,
    controllers,
    drive_section,
    sensitivity_section,
    step_chart,
    step_response,
)
from workbench.report.design_tables import design_parts, design_sentence, then_of_design
from workbench.report.fit import fit, fit_chart
from workbench.report.friction import friction_curve
from workbench.report.loop import judged, loop
from workbench.report.loop import step_chart as loop_chart
from workbench.report.model_tables import (
    fit_lines,
    logs_of,
    model_parts,
    next_of_model,
    parameter_rows,
    plant_lines,
    summary,
)
from workbench.report.notes import report_notes
from workbench.report.page import Section, lines_section
from workbench.report.residual import residual
from workbench.report.response import over_frequency
from workbench.report.templating import render
from workbench.report.trace_words import share_of_friction
from workbench.report.validation_tables import (
    then_of_validation,
    validation_parts,
    validation_sentence,
)
from workbench.report.view import View
from workbench.steps.identify_sources import Identified
from workbench.steps.loop_figures import Traces
from workbench.steps.missing_force import missing_force, share_of_coulomb
from workbench.steps.predict import fitted_run
from workbench.steps.validate import Validation, validation_document


def identified_view(found: Identified) -> View:
    """What was identified, how well it follows the log, what it leaves."""
    model, sources = found.model, found.sources

    @cache
    def runs() -> list[FreeRun | None]:
        return [fitted_run(model, one.log, number) for number, one in enumerate(sources)]

    def sections() -> Sequence[Section]:
        said = (*fit_lines(model), *plant_lines(model), *found.remarks, *model.fit.remarks)
        return (
            residual(model, sources, runs(), missing),
            parameters_section(model),
            friction_curve(model, found.fit, sources),
            fit(model, sources, runs()),
            *over_frequency(model, sources),
            lines_section("In words", report_notes(said, logs_of(model))),
        )

    missing = missing_force(model, [one.log for one in sources])
    share = share_of_coulomb(model, missing)
    lacks = "" if share is None else f" Force missing: {share_of_friction(share)} of friction."
    return View(
        f"Identification of {model.card}",
        summary(model) + lacks,
        model_parts(model, found.remarks),
        lambda: model_document(model),
        {"model.json": lambda: model_document(model)},
        sections,
        lambda: fit_chart(model, sources, runs()),
        [next_of_model(model)],
        then_by_command=True,
    )


def design_view(found: Design, rotary: bool = False) -> View:
    """The controllers, their margins, what they do to noise, how fast they are."""

    def sections() -> Sequence[Section]:
        return (
            step_response(found),
            controllers(found, rotary),
            *bode_section(found),
            sensitivity_section(found, rotary),
            coefficients(found),
            drive_section(found),
        )

    return View(
        f"Design for {found.card}",
        design_sentence(found),
        design_parts(found, rotary),
        lambda: design_document(found),
        {"design.json": lambda: design_document(found)},
        sections,
        lambda: step_chart(found),
        then_of_design(found),
        then_by_command=found.recommended == "none",
    )


def validation_view(
    found: Validation, traces: Mapping[tuple[str, str], Traces], rotary: bool = False
) -> View:
    """Whether the design holds in simulation, and what the loop does."""

    def sections() -> Sequence[Section]:
        places = dict.fromkeys(place for _, place in traces)
        drawn = [one for place in places for one in loop(found, traces, place, rotary)]
        return (*drawn[:1], judged(found, rotary), *drawn[1:])

    return View(
        f"Validation for {found.card}",
        validation_sentence(found),
        validation_parts(found, rotary),
        lambda: validation_document(found),
        {"validation.json": lambda: validation_document(found)},
        sections,
        lambda: loop_chart(found, traces, "model", rotary),
        then_of_validation(found),
        then_by_command=not found.passed,
    )


def parameters_section(model: Model) -> Section:
    """The parameters with units and intervals, or why there is none."""
    estimates = {**model.friction, **(model.actuator or {})}
    assumed = ", ".join(
        f"{name} = {_shown(used(e))} {e.unit}" for name, e in estimates.items() if e.value is None
    )
    return Section("Parameters", render("parameters", rows=parameter_rows(model), assumed=assumed))


def _shown(value: float) -> str:
    """A value that simulations use; what a plant keeps of 0 is 0."""
    return "0" if abs(value) <= AT_ZERO else f"{value:.3g}"
