"""A machine's results as its page shows them: the last ones, their way to the webhook, and the axis
test of the newest against those before it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any, Literal, NamedTuple

from sqlalchemy import and_, select

from design.machine.readable import shown_unit
from design.measured.axis_limits import (
    FEWEST_EARLIER,
    MEANING_OF,
    Allowed,
    Light,
    light_of,
    limits_of,
)
from workbench.registry.database import Database
from workbench.registry.rows import accepted_version, judged_now
from workbench.registry.tables import (
    LogRow,
    MachineNowRow,
    NoticeRow,
    OutboxRow,
    OutcomeRow,
    VersionRow,
)
from workbench.registry.values import ALARMING

Delivered = Literal["", "sent", "waiting", "given up"]


@dataclass(frozen=True)
class TestedLog:
    """A log of the machine, when it was recorded and tested; verdict None: it waits.

    parameters: what it gave of each; delivered: whether the webhook has taken its alarm; sound:
    whether it is of the machine as somebody has accepted it, and no alarm.
    """

    file: str
    sha256: str
    recorded_at: float
    verdict: str | None
    reason: str
    number: int | None
    at: datetime | None
    parameters: Sequence[Mapping[str, Any]]
    delivered: Delivered
    sound: bool


def last_logs(
    database: Database, machine: str, last: int, *, sound: bool = False
) -> Sequence[TestedLog]:
    """The machine's last logs by the time of their files, the newest first.

    sound: those alone that were tested against the model of the version that a person has
    activated last, and were no alarm.
    """
    sent = and_(NoticeRow.log_id == OutcomeRow.log_id, NoticeRow.turn == OutcomeRow.turn)
    queued = and_(OutboxRow.log_id == OutcomeRow.log_id, OutboxRow.turn == OutcomeRow.turn)
    with database.reading() as session:
        accepted = accepted_version(session, machine)
        model = None if accepted is None else accepted.model_id
    of_accepted = VersionRow.model_id.is_not_distinct_from(model)
    is_sound = and_(of_accepted, OutcomeRow.verdict.not_in(ALARMING)).is_(True)
    query = (
        select(LogRow, OutcomeRow, VersionRow.number, NoticeRow.at, OutboxRow, is_sound)
        .select_from(LogRow)
        .outerjoin(OutcomeRow, judged_now())
        .outerjoin(VersionRow, VersionRow.id == OutcomeRow.version_id)
        .outerjoin(NoticeRow, sent)
        .outerjoin(OutboxRow, queued)
        .where(LogRow.machine == machine, *([is_sound] if sound else ()))
        .order_by(LogRow.mtime_ns.desc(), LogRow.file.desc(), LogRow.id.desc())
        .limit(last)
    )
    return [_judged(*row) for row in database.rows(query)]


def condition(database: Database, machine: str) -> str:
    """The machine's state by its last log; "no_log" where nothing is known of it."""
    with database.reading() as session:
        found = session.scalar(select(MachineNowRow.state).where(MachineNowRow.machine == machine))
    return found or "no_log"


def _judged(
    log: LogRow, done: OutcomeRow | None, number: int | None, sent: datetime | None,
    queued: OutboxRow | None, sound: bool,
) -> TestedLog:  # fmt: skip
    own = (log.file, log.sha256, log.mtime_ns / 1e9)
    if done is None:
        return TestedLog(*own, None, "", None, None, (), "", False)
    delivered: Delivered = "sent" if sent else ""
    if queued is not None:
        delivered = "waiting" if queued.given_up_at is None else "given up"
    parameters = tuple((done.evidence.get("drift") or {}).get("parameters") or ())
    return TestedLog(*own, done.verdict, done.reason, number, done.at, parameters, delivered, sound)


LAST_ON_PAGE = 30
MOST_NAMED = 3  # files that a sentence names
NAMED = {"constant_force.F_0": "constant_force", "backlash.width": "backlash"}


class AxisLine(NamedTuple):
    """A quantity of the newest log: value with its interval, its limits, all in the unit in which
    people read it, and its light."""

    meaning: str
    unit: str
    value: float
    low: float
    high: float
    allowed: Allowed | None
    light: Light


