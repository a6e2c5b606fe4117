"""Section: the parameters in a table, with what each means."""

from workbench.model import Model, used
from workbench.report.page import Section, render
from workbench.views import parameter_rows


def parameters(model: Model) -> Section:
    """The parameters with units and intervals, or why there is none."""
    held = {**model.friction, **(model.actuator or {})}
    assumed = ", ".join(
        f"{name} = {used(e):.3g} {e.unit}" for name, e in held.items() if e.value is None
    )
    return Section("Parameters", render("parameters", rows=parameter_rows(model), assumed=assumed))
