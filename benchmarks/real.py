"""Real logs decide: every measured rig, and small cases of known truth, beside ten lines of least
squares.

    python benchmarks/real.py --out real.jsonl [--only NAME ...] [--splits|--halves] [--limit 300]
        [--part look|identify|trace|both]
    python benchmarks/real.py --report real.jsonl

Rigs are the folders of WORKBENCH_DATA, cases the folder `cases` beside it; what is absent is
skipped with a line saying so. What each is and what is right of it stands in `real.toml`; the
yardstick in `yardstick.py`; with --splits other splits of the rigs (`real_splits.toml`), and no
others; with --halves each of their files by itself, fitted on the first 60 % of its rows; how a
model is measured with it in `real_shares.py`. A case is run in a process of its own with a limit of
processor time, through the functions behind the commands
`init`, `doctor`, `identify` and `trace`. With --out a line of JSON is added for each case; of
several lines of a case the later answers count. Exit status 0 in any case.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.real_cases import Case, cases_folder, every_case
from benchmarks.real_report import line, print_report
from workbench.logs.sources import DATA_VARIABLE

ROOT = Path(__file__).resolve().parent.parent
PARTS_ASKED = {"look": (), "both": ("identify", "trace"), "promise": ("said_alone", "alone")}
PARTS_ASKED["promise_of_test"] = PARTS_ASKED["promise"]
PARTS = ("look", "identify", "trace", "both")


def answered(case: Case, limit: float, part: str) -> dict[str, Any]:
    """The answers of a process of its own, which the system ends when it takes too long."""
    command = [sys.executable, "-m", "benchmarks.real_child", case.name, str(limit), part]
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    threads = {f"{k}_NUM_THREADS": "1" for k in ("OMP", "OPENBLAS", "MKL")}
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=ROOT,
        env={**os.environ, **threads, "PYTHONPATH": paths},
    )  # fmt: skip
    lines = [one for one in done.stdout.splitlines() if one.startswith("{")]
    found: dict[str, Any] = json.loads(lines[-1]) if lines else {}
    found |= {"case": case.name, "group": case.group}
    if done.returncode == 0:
        return found
    over = done.returncode in (-signal.SIGXCPU, -signal.SIGKILL)
    why = f"over {limit:g} s" if over else done.stderr.strip()[-400:]
    wanted = PARTS_ASKED.get(part, (part,))
    for what in wanted:
        found.setdefault(what, {"over" if over else "fault": why})
    return found


def read(file: Path) -> list[dict[str, Any]]:
    """The answers of a file, those of a case put together."""
    found: dict[str, dict[str, Any]] = {}
    if file.exists():
        for text in file.read_text("utf-8").splitlines():
            one = json.loads(text)
            found[one["case"]] = {**found.get(one["case"], {}), **one}
    return list(found.values())


def run(todo: Sequence[Case], given: argparse.Namespace) -> list[dict[str, Any]]:
    """Runs the cases one after the other; lines of JSON are written as they come."""
    out = []
    for case in todo:
        if not case.there:
            print(f"{case.name}: skipped, its files are not there", flush=True)
            continue
        found = answered(case, given.limit, given.part)
        print(line(case, found), flush=True)
        out.append(found)
        if given.out:
            with given.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(found) + "\n")
    return out


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--splits", action="store_true", help="other splits of the rigs")
    parser.add_argument("--halves", action="store_true", help="each file: 60 %% of it and the rest")
    parser.add_argument("--part", choices=PARTS, default="both")
    parser.add_argument("--limit", type=float, default=300.0, help="processor seconds a case")
    parser.add_argument("--out", type=Path, help="lines of JSON are added to it")
    parser.add_argument("--report", type=Path, help="only the table of such a file")
    return parser.parse_args()


def main() -> int:
    """Run the benchmark."""
    given = arguments()
    os.environ.setdefault(DATA_VARIABLE, str(ROOT.parent / "shared" / "data"))
    cases = every_case()
    if given.report:
        print_report(cases, read(given.report))
        return 0
    if not cases_folder().is_dir():
        print(f"no folder {cases_folder().name!r} beside {DATA_VARIABLE}: its cases are skipped")
        cases = tuple(one for one in cases if one.group != "case")
    groups = {"split"} if given.splits else {"half"} if given.halves else {"rig", "case"}
    asked = set(given.only or [one.name for one in cases if one.group in groups])
    todo = [one for one in cases if one.name in asked]
    found = run(todo, given)
    print_report(cases, read(given.out) if given.out else found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
