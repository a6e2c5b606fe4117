"""Which rules of the tracer change what it says: each switched off, or its number doubled.

    python benchmarks/ablation.py [--first 700] [--how off] [--rules HELPS ...] [--quick] [--jobs 2]
    python benchmarks/ablation.py --together    groups of rules, halved until none changes anything

A rule is a number that decides; off is the value at which it never does. The cases are those of
the blind benchmark (benchmarks/blind_cases.py), one of every kind that a verdict can go wrong in,
on fixed seeds; what a rule changes is the verdict, the effects named, or the signal that a rest
depends on. `--how double` and `--how halve` change the number instead; `--quick` leaves out the
cases that take longest.
"""

import argparse
import contextlib
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.blind_cases import Made, case_of, make
from benchmarks.blind_effects import HOLDS
from identification.effects._library import built_in
from identification.errors import UserError
from identification.tracing.trace import trace

SECONDS = 40.0
CASES = (
    "clean:motor:-:0:{0}",
    "clean:force:-:0:{0}",
    "single:table2:presliding:0.2:{0}",
    "single:random:stribeck:0.2:{0}",
    "single:force:backlash:0.2:{0}",
    "single:table2:valve_dead_zone:0.2:{0}",
    "single:random:rising_stiction:0.2:{0}",
    "single:force:warmup:0.2:{0}",
    "two:table2:spring+load_dependent_friction:0.2:{0}",
    "removed:random:cogging:0.2:{0}",
    "removed:table2:spring:0.2:{0}",
    "removed:force:stribeck:0.2:{0}",
    "drift:table2:-:0.1:{0}",
    "clean:random:-:0:{0}",
    "clean:table2:-:0:{0}",
    "single:motor:cogging:0.2:{0}",
    "single:motor:load_dependent_friction:0.2:{0}",
    "single:random:nonlinear_viscous:0.2:{0}",
    "single:random:presliding:0.2:{0}",
    "single:force:rising_stiction:0.2:{0}",
    "single:force:position_dependent_friction:0.2:{0}",
    "single:table2:stribeck:0.2:{0}",
    "two:table2:stribeck+position_dependent_friction:0.2:{0}",
    "removed:random:valve_dead_zone:0.2:{0}",
    "removed:motor:presliding:0.2:{0}",
    "removed:random:load_dependent_friction:0.2:{0}",
)
SLOW = (0, 4, 6, 10, 11)  # of them
ALL, NONE = float("inf"), 0.0
# The value at which a rule never decides.
RULES: dict[str, float] = {
    "SLIDES": NONE, "ASTRAY": ALL, "CLEARLY": NONE, "SLIGHT_SHARE": ALL, "AS_GOOD_AS_NONE": NONE,
    "RIGID_CONTACT": NONE, "RIVALS_TRIED": 0, "BRAKES": NONE, "EARNS": ALL, "TWICE": 1.0,
    "WORTH": 1.0, "LARGER": 1, "SECOND_SIGNAL": ALL, "SWINGS": NONE, "CHANCE_LEVEL": 1.0,
    "MATERIAL": NONE, "SHIFT": NONE, "REFUSED": 1, "HARDLY": NONE, "PENALTY": NONE,
    "MOTION_SHARE": NONE, "WIDEST_BAND": ALL, "SLIGHT": NONE, "TRIM": 1e9, "FEWEST_EVENTS": 99999,
    "ROBUST_SQUARE": 1e9, "FOURFOLD": NONE, "COMPLETE": 1.5, "ADEQUATE": 1.1,
    "EVENTS_NEEDED": 0, "HOPELESS": ALL, "BEYOND_CHANCE": NONE, "HALF": NONE, "FAR_LESS": ALL,
    "OF_ACCOUNT": NONE, "WORSE": ALL,
}  # fmt: skip


@dataclass(frozen=True)
class Said:
    """What a trace said of a case, and the time [s]."""

    verdict: str
    effects: tuple[str, ...]
    depends_on: tuple[str, ...]
    seconds: float

    def same(self, other: "Said") -> bool:
        """Whether both say the same."""
        return (self.verdict, self.effects, self.depends_on[:1]) == (
            other.verdict, other.effects, other.depends_on[:1],
        )  # fmt: skip


def made(first: int, quick: bool) -> list[Made]:
    """The cases as simulated; one that its loop does not bear is left out."""
    out = []
    for name in (one for i, one in enumerate(CASES) if not (quick and i in SLOW)):
        with contextlib.suppress(UserError, RuntimeError):
            out.append(make(case_of(name.format(first)), SECONDS))
    return out


