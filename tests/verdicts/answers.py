"""What the workbench says of an entry, and where that is not right."""

import re
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from design.identified.trace_logs import Traced, trace_logs
from identification.errors import UserError
from tests.verdicts.entries import Entry, Right, Within, with_amplitudes
from tests.verdicts.logs import sources
from workbench.cards.own_effects import library

NOT_NAMED, FALSE_POSITIVE, NOT_IDENTIFIABLE = "not named", "false positive", "not identifiable"
DIGITS = 4
Found = str | float | bool
Sizes = Mapping[str, float | None]


@dataclass(frozen=True)
class Answer:
    """An answer in the table's words; evaluations: how often the trace asked whether it is to go
    on, a measure of its work that is the same everywhere; seconds: of the processor, by its
    clock."""

    verdict: str
    effects: Mapping[str, Sizes]
    parameters: Sizes
    depends_on: tuple[str, ...]
    complete: bool
    halted: bool
    evaluations: int
    seconds: float
    refusal: str = ""


class EvaluationLimit:
    """Whether a trace is to go on: up to so many evaluations."""

    def __init__(self, most: int) -> None:
        self.most, self.count = most, 0

    def __call__(self) -> bool:
        self.count += 1
        return self.count <= self.most


def answer(entry: Entry, data: Path | None, folder: Path) -> Answer:
    """The entry's log traced as the command does it; a refusal is an answer too.

    Raises Absent where its data are not there.
    """
    evaluations, begun = EvaluationLimit(entry.evaluations), time.process_time()
    try:
        train, test = sources(entry, data, folder)
        traced = trace_logs(
            train.logs, test.logs if test else None, library(), keep_going=evaluations
        )
    except UserError as error:
        seconds = time.process_time() - begun
        return Answer("refused", {}, {}, (), False, False, evaluations.count, seconds, str(error))
    return _said(traced, evaluations.count, time.process_time() - begun)


def _said(traced: Traced, evaluations: int, seconds: float) -> Answer:
    """The answer; among its effects gravity and a constant force, which the plain model has."""
    found = traced.trace
    return Answer(
        verdict=found.verdict,
        effects={
            **{one.key: dict(one.values) for one in found.surroundings.effects},
            **{
                one.effect.key: with_amplitudes({n: e.value for n, e in one.params.items()})
                for one in found.effects
            },
        },
        parameters={name: e.value for name, e in found.parameters_after.items()},
        depends_on=tuple(dict.fromkeys((*found.unknown.depends_on, *found.left.depends_on))),
        complete=found.complete,
        halted=bool(found.not_tried),
        evaluations=evaluations,
        seconds=seconds,
    )


def shortfalls(said: Answer, right: Right) -> dict[str, Found]:
    """By what is wrong (`verdict`, `effect KEY`, `KEY.size`, ...) what was found in its place."""
    out: dict[str, Found] = {}
    if said.verdict not in right.verdict:
        out["verdict"] = said.verdict
    for key, sizes in right.effects.items():
        if key not in said.effects:
            out[f"effect {key}"] = NOT_NAMED
        else:
            out |= _off(f"{key}.", said.effects[key], sizes)
    for key in said.effects:
        once = re.sub(r"_\d+$", "", key)  # an order of a turn more
        if once not in right.effects and once not in right.may:
            out[f"effect {key}"] = FALSE_POSITIVE
    if right.complete is not None and said.complete is not right.complete:
        out["complete"] = said.complete
    if right.depends_on and not set(right.depends_on) & set(said.depends_on):
        out["depends_on"] = ", ".join(said.depends_on) or "nothing"
    if said.verdict != "refused":
        out |= _off("", said.parameters, right.parameters)
    return out


def _off(prefix: str, said: Sizes, right: Mapping[str, Within]) -> dict[str, Found]:
    return {
        f"{prefix}{name}": NOT_IDENTIFIABLE if said.get(name) is None else rounded(said[name])
        for name, one in right.items()
        if not one.holds(said.get(name))
    }


def rounded(value: float | None) -> float:
    """A number with the digits that the table keeps."""
    return float(f"{value:.{DIGITS}g}")
