"""Two versions side by side: every number of model and design, with its unit and interval."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from design.machine.readable import shown_unit

MODEL_PARTS = ("friction", "actuator", "effects")
DESIGN_PARTS = ("recommended", "force", "rst", "pid", "p_pi", "compensator")
LEFT_OUT = ("compensator.friction",)  # the model's own nine


@dataclass(frozen=True)
class Number:
    """A parameter as a document has it; value None with a reason where the logs do not identify
    it."""

    value: float | None
    low: float | None
    high: float | None
    reason: str | None


Entry = tuple[str, Number | str]  # with its unit


@dataclass(frozen=True)
class Line:
    """One parameter of two versions; change relative to the first, None where there is none.

    apart: whether the two 95 % intervals have nothing in common; None where one has none.
    """

    part: str
    name: str
    unit: str
    before: Number | str | None
    after: Number | str | None
    change: float | None
    apart: bool | None


def difference(
    before: Mapping[str, Mapping[str, Any] | None], after: Mapping[str, Mapping[str, Any] | None]
) -> tuple[Line, ...]:
    """The parameters of two versions, each given as documents by kind ("model", "design")."""
    out: list[Line] = []
    for part, keys in (("model", MODEL_PARTS), ("design", DESIGN_PARTS)):
        one = dict(_entries(before.get(part), keys))
        other = dict(_entries(after.get(part), keys))
        for name in dict.fromkeys((*one, *other)):
            out.append(_line(part, name, one.get(name), other.get(name)))
    return tuple(out)


def as_read(lines: Sequence[Line], names: tuple[str, str]) -> tuple[tuple[Line, ...], str]:
    """The lines in the units in which people read them; a part that only one version has is left
    out, and said."""
    out, said = list[Line](), list[str]()
    for part in dict.fromkeys(line.part for line in lines):
        own = [line for line in lines if line.part == part]
        lacking = [name for name, side in zip(names, ("before", "after"), strict=True)
                   if all(getattr(line, side) is None for line in own)]  # fmt: skip
        said += [f"{name} has no {part}" for name in lacking]
        for line in [] if lacking else own:
            unit, factor = shown_unit(line.unit)
            before, after = (_times(one, factor) for one in (line.before, line.after))
            out.append(replace(line, unit=unit, before=before, after=after))
    return tuple(out), "; ".join(said)


def _times(found: Number | str | None, factor: float) -> Number | str | None:
    if not isinstance(found, Number):
        return found
    value, low, high = (
        None if one is None else factor * one for one in (found.value, found.low, found.high)
    )
    return Number(value, low, high, found.reason)


def _entries(
    document: Mapping[str, Any] | None, keys: tuple[str, ...]
) -> Iterator[tuple[str, Entry]]:
    for key in keys:
        found = (document or {}).get(key)
        if isinstance(found, str):
            yield key, ("", found)
        elif isinstance(found, Mapping):
            prefix = "" if key == "friction" or key == "actuator" else f"{key}."
            yield from _numbers(found, prefix)


def _numbers(found: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Entry]]:
    """Everything below that has a value and a unit, by its path."""
    for key, entry in found.items():
        name = f"{prefix}{key}"
        if not isinstance(entry, Mapping) or name in LEFT_OUT:
            continue
        if "unit" in entry and "value" in entry:
            low, high, reason = (entry.get(k) for k in ("low", "high", "reason"))
            yield name, (str(entry["unit"]), Number(entry["value"], low, high, reason))
        else:
            yield from _numbers(entry, f"{name}.")


def _line(part: str, name: str, one: Entry | None, other: Entry | None) -> Line:
    unit, before, after = (other or one or ("",))[0], one and one[1], other and other[1]
    change = apart = None
    same_unit = one is not None and other is not None and one[0] == other[0]
    if same_unit and isinstance(before, Number) and isinstance(after, Number):
        if before.value and after.value is not None:
            change = (after.value - before.value) / abs(before.value)
        apart = _apart(before, after)
    return Line(part, name, unit, before, after, change, apart)


def _apart(one: Number, other: Number) -> bool | None:
    if one.low is None or one.high is None or other.low is None or other.high is None:
        return None
    return one.high < other.low or other.high < one.low
