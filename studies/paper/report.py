"""The report of `workbench paper`: claims, the figures as drawn here, rivals, maps, our design."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from design.servo import ServoRun
from studies.paper.claims import claims
from studies.paper.document import CLAIMS, FIGURES, case_rows, claim_rows, rival_servo_rows
from studies.paper.measures import Case
from studies.paper.sensitivity import Sensitivity
from studies.paper.study import Study
from studies.paper.svg import inline, picture
from workbench.report.chart_figure import (
    BAND,
    MEASURED,
    MODEL,
    OTHER,
    REFERENCE,
    figure,
    label,
    line,
    style,
)
from workbench.report.view import Section, page, table
from workbench.screen import tabled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CURVE_COLOURS = (MEASURED, MODEL, REFERENCE, OTHER, BAND, "#cc79a7")
RUN_LABELS = {"old": "old parameters", "new": "new parameters", "none": "no compensator"}


def paper_report(found: Study) -> str:
    """HTML: everything the study holds."""
    said = [one.verdict for one in claims(found)]
    count = {verdict: said.count(verdict) for verdict in dict.fromkeys(said)}
    lead = ", ".join(f"{number} {verdict}" for verdict, number in count.items()) + "."
    sections = (
        Section("The paper and this simulation", _table(CLAIMS, claim_rows(found))),
        _figure_6(found),
        _figure_7(found),
        _figure_8(found),
        _drift(found),
        _competitors(found, 1),
        _competitors(found, 3),
        _maps(found.sensitivity),
        _wrong(found.sensitivity),
        _beyond(found),
    )
    return page("The paper in simulation", lead, sections)


def _table(head: tuple[str, ...], rows: Any, lines: tuple[str, ...] = ()) -> Any:
    return table(tabled(head, rows), lines)


def _figure_6(found: Study) -> Section:
    cases = found.simulation.pd
    names = ("none", "no zero-velocity", "eq. (4)")
    with style():
        drawn = figure(9.0, 3.6)
        axes = drawn.subplots(1, 1)
        _positions(axes, {name: cases[name] for name in names})
        drawn.legend(loc="outside upper right", ncols=4)
        svg = inline(drawn, "figure-6", "steps under PD with and without compensator")
    caption = "PD on the plant of table 1, compensator on the paper's estimates of it."
    rows = _table(FIGURES, case_rows(cases))
    return Section("Figure 6", picture(svg, caption) + rows)


def _figure_7(found: Study) -> Section:
    run = found.simulation.pd["eq. (4)"].run
    with style():
        drawn = figure(9.0, 4.2)
        axes = drawn.subplots(2, 1, sharex=True)
        line(axes[0], run.t, run.compensation, color=BAND, lw=0.6, label="F_comp")
        line(axes[0], run.t, run.compensation_filtered, color=REFERENCE, label="F_compf")
        axes[0].legend(loc="upper right", ncols=2)
        line(axes[1], run.t, run.velocity, color=MEASURED)
        label(axes[0], "", "compensation [N]")
        label(axes[1], "time [s]", "velocity (5) [m/s]")
        svg = inline(drawn, "figure-7", "compensation force and velocity")
    caption = "Eq. (4) behind and before filter C, and the velocity it works with."
    return Section("Figure 7", picture(svg, caption))


def _figure_8(found: Study) -> Section:
    names = ("none", "F_stick in the band", "eq. (4)", "eq. (4), no F_stick")
    with style():
        drawn = figure(9.0, 4.8)
        axes = drawn.subplots(2, 1, sharex=True)
        for place, cases, title in (
            (axes[0], found.simulation.pid, "plant of table 1"),
            (axes[1], found.simulation.pid_table_3, "plant of table 3"),
        ):
            for name, colour in zip(names, CURVE_COLOURS, strict=False):
                run = cases[name].run
                late = run.t > run.t[-1] - 10.0
                error = 1e3 * (run.r - run.y)[late]
                line(place, run.t[late], error, color=colour, label=name)
            label(place, "", "error [mm]", title)
        label(axes[1], "time [s]", "error [mm]", "plant of table 3")
        handles = axes[0].get_legend_handles_labels()
        drawn.legend(*handles, loc="outside upper right", ncols=4)
        svg = inline(drawn, "figure-8", "limit cycles under PID")
    caption = "PID, the last 10 s of a stand of 60 s: what goes on moving is a limit cycle."
    rows = _table(FIGURES, case_rows(found.simulation.pid))
    more = _table(FIGURES, case_rows(found.simulation.pid_table_3))
    return Section("Figure 8", picture(svg, caption) + rows + more)


def _drift(found: Study) -> Section:
    rig = found.rig
    with style():
        drawn = figure(9.0, 6.6)
        axes = drawn.subplots(3, 1, sharex=True)
        for place, (name, cases) in zip(axes, rig.drifted.items(), strict=True):
            for key, colour in zip(("none", "old", "new"), CURVE_COLOURS, strict=False):
                run = cases[key].run
                line(place, run.t, 1e3 * (run.r - run.y), color=colour, label=RUN_LABELS[key])
            label(place, "", "error [mm]", name)
        label(axes[-1], "time [s]", "error [mm]", "RST")
        handles = axes[0].get_legend_handles_labels()
        drawn.legend(*handles, loc="outside upper right", ncols=3)
        svg = inline(drawn, "figures-14-22", "error after the drift under PD, PID and RST")
    caption = (
        "The rig after its drift (table 3) along a sine of 0.1 m and 20 s, under the printed PD, a"
        " PID placed on the printed model, and the printed RST. Old and new parameters are"
        " identified from one simulated log each. Amplitude and period are ours, chosen among 216"
        " for the printed ratios; the rig's actuator is worked out from the printed RST model."
    )
    rows = [row for name, cases in rig.drifted.items() for row in _named(name, cases)]
    return Section(
        "Figures 11 to 22",
        picture(svg, caption)
        + _table(FIGURES, rows)
        + _table(FIGURES, _named("PD before the drift", rig.before)),
    )


def _named(name: str, cases: Mapping[str, Case]) -> list[tuple[str, ...]]:
    return [(f"{name}, {row[0]}", *row[1:]) for row in case_rows(dict(cases))]


def _competitors(found: Study, number: int) -> Section:
    rows = rival_servo_rows(found, number)
    lines = (
        "each with the setting of the least squared error under another noise",
        "what rests on a model has the paper's estimates of table 1, the true values of table 3",
    )
    return Section(f"Rivals on the plant of table {number}", _table(FIGURES, rows, lines))


def _maps(maps: Sensitivity) -> Section:
    with style():
        drawn = figure(9.0, 5.2)
        axes = drawn.subplots(2, len(maps.noises), sharex=True, sharey=True)
        for row, (values, unit, scale) in enumerate(
            ((maps.standstill, "standstill [mm]", 1e3), (maps.chatter, "chatter [N]", 1.0))
        ):
            shown = scale * values
            low, high = float(np.min(shown)), float(np.max(shown))
            for column, noise in enumerate(maps.noises):
                place = axes[row][column]
                drawn_map = place.imshow(
                    shown[column], aspect="auto", origin="lower", vmin=low, vmax=high,
                    cmap="viridis",
                )  # fmt: skip
                place.grid(visible=False)
                place.set_xticks(range(len(maps.e_T)), [f"{1e3 * e:g}" for e in maps.e_T])
                place.set_yticks(range(len(maps.N_c)), [f"{n:g}" for n in maps.N_c])
                title = f"{noise:g} x noise" if row == 0 else ""
                label(place, "e_T [mm]" if row else "", "" if column else "N_c", title)
            drawn.colorbar(drawn_map, ax=axes[row], label=unit)
        svg = inline(drawn, "maps", "error at standstill and chatter against N_c and e_T")
    caption = (
        "PD and compensator (4) on table 1. Chatter: standard deviation of F_comp's change from"
        " sample to sample. Noise in units of the paper's."
    )
    return Section("Sensitivity to N_c, e_T and noise", picture(svg, caption))


def _wrong(maps: Sensitivity) -> Section:
    with style():
        drawn = figure(7.0, 3.6)
        axes = drawn.subplots(1, 1)
        for (name, errors), colour in zip(maps.wrong.items(), CURVE_COLOURS, strict=False):
            axes.plot(maps.factors, errors, color=colour, marker="o", ms=3, label=name)
        axes.legend(ncols=3)
        label(axes, "parameter over its true value", "squared error over that with all true")
        svg = inline(drawn, "wrong", "squared error against one wrong parameter")
    caption = "One parameter of the compensator wrong at a time; m and F_v are not in eq. (4)."
    return Section("Sensitivity to wrong parameters", picture(svg, caption))


def _beyond(found: Study) -> Section:
    ours = found.ours
    runs: dict[str, ServoRun] = {"paper's design, new parameters": ours.paper.run}
    runs |= {"our design without compensator": ours.bare.run, "our design": ours.ours.run}
    with style():
        drawn = figure(9.0, 3.6)
        axes = drawn.subplots(1, 1)
        for (name, run), colour in zip(runs.items(), CURVE_COLOURS, strict=False):
            line(axes, run.t, 1e3 * (run.r - run.y), color=colour, label=name)
        drawn.legend(loc="outside upper right", ncols=3)
        label(axes, "time [s]", "error [mm]")
        svg = inline(drawn, "beyond", "error of the paper's design and of ours")
    caption = (
        f"RST with dominant poles {ours.tuned.dominant[0]:.3g} rad/s, zeta"
        f" {ours.tuned.dominant[1]:g}; compensator: {ours.chosen}. Squared error"
        f" {ours.ratio:.3f} of the paper's design with new parameters."
    )
    return Section("Our design", picture(svg, caption))


def _positions(axes: "Axes", cases: Mapping[str, Case]) -> None:
    first = next(iter(cases.values())).run
    line(axes, first.t, 1e3 * first.r, color=MEASURED, ls=":", label="reference")
    for (name, case), colour in zip(cases.items(), CURVE_COLOURS[1:], strict=False):
        line(axes, case.run.t, 1e3 * case.run.y, color=colour, label=name)
    label(axes, "time [s]", "position [mm]")
