"""Which of two logs of a machine is the older: by the files' times, or by the numbers in names.

A copy made late has a new time, but its name still says when it was recorded ("run007.csv").
"""

import re
from collections.abc import Iterable
from pathlib import PurePath
from typing import Literal

from workbench.registry.values import SeenLog

Order = Literal["time-or-name", "time"]
_DIGITS = re.compile(r"(\d+)")
_YEAR = re.compile(r"(19|20)\d\d")


def older(log: SeenLog, other: SeenLog, order: Order = "time-or-name") -> bool:
    """Whether `log` was recorded before `other`, by its time or by the numbers in its name.

    order "time": by the files' times alone, for loggers whose numbers begin again.
    """
    if (log.mtime_ns, log.file) < (other.mtime_ns, other.file):
        return True
    if order == "time":
        return False
    one, two = _numbered(log.file), _numbered(other.file)
    return one is not None and two is not None and one[0] == two[0] and one[1] < two[1]


def newest_of_later(
    log: SeenLog, others: Iterable[SeenLog], order: Order = "time-or-name"
) -> SeenLog | None:
    """Of the others, the newest that `log` is older than; None where it is older than none."""
    later = [one for one in others if one.sha256 != log.sha256 and older(log, one, order)]
    return max(later, key=lambda one: (one.mtime_ns, one.file), default=None)


def _numbered(file: str) -> tuple[tuple[str, ...], tuple[int, ...]] | None:
    """A name's texts and its numbers; None where these are in no order of time.

    With the year last ("24.11.2026") a larger number may be an earlier day.
    """
    parts = _DIGITS.split(PurePath(file).stem)
    numbers = parts[1::2]
    if not numbers or any(_YEAR.fullmatch(number) for number in numbers[1:]):
        return None
    return tuple(parts[0::2]), tuple(int(number) for number in numbers)
