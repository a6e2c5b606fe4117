"""`workbench token`: who may read and change through the page."""

from typing import Literal

import click

from workbench import options
from workbench.commands.registry import YOU, opened
from workbench.jobs.options import clock
from workbench.output import emit
from workbench.signature import argument, option


@click.group(cls=options.StatusGroup, epilog="Example: workbench token add anna --role change")
def command() -> None:
    """Tokens of the page: whoever has one reads, or changes, under its name.

    The registry keeps a hash of each; a token is shown once, when it is made. Every subcommand
    takes --registry FILE|URL and --json.
    """


@options.command(command, "add", epilog="Example: workbench token add anna --role change")
def add_token(
    name: str = argument(),
    role: Literal["read", "change"] = option("", default="read"),
    by: str = option("Who makes it.  [default: you]", **YOU),
    where: str | None = options.REGISTRY_OPTION,
) -> None:
    """Make a token and show it, this once."""
    from workbench.registry.access import Access

    with opened(where, create=True) as found:
        secret = Access(found.database).add(name, role, by=by, now=clock())
    shown = f"{secret}\nThe token of {name} ({role}); it is shown only now and stored nowhere."
    emit({"name": name, "role": role, "token": secret}, lambda: shown)


@options.command(command, "list", epilog="Example: workbench token list --json")
def list_tokens(where: str | None = options.REGISTRY_OPTION) -> None:
    """List the tokens by name, role and who made them; not the tokens themselves."""
    from workbench.registry.access import Access
    from workbench.registry.views import moment
    from workbench.screen import screen, tabled

    with opened(where, create=True) as found:
        tokens = Access(found.database).tokens()
    rows = [
        (one.name, one.role, one.made_by, moment(one.at),
         "active" if one.ended is None else f"revoked {moment(one.ended)}")
        for one in tokens
    ]  # fmt: skip
    head = ("token", "role", "made by", "at", "state")
    shown = screen(tabled(head, rows, ())) if rows else "no token yet"
    emit({"tokens": tokens}, lambda: shown)


@options.command(command, "revoke", epilog="Example: workbench token revoke anna")
def revoke_token(
    name: str = argument(),
    by: str = option("Who revokes it.  [default: you]", **YOU),
    where: str | None = options.REGISTRY_OPTION,
) -> None:
    """Take a token no more; its name stays taken."""
    from workbench.registry.access import Access

    with opened(where, create=True) as found:
        Access(found.database).revoke(name, by=by, now=clock())
    emit({"name": name, "revoked": True}, lambda: f"{name}: revoked")
