"""What doctor says is identifiable, and what identify reports: on every rig and case of the real
logs.

    python benchmarks/promises.py --out promises.jsonl [--only NAME ...] [--limit 300] [--held-out]
    python benchmarks/promises.py --again promises.jsonl [--held-out]

Rigs and cases are those of `real.toml`, each in a process of its own as `real.py` runs it. Of the
first log of a case alone `doctor LOG` is held against `identify LOG`, parameter by parameter; where
a case has several logs, what doctor would say of them together against `identify LOG...`. A log
that is refused tells nothing. With --held-out these are the test logs of the cases, which did not
serve to choose how long a first look is. With --again the answers of `identify` are read from the
file, and doctor alone is asked anew. Exit status 0 in any case.
"""

import argparse
import json
import os
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.real import ROOT, answered, read
from benchmarks.real_cases import Case, every_case
from benchmarks.real_child import OF_TEST
from identification.model.karnopp import NAMES
from workbench.logs.sources import DATA_VARIABLE

Answers = Mapping[str, Any]
WIDTH = 100  # of a reason


@dataclass(frozen=True)
class Promise:
    """A parameter of a log, or of the logs of a case: said to be identifiable ("yes", "no", or "if"
    some condition holds), and reported."""

    case: str
    logs: str
    name: str
    said: str
    identifiable: bool
    why: str
    because: str

    @property
    def kept(self) -> bool:
        """Whether the two are the same."""
        return self.said == ("yes" if self.identifiable else "no")


def promises(found: Answers) -> Iterator[Promise]:
    """Each of the nine of a case's answers; of the logs together where there are several."""
    for logs in ("alone", "all"):
        if logs not in found:
            continue
        fit, before = found[logs], found.get(f"said_{logs}", {"fault": ""})
        if any(word in one for one in (fit, before) for word in ("over", "fault")):
            continue
        identifiable, kept = before.get("identifiable", {}), fit.get("kept", {})
        refused = before.get("refused", "")
        for name in NAMES:
            one, got = identifiable.get(name, {}), kept.get(name, {})
            said = "yes" if one.get("can") else "if" if one.get("only_if") else "no"
            said = "no" if refused else said
            yield Promise(
                found["case"], logs, name, said, got.get("value") is not None,
                one.get("why") or refused, got.get("why") or fit.get("refused") or "",
            )  # fmt: skip


def print_table(found: Sequence[Answers]) -> None:
    """What differs, a line each, and the counts by parameter."""
    every = [one for case in found for one in promises(case)]
    print("| case | logs | | said | reported | doctor's reason | identify's reason |")
    print("|---|---|---|---|---|---|---|")
    for one in every:
        if not one.kept:
            identifiable = "yes" if one.identifiable else "no"
            why, because = (" ".join(text.split())[:WIDTH] for text in (one.why, one.because))
            print(f"| {one.case} | {one.logs} | {one.name} | {one.said} | {identifiable} | {why} |"
                  f" {because} |")  # fmt: skip
    print()
    print(
        "| | said and reported | said, not reported | not said, reported | neither"
        ' | "only if": reported | not |'
    )
    print("|---|---|---|---|---|---|---|")
    for name in (*NAMES, "all"):
        count = Counter((one.said, one.identifiable) for one in every if name in (one.name, "all"))
        cells = [count[key] for key in (("yes", True), ("yes", False), ("no", True), ("no", False),
                                      ("if", True), ("if", False))]  # fmt: skip
        print(f"| {name} | " + " | ".join(map(str, cells)) + " |")
    print()
    for logs, words in (("alone", "single logs"), ("all", "logs of a case together")):
        own = [one for one in every if one.logs == logs]
        cases = len({one.case for one in own})
        wrong = sum(not one.kept and one.said != "if" for one in own)
        open_ones = sum(one.said == "if" for one in own)
        print(f"{words}: {wrong} of {len(own)} parameters over {cases} differ;"
              f" \"only if\" of {open_ones}")  # fmt: skip
    missing = [case["case"] for case in found
               if any("over" in case.get(k, {}) or "fault" in case.get(k, {})
                      for k in ("said_alone", "said_all", "alone", "all"))]  # fmt: skip
    if missing:
        print(f"without an answer: {', '.join(missing)}")
    seconds = [case["said_alone"]["seconds"] for case in found
               if "seconds" in case.get("said_alone", {})]  # fmt: skip
    if seconds:
        print(f"doctor: {float(np.median(seconds)):.1f} processor seconds in the median,"
              f" {max(seconds):.1f} at most")  # fmt: skip


def asked(
    todo: Sequence[Case], known: Mapping[str, Answers], given: argparse.Namespace
) -> list[Answers]:
    """The answers of these cases; lines of JSON are written as they come."""
    out = list[Answers]()
    for case in todo:
        if not case.there:
            print(f"{case.name}: skipped, its files are not there", flush=True)
            continue
        before = known.get(case.name)
        part = "promise" if before is None else "said"
        found = answered(case, given.limit, part + (OF_TEST if given.held_out else ""))
        found = {**(before or {}), **found}
        out.append(found)
        if given.out:
            with given.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(found) + "\n")
        print(f"{case.name}: {sum(not one.kept for one in promises(found))}", flush=True)
    return out


def main() -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", metavar="NAME")
    parser.add_argument("--held-out", action="store_true", help="the test logs of the cases")
    parser.add_argument("--limit", type=float, default=300.0, help="processor seconds a case")
    parser.add_argument("--out", type=Path, help="lines of JSON are added to it")
    parser.add_argument("--again", type=Path, help="a file of such lines: its fits are kept")
    given = parser.parse_args()
    os.environ.setdefault(DATA_VARIABLE, str(ROOT.parent / "shared" / "data"))
    known = {one["case"]: one for one in read(given.again)} if given.again else {}
    rigs = [one for one in every_case() if one.group not in ("split", "half")]
    todo = [one for one in rigs if one.card is not None and one.test]
    if given.only:
        todo = [one for one in todo if one.name in given.only]
    print_table(asked(todo, known, given))
    return 0


if __name__ == "__main__":
    sys.exit(main())
