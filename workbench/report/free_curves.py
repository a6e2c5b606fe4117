"""Section of a trace: what an effect's law gives beside what the logs say, free of any law."""

from collections.abc import Sequence

from identification.tracing.result import FreeCurve
from workbench.report.chart import Area, Chart, Line, Panel, chart_html
from workbench.report.page import Section
from workbench.report.trace_pictures import axis_of, residual_unit
from workbench.report.trace_words import words


def free_curves(curves: Sequence[FreeCurve], rotary: bool, command: str = "V") -> Section:
    """Each named effect that is a function of a logged signal, by its law and free of it."""
    caption = (
        "Band: mean of what the model without the effect leaves there, with its 95 % interval;"
        " a law that stays inside it says what the logs say."
    )
    return Section("Law and logs", chart_html(curves_chart(curves, rotary, command), caption))


def curves_chart(curves: Sequence[FreeCurve], rotary: bool, command: str = "V") -> Chart:
    """The chart of `free_curves`; command: unit of u."""
    panels = []
    for one in curves:
        label, x_factor = axis_of(one.signal, rotary, command)
        unit, factor = residual_unit(one.equation, rotary)
        x, free, wide = x_factor * one.at, factor * one.free, 1.96 * factor * one.sd
        panels.append(
            Panel(
                label, f"{words(one.effect)} [{unit}]",
                [Line("by its law", x, factor * one.law, "model", "bold")],
                areas=[Area("by the logs alone", x, free - wide, free + wide, "measured")],
            )
        )  # fmt: skip
    what = "what each effect gives against its signal, by its law and by the logs alone"
    return Chart("trace-curves", what, panels, columns=2, shared_x=False)
