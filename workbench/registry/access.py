"""Tokens that let somebody read or change through the page, and the audit of what they did."""

import hashlib
import re
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from workbench.registry.database import Database
from workbench.registry.tables import AccessTokenEndRow, AccessTokenRow, AuditRow
from workbench.registry.values import BadRegistry, Role, of_row

TOKEN_PREFIX = "wb_"  # by which a token is known as one where it should not be
RANDOM_BYTES = 32
_PERSON = re.compile(r"[\w.@+-]{1,64}")


@dataclass(frozen=True)
class AccessToken:
    """A token as the registry knows it; ended: when it was revoked."""

    name: str
    role: Role
    made_by: str
    at: datetime
    ended: datetime | None


@dataclass(frozen=True)
class Access:
    """The tokens of a registry."""

    database: Database

    def add(self, name: str, role: Role, *, by: str, now: datetime) -> str:
        """A new token, which is shown only now; the registry keeps its hash.

        Raises BadRegistry where the name is taken or none.
        """
        if not _PERSON.fullmatch(name):
            raise BadRegistry(
                f"token {name!r}: letters, digits and . _ @ + - needed, at most 64, as anna"
            )
        secret = TOKEN_PREFIX + secrets.token_urlsafe(RANDOM_BYTES)
        with self.database.writing() as session:
            if session.scalar(select(AccessTokenRow.id).where(AccessTokenRow.name == name)):
                raise BadRegistry(
                    f"token {name!r}: exists already, active or revoked; give another name"
                )
            row = AccessTokenRow(name=name, role=role, sha256=hashed(secret), made_by=by, at=now)
            session.add(row)
            note(session, "token_added", name, role, by=by, now=now)
        return secret

    def revoke(self, name: str, *, by: str, now: datetime) -> None:
        """From now on the token is not taken; raises BadRegistry where there is no such."""
        with self.database.writing() as session:
            row = session.scalar(select(AccessTokenRow).where(AccessTokenRow.name == name))
            if row is None or session.get(AccessTokenEndRow, row.id) is not None:
                raise BadRegistry(f"token {name!r}: there is none; 'workbench token list' has them")
            session.add(AccessTokenEndRow(token_id=row.id, made_by=by, at=now))
            note(session, "token_revoked", name, row.role, by=by, now=now)

    def tokens(self) -> tuple[AccessToken, ...]:
        """Every token by name."""
        return self._found(_TOKENS.order_by(AccessTokenRow.name))

    def of(self, secret: str) -> AccessToken | None:
        """The token of that secret; None where there is none, or it was revoked."""
        own = (AccessTokenRow.sha256 == hashed(secret), AccessTokenEndRow.at.is_(None))
        return next(iter(self._found(_TOKENS.where(*own))), None)

    def audited(self, last: int) -> Sequence[AuditRow]:
        """The last changes, the newest first."""
        query = select(AuditRow).order_by(AuditRow.id.desc()).limit(last)
        return [row for (row,) in self.database.rows(query)]

    def _found(self, query: Select[*tuple[Any, ...]]) -> tuple[AccessToken, ...]:
        rows = self.database.rows(query)
        return tuple(of_row(AccessToken, row, ended=ended) for row, ended in rows)


_TOKENS = select(AccessTokenRow, AccessTokenEndRow.at).outerjoin(
    AccessTokenEndRow, AccessTokenEndRow.token_id == AccessTokenRow.id
)


def hashed(secret: str) -> str:
    """What the registry keeps of a token: with 256 random bits in it, a plain hash is enough."""
    return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).hexdigest()


def note(session: Session, kind: str, subject: str, detail: str, *, by: str, now: datetime) -> None:
    """Write a change into the audit, within the transaction that makes it."""
    session.add(AuditRow(kind=kind, subject=subject, detail=detail, made_by=by, at=now))
