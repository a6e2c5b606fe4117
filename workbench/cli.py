"""The command line: one group that imports a command only to run it, and what an error becomes."""

import errno
import importlib
import os
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress

import click
from click.shell_completion import CompletionItem

from identification.errors import NotIdentifiable, UserError
from workbench.options import BAD_INPUT, DONE, FAULT, REFUSAL, write_status
from workbench.output import Refused, Step, step
from workbench.termination import Terminated, raised_on_a_signal
from workbench.threads import one_thread_by_default

COMMANDS = {
    "demo": "Run the whole chain on a shipped recipe and write a report.",
    "init": "Propose a card for a log: columns, units, signs and rig.",
    "doctor": "Check a log before any fit; without a log, the installation.",
    "identify": "Find friction, plant and actuator of a machine from its logs.",
    "trace": "Find the physical effect that the model of a machine lacks.",
    "drift": "Test whether a machine has changed since its model.",
    "axis-test": "Test an axis by one log: green, yellow or red, on one page.",
    "response": "Show the machine over frequency: Bode, resonances, margins.",
    "predict": "Predict force and position of a log by a model.",
    "design": "Design PID, RST and P-PI controllers for a model.",
    "experiment": "Design the next experiment: the most informative reference.",
    "validate": "Check a design on a plant in simulation.",
    "export": "Write a design as code, a model as tables for its control.",
    "simulate": "Make the log of a recipe, its truth beside it.",
    "effects": "List the effects that 'trace' knows; check your own.",
    "registry": "Show and change the active version of each machine.",
    "reidentify": "Test the new logs of all machines; re-tune what has drifted.",
    "watch": "Do so again and again, by schedule and on new files.",
    "fleet": "Identify or test the logs of many machines on a Dask cluster.",
    "serve": "Serve the page: fleet, machines, and a place to drop a log.",
    "work": "Do what was asked for on the page.",
    "token": "Make and revoke the tokens of the page.",
}
TAB_VARIABLE = "_WORKBENCH_COMPLETE"  # set by the shell's completion script
COMPLETION = {
    "bash": f'eval "$({TAB_VARIABLE}=bash_source workbench)" in ~/.bashrc',
    "zsh": f'eval "$({TAB_VARIABLE}=zsh_source workbench)" in ~/.zshrc',
    "fish": f"{TAB_VARIABLE}=fish_source workbench | source in config.fish",
}
OURS = ("workbench", "identification", "design")
BROKEN_PIPE = 141
LONGEST_WORD = 200  # characters of a name, and of a whole message
LONGEST_LINE = 900
CUT = "[...]"
ADVICE = {
    errno.ENOSPC: "; free some space, or choose another folder with --out",
    errno.EDQUOT: "; free some space, or choose another folder with --out",
    errno.EACCES: "; check its rights, or choose another folder with --out",
    errno.EPERM: "; check its rights, or choose another folder with --out",
    errno.EROFS: "; choose another folder with --out",
}


def module_of(name: str) -> str:
    """The module that holds a command."""
    return f"workbench.commands.{name.replace('-', '_')}"


class LazyGroup(click.Group):
    """The commands of `COMMANDS`; each is imported from `workbench.commands` when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command:
        if cmd_name not in COMMANDS:
            raise click.NoSuchCommand(cmd_name, possibilities=COMMANDS, ctx=ctx)
        command = importlib.import_module(module_of(cmd_name)).command
        if not isinstance(command, click.Command):
            raise TypeError(f"workbench.commands.{cmd_name}.command is no click.Command")
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))
        rows = [("0", DONE), ("1", REFUSAL), ("2", BAD_INPUT), ("3", FAULT), ("130", "Ctrl-C")]
        write_status(formatter, rows)
        with formatter.section("Completion of commands, options and files by the Tab key"):
            formatter.write_dl([*COMPLETION.items()])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Commands with their help, none of which is imported for it; else the group's options."""
        if incomplete.startswith("-"):
            return super().shell_complete(ctx, incomplete)
        return [
            CompletionItem(name, help=said)
            for name, said in COMMANDS.items()
            if name.startswith(incomplete)
        ]


