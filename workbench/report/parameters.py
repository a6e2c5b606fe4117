"""Section: the parameters in a table, with what each means."""

from identification.estimation.estimates import AT_ZERO
from workbench.documents.model import Model, used
from workbench.report.model_tables import parameter_rows
from workbench.report.page import Section
from workbench.report.templating import render


def parameters_section(model: Model) -> Section:
    """The parameters with units and intervals, or why there is none."""
    held = {**model.friction, **(model.actuator or {})}
    assumed = ", ".join(
        f"{name} = {_shown(used(e))} {e.unit}" for name, e in held.items() if e.value is None
    )
    return Section("Parameters", render("parameters", rows=parameter_rows(model), assumed=assumed))


def _shown(value: float) -> str:
    """A value that simulations use; what a plant keeps of 0 is 0."""
    return "0" if abs(value) <= AT_ZERO else f"{value:.3g}"
