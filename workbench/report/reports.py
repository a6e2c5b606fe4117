"""The reports that commands write: which sections, in which order, under which words."""

from collections.abc import Mapping

from workbench.documents.design import Design
from workbench.report.controllers import (
    coefficients,
    controllers,
    drive_section,
    sensitivity_section,
    step_response,
)
from workbench.report.fit import fit
from workbench.report.friction import friction_curve
from workbench.report.loop import judged, loop
from workbench.report.model_tables import fit_lines, summary
from workbench.report.page import Section, page, render
from workbench.report.parameters import parameters_section
from workbench.report.residual import residual
from workbench.report.validation_tables import validation_verdict
from workbench.steps.identify_sources import Identified
from workbench.steps.loop_figures import Traces
from workbench.steps.predict import fitted_run
from workbench.steps.validate import Validation


def identification_report(found: Identified) -> str:
    """HTML: what was identified, how well it follows the log, what it leaves."""
    model, log = found.model, found.sources[0].log
    run = fitted_run(model, log, 0)
    notes = [*fit_lines(model), *found.remarks, *model.fit.remarks]
    sections = (
        parameters_section(model),
        Section("In words", render("lines", lines=notes)),
        fit(model, log, run),
        friction_curve(model, found.fit, log),
        residual(model, log, run),
    )
    return page(f"Identification of {model.card}", summary(model), sections)


def design_report(found: Design, rotary: bool = False) -> str:
    """HTML: the controllers, their margins, what they do to noise, how fast they are."""
    lead = (
        f"{found.recommended.upper()} recommended, position loop every"
        f" {1e3 * found.plant.h:.4g} ms; designed on the {found.plant.source} plant."
    )
    if found.recommendation:
        lead += f" {found.recommendation.why}."
    sections = (
        controllers(found, rotary),
        step_response(found),
        sensitivity_section(found, rotary),
        coefficients(found),
        drive_section(found),
    )
    return page(f"Design for {found.card}", lead, sections)


def validation_report(
    found: Validation, traces: Mapping[tuple[str, str], Traces], rotary: bool
) -> str:
    """HTML: whether the design holds in simulation, and what the loop does."""
    places = dict.fromkeys(place for _, place in traces)
    sections = (judged(found, rotary), *(loop(found, traces, place, rotary) for place in places))
    return page(
        f"Validation for {found.card}", f"{validation_verdict(found)}. {found.why}.", sections
    )
