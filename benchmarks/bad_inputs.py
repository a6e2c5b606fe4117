"""Bad inputs through the command line: does each end in one line, in time, with nothing left over?

    python benchmarks/bad_inputs.py [--cases 600] [--seed 0] [--jobs 2] [--limit 60] [--only TEXT]

Logs of each format, cards, models, designs, states, options, names and files, each spoilt in its
own way (`tests/bad_inputs/cases.py`), run in processes of their own. Right is an exit status of 0,
1 or 2, at most one line on standard error, within the limit [s, of two processors], and no
half-written file. A row for each case that ends otherwise, then the counts. Exit status 1 where
there is one.
"""

import argparse
import sys
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from tests.bad_inputs.cases import Case, cases
from tests.bad_inputs.running import Ended, ended, in_process_of_its_own
from tests.bad_inputs.shop import Shop, make_shop

RIGHT = ("exit status 0", "exit status 1", "exit status 2")


def judged(number: int, total: int, seed: int, folder: str, limit: float) -> Ended:
    """How one case of the seed ended; a worker's task."""
    case = cases(total, seed)[number]
    return ended(case, Shop(Path(folder)), in_process_of_its_own(limit))


def row(case: Case, found: Ended) -> str:
    """A line on one case."""
    said = " ".join(found.stderr.split())[:200]
    return f"{case.name:50} {found.seconds:6.1f} s  {'; '.join(found.faults)}  {said}"


def main() -> int:
    """Exit status 1 where a case ended as it should not."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--cases", type=int, default=600)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--limit", type=float, default=60.0)
    parser.add_argument("--only", default="", help="cases whose name holds this text")
    given = parser.parse_args()
    found = cases(given.cases, given.seed)
    wanted = [k for k, case in enumerate(found) if given.only in case.name]
    counts: Counter[str] = Counter()
    slowest = 0.0
    with (
        tempfile.TemporaryDirectory() as folder,
        ProcessPoolExecutor(given.jobs, mp_context=get_context("spawn")) as pool,
    ):
        make_shop(Path(folder))
        tasks = {
            k: pool.submit(judged, k, given.cases, given.seed, folder, given.limit) for k in wanted
        }
        for k, task in tasks.items():
            one = task.result()
            slowest = max(slowest, one.seconds)
            counts[f"exit status {one.status}"] += 1
            counts.update(fault.partition(":")[0] for fault in one.faults)
            if one.faults:
                print(row(found[k], one), flush=True)
    print(f"{len(wanted)} cases, seed {given.seed}; the slowest took {slowest:.1f} s")
    for what, number in sorted(counts.items()):
        print(f"  {what}: {number}")
    return int(any(not what.startswith(RIGHT) for what in counts))


if __name__ == "__main__":
    sys.exit(main())
