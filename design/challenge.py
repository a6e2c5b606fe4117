"""Champion and challenger: a new model and design replace the old only where they win.

They have to win twice, with margin: on held-out logs or time blocks that neither was fitted on
(free run in windows, and the force equation), and in the simulated loop of the machine as it is
now, along one reference for both designs. Where only the model wins and the active design still
keeps every limit, the model alone is replaced. The rule is ours; the paper re-tunes without asking.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from design.closed_loop.driven_loop import driven_loop, run_driven
from design.closed_loop.loop_figures import common_reference, tested_of
from design.controllers.validate import validate
from design.machine.design import Design
from design.machine.model import Model
from design.machine.readable import Display
from design.measured.predict import default_drive, pooled, predict
from identification.errors import BadModel
from identification.log import Log
from identification.model.estimates import Drive

WINDOW = 2.0  # s between fresh starts of a free run, as everywhere on held-out logs
LEAST_HELD_OUT = 2.0  # s


@dataclass(frozen=True)
class Terms:
    """What winning means.

    held_out: least relative fall of a held-out error; worse: largest rise of any other one;
    loop: least relative fall of the tracking error in simulation.
    """

    held_out: float = 0.1
    worse: float = 0.02
    loop: float = 0.02


@dataclass(frozen=True)
class Contender:
    """A model and the design made for it; None: a model alone."""

    model: Model
    design: Design | None


@dataclass(frozen=True)
class HeldOut:
    """Errors on held-out logs: free run [m] and force equation [N]; None where there is none."""

    position_rms: float | None
    force_rms: float | None


@dataclass(frozen=True)
class Tracking:
    """A design on the machine as it is now: error along the reference [m], and what it misses."""

    rms: float | None
    missed: tuple[str, ...]


@dataclass(frozen=True)
class Contest:
    """Who has won and why, with the figures of both; loop of the champion None: no design.

    won: the challenger, model and design; model_won: its model, while the champion's design keeps
    every limit on it and is not beaten.
    """

    won: bool
    model_won: bool
    reason: str
    held_out: dict[str, HeldOut]
    loop: dict[str, Tracking | None]


def challenge(
    champion: Contender,
    challenger: Contender,
    held_out: Sequence[Log],
    rng: np.random.Generator,
    terms: Terms | None = None,
) -> Contest:
    """The contest on logs that neither was fitted on, and in the loop on the challenger's plant.

    rng: of the simulated sensors' noise. Raises BadModel where no held-out log is long enough.
    """
    terms = terms or Terms()
    if not any(log.duration >= LEAST_HELD_OUT for log in held_out):
        raise BadModel(f"no held-out log of at least {LEAST_HELD_OUT:g} s; give a longer one")
    # One drive for both: the command where each model may be driven by it on each log.
    both = {"champion": champion, "challenger": challenger}
    ways = {default_drive(one.model, log) for one in both.values() for log in held_out}
    drive: Drive = "command" if ways == {"command"} else "force"
    errors = {name: held_out_errors(one.model, held_out, drive) for name, one in both.items()}
    designs = [one.design for one in both.values() if one.design is not None]
    seed = int(rng.integers(2**32))  # both designs see the same noise
    loop = {
        name: tracking(challenger.model, one.design, designs, np.random.default_rng(seed))
        if one.design is not None
        else None
        for name, one in both.items()
    }
    display, old = challenger.model.display, loop["champion"]
    pairs = _compared(errors["champion"], errors["challenger"], display)
    lost = _lost_held_out(pairs, terms)
    if lost:
        return Contest(False, False, lost, errors, loop)
    won, said = _tracked(old, loop["challenger"], terms, display)
    champion_passes = old is not None and old.rms is not None and not old.missed
    said = f"{_held_out_words(pairs)}; simulation: {said}"
    return Contest(won, not won and champion_passes, said, errors, loop)


def held_out_errors(model: Model, logs: Sequence[Log], drive: Drive) -> HeldOut:
    """Root mean squares over the logs, by their lengths; no free run with prescribed motion."""
    positions, forces = [], []
    for log in logs:
        window = WINDOW if log.duration >= 2 * WINDOW else None
        one = predict(model, log, drive=drive, window=window)
        positions.append((None if model.by_equation else one.position_rms, len(log)))
        forces.append((one.force_predicted_rms, len(log)))
    return HeldOut(pooled(positions), pooled(forces))


# Of what both have an error of: its name, that of the active model, the new one, in words.
Pairs = list[tuple[str, float, float, str]]


def _compared(old: HeldOut, new: HeldOut, display: Display) -> Pairs:
    pairs = (
        ("free run", old.position_rms, new.position_rms, display.length_text),
        ("force", old.force_rms, new.force_rms, display.force_text),
    )
    return [
        (name, before, after, f"{text(after)} rms against {text(before)}")
        for name, before, after, text in pairs
        if before is not None and after is not None
    ]


def _lost_held_out(pairs: Pairs, terms: Terms) -> str:
    """Why the challenger does not win on held-out logs; empty where it does."""
    for name, before, after, said in pairs:
        if not after <= before * (1.0 + terms.worse):
            return f"held out, {name}: {said}, worse than the active one"
    if any(after <= before * (1.0 - terms.held_out) for _, before, after, _ in pairs):
        return ""
    least = f"one of them has to fall by {100 * terms.held_out:g} % at least"
    return f"{_held_out_words(pairs)}; {least}"


def _held_out_words(pairs: Pairs) -> str:
    """The errors of the new model against those of the active one."""
    found = ", ".join(f"{name} {said}" for name, _, _, said in pairs)
    return f"held out: {found or 'nothing to compare'}"


def _tracked(
    old: Tracking | None, new: Tracking | None, terms: Terms, display: Display
) -> tuple[bool, str]:
    """Whether the challenger wins in simulation, and what came out there."""
    if new is None:
        return False, "no design"
    if new.missed or new.rms is None:
        return False, "; ".join(new.missed)
    text = f"tracking error {display.length_text(new.rms)} rms"
    if old is None:
        return True, f"{text}, no design before"
    if old.missed or old.rms is None:
        return True, f"{text}, the active design misses: {'; '.join(old.missed)}"
    text = f"{text} against {display.length_text(old.rms)} of the active design"
    if new.rms <= old.rms * (1.0 - terms.loop):
        return True, text
    return False, f"{text} on the same machine, at least {100 * terms.loop:g} % less needed"


def tracking(
    machine: Model, found: Design, designs: Sequence[Design], rng: np.random.Generator
) -> Tracking:
    """A design on a machine: what validation says of it, and its error on the common reference."""
    if found.recommended == "none":
        return Tracking(None, ("no controller keeps its goals",))
    name = tested_of(found)
    try:
        checked, _ = validate(machine, found, rng)
        loop = driven_loop(machine, found, found.controllers[name])
        run = run_driven(machine, loop, common_reference(machine, designs, loop.h), rng)
    except BadModel as error:
        return Tracking(None, (str(error),))
    with np.errstate(over="ignore", invalid="ignore"):
        rms = float(np.sqrt(np.mean((run.r - run.y) ** 2)))
    return Tracking(rms if np.isfinite(rms) else None, checked.figures[name]["model"].missed)
