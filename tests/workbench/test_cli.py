"""The command line: lazy, and every error one line with its exit status."""

import errno
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import click
import pytest

from identification.errors import BadLog, NotIdentifiable, UserError
from workbench import cli, commands
from workbench.options import StatusCommand
from workbench.output import Refused, step
from workbench.termination import ENDING, Terminated

HEAVY = ("numpy", "scipy", "numba", "pandas", "matplotlib", "pyarrow", "h5py", "rich", "pydantic")
Fail = Callable[[BaseException | int | None], None]


def buffered() -> dict[str, str]:
    """This environment, with standard output buffered as for a user."""
    return {key: value for key, value in os.environ.items() if key != "PYTHONUNBUFFERED"}


def shell(*arguments: str) -> subprocess.CompletedProcess[str]:
    """The command line in a process of its own."""
    command = [sys.executable, "-m", "workbench", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture
def outcome(monkeypatch: pytest.MonkeyPatch) -> Iterator[Fail]:
    """Sets how the command `probe` ends: by an error, or with a status."""
    ends: list[BaseException | int | None] = [None]

    @click.command()
    @click.option("--size", type=int)
    @click.option("--json", is_flag=True, expose_value=False)
    @click.argument("name", required=False)
    def command(size: int | None, name: str | None) -> int | None:
        if isinstance(ends[0], BaseException):
            raise ends[0]
        return ends[0]

    module = ModuleType("workbench.commands.probe")
    module.__dict__["command"] = command
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setitem(cli.COMMANDS, "probe", "A command of the tests.")

    def set_end(end: BaseException | int | None) -> None:
        ends[0] = end

    yield set_end


def test_table_and_folder_agree() -> None:
    (folder,) = commands.__path__
    modules = {p.stem for p in Path(folder).glob("*.py") if not p.stem.startswith("_")}
    assert modules == {name.replace("-", "_") for name in cli.COMMANDS}


def test_every_command_shows_help_with_an_example() -> None:
    group = cli.cli
    with group.make_context("workbench", [], resilient_parsing=True) as ctx:
        for name in cli.COMMANDS:
            command = group.get_command(ctx, name)
            assert command is not None
            shown = command.get_help(click.Context(command, parent=ctx, info_name=name))
            assert f"workbench {name}" in shown.split("Usage:")[1].partition("\n")[2], name


def test_help_imports_nothing_numeric() -> None:
    code = (
        "import sys; from workbench.cli import main; main(['--help']);"
        f"print('loaded:', sorted(set({HEAVY!r}) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("loaded: []\n")
    for name, help_line in cli.COMMANDS.items():
        assert name in done.stdout
        assert help_line in done.stdout


def test_exit_status_stands_in_every_help() -> None:
    group = cli.cli
    with group.make_context("workbench", [], resilient_parsing=True) as ctx:
        assert "Exit status:" in group.get_help(ctx)
        waiting = [group.get_command(ctx, name) for name in cli.COMMANDS]
        while waiting:
            command = waiting.pop()
            if isinstance(command, click.Group):
                waiting += command.commands.values()
            else:
                assert isinstance(command, StatusCommand)
                shown = command.get_help(click.Context(command, parent=ctx, info_name="x"))
                (rows,) = re.findall(r"Exit status:\n((?:  .*\n)+)", shown)
                assert ("\n  1  " in rows) is bool(command.refusal)
                assert "  0  " in rows and "\n  2  " in rows and "\n  3  " in rows


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("workbench dr", "plain,drift"),
        ("workbench --ver", "plain,--version"),
        ("workbench trace --car", "plain,--card"),
        ("workbench trace --card em", "plain,emps"),
        ("workbench trace --card ./", "file,./"),
        ("workbench identify ru", "file,ru"),
        ("workbench registry pro", "plain,promote"),
    ],
)
def test_completion(
    line: str, found: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(cli.TAB_VARIABLE, "bash_complete")
    monkeypatch.setenv("COMP_WORDS", line)
    monkeypatch.setenv("COMP_CWORD", str(line.count(" ")))
    cli.main([])
    assert capsys.readouterr().out.split() == [found]


def test_completion_of_commands_imports_none_of_them() -> None:
    asked = {
        "COMP_WORDS": "workbench tr",
        "COMP_CWORD": "1",
        cli.TAB_VARIABLE: "bash_complete",
    }
    code = (
        "import sys; from workbench.cli import main; main([]);"
        "print([name for name in sys.modules if name.startswith('workbench.commands')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                          env={**os.environ, **asked})  # fmt: skip
    assert done.stdout == "plain,trace\n[]\n"


def test_completion_is_installed_by_a_script_of_its_shell(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for shell_name in ("zsh", "fish"):  # that of bash asks bash for its version
        monkeypatch.setenv(cli.TAB_VARIABLE, f"{shell_name}_source")
        assert cli.main([]) == 0
        assert f"{cli.TAB_VARIABLE}={shell_name}_complete" in capsys.readouterr().out


def test_a_refusal_ends_with_the_next_command(
    outcome: Fail, capsys: pytest.CaptureFixture[str]
) -> None:
    then = step("which run to add", "doctor", "my run.csv", "--card", "emps")
    outcome(Refused("F_sn", then))
    assert cli.main(["probe"]) == 1
    line = "next (which run to add): workbench doctor 'my run.csv' --card emps"
    assert capsys.readouterr() == ("", f"refused: F_sn\n{line}\n")


def test_no_command_shows_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main([]) == 0
    assert "Commands:" in capsys.readouterr().out


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("workbench 0.")


@pytest.mark.parametrize("status", [0, 1, None])
def test_returned_status_is_the_exit_status(outcome: Fail, status: int | None) -> None:
    outcome(status)
    assert cli.main(["probe"]) == (status or 0)


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (UserError("a: no column 'y'"), 2, "error: a: no column 'y'"),
        (BadLog("run 3:\n  t goes\r\nback\x1b[1m"), 2, "error: run 3: t goes back\ufffd[1m"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (Terminated(15), 143, "terminated"),
        (click.Abort(), 130, "interrupted"),
        (click.FileError("a.csv", "gone"), 2, "error: Could not open file 'a.csv': gone"),
        (IsADirectoryError(errno.EISDIR, "Is a directory", "x"), 2, "error: x: Is a directory"),
        (OSError("truncated file"), 2, "error: truncated file"),
    ],
)
def test_error_is_one_line(
    outcome: Fail,
    capsys: pytest.CaptureFixture[str],
    error: BaseException,
    status: int,
    line: str,
) -> None:
    outcome(error)
    assert cli.main(["probe"]) == status
    assert capsys.readouterr() == ("", line + "\n")


def test_long_names_and_long_messages_lose_their_middle() -> None:
    name = "/".join(["a" * 100] * 50)
    said = cli.one_line(f"error: {name}: File name too long; choose another folder with --out")
    assert said.startswith("error: aaaa")
    assert said.endswith("aaaa: File name too long; choose another folder with --out")
    assert len(said) < 300 and "[...]" in said
    assert len(cli.one_line("a word " * 1000 + "end")) <= 900
    assert cli.one_line("a word " * 1000 + "end").endswith("word end")


def test_a_warning_is_no_line_of_a_command_but_an_error_in_the_tests(
    outcome: Fail, capsys: pytest.CaptureFixture[str]
) -> None:
    code = (
        "import sys, warnings, click\n"
        "from types import ModuleType\n"
        "from workbench import cli\n"
        "module = ModuleType('workbench.commands.probe')\n"
        "module.command = click.Command('probe', callback=lambda: warnings.warn('overflow'))\n"
        "sys.modules[module.__name__] = module\n"
        "cli.COMMANDS['probe'] = 'x'\n"
        "sys.exit(cli.main(['probe']))\n"
    )
    for shown, debug in ((False, "0"), (True, "1")):
        done = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "WORKBENCH_DEBUG": debug},
        )
        assert ("overflow" in done.stderr) is shown
    outcome(RuntimeWarning("overflow"))
    assert cli.main(["probe"]) == 3
    assert "RuntimeWarning" in capsys.readouterr().err


