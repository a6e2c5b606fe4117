"""Remarks of two kinds: those that change how a result is read or used, and asides."""


class MinorRemark(str):
    """A remark on which a reader of the result cannot act, and that does not change how it reads.

    It is printed in reports and with `--verbose`; read back from a file it is a text as any other.
    """

    __slots__ = ()
