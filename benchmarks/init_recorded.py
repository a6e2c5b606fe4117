"""Does `workbench init` propose the right card for the files that people recorded?

    python benchmarks/init_recorded.py [--cases FOLDER] [--only TEXT]

Every file of `WORKBENCH_DATA`, and every small case that lies beside it (by default the folder
`cases` next to it), as it was recorded. What is right of each is written below by hand: kind,
motion, column and unit of each signal, or the words of a refusal. Right with the other: as many
lines put right by the answer "+". Units of a file that has no names are asked for only where
something in the file tells them. Weights were chosen with these files in sight, so this guards what
is right of them; it judges nothing.
"""

import argparse
import os
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from design.first_card.answers import THE_OTHER, BadAnswer, with_rig
from design.first_card.proposal import Proposal
from identification.errors import UserError
from workbench.logs.sources import DATA_VARIABLE
from workbench.steps.first_card.proposal import proposed, with_signal
from workbench.steps.first_card.written import checked_proposal

Signal = tuple[str | int, str]  # column, and unit ("": in no log)


@dataclass(frozen=True)
class Right:
    """What is right of the files that a pattern names: kinds, motion, signals, words of a refusal,
    and words that have to be said."""

    pattern: str
    kinds: tuple[str, ...] = ()
    rotary: bool = False
    signals: Mapping[str, Signal] = field(default_factory=dict)
    refused: str = ""
    said: tuple[str, ...] = ()


def _of(t: Signal, y: Signal, **others: Signal) -> dict[str, Signal]:
    return {"t": t, "y": y, **others}


_S = "s"
DATA: tuple[Right, ...] = (
    Right("emps/DATA_EMPS*.mat", ("motor",), False,
          _of(("t", _S), ("qm", "m"), u=("vir", ""))),
    Right("pneumatic_seals/*.csv", ("force",), False,
          _of((0, "ms"), (4, "mm"), F=(6, "N"))),
    Right("friction_backlash/*.json", ("force",), False, _of((0, _S), (1, ""), F=(2, ""))),
    Right("xl330_servo/*.json", ("motor",), True,
          _of(("timestamp", _S), ("position", "rad"), u=("load", ""),
              r=("goal_position", "rad"))),
    Right("ak80_pendulum/filter*.csv", ("force",), True,
          _of(("time", _S), ("pos", "rad"), F=("torque", "N m"))),
    Right("ak80_pendulum/gravity_compensation*.csv", ("force",), True,
          _of(("time", _S), ("position", "rad"), F=("torque", "N m")), said=("by hand",)),
    Right("ak80_pendulum/*.csv", ("force",), True,
          _of(("time", _S), ("position", "rad"), F=("torque", "N m"))),
    Right("laas_odri/cogging_tableau.txt", refused="no table|no numbers|rows|program"),
    Right("laas_odri/rolling*.txt", ("motor",), True,
          _of(("Time", _S), ("Position", "rad"), u=("Iq", "A")), said=("coast", "one direction")),
    Right("laas_odri/speed_test*.txt", ("motor",), True,
          _of(("Time", _S), ("Position", "rad"), u=("Iq", "A")), said=("one way",)),
    Right("laas_odri/*.txt", ("motor",), True,
          _of(("Time", _S), ("Position", "rad"), u=("Iq", "A"))),
    Right("odrive_cogging/coggingmap*.npy", refused="clock|rows|no log"),
    Right("odrive_cogging/*.mat", ("motor",), True, _of((0, _S), (1, "count"), u=(2, "A"))),
    Right("odrive_cogging/*.npy", ("motor",), True, _of((0, _S), (1, "count"), u=(2, "A"))),
    Right("qube_furuta/*.csv", ("motor",), True,
          _of(("t", _S), ("theta", "rad"), u=("plant_input", ""), r=("target_theta", "rad"))),
)  # fmt: skip
CASES: tuple[Right, ...] = (
    Right("belt_cart*", ("motor",), False,
          _of(("time_s", _S), ("x_m", "m"), u=("current_A", "A"))),
    Right("cogging*", ("motor",), True,
          _of(("time_s", _S), ("pos_counts", "count"), u=("iq_A", "A"))),
    Right("comma_is_both*", refused="a comma both parts"),
    Right("command_offset*", ("motor",), False,
          _of(("time_s", _S), ("position_mm", "mm"), u=("drive_V", "V"), r=("setpoint_mm", "mm"))),
    Right("held_sensor*", ("force",), False,
          _of(("time_s", _S), ("position_mm", "mm"), F=("force_cmd_N", "N")),
          said=("renewed at 50 Hz",)),
    Right("hold_limit_cycle*", ("motor",), True,
          _of(("t", _S), ("position_rad", "rad"), u=("current_A", "A"))),
    Right("late_sensor*", ("motor",), False,
          _of(("time_s", _S), ("position_m", "m"), u=("command_V", "V"), r=("setpoint_m", "m"))),
    Right("open_loop*", ("motor",), True,
          _of(("time_s", _S), ("angle_rad", "rad"), u=("iq_A", "A"))),
    Right("rests_in_test_test*", ("force",), True,
          _of(("time_s", _S), ("angle_rad", "rad"), F=("torque_Nm", "N m")),
          refused="does not move|nothing moves|no column moves"),
    Right("sign_magnitude*", refused="sign and magnitude"),
    Right("twos_complement*", ("motor", "force"), False, _of(("time", _S), ("pos", "count"))),
    Right("two_commands*", ("electro-pneumatic",), True,
          _of(("time_s", _S), ("elbow_rad", "rad"), p_p=("p6_bar", "bar"), p_n=("p7_bar", "bar"))),
    Right("*", ("force",), True,
          _of(("time_s", _S), ("angle_rad", "rad"), F=("torque_Nm", "N m"))),
)  # fmt: skip


