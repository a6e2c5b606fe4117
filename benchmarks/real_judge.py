"""What is right in the answers to a case of `real`: questions, intervals, proofs."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from benchmarks.real_cases import Case, Truth

WORSE = 1.02  # times the plain model's error, from which a prediction is worse
NEVER_RIGHT = ("over", "fault")
RUNS = ("run_0.2", "run_2")


@dataclass(frozen=True)
class Question:
    """A question, whether its answer is right, and what is wrong with it."""

    about: str
    right: bool
    why: str = ""


def questions(case: Case, found: Mapping[str, Any]) -> list[Question]:
    """Every question of the case that was asked."""
    out = []
    right = case.right
    if right.init is not None and "init" in found:
        out.append(_question("init", _init(right.init, found["init"])))
    if right.doctor is not None and "doctor" in found:
        out.append(_question("doctor", _doctor(right.doctor, found["doctor"])))
    last = final_model(found)
    if last is not None:
        out += [_question(one.name, _parameter(one, last)) for one in right.truth]
    if right.verdicts and "trace" in found:
        out.append(_question("verdict", _verdict(case, found["trace"])))
    return out


def _question(about: str, wrong: str) -> Question:
    return Question(about, not wrong, wrong)


def final_model(found: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The last answer with parameters; an answer without any where none has; None: not asked."""
    asked = [found[key] for key in ("trace", "identify") if key in found]
    with_parameters = [one for one in asked if "parameters" in one]
    best: list[Mapping[str, Any]] = with_parameters or asked
    return best[0] if best else None


def _failed(answer: Mapping[str, Any]) -> str:
    said = {key: str(answer[key]).strip().splitlines() for key in NEVER_RIGHT if key in answer}
    return next((f"{key}: {lines[-1] if lines else ''}" for key, lines in said.items()), "")


def _init(right: Mapping[str, Any], answer: Mapping[str, Any]) -> str:
    """What is wrong with a proposed card; empty: nothing."""
    if "refused" in right:
        said = str(answer.get("refused", ""))
        return "" if re.search(right["refused"], said) else f"not refused so: {said or 'a card'}"
    failed = _failed(answer) or str(answer.get("refused", ""))
    if failed:
        return failed
    wrong = []
    if "kind" in right and answer["kind"] not in right["kind"]:
        wrong.append(f"kind {answer['kind']}")
    if "motion" in right and answer["motion"] != right["motion"]:
        wrong.append(str(answer["motion"]))
    for name, column in right["signals"].items():
        shown = answer["signals"].get(name, [])
        if column not in shown:
            wrong.append(f"{name} = {shown[0] if shown else 'none'}, not {column}")
    for name, unit in right.get("units", {}).items():
        given = answer["units"].get(name)
        if given is not None and given != unit:
            wrong.append(f"{name} in {given}, not {unit}")
    return "; ".join(wrong)


def _doctor(right: Mapping[str, Any], answer: Mapping[str, Any]) -> str:
    """What is wrong with the doctor's answer; empty: nothing."""
    if failed := _failed(answer) or str(answer.get("refused", "")):
        return failed
    wrong, text = [], answer["text"]
    if "delay" in right:
        low, high = right["delay"]
        late = answer["delays"].get("u")
        if late is None or not low <= late <= high:
            wrong.append(f"delay {late} s, not {low:g} to {high:g}")
    if "says" in right and not re.search(right["says"], text):
        wrong.append(f"does not say {right['says']}")
    if "never" in right and (said := re.search(right["never"], text)):
        wrong.append(f"says {said[0]!r}")
    rested = answer["rested"]
    if "most_rest" in right and (rested or 0.0) > right["most_rest"] * answer["duration"]:
        wrong.append(f"at rest for {rested:.3g} of {answer['duration']:.3g} s")
    return "; ".join(wrong)


def _parameter(truth: Truth, answer: Mapping[str, Any]) -> str:
    """What is wrong with a parameter; empty: nothing."""
    if failed := _failed(answer):
        return failed
    value = answer.get("parameters", {}).get(truth.name, {}).get("value")
    if value is None:
        return "" if truth.or_none else "not identifiable"
    if truth.low <= value <= truth.high:
        return ""
    return f"{value:.4g}, not {truth.low:.4g} to {truth.high:.4g}"


def _verdict(case: Case, answer: Mapping[str, Any]) -> str:
    """What is wrong with a verdict and the effects named; empty: nothing."""
    if failed := _failed(answer):
        return failed
    if "refused" in answer:
        return "" if "refused" in case.right.verdicts else str(answer["refused"])
    named, wrong = answer["effects"], []
    if answer["verdict"] not in case.right.verdicts:
        wrong.append(f"{answer['verdict']}, not {' or '.join(case.right.verdicts)}")
    wrong += [
        f"{must} not named"
        for must in case.right.must
        if not any(re.fullmatch(must, one) for one in named)
    ]
    wrong += [f"names {one}" for one in named if one in case.right.must_not]
    return "; ".join(wrong)


def intervals(case: Case, found: Mapping[str, Any]) -> list[bool]:
    """Whether each reported interval of a parameter with a known value holds it."""
    out = []
    parameters = (final_model(found) or {}).get("parameters", {})
    for truth in case.right.truth:
        one = parameters.get(truth.name, {})
        if truth.value is not None and one.get("low") is not None and one["value"] is not None:
            out.append(bool(one["low"] <= truth.value <= one["high"]))
    return out


def false_proof(found: Mapping[str, Any], force_is_measured: bool) -> str:
    """The held-out prediction of a measured signal that a reported effect makes worse, or that it
    was reported on a log at rest; else empty."""
    plain, after = found.get("identify", {}), found.get("trace", {})
    if after.get("verdict") != "effect":
        return ""
    least = found.get("yardstick", {})
    if "values" in least and least.get("share") is None:
        return "nothing slides on the held-out log"
    for key in (*RUNS, "share") if force_is_measured else RUNS:
        before, now = plain.get(key), after.get(key)
        if before is not None and (now is None or now > WORSE * before):
            return f"{key} {before:.3g} to {now if now is None else format(now, '.3g')}"
    return ""
