"""Machines as drives log them: does `identify` tell their nine, and `trace` what they have beside?

    python benchmarks/drives.py [--part clean effects pairs strange lacking] [--first 500]
        [--machines 6] [--families motor pneumatic force] [--effects stribeck cogging ...]
        [--strength 0.2] [--truth] [--limit 300] [--jobs 1] [--out drives.jsonl]
    python benchmarks/drives.py --report drives.jsonl

Machines with P-PI and PID loops at 1 to 8 kHz follow trapezoids, S-curves, sweeps and multisines;
they are logged at 250 Hz to 4 kHz for 20 to 120 s, with the count of an encoder, the noise of a
force sensor, a command of so many bits, and a clock that jitters. A program of its own simulates
them (`drives_kernel`), and each is judged in a process of its own with a limit of processor time,
by `fit_plant` and `trace` without the command line.

`clean`: the nine of `identify` (error over half the 95 % interval, within 1 where it holds), and
the verdict of `trace`, which should be "none". `effects`, `pairs`: whether `trace` names what is
there, first and alone, and its held-out error over that of noise (`--truth`: and over that of the
true structure).
`strange`: effects that no library has, where "unknown" is right. `lacking`: the intervals of the
nine from a log with an effect that the model lacks. Seeds below 500 serve to choose, the others to
judge. Exit status 0 in any case.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.drives_report import line, print_report
from benchmarks.drives_rig import EFFECTS, FAMILIES, PAIRS, STRANGE, shown

PARTS = ("clean", "effects", "pairs", "strange", "lacking")
ROOT = Path(__file__).resolve().parent.parent
LACKING = ("stribeck", "presliding", "cogging", "spring", "load")


@dataclass(frozen=True)
class Case:
    """One machine with these effects, and the part that asks for it."""

    part: str
    family: str
    effects: tuple[str, ...]
    seed: int

    @property
    def name(self) -> str:
        """Unique among cases of one strength."""
        return f"{self.part} {self.family} {'+'.join(self.effects)} {self.seed}"

    @property
    def asked(self) -> str:
        """What its process is to do."""
        return {"clean": "both", "lacking": "fit"}.get(self.part, "trace")


def name_of(found: dict[str, Any]) -> str:
    """Name of the case of an answer."""
    return Case(found["part"], found["family"], tuple(found["effects"]), found["seed"]).name


def read(file: Path) -> list[dict[str, Any]]:
    """Answers that a file holds."""
    if not file.exists():
        return []
    return [json.loads(one) for one in file.read_text("utf-8").splitlines()]


def cases(given: argparse.Namespace) -> Iterator[Case]:
    """The cases of a command line, one seed after the other."""
    options: dict[str, list[tuple[str, ...]]] = {
        "clean": [("none",)],
        "effects": [(one,) for one in given.effects or EFFECTS],
        "pairs": list(PAIRS),
        "strange": [(one,) for one in STRANGE],
        "lacking": [(one,) for one in given.effects or LACKING],
    }
    written = {name_of(one) for one in read(given.out)} if given.out else set()
    for part in given.part:
        for seed in range(given.first, given.first + given.machines):
            for effects in options[part]:
                for family in given.families:
                    case = Case(part, family, effects, seed)
                    if all(shown(one, family) for one in effects) and case.name not in written:
                        yield case


def child(case: Case, given: argparse.Namespace, asked: str, keys: Sequence[str]) -> dict[str, Any]:
    """The answer of a process of its own, which the system ends when it takes too long."""
    what = [case.family, "+".join(case.effects), str(case.seed), str(given.strength)]
    what += [str(given.limit), asked]
    command = [sys.executable, "-m", "benchmarks.drives_child", *what, *keys]
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    threads = {f"{k}_NUM_THREADS": "1" for k in ("OMP", "OPENBLAS", "MKL")}
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=ROOT,
        env={**os.environ, **threads, "PYTHONPATH": paths},
    )  # fmt: skip
    lines = done.stdout.splitlines()
    found: dict[str, Any] = json.loads(lines[-1]) if lines else {}
    if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        found["failed"] = f"over {given.limit:g} s"
    elif done.returncode != 0:
        found["failed"] = done.stderr.strip()[-300:]
    return found


def judged(case: Case, given: argparse.Namespace) -> dict[str, Any]:
    """All that is known of a case."""
    begin = time.perf_counter()
    keys = [EFFECTS[one] for one in case.effects if one in EFFECTS]
    out = {"part": case.part, "family": case.family, "effects": list(case.effects), "keys": keys,
           "seed": case.seed, "strength": given.strength}  # fmt: skip
    out |= child(case, given, case.asked, ())
    if given.truth and keys and "trace" in out:
        out["true_structure"] = child(case, given, "trace", keys).get("trace")
    return {**out, "seconds": time.perf_counter() - begin}


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--part", nargs="+", choices=PARTS, default=["clean", "effects"])
    parser.add_argument("--first", type=int, default=500)
    parser.add_argument("--machines", type=int, default=6, help="seeds a family")
    parser.add_argument("--families", nargs="+", choices=FAMILIES, default=list(FAMILIES))
    parser.add_argument("--effects", nargs="+", choices=EFFECTS, help="of effects and lacking")
    parser.add_argument("--strength", type=float, default=0.2, help="share of the Coulomb level")
    parser.add_argument(
        "--truth", action="store_true", help="trace with the true effects alone too"
    )
    parser.add_argument("--limit", type=float, default=300.0, help="processor seconds a process")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument(
        "--out", type=Path, help="lines of JSON are added to it, what it holds is not run again"
    )
    parser.add_argument("--report", type=Path, help="only the tables of such a file")
    return parser.parse_args()


def main() -> int:
    """Run the benchmark."""
    given = arguments()
    if given.report:
        print_report(read(given.report))
        return 0
    todo = list(cases(given))
    found = read(given.out) if given.out else []
    with ThreadPoolExecutor(given.jobs) as pool:
        for one in pool.map(lambda case: judged(case, given), todo):
            found.append(one)
            print(line(one), flush=True)
            if given.out:
                with given.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(one) + "\n")
    print_report(found)
    return 0


if __name__ == "__main__":
    sys.exit(main())