def wrong_lines(found: Proposal, right: Right) -> dict[str, str]:
    """What of a proposal is not right, by signal or key."""
    wrong = {}
    if found.kind not in right.kinds:
        wrong["kind"] = f"{found.kind} for {right.kinds[0] if right.kinds else 'a refusal'}"
    if (found.motion == "rotary") != right.rotary and right.signals["y"][1] != "count":
        wrong["motion"] = found.motion
    swapped = {"p_p": "p_n", "p_n": "p_p"}
    for name, (column, unit) in right.signals.items():
        ones = [found.signal(key) for key in (name, swapped.get(name)) if key]
        if not any(one is not None and one.column == column for one in ones):
            shown = "nothing" if ones[0] is None else ones[0].shown
            wrong[name] = f"{shown} for {column!r}"
        elif unit and not any(one is not None and one.unit == unit for one in ones):
            wrong[name] = f"in {ones[0].unit if ones[0] else ''} for {unit}"
    turned = [one.name for one in found.signals if str(one.gain).startswith("-")]
    return wrong | dict.fromkeys(turned, "turned, and no recorded signal is")


def with_the_other(found: Proposal, right: Right) -> bool:
    """Whether a proposal is right once each wrong line takes what it would be otherwise."""
    for _ in range(3):
        wrong = wrong_lines(found, right)
        if not wrong:
            return True
        try:
            for name in [key for key in ("kind", "motion") if key in wrong][:1] or wrong:
                rig = name in ("kind", "motion")
                found = (with_rig if rig else with_signal)(found, name, THE_OTHER)
        except (BadAnswer, AssertionError, StopIteration):
            return False
    return False


def every_file(data: Path, cases: Path) -> Iterator[tuple[Path, Right]]:
    """The files, each with what is right of it."""
    for folder, rights, suffixes in (
        (data, DATA, (".csv", ".txt", ".mat", ".npy", ".json")),
        (cases, CASES, (".csv",)),
    ):
        for path in sorted(folder.rglob("*")):
            name = str(path.relative_to(folder))
            right = next((one for one in rights if Path(name).match(one.pattern)), None)
            if path.suffix in suffixes and right is not None:
                yield path, right


def main() -> int:
    """Exit status 0 where every file is right at first or with the other."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=Path)
    parser.add_argument("--only", default="", help="files whose path holds this text")
    given = parser.parse_args()
    if not os.environ.get(DATA_VARIABLE):
        parser.error(f"the measured sets are needed: set {DATA_VARIABLE}")
    data = Path(os.environ[DATA_VARIABLE])
    cases = given.cases or data.parent / "cases"
    files = right = other = sure = bad = 0
    slowest = 0.0
    for path, wanted in every_file(data, cases):
        if given.only not in str(path):
            continue
        files += 1
        begun = time.perf_counter()
        said, ok, among, of_sure, of_bad = _judged(path, wanted)
        slowest = max(slowest, time.perf_counter() - begun)
        right, other, sure, bad = right + ok, other + among, sure + of_sure, bad + of_bad
        if not ok or of_bad:
            print(f"{path.parent.name}/{path.name}: {'other' if among else 'WRONG'} {said}")
    print(
        f"right at first: {right} of {files}, with the other: {other}; {sure} lines called sure,"
        f" {bad} of these wrong; the slowest took {slowest:.1f} s"
    )
    return int(other < files)


def _judged(path: Path, wanted: Right) -> tuple[str, bool, bool, int, int]:
    """What was found, right at first, right with the other, lines called sure, and wrong ones."""
    import re

    try:
        found = checked_proposal(proposed(path))
    except UserError as error:
        fits = bool(wanted.refused and re.search(wanted.refused, str(error)))
        return f"refused: {error}", fits, fits, 0, 0
    wrong = wrong_lines(found, wanted)
    lines = (*found.hardly, *found.remarks)
    unsaid = [one for one in wanted.said if not any(one in line for line in lines)]
    sure = [one.name for one in found.signals if one.sure] + [
        one.key for one in found.rig if one.sure
    ]
    words = [f"{name}: {why}" for name, why in wrong.items()] + [f"unsaid: {x}" for x in unsaid]
    among = (not wrong or with_the_other(found, wanted)) and not unsaid
    return "; ".join(words), not words, among, len(sure), sum(name in wrong for name in sure)


if __name__ == "__main__":
    sys.exit(main())
