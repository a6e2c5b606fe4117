"""The options that say what is asked of a computation, whose numbers `design.asked` has, and which
part of a command's bar each stage takes.

Light to import, since every `--help` asks for it.
"""

from dataclasses import fields

import click

from design.asked import Limits, Options, RobustAsked, Wanted
from workbench.options import POSITIVE, SEEDS, Finite, Parsed, listed_names, parse_orders
from workbench.signature import options_of

FIT_OPTIONS = options_of(
    Options,
    drive={},
    orders={"type": Parsed(parse_orders), "metavar": "NA,NB,NK"},
    design_period={"type": POSITIVE, "metavar": "S"},
)
LIMIT_OPTIONS = options_of(Limits, **{one.name: {"type": POSITIVE} for one in fields(Limits)})
ROBUST_OPTIONS = options_of(
    RobustAsked,
    draws={"type": click.IntRange(20, 10_000)},
    probability={"type": Finite(0.5, 1.0, max_open=True)},
    limits=LIMIT_OPTIONS,
    staircase={"type": POSITIVE, "metavar": "M"},
    seed={"type": SEEDS},
)
EXPERIMENT_OPTIONS = options_of(
    Wanted,
    parameters={"type": Parsed(listed_names), "multiple": False, "metavar": "NAME,..."},
    stroke={"type": (Finite(), Finite()), "metavar": "LOW HIGH"},
    speed={"type": POSITIVE},
    force={"type": POSITIVE},
    command={"type": POSITIVE},
    seconds={"names": ("--time",), "type": Finite(min=2, max=600)},
    seed={"type": SEEDS},
)

IDENTIFY_STAGES = {
    "refining": (0.0, 0.5),
    "weighing": (0.5, 0.95),
    "posterior": (0.6, 1.0),
}
TRACE_STAGES = {
    "recording": (0.0, 0.03),
    "refining": (0.03, 0.35),
    "tracing": (0.35, 0.55),
    "refitting": (0.55, 0.75),
    "judging": (0.75, 0.9),
    "converging": (0.45, 0.5),
    "weighing": (0.6, 0.95),
    "reporting": (0.95, 1.0),
}
