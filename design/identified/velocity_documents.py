"""What results say of a rig whose velocity follows the command."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from design.identified.velocity import VelocityPrediction, VelocityTraced
from design.machine.plain import plain
from design.machine.source import fingerprints
from design.machine.versions import versions
from identification.velocity.rivals import STRUCTURES, HeldOut


def velocity_trace_document(found: VelocityTraced) -> dict[str, Any]:
    """trace.json of such a rig: verdicts as in the contract, errors of the position [m]."""
    left = found.left
    after = next((one.left for one in left.rivals if one.key == left.named), left.unextended)
    return {
        "schema": "velocity-trace/1",
        "kind": "velocity",
        "card": found.model.card,
        "log": fingerprints(found.train),
        "test_log": fingerprints(found.test),
        "verdict": left.verdict,
        "complete": left.complete,
        "before": _errors(left.unextended),
        "after": _errors(after),
        "noise_floor": {"position_rms": found.noise},
        "effects": [
            {"key": key, "words": STRUCTURES[key].words,
             "params": plain(own)}
            for key, own in found.model.effects.items()
        ],
        "rivals": [
            {"key": one.key, **_errors(one.left), "p_value": one.p_value, "better": one.better}
            for one in left.rivals
        ],
        "not_tried": list(left.not_tried),
        "parameters": plain(found.model.valve),
        "remarks": list(found.model.remarks),
        "versions": versions(),
    }  # fmt: skip


def _errors(test_errors: HeldOut) -> dict[str, float]:
    long, short = test_errors.rms
    return {"position_rms_2s": long, "position_rms_02s": short}


def prediction_summary(
    runs: Sequence[VelocityPrediction], window: float | None
) -> dict[str, float | int | None]:
    """Error of the position [m] over all runs, as `--json` prints it."""
    off = np.concatenate([one.measured - one.simulated for one in runs])
    off = off[np.isfinite(off)]
    return {
        "samples": len(off),
        "window": window,
        "position_rms": float(np.sqrt(np.mean(off**2))),
        "position_worst": float(np.max(np.abs(off))),
    }
