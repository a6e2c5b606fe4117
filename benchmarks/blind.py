"""Effect x strength x machine x seed: does the tracer name what was hidden in a log?

    python benchmarks/blind.py --out blind.jsonl [--machines table1 motor random] [--effects spring]
        [--strengths 0.05 0.1 0.2 0.4] [--seeds 2] [--first 0] [--clean 40] [--removed] [--two 20]
        [--drift 10] [--no-single] [--baselines] [--fit-truth] [--jobs 2]
    python benchmarks/blind.py --case clean:motor:-:0:50 --out one.jsonl
    python benchmarks/blind.py --report blind.jsonl

Machines and their runs: `blind_machines`; what a strength means: `blind_effects`. Every run is
traced by a process of its own that is given two logs (train, held out), the rig and the keys taken
out of the library; the truths lie in a folder that this process cannot open (`blind_child.seal`)
and are joined to the answers afterwards. A line of the output file is one run; runs that it holds
already are not made again. `--fit-truth` traces each log once more, after its blind answer, with a
library of the true effects alone; `--baselines` judges the same logs by stepwise BIC, LASSO, SINDy
and a Gaussian process (`blind_baselines`). Exit status 0 in any case.
"""

import argparse
import hashlib
import json
import os
import queue
import select
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.blind_cases import (
    Case,
    Made,
    Plan,
    case_of,
    cases,
    effect_keys,
    make,
    truth,
    write_job,
)
from benchmarks.blind_machines import MACHINES, SECONDS
from benchmarks.blind_report import print_report
from identification.errors import UserError

ROOT = Path(__file__).resolve().parent.parent
LIMIT = 900.0  # s for one run, after which its process is ended


@dataclass
class Tracer:
    """A child process that traces folders one after the other; started again where it ended."""

    sealed: Path
    process: subprocess.Popen[str] | None = field(default=None)

    def started(self) -> subprocess.Popen[str]:
        """The running process."""
        if self.process is None or self.process.poll() is not None:
            paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
            # A thread each: the tracer itself runs two, and another process the other job.
            threads = {f"{k}_NUM_THREADS": "1" for k in ("OMP", "OPENBLAS", "MKL")}
            self.process = subprocess.Popen(
                [sys.executable, "-m", "benchmarks.blind_child", str(self.sealed)],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT,
                env={**os.environ, **threads, "PYTHONPATH": paths},
            )  # fmt: skip
        return self.process

    def answer(self, folder: Path) -> dict[str, Any]:
        """The result for a folder; a process that dies or takes too long is a fault."""
        process = self.started()
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write(f"{folder}\n")
        process.stdin.flush()
        if not select.select([process.stdout], [], [], LIMIT)[0]:
            self.end()
            return {"trace": {"verdict": "fault", "error": f"over {LIMIT:g} s"}, "seconds": LIMIT}
        if process.stdout.readline().strip() != "done":
            self.end()
            return {"trace": {"verdict": "fault", "error": "the process ended"}, "seconds": 0.0}
        found: dict[str, Any] = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        return found

    def end(self) -> None:
        """Ends the process."""
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
            self.process = None


@dataclass(frozen=True)
class Bench:
    """Where runs are made: work folder, truths, tracing processes, and what each run is to have."""

    work: Path
    sealed: Path
    tracers: "queue.SimpleQueue[Tracer]"
    baselines: bool
    fit_truth: bool
    seconds: float

    def one(self, case: Case) -> dict[str, Any]:
        """The line of a case: name, blind answer, and its truth joined to it."""
        try:
            made = make(case, self.seconds)
        except (UserError, RuntimeError) as error:
            return {"case": case.name, "mode": case.mode, "failed": str(error)}
        hidden = self.sealed / f"{digest(case.name)}.json"
        hidden.write_text(json.dumps(truth(made)), encoding="utf-8")
        tracer = self.tracers.get()
        try:
            line = self.traced(made, tracer)
        finally:
            self.tracers.put(tracer)
        known = json.loads(hidden.read_text(encoding="utf-8"))
        return {"case": case.name, "mode": case.mode, "truth": known, **line}

    def traced(self, made: Made, tracer: Tracer) -> dict[str, Any]:
        """The blind answer, and where asked for the fit of the true structure after it."""
        folder = self.work / digest(made.case.name)
        write_job(made, folder, baselines=self.baselines)
        out = tracer.answer(folder)
        shutil.rmtree(folder)
        if self.fit_truth and made.case.effects and made.case.mode != "removed":
            write_job(made, folder, only=made.case.effects)
            out["true_structure"] = tracer.answer(folder)["trace"]
            shutil.rmtree(folder)
        return out


