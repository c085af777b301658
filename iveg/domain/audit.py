"""The audit: who did what, in a chain whose rows hold the hash of the row before.

A row that was changed, has gone or stands elsewhere breaks the chain there::

    hash(n) = SHA-256(canonical JSON of row n and hash(n - 1))

The chain proves nothing against whoever can write the whole of it anew; for that its
newest hash is told to the log each day, and can be kept outside.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from typing import Any, Final, Literal, Protocol

from iveg.domain.records import AuditRecord, Json

FIRST_HASH: Final = "0" * 64
"""What stands before the first row."""


class Actor(Protocol):
    """Whoever acts: a person, a program, or iVeg itself."""

    @property
    def person(self) -> str:
        """Id of the account."""

    @property
    def name(self) -> str:
        """Name at that moment."""

    @property
    def role(self) -> str:
        """Role at that moment."""

    @property
    def method(self) -> str:
        """Proof of the identity."""


@dataclass(frozen=True, slots=True)
class NamedActor:
    """An actor of whom no request tells: iVeg itself, or a stranger."""

    person: str
    name: str
    role: str
    method: str


ITSELF: Final = NamedActor("iveg", "iVeg", "system", "none")
"""What iVeg does unasked, such as retention."""
STRANGER: Final = NamedActor("", "", "stranger", "none")
"""Whoever tries to sign in."""
CONSOLE: Final = NamedActor("console", "console", "system", "shell")
"""Whoever calls ``iveg`` on the machine itself."""


def act_of(
    actor: Actor, action: str, subject: str, details: Json, *, audit_id: str, at: float
) -> AuditRecord:
    """What somebody did at a moment (Unix s), without its place in the chain yet."""
    return AuditRecord(
        audit_id=audit_id,
        at=at,
        person=actor.person,
        name=actor.name,
        role=actor.role,
        method=actor.method,
        action=action,
        subject=subject,
        details=canonical(details),
    )


@dataclass(frozen=True, slots=True)
class ChainEnd:
    """The newest row of the chain, or of its part that has gone."""

    seq: int = 0
    hash: str = FIRST_HASH


@dataclass(frozen=True, slots=True)
class AuditFault:
    """Where the chain is broken.

    Attributes:
        seq: The row, or the first that is missing.
        what: ``changed`` (its hash is not that of its values), ``missing``, or
            ``unlinked`` (it names another row as the one before).
    """

    seq: int
    what: Literal["changed", "missing", "unlinked"]


def canonical(details: Json) -> str:
    """Details as JSON in one spelling alone (ASCII, keys sorted, no spaces)."""
    return json.dumps(details, sort_keys=True, separators=(",", ":"))


def hash_of(row: AuditRecord) -> str:
    """The hash that a row must have (hex)."""
    values: dict[str, Any] = {
        one.name: getattr(row, one.name) for one in fields(row) if one.name != "hash"
    }
    return hashlib.sha256(canonical(values).encode()).hexdigest()


def chained(
    rows: Iterable[AuditRecord], end: ChainEnd, stored_at: float
) -> Iterator[AuditRecord]:
    """Rows with their places in the chain, behind its end.

    Args:
        rows: In the order in which they are to stand.
        end: The newest row so far.
        stored_at: This moment (Unix s); rows that are late say so by it.
    """
    for row in rows:
        linked = replace(
            row, seq=end.seq + 1, stored_at=stored_at, previous_hash=end.hash
        )
        linked = replace(linked, hash=hash_of(linked))
        yield linked
        end = ChainEnd(linked.seq, linked.hash)


def find_faults(
    rows: Iterable[AuditRecord], begin: ChainEnd, end: ChainEnd
) -> Iterator[AuditFault]:
    """Where a chain is broken.

    Args:
        rows: What the database has, by ``seq``.
        begin: The newest row that retention took, which stays known by its hash.
        end: The newest row that was ever written.
    """
    last = begin
    for row in rows:
        if row.seq != last.seq + 1:
            yield AuditFault(last.seq + 1, "missing")
        elif row.previous_hash != last.hash:
            yield AuditFault(row.seq, "unlinked")
        if row.hash != hash_of(row):
            yield AuditFault(row.seq, "changed")
        last = ChainEnd(row.seq, row.hash)
    if last.seq < end.seq:
        yield AuditFault(last.seq + 1, "missing")
    elif last != end:
        yield AuditFault(last.seq, "unlinked")
