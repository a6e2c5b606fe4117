"""The registry as tables for a terminal."""

from collections.abc import Sequence
from datetime import datetime

from design.judgement import ALARMING
from design.machine.difference import Line, Number, as_read
from design.machine.readable import in_digits, number
from identification.model.estimates import NORMAL_95
from workbench.registry.values import Decision, LogOutcome, MachineState, Version
from workbench.screen import Part, Screen, screen, tabled
from workbench.verdicts import counted, in_words

SHORT = 12  # characters of a fingerprint that are shown


def list_screen(machines: Sequence[MachineState]) -> Screen | str:
    """A line a machine."""
    if not machines:
        return "no machine yet; 'workbench registry add MACHINE MODEL DESIGN' makes one"
    head = ("machine", "active", "since", "versions", "logs", "waiting", "excluded")
    rows = [
        (
            one.name,
            "-" if one.in_force is None else str(one.in_force.number),
            "-" if one.since is None else moment(one.since.at),
            *(str(n) for n in (one.versions, one.logs, one.waiting, one.set_aside)),
        )
        for one in machines
    ]
    return screen(tabled(head, rows))


def machine_screen(
    state: MachineState,
    decisions: Sequence[Decision],
    outcomes: Sequence[LogOutcome],
    accepted: Version | None,
) -> Screen:
    """A machine: the active version and why, the latest decisions and results of logs; with
    --verbose all of them. accepted: the version that somebody has accepted last."""
    if state.in_force is None or state.since is None:
        first = f"{state.name}: no active version; 'workbench registry promote {state.name} N'"
    else:
        first = (
            f"{state.name}: version {state.in_force.number} active since"
            f" {moment(state.since.at)}, by {state.since.made_by}: {state.since.reason}"
        )
    parts: list[Part | str] = [first]
    if state.in_force and accepted and state.in_force.model != accepted.model:
        number = state.in_force.number
        parts.append(
            f"nobody has accepted version {number}: the axis test's limits are those of version"
            f" {accepted.number}; 'workbench registry promote {state.name} {number}' accepts it"
        )
    head = ("decision", "version", "at", "by", "log", "reason")
    rows = [
        (in_words(d.kind), str(d.number), moment(d.at), d.made_by, short(d.log), d.reason)
        for d in decisions
    ]
    parts.append(tabled(head, rows, latest=True))
    if outcomes:
        parts.append(outcomes_table(outcomes))
    if state.waiting:
        parts.append(f"{counted(state.waiting, 'log')} still without a result")
    return screen(*parts)


def outcomes_table(outcomes: Sequence[LogOutcome], *, alarms_first: bool = False) -> Part:
    """A line a log, the latest last; alarms_first: those to be looked at, on one screen."""

    def rows(of: Sequence[LogOutcome]) -> list[tuple[str, ...]]:
        return [
            (
                o.machine,
                o.log.file,
                in_words(o.verdict),
                "-" if o.number is None else str(o.number),
                o.reason,
            )
            for o in of
        ]

    head = ("machine", "log", "verdict", "against version", "reason")
    if not alarms_first:
        return tabled(head, rows(outcomes), latest=True)
    first = sorted(outcomes, key=lambda one: one.verdict not in ALARMING)
    return tabled(head, rows(first), whole=rows(outcomes))


def difference_screen(lines: Sequence[Line], names: tuple[str, str]) -> Screen:
    """Two versions side by side."""
    shown, said = as_read(lines, names)
    head = ("parameter", names[0], "unit", "95 %", names[1], "95 %", "change")
    rows = [
        (
            line.name,
            value,
            line.unit,
            interval,
            *_cells(line.after),
            _change(line),
        )
        for line in shown
        for value, interval in [_cells(line.before)]
    ]
    return screen(tabled(head, rows), *([said] if said else ()))


def moment(at: datetime) -> str:
    """A moment in UTC, to the second."""
    return f"{at:%Y-%m-%d %H:%M:%S}Z"


def short(digest: str | None) -> str:
    """The beginning of a fingerprint."""
    return "-" if digest is None else digest[:SHORT]


def _cells(found: Number | str | None) -> tuple[str, str]:
    """Value and interval, with as many digits as the interval leaves meaning to."""
    if not isinstance(found, Number):
        return found or "-", ""
    if found.value is None or found.low is None or found.high is None:
        return "-" if found.value is None else f"{found.value:.5g}", ""
    sd = (found.high - found.low) / (2.0 * NORMAL_95)
    value, low, high = in_digits((found.value, found.low, found.high), found.value, sd)
    return value, f"{low} to {high}"


def _change(line: Line) -> str:
    if line.before == line.after:
        return ""
    if line.change is None:
        return "changed"
    sure = " (intervals apart)" if line.apart else ""
    sign = "+" if line.change > 0 else ""
    return f"{sign}{number(100 * line.change, 2)} %{sure}"
