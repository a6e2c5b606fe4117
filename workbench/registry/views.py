"""The registry as tables for a terminal."""

from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING

from workbench.output import table
from workbench.registry.difference import Line, Number
from workbench.registry.values import Decision, LogOutcome, MachineState

if TYPE_CHECKING:
    from rich.console import Group
    from rich.padding import Padding

SHORT = 12  # characters of a fingerprint that are shown


def list_view(machines: Sequence[MachineState]) -> "Padding | str":
    """A line a machine."""
    if not machines:
        return "no machine yet; 'workbench registry add MACHINE MODEL DESIGN' makes one"
    head = ("machine", "in force", "since", "versions", "logs", "waiting", "set aside")
    return table(
        head,
        [
            (
                one.name,
                "-" if one.in_force is None else str(one.in_force.number),
                "-" if one.since is None else moment(one.since.at),
                *(str(n) for n in (one.versions, one.logs, one.waiting, one.set_aside)),
            )
            for one in machines
        ],
    )


def machine_view(
    state: MachineState, decisions: Sequence[Decision], outcomes: Sequence[LogOutcome]
) -> "Group":
    """A machine: what is in force and why, every decision, every log's result."""
    from rich.console import Group, RenderableType

    if state.in_force is None or state.since is None:
        first = f"{state.name}: nothing in force; 'workbench registry promote {state.name} N'"
    else:
        first = (
            f"{state.name}: version {state.in_force.number} in force since"
            f" {moment(state.since.at)}, by {state.since.made_by}: {state.since.reason}"
        )
    parts: list[RenderableType] = [first]
    parts.append(
        table(
            ("decision", "version", "at", "by", "log", "reason"),
            [
                (d.kind, str(d.number), moment(d.at), d.made_by, short(d.log), d.reason)
                for d in decisions
            ],
        )
    )
    if outcomes:
        parts.append(outcomes_view(outcomes))
    if state.waiting:
        parts.append(f"{state.waiting} log(s) wait for a result")
    return Group(*parts)


def outcomes_view(outcomes: Sequence[LogOutcome]) -> "Padding":
    """A line a log."""
    return table(
        ("machine", "log", "verdict", "version", "reason"),
        [
            (o.machine, o.log.file, o.verdict, "-" if o.number is None else str(o.number), o.reason)
            for o in outcomes
        ],
    )


def difference_view(lines: Sequence[Line], names: tuple[str, str]) -> "Padding":
    """Two versions side by side."""
    head = ("parameter", names[0], "unit", "95 %", names[1], "95 %", "change")
    return table(
        head,
        [
            (
                line.name,
                _value(line.before),
                line.unit,
                _interval(line.before),
                _value(line.after),
                _interval(line.after),
                _change(line),
            )
            for line in lines
        ],
    )


def moment(at: datetime) -> str:
    """A moment in UTC, to the second."""
    return f"{at:%Y-%m-%d %H:%M:%S}Z"


def short(digest: str | None) -> str:
    """The beginning of a fingerprint."""
    return "-" if digest is None else digest[:SHORT]


def _value(found: Number | str | None) -> str:
    if isinstance(found, Number):
        return "-" if found.value is None else f"{found.value:.5g}"
    return "-" if found is None else found


def _interval(found: Number | str | None) -> str:
    if not isinstance(found, Number) or found.low is None or found.high is None:
        return ""
    return f"{found.low:.5g} to {found.high:.5g}"


def _change(line: Line) -> str:
    if line.change is None:
        return "" if line.before == line.after else "changed"
    sure = " (intervals apart)" if line.apart else ""
    return f"{100 * line.change:+.2g} %{sure}"
