"""Remarks: those that change how a result is read or used, asides, and what was left out."""

from collections.abc import Iterable


class MinorRemark(str):
    """A remark on which a reader of the result cannot act, and that does not change how it reads.

    It is printed in reports and with `--verbose`; read back from a file it is a text as any other.
    """

    __slots__ = ()


class LeftOut(str):
    """A remark on a log, or runs of one, that are left out, which a refusal of the rest names."""

    __slots__ = ()


def left_out(remarks: Iterable[str]) -> list[str]:
    """The remarks on runs and logs that are left out."""
    return [one for one in remarks if isinstance(one, LeftOut)]
