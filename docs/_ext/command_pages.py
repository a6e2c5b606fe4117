"""A page a command, out of the commands themselves."""

from collections.abc import Iterator

from workbench.cli import COMMANDS, module_of

HEAD = """# Commands

Each command has `--help` with an example, `--json` for machines, and `--out` for its files. Files
appear whole or not at all. The exit status says how it went:

| status | means |
|---|---|
| 0 | done |
| 1 | done, and the answer is a refusal or an alarm |
| 2 | bad input: one line with what was found, where, what is needed, what to do |
| 3 | a fault of the workbench; `--debug` shows where |

What each of them writes, key by key, stands in [the contract](../../contract.md#commands).

| command | does |
|---|---|
"""
PAGE = """
.. click:: {module}:command
   :prog: workbench {name}
   :nested: full
"""


def pages() -> Iterator[tuple[str, str]]:
    """Names and texts of the pages."""
    rows = [f"| [{name}]({name}.rst) | {meant} |" for name, meant in COMMANDS.items()]
    below = "\n".join(["", "", "```{toctree}", ":hidden:", "", *COMMANDS, "```", ""])
    yield "commands/index.md", HEAD + "\n".join(rows) + below
    for name in COMMANDS:
        yield f"commands/{name}.rst", PAGE.format(name=name, module=module_of(name))
