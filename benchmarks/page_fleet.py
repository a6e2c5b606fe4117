"""A registry with many machines, written in bulk: an active version and a few results each."""

import math
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
from sqlalchemy import insert
from sqlalchemy.orm import Session

from workbench.registry.store import Registry
from workbench.registry.tables import (
    ActiveVersionRow,
    DecisionRow,
    LogRow,
    MachineNowRow,
    MachineRow,
    MachineTrendRow,
    OutcomeRow,
    RecordRow,
    VersionRow,
)

STATES = ("in_tune",) * 16 + ("drifting", "structure", "log_bad", "not_judged")
VERDICTS = {"in_tune": "none", "drifting": "refused", "structure": "structure",
            "log_bad": "set_aside", "not_judged": "not_judged"}  # fmt: skip
NAMES_SHOWN = ("m", "F_cp", "F_cn", "F_vp", "F_vn", "dv_p", "dv_n", "F_sp", "F_sn")
LOGS_EACH = 4
TREND = 30
BLOCK_OF_MACHINES = 1000


def fill(where: str, count: int, seed: int = 0) -> None:
    """Write `count` machines into an empty registry."""
    rng, now = np.random.default_rng(seed), datetime.now(UTC)
    with Registry(where) as registry:
        for first in range(0, count, BLOCK_OF_MACHINES):
            numbers = range(first, min(first + BLOCK_OF_MACHINES, count))
            with registry.database.writing() as session:
                _block(session, numbers, rng, now)


def _block(session: Session, numbers: range, rng: np.random.Generator, now: datetime) -> None:
    rows: dict[Any, list[dict[str, Any]]] = {
        table: [] for table in (MachineRow, RecordRow, VersionRow, DecisionRow, ActiveVersionRow,
                                LogRow, OutcomeRow, MachineNowRow, MachineTrendRow)
    }  # fmt: skip
    for k in numbers:
        name, state = f"axis-{k:05d}", STATES[int(rng.integers(len(STATES)))]
        heard = now - timedelta(hours=float(rng.exponential(60.0)))
        random_walk = 10.0 * np.exp(
            0.01 * np.cumsum(rng.standard_normal((len(NAMES_SHOWN), TREND)), 1)
        )
        trend = {
            one: [float(f"{v:.6g}") for v in x]
            for one, x in zip(NAMES_SHOWN, random_walk, strict=True)
        }
        moved = max(trend, key=lambda one: abs(math.log(trend[one][-1] / 10.0)))
        at = {"machine": name, "made_at": now}
        rows[MachineRow].append({"name": name, "added_at": now})
        rows[RecordRow].append({**at, "id": k + 1, "kind": "model", "sha256": f"{k:064x}",
                                "document": {"friction": {}}})  # fmt: skip
        rows[VersionRow].append({**at, "id": k + 1, "number": 1, "model_id": k + 1})
        rows[DecisionRow].append({"id": k + 1, "machine": name, "kind": "promoted", "at": now,
                                  "version_id": k + 1, "reason": "first model", "evidence": {},
                                  "made_by": "benchmark"})  # fmt: skip
        rows[ActiveVersionRow].append({"machine": name, "version_id": k + 1, "decision_id": k + 1})
        for n in range(LOGS_EACH):
            key = k * LOGS_EACH + n + 1
            when = heard - timedelta(hours=LOGS_EACH - n)
            rows[LogRow].append({"id": key, "machine": name, "sha256": f"{key:064x}", "size": 1,
                                 "file": f"run{n}.csv", "seen_at": when,
                                 "mtime_ns": int(when.timestamp() * 1e9)})  # fmt: skip
            rows[OutcomeRow].append({"log_id": key, "turn": 0, "version_id": k + 1, "token": "t",
                                     "verdict": VERDICTS[state], "reason": "benchmark", "at": when,
                                     "evidence": _evidence(trend, n)})  # fmt: skip
        rows[MachineNowRow].append({"machine": name, "state": state, "heard_at": heard,
                                    "logs": LOGS_EACH, "moved": moved,
                                    "moved_by": trend[moved][-1] / 10.0 - 1.0,
                                    "moved_trend": trend[moved]})  # fmt: skip
        rows[MachineTrendRow].append({"machine": name, "trend": trend})
    for table, values in rows.items():
        session.execute(insert(table), values)


def _evidence(trend: dict[str, list[float]], n: int) -> dict[str, Any]:
    parameters = [
        {"name": name, "unit": "N", "before": 10.0, "after": x[n], "low": x[n] - 0.1,
         "high": x[n] + 0.1, "change": x[n] / 10.0 - 1.0, "sd": 0.01}
        for name, x in trend.items()
    ]  # fmt: skip
    return {"drift": {"verdict": "none", "parameters": parameters}}
