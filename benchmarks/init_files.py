"""Does `workbench init` propose the right card for files that it has never seen?

    python benchmarks/init_files.py [--first 500] [--files 30] [--words judge] [--out FOLDER]

Files are made from the shipped recipes (simulated anew for each seed, driven by a force or by two
pressures), from machines of a program written apart (`outside_rig`, mostly motors), and from the
measured sets that `WORKBENCH_DATA` holds: columns left out, added (speed, temperature, a status, a
sample number), renamed, rescaled to other units, turned in sign and shuffled; as CSV with comma,
semicolon and decimal comma, or tab, with a BOM, in the encodings of Windows, with a row of units,
with a preamble, without a header.

Right is a card with which the log is read as it was: the kind of rig, linear or rotary, and every
signal that the file has (t, y, r, F or both pressures, u) equal in SI to the original, up to a
common sign of the axis and to offsets. A command whose header gives no unit counts up to a factor,
which no log tells. The last line says too how many lines were called sure, and how many of these
are wrong.

Seeds below 500 with the words "choose" served to choose weights and words; seeds from 500 on with
the words "judge" judge.
"""

import argparse
import os
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from benchmarks.init_cases import Case, make_case
from benchmarks.init_judge import wrong_lines
from design.first_card.proposal import Proposal
from identification.errors import UserError
from workbench.logs.sources import DATA_VARIABLE
from workbench.steps.first_card.proposal import proposed


@dataclass(frozen=True)
class Outcome:
    """What became of one file: what is wrong (empty: right first time), and wrong lines that were
    called sure."""

    case: Case
    wrong: tuple[str, ...]
    sure_but_wrong: int
    sure: int
    lines: int


def judged(case: Case) -> Outcome:
    """The proposal for a file against what is in it."""
    try:
        found: Proposal = proposed(case.path)
    except UserError as error:
        return Outcome(case, (f"refused: {error}",), 0, 0, 0)
    wrong = wrong_lines(found, case)
    sure = [one for one in found.signals if one.sure]
    bad = sum(one.name in wrong for one in sure)
    words = tuple(f"{name}: {why}" for name, why in wrong.items())
    return Outcome(case, words, bad, len(sure), len(found.signals))


def main() -> int:
    """Exit status 0 where at least nine in ten are right."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=500)
    parser.add_argument("--files", type=int, default=30)
    parser.add_argument("--words", choices=["choose", "judge"], default="judge")
    parser.add_argument("--out", type=Path, help="keep the files there")
    given = parser.parse_args()
    if not os.environ.get(DATA_VARIABLE):
        parser.error(f"the measured sets are needed: set {DATA_VARIABLE}")
    right = sure = lines = bad = 0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(given.first, given.first + given.files):
            case = make_case(seed, given.words, given.out or Path(folder))
            one = judged(case)
            right += not one.wrong
            sure, lines, bad = sure + one.sure, lines + one.lines, bad + one.sure_but_wrong
            said = "right" if not one.wrong else "WRONG " + "; ".join(one.wrong)
            print(f"{seed} {case.said}: {said}", flush=True)
    print(
        f"right first time: {right} of {given.files} (seeds {given.first} to"
        f" {given.first + given.files - 1}, words {given.words}); {sure} of {lines} lines called"
        f" sure, {bad} of these wrong"
    )
    return int(right < 0.9 * given.files)


if __name__ == "__main__":
    sys.exit(main())
