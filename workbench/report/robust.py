"""A robust design as a table for a terminal and as a page: shares of machines, and their curves."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from identification.arrays import Array
from workbench.cards.parameter_units import shown
from workbench.cards.readable import length, number, shown_unit
from workbench.output import Row, written
from workbench.report.controllers import coefficients, controllers, drive_section
from workbench.report.design_tables import design_lines
from workbench.report.figures import (
    GREY,
    MEASURED,
    MODEL,
    REFERENCE,
    figure,
    inline,
    label,
    line,
    style,
)
from workbench.report.notes import notes
from workbench.report.page import Section, page
from workbench.report.templating import render
from workbench.screen import Screen, listed, screen, tabled
from workbench.steps.loop_figures import PRESENT
from workbench.steps.robust.outcomes import MEASURES, Measure
from workbench.steps.robust.robust import NOMINAL, ROBUST, Promise, Robust, Spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROBUST_HEAD = ("over the machines drawn", "limit", "kept", "5 %", "median", "95 %")
BESIDE_HEAD = ("median, and share that keeps the limit", "robust", "nominal", "present")
CURVE_LOOKS = {ROBUST: (MODEL, "-"), NOMINAL: (GREY, ":"), PRESENT: (MEASURED, "-.")}
AXIS_WIDEST = 12.0  # times the middle of all curves, to which an axis goes


def robust_sentence(found: Robust) -> str:
    """What was found, in one or two sentences."""
    promise, share = found.promises[ROBUST], 100 * found.asked.probability
    if not found.passed:
        return (
            f"No loop of {found.tried} keeps each limit on {share:g} % of the machines drawn; the"
            f" nearest misses: {'; '.join(found.missed)}."
        )
    called = promise.controller.upper()
    with_it = " with the compensator" if promise.compensator else ""
    least = min(
        (one.kept for one in promise.measures.values() if one.kept is not None), default=1.0
    )
    if promise.every == 1.0:
        return (
            f"{called}{with_it}: keeps every limit on each of {found.asked.draws} machines drawn."
        )
    return (
        f"{called}{with_it}: each limit holds on at least {100 * least:.0f} % of"
        f" {found.asked.draws} machines drawn, all of them at once on {100 * promise.every:.0f} %."
    )


def promise_rows(found: Robust, rotary: bool) -> list[Row]:
    """A row a measure of the robust loop, by `ROBUST_HEAD`."""
    return [
        (
            one.words,
            "" if spread.limit is None else _limit(one, spread.limit, rotary),
            "" if spread.kept is None else f"{100 * spread.kept:.0f} %",
            *(_said(one, value, rotary) for value in (spread.low, spread.median, spread.high)),
        )
        for one, spread in _of(found.promises[ROBUST])
    ]


def beside_rows(found: Robust, rotary: bool) -> list[Row]:
    """The medians of every loop, and the shares, by `BESIDE_HEAD`."""
    return [
        (one.words, *(_beside(one, found.promises.get(name), rotary) for name in CURVE_LOOKS))
        for one, _ in _of(found.promises[ROBUST])
    ]


def _beside(one: Measure, promise: Promise | None, rotary: bool) -> str:
    spread = None if promise is None else promise.measures.get(one.name)
    if spread is None:
        return "-"
    kept = "" if spread.kept is None else f" ({100 * spread.kept:.0f} %)"
    return f"{_said(one, spread.median, rotary)}{kept}"


def _of(promise: Promise) -> list[tuple[Measure, Spread]]:
    return [(one, promise.measures[one.name]) for one in MEASURES if one.name in promise.measures]


def _limit(one: Measure, value: float, rotary: bool) -> str:
    said = _said(one, value, rotary)
    if said == "none":
        return said
    return f"at least {said}" if one.floor else f"at most {said}"


def _said(one: Measure, value: float, rotary: bool) -> str:
    """A value of a measure in words."""
    if not np.isfinite(value):
        return "any" if one.floor else "runs away"
    match one.kind:
        case "share":
            return f"{number(100 * value)} %"
        case "length":
            return "none" if value == 0.0 else length(value, rotary)
        case "time":
            return f"{number(value)} s"
        case "samples":
            return f"{number(value)} samples"
    return number(value)


def robust_lines(found: Robust, rotary: bool) -> list[str]:
    """How it was chosen, and what to know of it."""
    return [*choice_lines(found, rotary), *(f"note: {one}" for one in robust_remarks(found))]


def robust_remarks(found: Robust) -> tuple[str, ...]:
    """What it misses, and its remarks."""
    return (*found.missed, *found.remarks)


def choice_lines(found: Robust, rotary: bool) -> list[str]:
    """How it was chosen."""
    speed, (unit, factor) = found.speed, shown_unit(shown(rotary).velocity)
    drift = ", ".join(f"{n} {100 * s:.2g} %" for n, s in (found.asked.drift or {}).items())
    return [
        f"the best of {found.tried} loops, chosen on {found.asked.draws} machines; the shares are"
        f" counted on as many drawn anew (seed {found.asked.seed})",
        *([f"drawn with the drift seen so far: {drift}"] if drift else []),
        f"slow ramp: {number(factor * speed)} {unit}, half the narrowest stick band",
    ]


def robust_view(found: Robust, folder: Path | None, rotary: bool) -> Screen:
    """The robust design for a terminal."""
    names = ("design.json", "robust.json", "report.html")
    return screen(
        robust_sentence(found),
        tabled(ROBUST_HEAD, promise_rows(found, rotary), right=(2, 3, 4, 5)),
        tabled(BESIDE_HEAD, beside_rows(found, rotary), right=(1, 2, 3)),
        listed(choice_lines(found, rotary)),
        notes(robust_remarks(found)),
        *([] if folder is None else [written(folder, *names)]),
    )


def robust_report(found: Robust, rotary: bool) -> str:
    """HTML: the curves over the machines, the shares, the controllers and their equations."""
    with style():
        svg = inline(robust_figure(found, rotary), "robust", "shares of machines by measure")
    caption = (
        "Share of the machines drawn (upwards) on which a measure is at most the value (to the"
        " right): the robust loop, the nominal design's, the present one. Broken: the limit."
    )
    design = found.design
    sections = [
        Section("Over the machines that there may be", render("figure", svg=svg, caption=caption)
                + render("table", head=ROBUST_HEAD, rows=promise_rows(found, rotary),
                         lines=robust_lines(found, rotary))),
        Section("Beside the nominal design and the present controller",
                render("table", head=BESIDE_HEAD, rows=beside_rows(found, rotary), lines=[])),
        controllers(design, rotary),
        coefficients(design),
        drive_section(design),
        Section("Notes", render("table", head=(), rows=(), lines=design_lines(design, rotary))),
    ]  # fmt: skip
    then = _then(found)
    return page(f"Robust design for {design.card}", robust_sentence(found), sections, then)


def _then(found: Robust) -> list[str]:
    if not found.passed:
        return ["`workbench experiment MODEL` finds the run that narrows what is not sure, then"
                " identify and design again"]  # fmt: skip
    return ["`workbench validate MODEL design.json` shows its loops in time, `workbench export"
            " design.json --to c` writes the code"]  # fmt: skip


def robust_figure(found: Robust, rotary: bool) -> "Figure":
    """The share of machines over each measure's value, for every loop."""
    wanted = [one for one, _ in _of(found.promises[ROBUST]) if _varies(found, one.name)]
    rows = max(-(-len(wanted) // 3), 1)
    with style():
        drawn = figure(9.0, 0.9 + 2.3 * rows)
        every = np.atleast_1d(drawn.subplots(rows, 3, sharey=True)).ravel()
        for axes, one in zip(every, wanted, strict=False):
            _shares(axes, found, one, rotary)
        for axes in every[len(wanted) :]:
            axes.remove()
        for axes in every[::3]:
            axes.set_ylabel("share of machines [%]")
        handles, names = every[0].get_legend_handles_labels()
        drawn.legend(handles, names, loc="outside upper center", ncols=4)
    return drawn


def _varies(found: Robust, name: str) -> bool:
    """Whether any loop has another value than the others' first."""
    values = [_finite(one.found.values[name]) for one in found.promises.values()
              if name in one.found.values]  # fmt: skip
    told = np.concatenate(values) if values else np.zeros(0)
    return told.size > 0 and float(np.ptp(told)) > 0.0


def _finite(values: Array) -> Array:
    return values[np.isfinite(values)]


def _shares(axes: "Axes", found: Robust, one: Measure, rotary: bool) -> None:
    factor, unit = _axis(one, rotary)
    limit = found.promises[ROBUST].measures[one.name].limit
    told: list[Array] = []
    for name, promise in found.promises.items():
        values = promise.found.values.get(one.name)
        if values is None:
            continue
        at = np.sort(factor * values)
        share = 100.0 * np.arange(1, len(at) + 1) / len(at)
        keep = np.isfinite(at)
        told.append(at[keep])
        line(axes, np.repeat(at[keep], 2), np.repeat(share[keep], 2), color=CURVE_LOOKS[name][0],
             ls=CURVE_LOOKS[name][1], lw=1.2, label=name)  # fmt: skip
    if limit is not None:
        axes.axvline(factor * limit, color=REFERENCE, ls="--", lw=1.0, label="limit")
    _within(axes, told, None if limit is None else factor * limit)
    axes.set_ylim(-3.0, 103.0)
    label(axes, f"{one.words.split(',')[0]}{unit}", "")


def _within(axes: "Axes", told: Sequence[Array], limit: float | None) -> None:
    """The axis to the curves, but not to the far end of one that runs off."""
    every = np.concatenate([*told, [] if limit is None else [limit]])
    if every.size == 0:
        return
    low, high = float(np.min(every)), float(np.max(every))
    middle = max(float(np.median(np.abs(every))), limit or 0.0)
    high = min(high, AXIS_WIDEST * middle) if middle > 0.0 else high
    room = 0.05 * max(high - low, 1e-9 * max(abs(high), 1.0))
    axes.set_xlim(low - room, high + room)


def _axis(one: Measure, rotary: bool) -> tuple[float, str]:
    match one.kind:
        case "share":
            return 100.0, " [%]"
        case "length":
            unit, factor = shown_unit(shown(rotary).position)
            return factor, f" [{unit}]"
        case "time":
            return 1.0, " [s]"
        case "samples":
            return 1.0, " [samples]"
    return 1.0, ""