@click.group(cls=LazyGroup, invoke_without_command=True)
@click.version_option(package_name="servo-workbench", message="%(prog)s %(version)s")
@click.option("--debug", is_flag=True, expose_value=False, help="Show the traceback of a fault.")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """A log of a positioning servo goes in, a re-tuned controller comes out.

    Example: workbench demo
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def one_line(text: str) -> str:
    """The text on one line that a screen can hold, without characters that a terminal would obey.

    Long names, then a long text, lose their middle: a message ends in what to do.
    """
    words = (_shortened(word, LONGEST_WORD) for word in text.split())
    line = _shortened(" ".join(words), LONGEST_LINE)
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in line)


def verdict(error: BaseException) -> tuple[int, str]:
    """Exit status and message (empty: say nothing) of an error that ended a command."""
    match error:
        case BrokenPipeError():
            return BROKEN_PIPE, ""
        case Terminated(number=number):
            return 128 + number, "terminated"
        case KeyboardInterrupt() | click.Abort():
            return 130, "interrupted"
        case NotIdentifiable():
            return 1, f"refused: {error}"
        case UserError():
            return 2, f"error: {error}"
        case click.UsageError(ctx=click.Context() as ctx):
            return 2, f"error: {error.format_message()} See '{ctx.command_path} --help'."
        case click.ClickException():
            return 2, f"error: {error.format_message()}"
        case OSError():
            return 2, f"error: {_os_message(error)}"
        case _:
            kind = type(error).__name__
            where = f"in {_place(error)}; --debug shows the traceback"
            return 3, f"fault of ours: {kind}: {error} ({where})"


def main(argv: Sequence[str] | None = None) -> int:
    """Exit status of the command line `argv`, by default the arguments of this process."""
    arguments = tuple(sys.argv[1:] if argv is None else argv)
    one_thread_by_default(os.environ)
    try:
        with raised_on_a_signal(), warnings.catch_warnings():
            if not _debug(arguments):  # "error" filters, as in the tests, still act
                warnings.showwarning = _drop_warning
            return _run(arguments)
    except (Exception, KeyboardInterrupt) as error:
        status, message = verdict(error)
        if status == 3 and _debug(arguments):
            import traceback

            traceback.print_exception(error)
        then = _then(error, arguments) if status == 1 else None
        options = arguments[: arguments.index("--")] if "--" in arguments else arguments
        if then and "--json" in options:
            _echo_refusal(str(error), then)
    _flush_or_drop()
    for line in [message, str(then)] if then else [message]:
        with suppress(OSError):  # of a terminal that is gone
            click.echo(one_line(line), err=True, nl=bool(line))
    return status


def _run(arguments: Sequence[str]) -> int:
    """Exit status of a command that ends without an error."""
    asked = os.environ.get(TAB_VARIABLE)
    if asked:
        from click.shell_completion import shell_complete

        return shell_complete(cli, {}, "workbench", TAB_VARIABLE, asked)
    try:
        with cli.make_context("workbench", list(arguments)) as ctx:
            status = cli.invoke(ctx)
    except click.exceptions.Exit as stop:
        status = stop.exit_code
    sys.stdout.flush()
    return int(status or 0)


def _then(error: BaseException, arguments: Sequence[str]) -> Step:
    """What to type after a refusal; where the command does not know, its help."""
    if isinstance(error, Refused):
        return error.then
    name = next((one for one in arguments if one in COMMANDS), None)
    return step("what it needs", name, "--help")


def _echo_refusal(reason: str, then: Step) -> None:
    """Print a refusal as JSON; where nobody takes it, the exit status says it alone."""
    import json

    document = {"verdict": "refused", "reason": one_line(reason), "next": then.command}
    with suppress(OSError):
        click.echo(json.dumps(document, indent=2))


def _debug(arguments: Sequence[str]) -> bool:
    return "--debug" in arguments or os.environ.get("WORKBENCH_DEBUG", "0") not in ("", "0")


def _flush_or_drop() -> None:
    """Flush standard output; where nobody takes it, drop it, or Python complains at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _shortened(text: str, most: int) -> str:
    """The text, its middle left out where it is longer than `most` characters."""
    if len(text) <= most:
        return text
    half = (most - len(CUT)) // 2
    return text[:half] + CUT + text[-half:]


def _drop_warning(*_: object, **__: object) -> None:
    """Where a warning would be shown: it is for whoever develops, not for the user."""


def _os_message(error: OSError) -> str:
    if error.strerror is None:
        return str(error)
    place = "" if error.filename is None else f"{error.filename}: "
    return f"{place}{error.strerror}{ADVICE.get(error.errno or 0, '')}"


def _place(error: BaseException) -> str:
    """Module and line of the last frame in our packages."""
    import traceback

    place = "an unknown place"
    for frame, line in traceback.walk_tb(error.__traceback__):
        module = str(frame.f_globals.get("__name__"))
        if module.partition(".")[0] in OURS:
            place = f"{module}, line {line}"
    return place
