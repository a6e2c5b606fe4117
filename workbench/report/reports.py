"""The reports that commands write: which sections, in which order, under which words."""

from collections.abc import Mapping

from workbench.documents.design import Design
from workbench.report.bode import bode_section
from workbench.report.controllers import (
    coefficients,
    controllers,
    drive_section,
    sensitivity_section,
    step_response,
)
from workbench.report.design_tables import design_sentence, then_of_design
from workbench.report.fit import fit
from workbench.report.friction import friction_curve
from workbench.report.loop import judged, loop
from workbench.report.model_tables import (
    fit_lines,
    logs_of,
    next_of_model,
    plant_lines,
    summary,
)
from workbench.report.notes import report_notes
from workbench.report.page import Section, page
from workbench.report.parameters import parameters_section
from workbench.report.residual import residual
from workbench.report.response import over_frequency
from workbench.report.templating import render
from workbench.report.validation_tables import then_of_validation, validation_sentence
from workbench.steps.identify_sources import Identified
from workbench.steps.loop_figures import Traces
from workbench.steps.predict import fitted_run
from workbench.steps.validate import Validation


def identification_report(found: Identified) -> str:
    """HTML: what was identified, how well it follows the log, what it leaves."""
    model, sources = found.model, found.sources
    runs = [fitted_run(model, one.log, number) for number, one in enumerate(sources)]
    told = (*fit_lines(model), *plant_lines(model), *found.remarks, *model.fit.remarks)
    sections = (
        residual(model, sources, runs),
        parameters_section(model),
        friction_curve(model, found.fit, sources),
        fit(model, sources, runs),
        *over_frequency(model, sources),
        Section("In words", render("lines", lines=report_notes(told, logs_of(model)))),
    )
    then = [next_of_model(model)]
    return page(f"Identification of {model.card}", summary(model), sections, then)


def design_report(found: Design, rotary: bool = False) -> str:
    """HTML: the controllers, their margins, what they do to noise, how fast they are."""
    sections = (
        step_response(found),
        controllers(found, rotary),
        *bode_section(found),
        sensitivity_section(found, rotary),
        coefficients(found),
        drive_section(found),
    )
    lead, then = design_sentence(found), then_of_design(found)
    return page(f"Design for {found.card}", lead, sections, then)


def validation_report(
    found: Validation, traces: Mapping[tuple[str, str], Traces], rotary: bool
) -> str:
    """HTML: whether the design holds in simulation, and what the loop does."""
    places = dict.fromkeys(place for _, place in traces)
    drawn = [one for place in places for one in loop(found, traces, place, rotary)]
    sections = (*drawn[:1], judged(found, rotary), *drawn[1:])
    lead, then = validation_sentence(found), then_of_validation(found)
    return page(f"Validation for {found.card}", lead, sections, then)
