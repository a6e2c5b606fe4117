"""The rule of what is reported, as a reader of the results has it: what breaks it in an estimate or
a file."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from identification.model.estimates import Estimate

AS_ZERO = 1.1e-9  # a plant's smallest parameter


def broken(one: Estimate, bounds: tuple[float, float] | None = None) -> str | None:
    """What breaks the rule in an estimate, None where nothing does.

    bounds: at which it is at one, by default where a plant keeps what comes out 0.
    """
    return _broken(asdict(one), bounds)


def broken_in(document: object, path: str = "") -> Iterator[str]:
    """What breaks the rule in a result: every parameter below, with its path."""
    if isinstance(document, Mapping):
        if {"value", "unit", "sd", "low", "high"} <= set(document):
            said = _broken(document, None)
            if said:
                yield f"{path}: {said} ({dict(document)})"
            return
        for key, entry in document.items():
            if key == "change":  # relative, with 0 in its interval where nothing has moved
                continue
            yield from broken_in(entry, f"{path}.{key}")
    elif isinstance(document, Sequence) and not isinstance(document, str):
        for number, entry in enumerate(document):
            yield from broken_in(entry, f"{path}[{number}]")


def _broken(one: Mapping[str, Any], bounds: tuple[float, float] | None) -> str | None:
    value, low, high = one["value"], one["low"], one["high"]
    if value is None:
        reasoned = one.get("reason") and one.get("assumed") is not None
        return None if reasoned and low is None and high is None else "null without its reason"
    if low is None or high is None:  # given, as by a card, and no estimate
        return (
            None
            if low is high is one["sd"] and one.get("reason")
            else "neither estimated nor given"
        )
    if not low < high:
        return "an interval of no width"
    if not low <= value <= high:
        return "an interval beside its value"
    if high - low > abs(value):
        return "an interval wider than the value"
    if abs(value) <= AS_ZERO if bounds is None else value in bounds:
        return "a value at its bound"
    return None
