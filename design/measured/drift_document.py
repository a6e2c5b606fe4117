"""Tests of drift as plain values, as drift.json has them."""

from dataclasses import asdict
from typing import Any

import numpy as np

from design.machine.plain import as_number, plain
from design.machine.versions import versions
from design.measured.drift_of_logs import Drifted, Tested
from identification.drift.drift_result import DriftTest, Shift
from identification.estimation.estimates import reported_estimate
from identification.model.estimates import Estimate

DRIFT_SCHEMA = "drift/1"


def drift_document(found: Drifted, model_file: str) -> dict[str, Any]:
    """The tests as drift.json holds them."""
    return {
        "schema": DRIFT_SCHEMA,
        "card": found.model.card,
        "model": {"file": model_file, "key": found.key},
        "settings": {**asdict(found.settings), "to_be_seen": found.settings.to_be_seen},
        "verdict": found.verdict,
        "log": [_of_run(one) for one in found.tests],
        "seen": [asdict(one) for one in found.stream.seen],
        "bad_samples": [one.as_json() for one in found.bad],
        "remarks": list(found.remarks),
        "versions": versions(),
    }


def _of_run(one: Tested) -> dict[str, Any]:
    test, source = one.test, one.source
    return {
        "file": source.file,
        "sha256": source.sha256,
        "rows": source.rows,
        "verdict": test.verdict,
        "reason": test.reason,
        "found_by": test.found_by,
        "moved": [_number(shift) for shift in test.moved],
        "unsure": list(test.unsure),
        "parameters": {name: _number(shift) for name, shift in test.shifts.items()},
        "not_judged": dict(test.inconclusive),
        "could_have_seen": detectable_sizes(test),
        "single": plain(test.single),
        "alone": plain(test.alone),
        "mean": plain(test.mean),
        "chi_square": test.chi_square,
        "chi_square_allowed": test.allowed,
    }


def detectable_sizes(test: DriftTest) -> dict[str, float | None]:
    """Minimum detectable change of each parameter in a test, None where it detects none."""
    return {n: x if np.isfinite(x) else None for n, x in test.could_have_seen.items()}


def _number(shift: Shift) -> dict[str, Any]:
    """A parameter before, after, and its relative change, each as results carry a parameter."""
    return {
        "name": shift.name,
        "before": as_number(reported_estimate(shift.before, shift.unit, shift.before_sd)),
        "after": as_number(reported_estimate(shift.after, shift.unit, shift.after_sd)),
        "change": as_number(Estimate(shift.change, "1", shift.sd, *shift.interval)),
    }
