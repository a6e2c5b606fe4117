"""Option texts into values; each wrong one is a usage error that names what is needed."""

import cmath
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click
from click.shell_completion import CompletionItem

from workbench.files import shipped_cards
from workbench.screen import verbose_option

Command = TypeVar("Command", bound=Callable[..., Any])


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


BUDGET = 120.0  # s, after which a fit or a trace ends with the best so far


def budget_option(command: Command) -> Command:
    """The option `--budget` of a fit or a trace [s]."""
    return click.option(
        "--budget",
        type=SECONDS_ABOVE_0,
        default=BUDGET,
        show_default=True,
        metavar="SECONDS",
        help="End after so long with the best so far; the first Ctrl-C does the same.",
    )(command)


def card_option(command: Command) -> Command:
    """The option `--card`, the card of all logs; given twice it is a usage error."""
    return click.option(
        "--card",
        multiple=True,
        required=True,
        callback=_the_only,
        shell_complete=complete_card,
        help="Path of the card, or the name of a shipped one.",
    )(command)


def present_card_option(command: Command) -> Command:
    """The option `--card` of commands that read a model, for another present controller."""
    return click.option(
        "--card",
        shell_complete=complete_card,
        help="Card whose [controller] is shown as the present one, in place of the model's.",
    )(command)


def motion_limits(command: Command) -> Command:
    """What a loop's motion must keep: `standstill`, `tracking`, `overshoot`, `force`."""
    options = (
        ("--standstill", 0.05, "Largest error at standstill, relative to the step."),
        ("--tracking", 0.15, "Largest rms error along the smooth reference, relative to its"
         " amplitude."),
        ("--overshoot", 0.1, "Largest overshoot, relative to the step."),
        ("--force", 1.2, "Largest force, relative to the largest in the logs of the machine's"
         " model."),
    )  # fmt: skip
    for name, usual, said in reversed(options):
        command = click.option(name, type=POSITIVE, default=usual, show_default=True, help=said)(
            command
        )
    return command


def effects_option(command: Command) -> Command:
    """The option `--effects`, folders of effects of the user's own, as `effects`: see
    `workbench.cards.own_effects`."""
    return click.option(
        "--effects",
        multiple=True,
        metavar="FOLDER",
        type=click.Path(path_type=Path),
        help="Folder of your own effects, one a file; may be given several times. Its Python is"
        " run: give only folders that you trust.",
    )(command)


def refuse_for_velocity(*options: str) -> None:
    """Raises a usage error where one of these options, by the names of their values, is given: they
    have no meaning for a rig whose velocity follows the command."""
    context = click.get_current_context()
    for option in context.command.params:
        given = context.get_parameter_source(option.name or "")
        if option.name in options and given is click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(
                f'{option.opts[0]} has no meaning for a rig of kind = "velocity"; leave it out.',
                context,
            )


def registry_option(command: Command) -> Command:
    """The option `--registry`, where the registry is, as `where`."""
    return click.option(
        "--registry",
        "where",
        metavar="FILE|URL",
        help="SQLite file or postgresql://...  [default: WORKBENCH_REGISTRY, or registry.db]",
    )(command)


def machines_option(command: Command) -> Command:
    """The option `--machines` of what serves the page: the folder of all machines."""
    return click.option(
        "--machines",
        type=click.Path(path_type=Path),
        default=Path("machines"),
        metavar="FOLDER",
        show_default=True,
        help="Folder of the machines, as of 'watch'; dropped logs lie in it too.",
    )(command)


def events_options(command: Command) -> Command:
    """The options `--json`, as `as_json`, `--verbose` and `--debug` of commands that report events
    as JSON."""
    debug = click.option("--debug", is_flag=True, expose_value=False, hidden=True)
    return click.option(
        "--json", "as_json", is_flag=True, help="Accepted as everywhere; events are JSON."
    )(verbose_option(debug(command)))


def _the_only(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> str:
    if len(values) > 1:
        raise click.UsageError(
            f"--card is given {len(values)} times ({', '.join(values)}); one card for all logs"
            " needed, identify machines one by one.",
            ctx,
        )
    return values[0]


def parse_orders(text: str | None) -> tuple[int, int, int] | None:
    """`na,nb,nk` as three counts; None for None."""
    if text is None:
        return None
    parts = text.split(",")
    if len(parts) != 3 or not all(part.strip().isdigit() for part in parts):
        raise click.UsageError(f"--orders {text!r}: three counts na,nb,nk needed, as in 3,2,1.")
    na, nb, nk = (int(part) for part in parts)
    return na, nb, nk


def parse_poles(text: str | None) -> tuple[float, float] | None:
    """`w_n,zeta` as numbers; None for None."""
    if text is None:
        return None
    try:
        w_n, zeta = (float(part) for part in text.split(","))
    except ValueError:
        raise click.UsageError(f"--poles {text!r}: w_n,zeta needed, as in 20,0.9.") from None
    if not (math.isfinite(w_n) and math.isfinite(zeta)):
        raise click.UsageError(f"--poles {text!r}: finite numbers needed.")
    return w_n, zeta


def parse_auxiliary(text: str | None) -> tuple[complex, ...] | None:
    """Values of z, `0.5,0.3+0.2j,0.3-0.2j`; None for None, none for an empty text."""
    if text is None:
        return None
    try:
        poles = tuple(complex(part.replace(" ", "")) for part in text.split(",") if part.strip())
    except ValueError:
        raise click.UsageError(
            f"--auxiliary {text!r}: values of z needed, as in 0.5,0.3+0.2j,0.3-0.2j."
        ) from None
    if not all(cmath.isfinite(z) for z in poles):
        raise click.UsageError(f"--auxiliary {text!r}: finite numbers needed.")
    return poles
