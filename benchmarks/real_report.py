"""Table and summary of `real`."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.real_cases import Case
from benchmarks.real_judge import Question, false_proof, intervals, questions

MARGIN = 1.05  # times the yardstick's share, above which a model is worse
HEAD = (
    "", "init", "doctor", "share of the force left: yardstick / identify / trace [%]",
    "free run of 0.2 s [m, rad]", "of 2 s", "parameters", "verdict", "s",
)  # fmt: skip
GROUPS = {
    "rig": "rigs", "split": "other splits of the rigs", "half": "a file each", "case": "cases",
}  # fmt: skip
Answers = Mapping[str, Any]


def print_report(cases: Sequence[Case], answers: Sequence[Answers]) -> None:
    """The table, what is wrong, and the summary."""
    known = {case.name: case for case in cases}
    found = [(known[one["case"]], one) for one in answers if one["case"] in known]
    print("| " + " | ".join(HEAD) + " |")
    print("|" + "---|" * len(HEAD))
    for group, title in GROUPS.items():
        rows = [row(*one) for one in found if one[0].group == group]
        if rows:
            print(f"| *{title}* |" + " |" * (len(HEAD) - 1))
        for cells in rows:
            print("| " + " | ".join(cells) + " |")
    print()
    for case, one in found:
        wrong = [f"{q.about}: {q.why}" for q in questions(case, one) if not q.right]
        if wrong:
            print(f"- {case.name}: " + "; ".join(" ".join(why.split())[:160] for why in wrong))
    print()
    for text in summary(found):
        print(text)


def row(case: Case, found: Answers) -> list[str]:
    """The cells of a case."""
    asked = questions(case, found)
    models = [found.get(key, {}) for key in ("yardstick", "identify", "trace")]
    shares = [_cell(one, "share", 100.0) for one in models]
    runs = [
        "prescribed" if case.prescribed else " / ".join(_cell(one, key) for one in models)
        for key in ("run_0.2", "run_2")
    ]
    own = [q for q in asked if q.about not in ("init", "doctor", "verdict")]
    parameters = f"{sum(q.right for q in own)} of {len(own)}" if own else "-"
    note = " (written as CSV first)" if found.get("array") else ""
    return [
        case.name + note, _mark(asked, "init"), _mark(asked, "doctor"), " / ".join(shares),
        *runs, parameters, _said(found.get("trace", {}), asked), f"{seconds(found):.0f}",
    ]  # fmt: skip


def _cell(answer: Answers, key: str, times: float = 1.0) -> str:
    value = answer.get(key)
    if value is not None:
        return f"{times * value:.3g}"
    if "over" in answer:
        return str(answer["over"])
    return next((word for word in ("refused", "fault") if word in answer), "-")


def _mark(asked: Sequence[Question], about: str) -> str:
    return next(("right" if q.right else "**wrong**" for q in asked if q.about == about), "-")


def _said(trace: Answers, asked: Sequence[Question]) -> str:
    word = trace.get("verdict") or next(
        (word for word in ("refused", "over", "fault") if word in trace), "-"
    )
    named = ", ".join(trace.get("effects", ()))
    halted = " (halted)" if trace.get("not_tried") else ""
    return f"{_mark(asked, 'verdict')}: {word}{': ' if named else ''}{named}{halted}"


def line(case: Case, found: Answers) -> str:
    """One line of progress."""
    return " | ".join(row(case, found))


def seconds(found: Answers) -> float:
    """Processor time of all answers."""
    return float(
        sum(x["seconds"] for x in found.values() if isinstance(x, dict) and "seconds" in x)
    )


def worse(found: Sequence[tuple[Case, Answers]], key: str) -> tuple[list[str], int]:
    """Names of the cases in which an answer leaves more than the yardstick, and of how many."""
    names, of = [], 0
    for case, one in found:
        ours, least = one.get(key, {}).get("share"), one.get("yardstick", {}).get("share")
        if ours is not None and least is not None:
            of += 1
            if not ours <= MARGIN * least:
                names.append(case.name)
    return names, of


def summary(found: Sequence[tuple[Case, Answers]]) -> list[str]:
    """The figures that are asked for, a line each."""
    out = []
    for key in ("identify", "trace"):
        names, of = worse(found, key)
        out.append(f"{key} leaves more than {MARGIN:g} times the yardstick's share: {len(names)}"
                   f" of {of} ({', '.join(names) or 'none'})")  # fmt: skip
        for word in ("refused", "over", "fault"):
            failed = [case.name for case, one in found if word in one.get(key, {})]
            if failed:
                out.append(f"{key} {word}: {', '.join(failed)}")
    every = [q for case, one in found for q in questions(case, one)]
    out.append(f"questions right: {sum(q.right for q in every)} of {len(every)}")
    proofs = [
        f"{case.name} ({why})"
        for case, one in found
        if (why := false_proof(one, one.get("yardstick", {}).get("measured", "F") == "F"))
    ]
    reported = sum(one.get("trace", {}).get("verdict") == "effect" for _, one in found)
    out.append(f"false proofs: {len(proofs)} of {reported} reported"
               f" ({', '.join(proofs) or 'none'})")  # fmt: skip
    contained = [hold for case, one in found for hold in intervals(case, one)]
    out.append(f"intervals that hold: {sum(contained)} of {len(contained)}")
    times = [seconds(one) for _, one in found]
    if times:
        out.append(f"median processor seconds: {float(np.median(times)):.0f}")
    return out
