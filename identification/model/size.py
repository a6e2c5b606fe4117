"""A number with its standard deviation."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Size:
    """A size and its standard deviation; both 0 where it does not show."""

    value: float = 0.0
    sd: float = 0.0


NOT_SHOWN = Size()
