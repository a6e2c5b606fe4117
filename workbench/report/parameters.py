"""Section: the parameters in a table, with what each means."""

from workbench.documents.model import Model, used
from workbench.report.model_tables import parameter_rows
from workbench.report.page import Section, render


def parameters_section(model: Model) -> Section:
    """The parameters with units and intervals, or why there is none."""
    held = {**model.friction, **(model.actuator or {})}
    assumed = ", ".join(
        f"{name} = {used(e):.3g} {e.unit}" for name, e in held.items() if e.value is None
    )
    return Section("Parameters", render("parameters", rows=parameter_rows(model), assumed=assumed))
