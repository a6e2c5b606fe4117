"""Runs what the pages say: every `sh` and `python` block, in order, in a folder of its own a page.

    ```sh                      run by bash; a command that fails ends the build
    ```python                  run by one interpreter a page, as a notebook would
    ```toml card.toml          written to that file, of any language

A page that says `<!-- after: start -->` begins in a copy of the folder that page left. What a
block prints stands below it in the site, unless the block is `sh quiet`. `make` is asked only what
it would do, and `pip install` is compared with what the project declares: both would install.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[2]
LONGEST = 900.0  # s that a block may take
AFTER = re.compile(r"<!-- after: ([\w./-]+) -->")
INSTALLED = re.compile(r"(?:\S*bin/)?pip install '?servo-workbench(?:\[(?P<extras>[\w,]+)\])?'?")
COLOURS = re.compile(r"\x1b\[[0-9;]*m")
BESIDE = {"README": ROOT / "README.md", "CONTRIBUTING": ROOT / "CONTRIBUTING.md"}
SHIM = """#!/bin/sh
exec {python} -m workbench "$@"
"""
INTERPRETER = """
import contextlib, io, json, os, sys, traceback
answers = os.fdopen(os.dup(1), "w")
names = {"__name__": "__main__"}
for line in sys.stdin:
    said, failed = io.StringIO(), None
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            exec(compile(json.loads(line), "<page>", "exec"), names)
        except BaseException:
            failed = traceback.format_exc()
    print(json.dumps([said.getvalue(), failed]), file=answers, flush=True)
"""


class PageFault(Exception):
    """A block of a page that does not do what the page says."""


@dataclass(frozen=True)
class Block:
    """A fenced block: language, what stands behind it, text, and the line after its end."""

    language: str
    argument: str
    text: str
    end: int


def blocks(source: str) -> list[Block]:
    """The fenced blocks of a page in Markdown."""
    found = []
    for token in MarkdownIt().parse(source):
        if token.type == "fence" and token.map:
            language, _, argument = token.info.strip().partition(" ")
            found.append(Block(language, argument.strip(), token.content, token.map[1]))
    return found


class Session:
    """A page's folder, and the interpreter that runs its Python."""

    def __init__(self, folder: Path, surroundings: Mapping[str, str]) -> None:
        self.folder = folder
        programs = folder.parent / "bin"
        programs.mkdir(exist_ok=True)
        shim = programs / "workbench"
        if not shim.exists():
            shim.write_text(SHIM.format(python=shlex.quote(sys.executable)), "utf-8")
            shim.chmod(0o755)
        path = f"{programs}{os.pathsep}{Path(sys.executable).parent}{os.pathsep}"
        self._environment = {
            **{key: value for key, value in os.environ.items() if key != "WORKBENCH_REGISTRY"},
            "PATH": path + os.environ["PATH"],
            "PYTHONPATH": str(ROOT),
            "MPLBACKEND": "agg",
            **surroundings,
        }
        self._python: subprocess.Popen[str] | None = None

    def run(self, block: Block) -> str:
        """What the block prints; raises PageFault where it fails."""
        if block.argument and block.argument != "quiet":
            return self._write(block)
        match block.language:
            case "sh":
                return self._plain(self._shell(block.text))
            case "python":
                return self._plain(self._interpreted(block.text))
        return ""

    def close(self) -> None:
        """End the interpreter."""
        if self._python is not None:
            self._python.communicate()

    def _write(self, block: Block) -> str:
        path = self.folder / block.argument
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(block.text, "utf-8")
        return ""

    def _shell(self, text: str) -> str:
        lines = [one for one in map(_without_installing, text.splitlines()) if one is not None]
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", "\n".join(lines)], cwd=self.folder, text=True,
            env=self._environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, timeout=LONGEST, check=False,
        )  # fmt: skip
        if done.returncode:
            raise PageFault(f"exit status {done.returncode} of\n{text}\n{done.stdout}")
        return done.stdout

    def _interpreted(self, text: str) -> str:
        if self._python is None:
            self._python = subprocess.Popen(
                [sys.executable, "-c", INTERPRETER], cwd=self.folder, env=self._environment,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            )  # fmt: skip
        assert self._python.stdin is not None and self._python.stdout is not None
        self._python.stdin.write(json.dumps(text) + "\n")
        self._python.stdin.flush()
        said, failed = json.loads(self._python.stdout.readline())
        if failed:
            raise PageFault(f"{failed}\nof\n{text}\n{said}")
        return str(said)

    def _plain(self, said: str) -> str:
        return COLOURS.sub("", said).replace(f"{self.folder}/", "").strip("\n")


