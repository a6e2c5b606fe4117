"""Option texts into values; each wrong one is a usage error that names what is needed. And a
command's exit status, which its help gives."""

import cmath
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from workbench.files import shipped_cards
from workbench.screen import shared_options
from workbench.signature import argument, by_signature, option

DONE = "done"
REFUSAL = "done, and the answer is a refusal or an alarm; it ends with the next command"
BAD_INPUT = "bad input: one line says what was found, where, what is needed, what to do"
FAULT = "a fault of ours; --debug shows where"
EVENTS = "Accepted as everywhere; events are JSON."  # --json of commands that report events


class StatusCommand(click.Command):
    """A command whose help ends with its exit status; refusal: what 1 means, "" where it has none.

    done: what 0 means.
    """

    def __init__(self, *given: Any, refusal: str = "", done: str = DONE, **named: Any) -> None:
        super().__init__(*given, **named)
        self.refusal, self.done = refusal, done

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The exit status, then the example."""
        rows = [("0", self.done), ("1", self.refusal), ("2", BAD_INPUT), ("3", FAULT)]
        write_status(formatter, [row for row in rows if row[1]])
        super().format_epilog(ctx, formatter)


class StatusGroup(click.Group):
    """A command of several; each of them gives its exit status."""

    command_class = StatusCommand


def write_status(formatter: click.HelpFormatter, rows: list[tuple[str, str]]) -> None:
    """The section of a help page on the exit status."""
    with formatter.section("Exit status"):
        formatter.write_dl(rows)


def command(
    group: click.Group | None = None, name: str | None = None, *,
    json: str = "Print the result as JSON.", **how: Any,
) -> Callable[[Callable[..., Any]], click.Command]:  # fmt: skip
    """A command, or one of a group, with the options that its function's parameters say.

    json: help of --json; how: as `StatusCommand` has it.
    """
    make = group.command if group else partial(click.command, cls=StatusCommand)
    shared = partial(shared_options, json=json)
    return lambda function: make(name, **how)(by_signature(function, shared))


class Finite(click.FloatRange):
    """A finite number within bounds: a period, a margin, a limit."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """The number; a usage error where it is none, not finite, or out of bounds."""
        found = float(super().convert(value, param, ctx))
        if not math.isfinite(found):
            self.fail(
                f"{value} is not finite; a number {self._describe_range()} needed.", param, ctx
            )
        return found


class Parsed(click.ParamType[Any]):
    """A text that a function reads, which raises a usage error where it is none of its kind."""

    def __init__(self, read: Callable[[str], Any]) -> None:
        self.name = "text"
        self.read = read

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """What the text says; a default as it is."""
        return self.read(value) if isinstance(value, str) else value


POSITIVE = Finite(min=0, min_open=True)
SECONDS = Finite(min=0, max=1e9)
SECONDS_ABOVE_0 = Finite(min=0, max=1e9, min_open=True)


def complete_file(_ctx: click.Context, _param: click.Parameter, begun: str) -> list[CompletionItem]:
    """Completed by the shell as the name of a file."""
    return [CompletionItem(begun, type="file")]


def complete_card(_ctx: click.Context, _param: click.Parameter, begun: str) -> list[CompletionItem]:
    """The shipped cards that begin so; else, by the shell, names of files."""
    names = [CompletionItem(name) for name in shipped_cards() if name.startswith(begun)]
    return names or [CompletionItem(begun, type="file")]


def _the_only(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> str:
    if len(values) > 1:
        raise click.UsageError(
            f"--card is given {len(values)} times ({', '.join(values)}); one card for all logs"
            " needed, identify machines one by one.",
            ctx,
        )
    return values[0]


BUDGET = 120.0  # s, after which a fit or a trace ends with the best so far
# Options that several commands have, as defaults of their parameters.
BUDGET_OPTION = option(
    "End after so long with the best so far; the first Ctrl-C does the same.",
    type=SECONDS_ABOVE_0, default=BUDGET, metavar="SECONDS",
)  # fmt: skip
CARD_OPTION = option(  # the card of all logs; given twice it is a usage error
    "Path of the card, or the name of a shipped one.",
    multiple=True, required=True, callback=_the_only, shell_complete=complete_card,
)  # fmt: skip
PRESENT_CARD_OPTION = option(  # of commands that read a model, for another present controller
    "Card whose [controller] is shown as the present one, in place of the model's.",
    shell_complete=complete_card,
)
EFFECTS_OPTION = option(  # folders of the user's own effects: `workbench.cards.own_effects`
    "Folder of your own effects, one a file; may be given several times. Its Python is run: give"
    " only folders that you trust.",
    metavar="FOLDER",
)
SEEDS = click.IntRange(min=0)
SEED_OPTION = option("", type=SEEDS, default=0)
REGISTRY_OPTION = option(
    "SQLite file or postgresql://...  [default: WORKBENCH_REGISTRY, or registry.db]",
    "--registry", metavar="FILE|URL",
)  # fmt: skip
MACHINES_OPTION = option(  # of what serves the page: the folder of all machines
    "Folder of the machines, as of 'watch'; dropped logs lie in it too.",
    default=Path("machines"), metavar="FOLDER",
)  # fmt: skip
OUT_OPTION = option(
    "Folder for the results.  [default: runs/<time>-<command>]", metavar="DIR", last=True
)
MODEL_ARGUMENT = argument("MODEL")
LOG_ARGUMENT = argument("LOG", shell_complete=complete_file)
LOGS_ARGUMENT = argument("LOG...", required=True, shell_complete=complete_file)


def listed_names(text: str) -> tuple[str, ...]:
    """Names with commas between them."""
    return tuple(name.strip() for name in text.split(",") if name.strip())


def refuse_given(why: str, *options: str) -> None:
    """Raises a usage error where one of these options, by the names of their values, is given; why:
    it may not be, and what to do (`{}` stands for the option)."""
    context = click.get_current_context()
    for one in context.command.params:
        source = context.get_parameter_source(one.name or "")
        if one.name in options and source is click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(why.format(one.opts[0]))


def refuse_for_velocity(*options: str) -> None:
    """Raises a usage error where one of these options, by the names of their values, is given: they
    have no meaning for a rig whose velocity follows the command."""
    refuse_given('{} has no meaning for a rig of kind = "velocity"; leave it out.', *options)


def parse_orders(text: str) -> tuple[int, int, int]:
    """`na,nb,nk` as three counts."""
    parts = text.split(",")
    if len(parts) != 3 or not all(part.strip().isdigit() for part in parts):
        raise click.UsageError(f"--orders {text!r}: three counts na,nb,nk needed, as in 3,2,1.")
    na, nb, nk = (int(part) for part in parts)
    return na, nb, nk


def parse_poles(text: str) -> tuple[float, float]:
    """`w_n,zeta` as numbers."""
    try:
        w_n, zeta = (float(part) for part in text.split(","))
    except ValueError:
        raise click.UsageError(f"--poles {text!r}: w_n,zeta needed, as in 20,0.9.") from None
    if not (math.isfinite(w_n) and math.isfinite(zeta)):
        raise click.UsageError(f"--poles {text!r}: finite numbers needed.")
    return w_n, zeta


def parse_auxiliary(text: str) -> tuple[complex, ...]:
    """Values of z, `0.5,0.3+0.2j,0.3-0.2j`; none for an empty text."""
    try:
        poles = tuple(complex(part.replace(" ", "")) for part in text.split(",") if part.strip())
    except ValueError:
        raise click.UsageError(
            f"--auxiliary {text!r}: values of z needed, as in 0.5,0.3+0.2j,0.3-0.2j."
        ) from None
    if not all(cmath.isfinite(z) for z in poles):
        raise click.UsageError(f"--auxiliary {text!r}: finite numbers needed.")
    return poles
