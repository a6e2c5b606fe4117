"""Results as plain tables, a parameter as value, unit and interval."""

from collections.abc import Mapping
from dataclasses import asdict, fields, is_dataclass
from typing import Any

from identification.model.estimates import Estimate


def plain(value: object) -> Any:
    """Dataclasses as dictionaries, parameters as results carry them."""
    match value:
        case Estimate():
            return as_number(value)
        case _ if is_dataclass(value):
            return {each.name: plain(getattr(value, each.name)) for each in fields(value)}
        case Mapping():
            return {key: plain(entry) for key, entry in value.items()}
        case list():
            return [plain(entry) for entry in value]
        case tuple():
            return tuple(plain(entry) for entry in value)
    return value


def as_number(estimate: Estimate) -> dict[str, Any]:
    """One parameter as results carry it; beside value and interval only what says something."""
    number = asdict(estimate)
    return {
        key: value
        for key, value in number.items()
        if value is not None or key not in ("reason", "assumed", "at_most")
    }