def test_a_refusal_asked_as_json_is_an_object(
    outcome: Fail, capsys: pytest.CaptureFixture[str]
) -> None:
    outcome(NotIdentifiable("run 3: no breakaway\nin the negative direction"))
    assert cli.main(["probe", "--json"]) == 1
    shown = capsys.readouterr()
    reason = "run 3: no breakaway in the negative direction"
    then = "workbench probe --help"
    assert json.loads(shown.out) == {"verdict": "refused", "reason": reason, "next": then}
    assert shown.err == f"refused: {reason}\nnext (what it needs): {then}\n"
    assert cli.main(["probe", "--", "--json"]) == 1
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("error", [BadLog("a: empty"), ZeroDivisionError(), KeyboardInterrupt()])
def test_an_error_asked_as_json_leaves_standard_output_empty(
    outcome: Fail, capsys: pytest.CaptureFixture[str], error: BaseException
) -> None:
    outcome(error)
    assert cli.main(["probe", "--json"]) > 1
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EACCES, errno.EROFS])
def test_disk_error_says_what_to_do(
    outcome: Fail, capsys: pytest.CaptureFixture[str], number: int
) -> None:
    outcome(OSError(number, "what the system says", "runs/x"))
    assert cli.main(["probe"]) == 2
    shown = capsys.readouterr().err
    assert shown.startswith("error: runs/x: what the system says; ")
    assert "--out" in shown
    assert shown.count("\n") == 1