@dataclass(frozen=True)
class AxisShown:
    """The axis test of the newest log that gives parameters: its file, its lines, and what to know
    of the limits, a sentence each; newer: logs after it, which gave none."""

    file: str
    lines: Sequence[AxisLine]
    said: Sequence[str]
    newer: str


def newest_lights(
    logs: Sequence[TestedLog], sound: Sequence[TestedLog], accepted: int | None
) -> AxisShown:
    """The newest log's lines against the sound logs before it; no file where none has parameters.

    logs, sound: the newest first; accepted: the version whose logs are the sound ones.
    """
    identified = [one for one in logs if one.parameters]
    if not identified:
        return AxisShown("", (), (), "")
    newest = identified[0]
    older = [one for one in sound if one.parameters and one.sha256 != newest.sha256][:LAST_ON_PAGE]
    past = history(list(reversed(older)))
    limits = limits_of({name: [value for _, value in every] for name, every in past.items()})
    found = {}
    for name, (unit, value, low, high) in by_quantity(newest.parameters).items():
        allowed, (unit, factor) = limits.get(name), shown_unit(unit)
        light = light_of(value, low, high, allowed) if allowed else ""
        if allowed is not None:
            allowed = replace(allowed, low=factor * allowed.low, high=factor * allowed.high)
        numbers = factor * value, factor * low, factor * high
        found[name] = AxisLine(MEANING_OF[name], unit, *numbers, allowed, light)
    said = [f"limits: mean ± 3 sd of {len(older)} sound logs (wider of few)"]
    if len(older) < FEWEST_EARLIER:
        said = [f"no limits: {few_sound_logs(len(older), accepted)}"]
    out = left_out([one for one in identified if one is not newest], accepted)
    silent = [one.file for one in logs[: logs.index(newest)] if one.verdict is not None]
    lines = [found[name] for name in MEANING_OF if name in found]
    return AxisShown(newest.file, lines, [*said, out] if out else said, _few(silent))


def few_sound_logs(count: int, accepted: int | None) -> str:
    """Why the machine's own logs give no limits."""
    of = f" of the accepted version {accepted}" if accepted else ""
    return f"{count} sound logs with parameters{of}, at least {FEWEST_EARLIER} needed"


def left_out(logs: Sequence[TestedLog], accepted: int | None) -> str:
    """Which of the logs are no part of the limits, and why; "" where all are."""
    out = [one for one in logs if one.parameters and not one.sound]
    alarmed = [one.file for one in out if one.verdict in ALARMING]
    others = [one.file for one in out if one.verdict not in ALARMING]
    parts = [f"{_few(alarmed)} (alarm)"] if alarmed else []
    if others:
        parts.append(f"{_few(others)} (not tested against the accepted version {accepted})")
    return f"the limits leave out {', '.join(parts)}" if parts else ""


def _few(files: Sequence[str]) -> str:
    """The first of the names, the newest, and how many more there are."""
    more = len(files) - MOST_NAMED
    return ", ".join(files[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def by_quantity(
    parameters: Iterable[Mapping[str, Any]],
) -> dict[str, tuple[str, float, float, float]]:
    """Unit, value and ends of the interval of what the axis test looks at, by quantity."""
    out = {}
    for each in parameters:
        name = NAMED.get(str(each["name"]), str(each["name"]))
        if name in MEANING_OF:
            sign, value = -1.0 if name == "F_sn" else 1.0, float(each["after"])
            ends = sorted(sign * float(each.get(key) or value) for key in ("low", "high"))
            out[name] = (str(each.get("unit", "")), sign * value, ends[0], ends[1])
    return out


def history(logs: Sequence[TestedLog]) -> dict[str, list[tuple[float, float]]]:
    """Values of the logs by quantity, each with the moment at which its log was recorded."""
    out: dict[str, list[tuple[float, float]]] = {}
    for one in logs:
        found = {name: value for name, (_, value, *_) in by_quantity(one.parameters).items()}
        if "F_cp" in found and "F_cn" in found:
            found.setdefault("constant_force", 0.5 * (found["F_cn"] - found["F_cp"]))
        for name, value in found.items():
            out.setdefault(name, []).append((one.recorded_at, value))
    return out
