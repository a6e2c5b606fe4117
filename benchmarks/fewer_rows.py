"""Every second, fourth, eighth row of measured rigs and small cases: does what is stated hold?

    python -m benchmarks.fewer_rows [--only NAME ...] [--every 2 4 8]

A logger that is slower than the drive's loop has one of several commands, and none of the impulses
between them. The training logs of `real.toml` (WORKBENCH_DATA, and the folder `cases` beside it)
are identified as they are and with fewer rows. Stated values are held against the truth where the
table has one, else against those of all rows; wrong are those more than 3 deviations of both off. A
row for each, then the counts.
"""

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks.real_cases import Case, every_case, prepared
from identification.errors import UserError
from identification.estimation.fit import fit_plant
from identification.log import Log, Rig
from identification.model.karnopp import NAMES
from workbench.logs.sources import sources_of

EVERY = (2, 4, 8)
FAR = 3.0  # deviations
CASES = (
    "emps", "belt_cart", "laas_acc_current", "open_loop", "qube_furuta", "gravity_pose0",
    "command_offset", "late_sensor_40ms", "cogging_slow", "ak80_fft",
)  # fmt: skip
Stated = Mapping[str, tuple[float, float]]


def stated(logs: list[Log], rig: Rig) -> Stated:
    """Values of the nine that are stated, with deviations; none where the logs are refused."""
    try:
        fit = fit_plant(logs, np.random.default_rng(0), rig=rig)
    except UserError:
        return {}
    own = ((name, fit.estimates[name]) for name in NAMES)
    return {
        k: (one.value, one.sd) for k, one in own if one.value is not None and one.sd is not None
    }


def fewer(log: Log, every: int) -> Log:
    """The log with so many times fewer rows."""
    return Log(log.name, {key: np.asarray(x)[::every].copy() for key, x in log.signals.items()})


def beyond(found: Stated, case: Case, whole: Stated) -> dict[str, float]:
    """Deviations by which stated values are off, of those that are too far."""
    true = {one.name: one.value for one in case.right.truth if one.value is not None}
    out = {}
    for name, (value, sd) in found.items():
        right, unsure = (true[name], 0.0) if name in true else whole.get(name, (value, 0.0))
        off = (value - right) / float(np.hypot(sd, unsure))
        if abs(off) > FAR:
            out[name] = off
    return out


def main() -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", default=CASES, metavar="NAME")
    parser.add_argument("--every", nargs="+", type=int, default=EVERY)
    given = parser.parse_args()
    counts = Counter[str]()
    for case in (one for one in every_case() if one.name in given.only and one.there):
        with tempfile.TemporaryDirectory() as work:
            ready = prepared(case, Path(work))
            assert ready.card is not None
            rig = ready.card.rig()
            runs = sources_of([str(path) for path in ready.train], ready.card).runs
            logs = [one.log for one in runs]
        whole = stated(logs, rig)
        for every in (1, *given.every):
            found = stated([fewer(log, every) for log in logs], rig) if every > 1 else whole
            wrong = beyond(found, case, whole)
            key = "all rows" if every == 1 else "fewer"
            counts[key] += len(found)
            counts[f"{key}, wrong"] += len(wrong)
            said = ", ".join(f"{name} by {off:+.1f}" for name, off in wrong.items())
            print(f"{case.name:18s} 1/{every}: {len(found)} stated, off: {said or '-'}", flush=True)
    print(dict(counts))
    return 0


if __name__ == "__main__":
    sys.exit(main())
