"""The process that identifies and traces one machine of `drives`: lines of JSON, each of which
holds the one before.

    python -m benchmarks.drives_child FAMILY EFFECT[+EFFECT] SEED STRENGTH LIMIT
        fit|trace|both [KEY ...]

LIMIT: processor time [s], after which the system ends the process. KEY: the library cut down to
these effects, which gives the held-out error of the true structure.
The simulation is made here too, but estimator and tracer get the logs and the card's rig alone.
"""

import json
import resource
import sys
import time
import traceback
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from benchmarks.drives_rig import Made, make, truth
from identification.effects._library import built_in
from identification.errors import UserError
from identification.estimation.fit import fit_plant
from identification.model.karnopp import NAMES
from identification.tracing.trace import trace

SEED = 0  # of the estimator's own draws


def fitted(made: Made) -> dict[str, Any]:
    """The nine as identified: value and interval, or why there is none."""
    fit = fit_plant([made.train], np.random.default_rng(SEED), rig=made.machine.rig)
    return {
        "nine": {key: asdict(fit.estimates[key]) for key in NAMES},
        "drive": fit.drive, "chi_square": fit.chi_square, "adequate": fit.adequate,
        "prescribed": fit.prescribed, "remarks": list(fit.remarks),
    }  # fmt: skip


def traced(made: Made, keys: Sequence[str]) -> dict[str, Any]:
    """What the trace names, and its errors before and after on the held-out log."""
    library = {k: e for k, e in built_in().items() if not keys or k in keys}
    found = trace([made.train], [made.test], made.machine.rig, library, np.random.default_rng(SEED))
    return {
        "verdict": found.verdict,
        "effects": [one.effect.key for one in found.effects],
        "params": {
            one.effect.key: {k: e.value for k, e in one.params.items()} for one in found.effects
        },
        "explained": [one.explained for one in found.effects],
        "depends_on": list(found.unknown.depends_on),
        "before": asdict(found.before["test"]),
        "after": asdict(found.after["test"]),
        "noise_force": found.noise_force,
        "nine": {key: asdict(one) for key, one in found.parameters_after.items() if key in NAMES},
        "remarks": list(found.remarks),
    }


def tried(what: str, made: Made, keys: Sequence[str]) -> dict[str, Any]:
    """The answer to one question, its processor time, or what went wrong."""
    begin = time.process_time()
    try:
        out = fitted(made) if what == "fit" else traced(made, keys)
    except UserError as error:
        out = {"refused": f"{type(error).__name__}: {error}"}
    except Exception:
        out = {"fault": traceback.format_exc()}
    return {**out, "seconds": time.process_time() - begin}


def main() -> None:
    """Answers the case of the command line."""
    family, effects, seed, strength, limit, asked, *keys = sys.argv[1:]
    most = round(float(limit))
    resource.setrlimit(resource.RLIMIT_CPU, (most, most + 1))
    made = make(family, tuple(effects.split("+")), int(seed), float(strength))
    out: dict[str, Any] = {
        "truth": truth(made), "sizes": dict(made.effects), "words": made.machine.words,
    }  # fmt: skip
    for what in ("fit", "trace") if asked == "both" else (asked,):
        print(json.dumps(out), flush=True)  # what is known should the time be over
        out[what] = tried(what, made, keys)
    print(json.dumps(out), flush=True)


if __name__ == "__main__":
    main()
