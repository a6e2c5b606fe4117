"""Cases of the blind benchmark: what is simulated, and the folder that the tracer is given."""

import json
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np

from benchmarks.blind_effects import ABSORBED, HOLDS, PLACE, SIZES, acting, place_of, shows
from benchmarks.blind_machines import (
    Machine,
    Run,
    calmed,
    drifted,
    machine,
    simulated,
    stream,
    usable,
)
from identification.effects._base import Acting
from identification.effects._library import built_in

Mode = Literal["clean", "single", "two", "removed", "drift"]


@dataclass(frozen=True)
class Case:
    """One run: machine by name, effects at this strength, seed, and what is asked of it."""

    mode: Mode
    machine: str
    effects: tuple[str, ...]
    strength: float
    seed: int

    @property
    def name(self) -> str:
        """Unique among cases."""
        what = "+".join(self.effects) or "-"
        return f"{self.mode}:{self.machine}:{what}:{self.strength:g}:{self.seed}"


def case_of(name: str) -> Case:
    """The case of this name, as a results file and the progress show it."""
    mode, machine_name, what, strength, seed = name.split(":")
    keys = () if what == "-" else tuple(what.split("+"))
    return Case(cast(Mode, mode), machine_name, keys, float(strength), int(seed))


@dataclass(frozen=True)
class Plan:
    """What the command line asks for."""

    effects: Sequence[str]
    machines: Sequence[str]
    strengths: Sequence[float]
    seeds: Sequence[int]
    clean: int
    single: bool
    removed: bool
    two: int
    drift: int


def effect_keys() -> list[str]:
    """Effects of the library that the benchmark knows to size."""
    return [key for key in built_in() if key in SIZES and key not in ABSORBED]


def cases(plan: Plan) -> Iterator[Case]:
    """Every case of a plan, those that the machine's logs cannot show left out."""
    for seed in plan.seeds:
        for name in plan.machines:
            one = machine(name, seed)
            for key in plan.effects:
                if not shows(key, one):
                    continue
                for s in plan.strengths:
                    if plan.single:
                        yield Case("single", name, (key,), s, seed)
                    if plan.removed:
                        yield Case("removed", name, (key,), s, seed)
    yield from others(plan)


def others(plan: Plan) -> Iterator[Case]:
    """Cases counted by number, over the machines in turn: clean, two effects, drift."""
    first = plan.seeds[0]
    for mode, count in (("clean", plan.clean), ("two", plan.two), ("drift", plan.drift)):
        for i in range(count):
            name = plan.machines[i % len(plan.machines)]
            seed = first + i // len(plan.machines)
            s = 0.0 if mode == "clean" else plan.strengths[i % len(plan.strengths)]
            if mode == "two":
                keys = pair(plan.effects, machine(name, seed), seed)
                if keys:
                    yield Case("two", name, keys, s, seed)
            elif mode == "clean":
                yield Case("clean", name, (), 0.0, seed)
            else:
                yield Case("drift", name, (), s, seed)


def pair(keys: Sequence[str], one: Machine, seed: int) -> tuple[str, ...]:
    """Two effects that act in different places, drawn from the seed; () where there are none."""
    library, rng = built_in(), stream(seed, one.name, "pair")
    shown = [key for key in keys if shows(key, one)]
    options = [
        (a, b) for i, a in enumerate(shown) for b in shown[i + 1 :]
        if PLACE[library[a].acts] != PLACE[library[b].acts]
    ]  # fmt: skip
    return options[int(rng.integers(len(options)))] if options else ()


@dataclass(frozen=True, eq=False)
class Made:
    """A case as simulated: its machine, effects and both runs."""

    case: Case
    machine: Machine
    effects: tuple[Acting, ...]
    train: Run
    test: Run


def make(case: Case, seconds: float) -> Made:
    """Simulates a case; raises BadModel or RuntimeError where its loop cannot be used."""
    one, library = machine(case.machine, case.seed), built_in()
    plain = simulated(one, (), case.seed, "train", seconds)
    at = place_of(one, plain)
    acts = tuple(
        acting(key, case.strength, at, library, stream(case.seed, case.machine, key))
        for key in case.effects
    )
    for act in acts:
        one = calmed(one, act.values["tau"] if act.effect.acts == "delay" else 0.0)
    train = simulated(one, acts, case.seed, "train", seconds) if acts else plain
    nine = one.friction
    if case.mode == "drift":
        nine = drifted(nine, case.strength, stream(case.seed, case.machine, "drift"))
    test = simulated(one, acts, case.seed, "test", seconds, nine)
    if not (usable(train.true) and usable(test.true)):
        raise RuntimeError("the loop hardly slides, or runs away, with these effects")
    return Made(case, one, acts, train, test)


def truth(made: Made) -> dict[str, Any]:
    """What only the maker knows."""
    return {
        "mode": made.case.mode,
        "machine": made.case.machine,
        "kind": made.machine.kind,
        "strength": made.case.strength,
        "seed": made.case.seed,
        "coulomb": made.machine.coulomb,
        "friction": asdict(made.machine.friction),
        "drive": asdict(made.machine.drive),
        "effects": {one.key: one.values for one in made.effects},
        "depends_on": {one.key: list(one.effect.depends_on) for one in made.effects},
    }


def write_job(
    made: Made, folder: Path, *, only: Sequence[str] = (), baselines: bool = False
) -> None:
    """The folder that the tracing process reads; only: the library cut down to these keys."""
    hidden = made.case.effects if made.case.mode == "removed" else ()
    removed = [key for one in hidden for key in (one, *HOLDS.get(one, ()))]
    request = {
        "rig": asdict(made.machine.rig),
        "removed": [] if only else removed,
        "only": list(only),
        "baselines": baselines,
    }
    folder.mkdir(parents=True)
    for run in (made.train, made.test):
        with zipfile.ZipFile(folder / f"{run.log.name}.npz", "w") as stored:
            for key, x in run.log.signals.items():
                with stored.open(f"{key}.npy", "w") as entry:
                    np.save(entry, x)
    (folder / "request.json").write_text(json.dumps(request), encoding="utf-8")