def digest(text: str) -> str:
    """A name that tells nothing."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def done(file: Path) -> set[str]:
    """Names of the cases that a file holds."""
    if not file.exists():
        return set()
    return {json.loads(line)["case"] for line in file.read_text(encoding="utf-8").splitlines()}


def run(
    todo: Sequence[Case], file: Path, *, jobs: int = 2, baselines: bool = False,
    fit_truth: bool = False, seconds: float = SECONDS,
) -> None:  # fmt: skip
    """Makes every case that the file does not hold yet, and appends a line for each."""
    answered = done(file)
    left = [case for case in todo if case.name not in answered]
    with tempfile.TemporaryDirectory() as work, tempfile.TemporaryDirectory() as sealed:
        tracers: queue.SimpleQueue[Tracer] = queue.SimpleQueue()
        every = [Tracer(Path(sealed)) for _ in range(jobs)]
        for tracer in every:
            tracers.put(tracer)
        bench = Bench(Path(work), Path(sealed), tracers, baselines, fit_truth, seconds)
        try:
            with ThreadPoolExecutor(jobs) as pool, file.open("a", encoding="utf-8") as out:
                waiting = {pool.submit(bench.one, case): case for case in left}
                for i, future in enumerate(as_completed(waiting)):
                    line = future.result()
                    out.write(json.dumps(line) + "\n")
                    out.flush()
                    print(f"{i + 1:5d}/{len(left)} {said(line)}", flush=True)
        finally:
            for tracer in every:
                tracer.end()


def said(line: dict[str, Any]) -> str:
    """One line of progress."""
    if "failed" in line:
        return f"{line['case']:60s} not simulated: {line['failed']}"
    found = line["trace"]
    named = ", ".join(one["key"] for one in found.get("effects", ())) or "-"
    depends = ",".join(found.get("unknown", {}).get("depends_on", ()))
    answer = f"{found['verdict']:12s} {named:30s} {depends:12s}"
    return f"{line['case']:60s} {answer} {line['seconds']:6.1f} s"


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--effects", nargs="*", choices=effect_keys(), default=effect_keys())
    parser.add_argument("--machines", nargs="+", choices=MACHINES, default=list(MACHINES))
    parser.add_argument("--strengths", nargs="+", type=float, default=[0.05, 0.1, 0.2, 0.4])
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--clean", type=int, default=0, metavar="N")
    parser.add_argument("--two", type=int, default=0, metavar="N")
    parser.add_argument("--drift", type=int, default=0, metavar="N")
    parser.add_argument("--removed", action="store_true")
    parser.add_argument("--no-single", action="store_true")
    parser.add_argument("--baselines", action="store_true")
    parser.add_argument("--fit-truth", action="store_true")
    parser.add_argument("--case", nargs="+", metavar="NAME", help="as the progress shows them")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--out", type=Path, default=Path("blind.jsonl"))
    parser.add_argument("--report", type=Path, metavar="FILE")
    return parser.parse_args()


def main() -> None:
    """Runs the cases asked for, then prints the tables of the whole file."""
    asked = arguments()
    if asked.report is None:
        plan = Plan(
            asked.effects, asked.machines, asked.strengths,
            range(asked.first, asked.first + asked.seeds), asked.clean, not asked.no_single,
            asked.removed, asked.two, asked.drift,
        )  # fmt: skip
        todo = [*map(case_of, asked.case)] if asked.case else [*cases(plan)]
        run(
            todo, asked.out, jobs=asked.jobs, baselines=asked.baselines,
            fit_truth=asked.fit_truth, seconds=asked.seconds,
        )  # fmt: skip
    print_report(asked.report or asked.out)


if __name__ == "__main__":
    main()