def said_of(one: Made) -> Said:
    """What the tracer says of a case."""
    hidden = one.case.effects if one.case.mode == "removed" else ()
    removed = {key for name in hidden for key in (name, *HOLDS.get(name, ()))}
    library = {k: e for k, e in built_in().items() if k not in removed}
    begin = time.perf_counter()
    try:
        found = trace(
            [one.train.log], [one.test.log], one.machine.rig, library, np.random.default_rng(0)
        )
    except (UserError, ArithmeticError, ValueError, IndexError, np.linalg.LinAlgError) as error:
        return Said(type(error).__name__, (), (), time.perf_counter() - begin)
    keys = tuple(e.effect.key for e in found.effects)
    return Said(found.verdict, keys, found.unknown.depends_on, time.perf_counter() - begin)


@contextlib.contextmanager
def changed(rule: str, how: str) -> Iterator[None]:
    """The rule's number changed in every module that names it."""
    places = [
        module for name, module in list(sys.modules.items())
        if name.startswith("identification.") and hasattr(module, rule)
    ]  # fmt: skip
    before = getattr(places[0], rule)
    value = {"off": RULES[rule], "double": 2 * before, "halve": before / 2}[how]
    value = int(value) if isinstance(before, int) and np.isfinite(value) else value
    for module in places:
        setattr(module, rule, value)
    try:
        yield
    finally:
        for module in places:
            setattr(module, rule, before)


def tried(
    rules: Sequence[str], first: int, quick: bool, how: str
) -> tuple[Sequence[str], list[Said]]:
    """What is said of every case with these rules changed together."""
    cases = made(first, quick)
    with contextlib.ExitStack() as stack:
        for rule in rules:
            stack.enter_context(changed(rule, how))
        return rules, [said_of(one) for one in cases]


Run = Callable[[Sequence[str]], tuple[Sequence[str], list[Said]]]
Tell = Callable[[Sequence[str], list[Said]], bool]


def halved(rules: Sequence[str], run: Run, tell: Tell) -> list[str]:
    """Those of the rules that change something, by groups halved until one is left."""
    _, found = run(rules)
    if not tell(rules, found):
        return []
    if len(rules) == 1:
        return list(rules)
    middle = len(rules) // 2
    return halved(rules[:middle], run, tell) + halved(rules[middle:], run, tell)


def table_line(
    rules: Sequence[str], cases: Sequence[Made], usual: Sequence[Said], found: Sequence[Said]
) -> str:
    """A line of the table."""
    off = [
        f"{one.case.name}: {a.verdict} {' '.join(a.effects)} -> {b.verdict} {' '.join(b.effects)}"
        f" {' '.join(b.depends_on[:1])}"
        for one, a, b in zip(cases, usual, found, strict=True)
        if not a.same(b)
    ]
    took = sum(b.seconds for b in found) / max(sum(a.seconds for a in usual), 1e-9)
    return (
        f"{' '.join(rules):20s} {len(off)} of {len(cases)} changed, {took:.2f} of the time; "
        + "; ".join(off)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=700)
    parser.add_argument("--how", choices=("off", "double", "halve"), default="off")
    parser.add_argument("--rules", nargs="*", default=list(RULES))
    parser.add_argument("--together", action="store_true")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    cases = made(asked.first, asked.quick)
    _, usual = tried((), asked.first, asked.quick, asked.how)
    for one, said in zip(cases, usual, strict=True):
        print(
            f"{one.case.name:60s} {said.verdict} {' '.join(said.effects)}"
            f" {' '.join(said.depends_on)} {said.seconds:.1f} s",
            flush=True,
        )
    run = partial(tried, first=asked.first, quick=asked.quick, how=asked.how)
    if asked.together:

        def tell(rules: Sequence[str], found: list[Said]) -> bool:
            print(table_line(rules, cases, usual, found), flush=True)
            return not all(a.same(b) for a, b in zip(usual, found, strict=True))

        print("decide:", " ".join(halved(asked.rules, run, tell)))
        return
    with ProcessPoolExecutor(asked.jobs) as pool:
        for rules, found in pool.map(run, [(rule,) for rule in asked.rules]):
            print(table_line(rules, cases, usual, found), flush=True)


if __name__ == "__main__":
    main()
