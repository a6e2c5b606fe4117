"""A controller as values: the program itself as a tree, and what a MATLAB model needs of it."""

from dataclasses import asdict
from typing import Any

import numpy as np

from design.feed_forward import FeedForward
from design.generated.exported import Exported, lead_of, title_of
from design.program import (
    Assign,
    Choice,
    Constant,
    Element,
    Number,
    Operation,
    Remark,
    Repeat,
    Variable,
)
from design.servo import Compensation
from identification.model.karnopp import NAMES
from identification.signals.filters import slope_filter

PROGRAM_SCHEMA = "program/1"
PROGRAM_KEYS = ("inputs", "output", "constants", "tables", "states", "locals")


def program_document(what: Exported) -> dict[str, Any]:
    """The program as a tree, the values behind it and the test vector."""
    program = what.program
    return {
        "schema": PROGRAM_SCHEMA,
        "title": title_of(what),
        "lead": lead_of(what),
        "name": program.name,
        "controller": what.controller,
        "h": program.h,
        "ratio": program.ratio,
        **{key: getattr(program, key) for key in PROGRAM_KEYS},
        "program": _tree(program.statements),
        "values": values_of(what),
        "test": {"inputs": what.test.inputs, "outputs": what.test.outputs},
    }


def matlab_values(what: Exported) -> dict[str, Any]:
    """The values behind the program and the test vector, an empty matrix where there is none."""
    test = what.test
    names = {
        one.name: column for one, column in zip(what.program.inputs, test.inputs.T, strict=True)
    }
    return {
        "title": title_of(what),
        **_filled_in(values_of(what)),
        "test": {**names, what.program.output.name: test.outputs},
    }


def values_of(what: Exported) -> dict[str, Any]:
    """The difference equation, the force loop below it and the compensator beside it.

    As `docs/contract.md` has them for design.json, "In the drive's own terms".
    """
    loop, units = what.loop, what.program
    law, force, compensation = loop.law, loop.force, loop.compensation
    own = what.design.p_pi if what.controller == "p-pi" else None
    return {
        "law": asdict(law),
        "force": None if force is None else asdict(force),
        "h": loop.h,
        "limit": loop.limit,
        "rate": loop.rate,
        "k_a": loop.k_a,
        "units": {one.name: one.unit for one in (*units.inputs, units.output)},
        "compensator": _compensator(what),
        "feed_forward": asdict(compensation) if isinstance(compensation, FeedForward) else None,
        "acceleration": loop.acceleration,
        "cascade": None if own is None or own.cascade is None else asdict(own.cascade),
        "filter": None if own is None or own.series is None else {
            **asdict(own.series), "b": own.series.filter.b, "a": own.series.filter.a,
        },
    }  # fmt: skip


def _compensator(what: Exported) -> dict[str, Any] | None:
    """The compensator (4) and its filters, each as b, a in z^-1; None where there is none."""
    if not isinstance(what.loop.compensation, Compensation):
        return None
    own, filters = what.loop.compensation.compensator, what.loop.compensation.filters
    parts = {
        "A": filters.velocity,
        "B": filters.error,
        "C": filters.force,
        "slope": slope_filter(what.loop.law.h, filters.N_d),
    }
    return {
        **{name: getattr(own.friction, name) for name in NAMES},
        "N_c": own.N_c,
        "e_T": own.e_T,
        "excess": own.excess,
        "filters": {name: {"b": one.b, "a": one.a} for name, one in parts.items()},
    }


def _filled_in(value: Any) -> Any:
    """The value with an empty matrix where there is none, and rows of numbers as arrays."""
    match value:
        case None:
            return np.zeros((0, 0))
        case dict():
            return {key: _filled_in(entry) for key, entry in value.items()}
        case tuple():
            return np.array(value, dtype=np.float64)
    return value


def _tree(one: Any) -> Any:
    """A statement or an operation as a list, what it is first; a number, a name."""
    match one:
        case tuple():
            return [_tree(each) for each in one]
        case Assign(target, value):
            return ["=", _tree(target), _tree(value)]
        case Choice(condition, then, otherwise):
            return ["if", _tree(condition), _tree(then), _tree(otherwise)]
        case Repeat(index, count, body):
            return ["for", index.name, count, _tree(body)]
        case Remark(text):
            return ["#", text]
        case Number(number):
            return number
        case Constant(name) | Variable(name):
            return name
        case Element(array, index):
            return ["[]", array, _tree(index)]
        case Operation(operator, arguments):
            return [operator, *_tree(arguments)]
