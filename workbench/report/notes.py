"""Remarks for a screen and a report: printed once for all logs that they hold for."""

from collections.abc import Collection, Iterable
from dataclasses import replace

from identification.remarks import MinorRemark
from workbench.remarks import Merged, merged, printed_once
from workbench.screen import Part, instead

MOST_NOTES = 6


def notes(remarks: Iterable[str], logs: Collection[str] = (), most: int = MOST_NOTES) -> Part:
    """The remarks for a terminal: merged and without asides; with --verbose each as it is.

    logs: names with which a remark on one log begins.
    """
    every = tuple(remarks)
    main = printed_once((one for one in every if not isinstance(one, MinorRemark)), logs)
    shown = [one._replace(text=f"note: {one.text}") for one in report_notes(every, logs)]
    return replace(instead(_noted(main), _noted(every), most, yields=True), merged=shown)


def report_notes(remarks: Iterable[str], logs: Collection[str] = ()) -> list[Merged]:
    """All remarks for a report, asides after the others; those merged with what each said."""
    return merged(sorted(remarks, key=lambda one: isinstance(one, MinorRemark)), logs)


def _noted(lines: Iterable[str]) -> list[str]:
    return [f"note: {line}" for line in lines]
