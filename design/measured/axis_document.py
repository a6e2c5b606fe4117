"""The test of an axis as plain values, as axis_test.json has it."""

from typing import Any

from design.machine.plain import plain
from design.measured.axis_test import AxisTest, Quantity

AXIS_SCHEMA = "axis_test/1"


def axis_document(test: AxisTest) -> dict[str, Any]:
    """The test for a PLC or SCADA: the light first, then every number with its limits."""
    return {
        "schema": AXIS_SCHEMA,
        "light": test.light,
        "machine": test.machine,
        "log": {"file": test.source.file, "sha256": test.source.sha256, "rows": test.source.rows,
                "duration": test.source.log.duration, "h": test.source.log.h},
        "reasons": test.reasons,
        "quantities": {one.name: _number(one) for one in test.quantities},
        "breakaways": test.breakaways,
        "travel": {way: getattr(test.travel, way) for way in ("place", "positive", "negative")},
        "version": test.earlier.version if test.earlier else None,
        "remarks": test.remarks,
    }  # fmt: skip


def _number(one: Quantity) -> dict[str, Any]:
    keys = ("value", "unit", "sd", "low", "high", "reason")
    shown = keys if one.estimate.value is None else keys[:-1]
    return {
        **{key: getattr(one.estimate, key) for key in shown},
        "light": one.light or None,
        "limits": plain(one.allowed),
    }
