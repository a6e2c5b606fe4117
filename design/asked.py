"""What is asked of a fit and of a loop: each number with its default and what it means, as the
option says it.

Light to import, since every `--help` asks for it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal


def asked(default: object, meaning: str) -> Any:
    """A field with its default, and what it means in the words of the option that says it."""
    return field(default=default, metadata={"meaning": meaning})


@dataclass(frozen=True)
class Limits:
    """What a loop must keep to pass.

    Margins; error at standstill and overshoot relative to the step; error along the smooth
    reference relative to its amplitude; largest force relative to that in the machine's logs.
    """

    modulus: float = asked(0.5, "Least modulus margin.")
    delay: float = asked(2.0, "Least delay margin, in samples.")
    standstill: float = asked(0.05, "Largest error at standstill, relative to the step.")
    tracking: float = asked(
        0.2, "Largest rms error along the smooth reference, relative to its amplitude."
    )
    overshoot: float = asked(0.1, "Largest overshoot, relative to the step.")
    force: float = asked(
        1.2, "Largest force, relative to the largest in the logs of the machine's model."
    )


@dataclass(frozen=True)
class RobustAsked:
    """What is asked over the machines: so many drawn, on what share of them each limit has to hold.

    staircase: largest on a slow ramp [m], None for any. drift: see `drift_found`.
    """

    draws: int = asked(200, "Machines drawn, with --robust.")
    probability: float = asked(
        0.95, "Share of the machines on which each limit has to hold, with --robust."
    )
    limits: Limits = field(default_factory=Limits)
    staircase: float | None = asked(
        None, "Largest staircase on a slow ramp [m, rad], with --robust.  [default: any]"
    )
    drift: Mapping[str, float] | None = None
    seed: int = asked(0, "Of the machines drawn, with --robust.")


@dataclass(frozen=True)
class Wanted:
    """What is asked: parameters to be identified (none: all), limits where they are not those of
    card and logs, seed. rivals: keys of effects of which one is at work, which the run is to
    discriminate."""

    parameters: tuple[str, ...] = asked(
        (), "Parameters to be identified, as m,F_cp,dv_p.  [default: all]"
    )
    stroke: tuple[float, float] | None = asked(
        None, "Positions between which it may move [m, rad].  [default: the card's, or the logs']"
    )
    speed: float | None = asked(None, "Largest speed [m/s, rad/s].  [default: 1.5 times the logs']")
    force: float | None = asked(None, "Largest force [N, N m].  [default: 1.2 times the logs']")
    command: float | None = asked(None, "Largest command.  [default: any]")
    seconds: float = asked(20.0, "How long the run lasts [s].")
    seed: int = asked(0, "")
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True)
class Options:
    """How to identify; orders (na, nb, nk) and period [s] of the ARX plant, None: chosen."""

    drive: Literal["force", "command"] | None = asked(
        None, "What drives the fitted run.  [default: the command where it explains the force]"
    )
    orders: tuple[int, int, int] | None = asked(None, "Orders of the ARX plant.  [default: chosen]")
    design_period: float | None = asked(
        None, "Sampling period of the ARX plant [s].  [default: 0.01, or the log's if longer]"
    )
