"""Templates of code filled in, and numbers in lines."""

import textwrap
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from typing import Any

from design.feed_forward import FeedForward
from workbench.export.exported import Exported
from workbench.output import templates

WIDEST = 96  # characters of a line of numbers
KEPT_BLANK = "\0"  # a blank within a value, at which no line ends


def filled(template: str, *, markup: bool = False, **values: Any) -> str:
    """The template `<template>.j2` filled in; with `markup`, values are escaped for XML."""
    found = templates("workbench.export", escaped=markup, keep_trailing_newline=True)
    return found.get_template(f"{template}.j2").render(**values)


def rows(values: Iterable[str]) -> list[str]:
    """Values with commas between them, in lines."""
    whole = ", ".join(value.replace(" ", KEPT_BLANK) for value in values)
    lines = textwrap.wrap(whole, WIDEST, break_long_words=False, break_on_hyphens=False)
    return [line.replace(KEPT_BLANK, " ") for line in lines]


def title_of(what: Exported) -> str:
    """One line that says what a file is."""
    kind = {"rst": "RST", "pid": "PID", "p-pi": "P-PI", "present": "present"}[what.controller]
    beside = " with friction compensator" if what.loop.compensation else ""
    if isinstance(what.loop.compensation, FeedForward):
        beside = " with feed-forward of acceleration and friction"
    return f"{what.design.card}: {kind} controller{beside}"


def heading_of(what: Exported) -> dict[str, Any]:
    """What every file says of a controller."""
    program = what.program
    return {"title": title_of(what), "lead": lead_of(what), "name": program.name, "h": program.h}


def lead_of(what: Exported) -> Sequence[str]:
    """What to know of a file, in lines."""
    program = what.program
    turns = (
        f", its position controller at every {program.ratio}th call" if program.ratio > 1 else ""
    )
    return (
        f"Made by servo-workbench {version('servo-workbench')} from a design of this machine.",
        f"Runs every {program.h:.12g} s{turns}.",
        "Letters are the paper's: r reference, y position, F_e force on the body, u command;",
        "R, S, T polynomials in z^-1; v velocity, e_y error; F_c, F_s, dv of Karnopp's friction.",
        *what.remarks,
    )