def _without_installing(line: str) -> str | None:
    """The line as it is run; None where it is compared instead."""
    bare = line.partition("#")[0].strip()
    if bare.startswith("make "):
        return f"make -n -C {shlex.quote(str(ROOT))} {bare.removeprefix('make ')} > /dev/null"
    if "pip install" in bare:
        asked = INSTALLED.fullmatch(bare)
        project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
        extras = set(((asked and asked["extras"]) or "").split(",")) - {""}
        if asked is None or extras - set(project["optional-dependencies"]):
            raise PageFault(f"{bare}: not what pyproject.toml declares")
        return None
    if bare == ". .venv/bin/activate":
        return None
    if bare.startswith(".venv/bin/"):
        return f"cd {shlex.quote(str(ROOT))} && {bare.removeprefix('.venv/bin/')}"
    return line


class Pages:
    """The pages of a folder, each run once, and what their blocks printed."""

    def __init__(
        self, home: Path, work: Path, surroundings: Mapping[str, str],
        beside: Mapping[str, Path] = BESIDE,
    ) -> None:  # fmt: skip
        self._work = work
        self._surroundings = surroundings
        read = {name: path.read_text("utf-8") for name, path in beside.items()}
        self._sources = {
            path.relative_to(home).with_suffix("").as_posix(): path.read_text("utf-8")
            for path in sorted(home.rglob("*.md"))
            if "made" not in path.parts
        } | read
        self.printed: dict[str, list[str]] = {}

    def run(self, workers: int = 2) -> None:
        """Run them all, each after the one that it names; raises PageFault with all that fail.

        workers: pages at a time.
        """
        order = self._order()
        with ThreadPoolExecutor(workers) as pool:
            running: dict[str, Future[list[str]]] = {}
            for name in order:  # the one before it has begun by then, so nobody waits for ever
                running[name] = pool.submit(
                    self._page, name, running.get(_after(self.source(name)))
                )
        faults = [str(done.exception()) for done in running.values() if done.exception()]
        if faults:
            raise PageFault("\n\n".join(faults))
        self.printed = {name: done.result() for name, done in running.items()}

    def _order(self) -> list[str]:
        """The pages, each behind the one that it begins after."""
        waiting, order = dict(self._sources), list[str]()
        while waiting:
            ready = [name for name, text in waiting.items() if _after(text) not in waiting]
            if not ready:
                raise PageFault(f"pages wait for each other: {', '.join(waiting)}")
            order += ready
            waiting = {name: text for name, text in waiting.items() if name not in ready}
        return order

    def source(self, name: str) -> str:
        """The page as it is written."""
        return self._sources[name]

    def folder(self, name: str) -> Path:
        """Where a page was run."""
        return self._work / name.replace("/", "-")

    def shown(self, name: str, source: str) -> str:
        """The page with what its blocks printed below them."""
        lines = source.splitlines()
        for block, said in reversed(list(zip(blocks(source), self.printed[name], strict=True))):
            if said and block.argument != "quiet":
                fence = "````"
                below = ["", f"{fence}{{code-block}} text", ":class: printed", "", said, fence]
                lines[block.end : block.end] = "\n".join(below).splitlines()
        return "\n".join(lines) + "\n"

    def _page(self, name: str, earlier: Future[list[str]] | None) -> list[str]:
        """What each block printed; earlier: the page that it begins after."""
        source, folder = self.source(name), self.folder(name)
        before = _after(source)
        if before and not earlier:
            raise PageFault(f"{name}.md: begins after {before}, which is no page")
        if before and earlier:
            earlier.result()
            shutil.copytree(self.folder(before), folder)
        else:
            folder.mkdir(parents=True)
        session = Session(folder, self._surroundings)
        try:
            return [session.run(block) for block in blocks(source)]
        except (PageFault, subprocess.TimeoutExpired) as error:
            raise PageFault(f"{name}.md: {error}") from None
        finally:
            session.close()


def _after(source: str) -> str:
    """The page after which this one begins; empty where it begins by itself."""
    found = AFTER.search(source)
    return found[1] if found else ""
