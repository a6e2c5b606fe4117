"""A robust design as robust.json writes it."""

from typing import Any

import numpy as np

from workbench.documents.versions import versions
from workbench.steps.robust.robust import ROBUST, Promise, Robust

ROBUST_SCHEMA = "robust/1"


def robust_document(found: Robust) -> dict[str, Any]:
    """robust.json: what was asked, every loop's promise and the shares that keep each limit."""
    asked = found.asked
    return {
        "schema": ROBUST_SCHEMA,
        "card": found.design.card,
        "passed": found.passed,
        "recommended": found.design.recommended,
        "compensator": bool(found.promises[ROBUST].compensator),
        "draws": asked.draws,
        "seed": asked.seed,
        "probability": asked.probability,
        "drift": dict(asked.drift or {}),
        "tried": found.tried,
        "slow_speed": found.speed,
        "loops": {name: _promise_document(one) for name, one in found.promises.items()},
        "missed": list(found.missed),
        "remarks": list(found.remarks),
        "versions": dict(versions()),
    }


def _promise_document(one: Promise) -> dict[str, Any]:
    return {
        "controller": one.controller,
        "compensator": one.compensator,
        "every_limit": one.every,
        "measures": {
            name: {
                "low": _finite(m.low), "median": _finite(m.median), "high": _finite(m.high),
                "limit": m.limit, "kept": m.share,
            }
            for name, m in one.measures.items()
        },
    }  # fmt: skip


def _finite(value: float) -> float | None:
    """A number as JSON has it: null where a loop runs away, or no delay makes it unstable."""
    return value if np.isfinite(value) else None
