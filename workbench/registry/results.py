"""A machine's results as its page shows them: the last ones, their way to the webhook, and the axis
test of the newest against those before it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal, NamedTuple

from sqlalchemy import and_, select

from workbench.registry.database import Database
from workbench.registry.rows import judged_now
from workbench.registry.tables import (
    LogRow,
    MachineNowRow,
    NoticeRow,
    OutboxRow,
    OutcomeRow,
    VersionRow,
)
from workbench.steps.axis_limits import MEANING_OF, Allowed, Light, light_of, limits_of

Delivered = Literal["", "sent", "waiting", "given up"]


@dataclass(frozen=True)
class TestedLog:
    """A log of the machine, when it was recorded and tested; verdict None: it waits.

    parameters: what it gave of each; delivered: whether the webhook has taken its alarm.
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


def last_logs(database: Database, machine: str, last: int) -> Sequence[TestedLog]:
    """The machine's last logs by the time of their files, the newest first."""
    sent = and_(NoticeRow.log_id == OutcomeRow.log_id, NoticeRow.turn == OutcomeRow.turn)
    queued = and_(OutboxRow.log_id == OutcomeRow.log_id, OutboxRow.turn == OutcomeRow.turn)
    query = (
        select(LogRow, OutcomeRow, VersionRow.number, NoticeRow.at, OutboxRow)
        .select_from(LogRow)
        .outerjoin(OutcomeRow, judged_now())
        .outerjoin(VersionRow, VersionRow.id == OutcomeRow.version_id)
        .outerjoin(NoticeRow, sent)
        .outerjoin(OutboxRow, queued)
        .where(LogRow.machine == machine)
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
    queued: OutboxRow | None,
) -> TestedLog:  # fmt: skip
    recorded = log.mtime_ns / 1e9
    if done is None:
        return TestedLog(log.file, log.sha256, recorded, None, "", None, None, (), "")
    drift = done.evidence.get("drift") or {}
    delivered: Delivered = "sent" if sent else ""
    if queued is not None:
        delivered = "waiting" if queued.given_up_at is None else "given up"
    parameters = tuple(drift.get("parameters") or ())
    return TestedLog(log.file, log.sha256, recorded, done.verdict, done.reason, number, done.at,
                     parameters, delivered)  # fmt: skip


LAST_ON_PAGE = 30
NAMED = {"constant_force.F_0": "constant_force", "backlash.width": "backlash"}


class AxisLine(NamedTuple):
    """A quantity of the newest log: value with its interval in SI, its limits and its light."""

    meaning: str
    unit: str
    value: float
    low: float
    high: float
    allowed: Allowed | None
    light: Light


def newest_lights(logs: Sequence[TestedLog]) -> tuple[str, Sequence[AxisLine]]:
    """The file of the newest log that identifies parameters, and its lines; none of them without
    one.

    logs: the newest first.
    """
    identified = [one for one in logs if one.parameters]
    if not identified:
        return "", ()
    newest, older = identified[0], identified[1 : 1 + LAST_ON_PAGE]
    past = history(list(reversed(older)))
    limits = limits_of({name: [value for _, value in every] for name, every in past.items()})
    found = {}
    for name, (unit, value, low, high) in by_quantity(newest.parameters).items():
        allowed = limits.get(name)
        light = light_of(value, low, high, allowed) if allowed else ""
        found[name] = AxisLine(MEANING_OF[name], unit, value, low, high, allowed, light)
    return newest.file, [found[name] for name in MEANING_OF if name in found]


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
        found = {str(each["name"]): float(each["after"]) for each in one.parameters}
        if "F_cp" in found and "F_cn" in found and "constant_force.F_0" not in found:
            found["constant_force.F_0"] = 0.5 * (found["F_cn"] - found["F_cp"])
        for name, value in found.items():
            name = NAMED.get(name, name)
            if name in MEANING_OF:
                size = abs(value) if name == "F_sn" else value
                out.setdefault(name, []).append((one.recorded_at, size))
    return out
