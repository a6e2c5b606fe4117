"""What is asked of a computation: each number with its default, and the option that says it.

Of these the commands make their options, and the functions of Python take them as they are; and
which part of a command's bar each stage takes. Light to import, since every `--help` asks for it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import click

from workbench.options import POSITIVE, SEEDS, Finite, Parsed, listed_names, parse_orders
from workbench.signature import asked

Orders = tuple[int, int, int]


@dataclass(frozen=True)
class Options:
    """How to identify; orders (na, nb, nk) and period [s] of the ARX plant, None: chosen."""

    drive: Literal["force", "command"] | None = asked(
        None, "What drives the fitted run.  [default: the command where it explains the force]"
    )
    orders: Orders | None = asked(
        None, "Orders of the ARX plant.  [default: chosen]",
        type=Parsed(parse_orders), metavar="NA,NB,NK",
    )  # fmt: skip
    design_period: float | None = asked(
        None, "Sampling period of the ARX plant [s].  [default: 0.01, or the log's if longer]",
        type=POSITIVE, metavar="S",
    )  # fmt: skip


@dataclass(frozen=True)
class Limits:
    """What a loop must keep to pass.

    Margins; error at standstill and overshoot relative to the step; error along the smooth
    reference relative to its amplitude; largest force relative to that in the machine's logs.
    """

    modulus: float = asked(0.5, "Least modulus margin.", type=POSITIVE)
    delay: float = asked(2.0, "Least delay margin, in samples.", type=POSITIVE)
    standstill: float = asked(
        0.05, "Largest error at standstill, relative to the step.", type=POSITIVE
    )
    tracking: float = asked(
        0.2, "Largest rms error along the smooth reference, relative to its amplitude.",
        type=POSITIVE,
    )  # fmt: skip
    overshoot: float = asked(0.1, "Largest overshoot, relative to the step.", type=POSITIVE)
    force: float = asked(
        1.2, "Largest force, relative to the largest in the logs of the machine's model.",
        type=POSITIVE,
    )  # fmt: skip


@dataclass(frozen=True)
class RobustAsked:
    """What is asked over the machines: so many drawn, on what share of them each limit has to hold.

    staircase: largest on a slow ramp [m], None for any. drift: see `drift_found`.
    """

    draws: int = asked(200, "Machines drawn, with --robust.", type=click.IntRange(20, 10_000))
    probability: float = asked(
        0.95, "Share of the machines on which each limit has to hold, with --robust.",
        type=Finite(0.5, 1.0, max_open=True),
    )  # fmt: skip
    limits: Limits = field(default_factory=Limits)
    staircase: float | None = asked(
        None, "Largest staircase on a slow ramp [m, rad], with --robust.  [default: any]",
        type=POSITIVE, metavar="M",
    )  # fmt: skip
    drift: Mapping[str, float] | None = None
    seed: int = asked(0, "Of the machines drawn, with --robust.", type=SEEDS)


@dataclass(frozen=True)
class Wanted:
    """What is asked: parameters to be identified (none: all), limits where they are not those of
    card and logs, seed. rivals: keys of effects of which one is at work, which the run is to
    discriminate."""

    parameters: tuple[str, ...] = asked(
        (), "Parameters to be identified, as m,F_cp,dv_p.  [default: all]",
        type=Parsed(listed_names), multiple=False, metavar="NAME,...",
    )  # fmt: skip
    stroke: tuple[float, float] | None = asked(
        None, "Positions between which it may move [m, rad].  [default: the card's, or the logs']",
        type=(Finite(), Finite()), metavar="LOW HIGH",
    )  # fmt: skip
    speed: float | None = asked(
        None, "Largest speed [m/s, rad/s].  [default: 1.5 times the logs']", type=POSITIVE
    )
    force: float | None = asked(
        None, "Largest force [N, N m].  [default: 1.2 times the logs']", type=POSITIVE
    )
    command: float | None = asked(None, "Largest command.  [default: any]", type=POSITIVE)
    seconds: float = asked(
        20.0, "How long the run lasts [s].", "--time", type=Finite(min=2, max=600)
    )
    seed: int = asked(0, "", type=SEEDS)
    rivals: tuple[str, ...] = ()


IDENTIFY_STAGES = {
    "refining": (0.0, 0.4),
    "searching": (0.4, 0.6),
    "weighing": (0.5, 0.95),
    "posterior": (0.6, 1.0),
}
TRACE_STAGES = {
    "recording": (0.0, 0.03),
    "refining": (0.03, 0.35),
    "tracing": (0.35, 0.55),
    "refitting": (0.55, 0.75),
    "judging": (0.75, 0.9),
    "settling": (0.45, 0.5),
    "searching": (0.5, 0.7),
    "weighing": (0.6, 0.95),
    "telling": (0.95, 1.0),
}
