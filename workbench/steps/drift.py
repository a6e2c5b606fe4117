"""The state of drift tests that is stored, and drift.json."""

import hashlib
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from design.machine.documents import model_document
from design.machine.model import Model
from design.machine.plain import as_number, plain
from design.machine.versions import versions
from design.measured.drift_of_logs import Drifted, Stream, Tested
from identification.drift.drift_result import DriftTest, Shift
from identification.estimation.estimates import reported_estimate
from identification.model.estimates import Estimate
from workbench.documents.reading import read_result
from workbench.output import dumps, write_whole

DRIFT_SCHEMA, DRIFT_STREAM_SCHEMA = "drift/1", "drift_stream/1"


def model_key(model: Model) -> str:
    """What names a model in a stored state: sha256 of what model.json says of it."""
    document = model_document(model)
    if model.own_logs is None:  # as a model was named before it could hold them
        del document["own_logs"]
    if not document["bad_samples"]:
        del document["bad_samples"]
    return hashlib.sha256(dumps(document).encode()).hexdigest()


def read_stream(path: Path) -> Stream | None:
    """What `--state` stored at `path`, None where there is no file yet; raises BadModel."""
    return read_result(path, Stream, DRIFT_STREAM_SCHEMA) if path.exists() else None


def write_stream(path: Path, stream: Stream) -> None:
    """Store the stream, whole or not at all. Raises BadOutput where it cannot be written."""
    write_whole(path, dumps(stream) + "\n", "--state")


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
        "change": as_number(Estimate(shift.change, "1", shift.sd, shift.low, shift.high)),
    }
