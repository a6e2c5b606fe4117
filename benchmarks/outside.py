"""Logs of a program written apart from ours: does `workbench trace` name what was put in them?

    python benchmarks/outside.py [--first 100] [--seeds 1] [--machines pneumatic force motor]
        [--effects spring stribeck] [--strange] [--laws] [--varied] [--jobs 2]

A machine a seed is drawn around three rigs, in a plain position loop of its own, and simulated by
Euler steps of 20 us that share no line with the package's kernels; what the effects do is written
here too, and not always as in the library (friction along the stroke and by temperature scales the
stick limits, Stribeck's level adds to them). Each log is written as CSV with a card and traced by
the command line. "Right" is the verdict that an engineer would want: the effect and nothing else,
"none" for the plain machine. `--strange`: eight effects that no library has; right is "unknown",
with a signal on which the effect depends. `--laws`: five known effects by another law than the
library's (Tustin's exponential, a rational growth, a harmonic, a bell along the stroke, a straight
line in time). `--varied`: a clock, length, noise and encoder drawn for each log, instead of 60 s at
500 Hz with little noise. Seeds below 100 served to find faults, as did 102 with `--strange`, 104
with `--laws`, 103 and, for small changes, 101 and 105; others judge. Exit status 0 in any case.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.outside_rig import EFFECTS, IN_COMMAND, LAWS, REFERENCES, RIGS, STRANGE, write


def traced(machine: str, effect: str, seed: int, place: int, varied: bool) -> tuple[str, bool]:
    """One line on one machine, and whether its verdict is right."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(folder, machine, effect, seed, place, varied)
        begun = time.perf_counter()
        command = [sys.executable, "-m", "workbench", "trace", str(folder / "train.csv"), "--test",
                   str(folder / "test.csv"), "--card", str(folder / "card.toml"), "--out",
                   str(folder / "out")]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        took = time.perf_counter() - begun
        if done.returncode != 0:
            return f"{machine:10}{effect:28}{done.stderr.strip()[-90:]}", False
        found: dict[str, Any] = json.loads((folder / "out" / "trace.json").read_text("utf-8"))
    keys = [one["key"] for one in found["effects"]]
    wanted = [] if effect == "none" else ["spring" if effect == "stiff_spring" else effect]
    wanted = [LAWS[effect][1]] if effect in LAWS else wanted
    right = keys == wanted and found["verdict"] == ("effect" if wanted else "none")
    if effect in STRANGE:
        keys += [f"[{signal}]" for signal in found["unknown"]["depends_on"]]
        right = found["verdict"] == "unknown" and not found["effects"]
        right = right and bool(STRANGE[effect][1] & set(found["unknown"]["depends_on"]))
    errors = [found[when]["test"]["force_rms"] for when in ("before", "after")]
    return (
        f"{machine:10}{effect:28}{REFERENCES[(seed + place) % 3]:10}{found['verdict']:12}"
        f"{', '.join(keys) or '-':34}{errors[0]:8.3g} -> {errors[1]:<8.3g}{took:6.0f} s"
        f"{'' if right else '  X'}"
    ), right


def main() -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--machines", nargs="+", choices=RIGS, default=list(RIGS))
    parser.add_argument("--effects", nargs="+", choices=[*EFFECTS, *STRANGE, *LAWS],
                        default=list(EFFECTS))  # fmt: skip
    other = parser.add_mutually_exclusive_group()
    other.add_argument("--strange", action="store_true", help="effects that no library has")
    other.add_argument("--laws", action="store_true", help="known effects by other laws")
    parser.add_argument("--varied", action="store_true", help="a recording of its own for each")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    every = [*EFFECTS, *STRANGE, *LAWS]
    if given.strange or given.laws:
        given.effects = list(STRANGE if given.strange else LAWS)
    cases = [
        (machine, effect, seed, every.index(effect), given.varied)
        for seed in range(given.first, given.first + given.seeds)
        for machine in given.machines
        for effect in given.effects
        if not (machine == "force" and effect in (*IN_COMMAND, "curved_actuator"))
        and not (machine == "motor" and effect == "leakage")
    ]
    count = 0
    with ThreadPoolExecutor(given.jobs) as pool:
        for line, right in pool.map(lambda case: traced(*case), cases):
            count += right
            print(line, flush=True)
    print(f"right: {count} of {len(cases)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