def test_fault_names_its_place_and_hides_the_traceback(
    outcome: Fail, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("WORKBENCH_DEBUG", raising=False)
    outcome(ZeroDivisionError("by\nzero"))
    assert cli.main(["probe"]) == 3
    shown = capsys.readouterr().err
    assert shown.startswith("fault of ours: ZeroDivisionError: by zero (in workbench.cli, line ")
    assert shown.count("\n") == 1


@pytest.mark.parametrize("way", ["option", "variable"])
def test_debug_shows_the_traceback(
    outcome: Fail, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    monkeypatch.setenv("WORKBENCH_DEBUG", "1" if way == "variable" else "0")
    outcome(ZeroDivisionError("by zero"))
    assert cli.main(["--debug", "probe"] if way == "option" else ["probe"]) == 3
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "found"),
    [
        (["vlidate"], "No such command 'vlidate'. Did you mean 'validate'?"),
        (["xyzzy"], "No such command 'xyzzy'. See 'workbench --help'."),
        (["probe", "--siz", "3"], "'--size'"),
        (["probe", "--size", "three"], "'three' is not a valid integer"),
        (["probe", "one", "extra"], "See 'workbench probe --help'."),
    ],
)
def test_usage_error_is_one_line(
    outcome: Fail, capsys: pytest.CaptureFixture[str], arguments: list[str], found: str
) -> None:
    assert cli.main(arguments) == 2
    shown = capsys.readouterr().err
    assert shown.startswith("error: ")
    assert found in shown
    assert shown.count("\n") == 1


def test_announced_command_without_a_module_is_a_fault(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(cli.COMMANDS, "absent", "No module holds it.")
    assert cli.main(["absent"]) == 3
    assert "No module named 'workbench.commands.absent'" in capsys.readouterr().err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_full_standard_output_is_one_line() -> None:
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "workbench", "--help"]
        done = subprocess.run(
            command, stdout=full, stderr=subprocess.PIPE, env=buffered(), text=True, check=False
        )
    assert done.returncode == 2
    assert done.stderr.startswith("error: No space left on device")
    assert done.stderr.count("\n") == 1


def test_reader_that_goes_away_is_no_error() -> None:
    command = [sys.executable, "-m", "workbench", "--help"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, env=buffered()) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == cli.BROKEN_PIPE


def test_signals_are_as_before_after_a_command(outcome: Fail) -> None:
    before = [signal.getsignal(one) for one in ENDING]
    outcome(None)
    cli.main(["probe"])
    assert [signal.getsignal(one) for one in ENDING] == before


def test_a_signal_that_is_ignored_stays_so(monkeypatch: pytest.MonkeyPatch) -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as under nohup
    try:
        monkeypatch.setattr(cli, "_run", lambda _: signal.raise_signal(signal.SIGHUP))
        cli.main([])
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
