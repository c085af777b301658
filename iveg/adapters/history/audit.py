"""The audit's chain in the database: rows behind its end, faults in it, sealed parts.

One writer at a time: SQLite's transactions are, PostgreSQL's lock the table, so that
``iveg user`` beside a running server breaks no chain.
"""

from collections.abc import Iterable, Iterator

from sqlalchemy import (
    ColumnElement,
    Connection,
    delete,
    func,
    insert,
    or_,
    select,
    text,
    update,
)

from iveg.adapters.history.tables import audit, audit_end, audit_sealed
from iveg.domain.audit import AuditFault, ChainEnd, chained, find_faults
from iveg.domain.records import AuditRecord, Record
from iveg.domain.retention import DAY_S

_NAMES = tuple(audit.c.keys())


def write_audit(
    connection: Connection, records: Iterable[Record], stored_at: float
) -> None:
    """Append rows that are not there yet, within the transaction of the caller.

    Args:
        connection: Of a writer.
        records: In their order; others than ``AuditRecord`` are passed over.
        stored_at: This moment (Unix s).
    """
    offered = {one.audit_id: one for one in records if isinstance(one, AuditRecord)}
    if not offered:
        return
    if connection.dialect.name == "postgresql":
        connection.execute(text("LOCK TABLE audit IN SHARE ROW EXCLUSIVE MODE"))
    known = select(audit.c.audit_id).where(audit.c.audit_id.in_(offered))
    for audit_id in connection.scalars(known):
        del offered[audit_id]
    before = chain_end(connection)
    rows = list(chained(offered.values(), before, stored_at))
    if not rows:
        return
    values = [{name: getattr(row, name) for name in _NAMES} for row in rows]
    connection.execute(insert(audit), values)
    end = {"seq": rows[-1].seq, "hash": rows[-1].hash, "at": stored_at}
    if before == ChainEnd():
        connection.execute(delete(audit_end))
        connection.execute(insert(audit_end).values(one=1, **end))
    else:
        connection.execute(update(audit_end).values(**end))


def chain_end(connection: Connection) -> ChainEnd:
    """The newest row that was ever written."""
    found = connection.execute(select(audit_end.c.seq, audit_end.c.hash)).first()
    return ChainEnd() if found is None else ChainEnd(found.seq, found.hash)


def sealed_end(connection: Connection) -> ChainEnd:
    """The newest row of what retention may take, or took."""
    c = audit_sealed.c
    newest = select(c.seq, c.hash).order_by(c.seq.desc()).limit(1)
    found = connection.execute(newest).first()
    return ChainEnd() if found is None else ChainEnd(found.seq, found.hash)


def faults(connection: Connection) -> Iterator[AuditFault]:
    """Where the chain is broken; nothing: it is whole."""
    begin, end = sealed_end(connection), chain_end(connection)
    # What of a sealed part is still there goes soon and proves nothing.
    kept = select(audit).where(audit.c.seq > begin.seq).order_by(audit.c.seq)
    rows = connection.execution_options(yield_per=1000).execute(kept).mappings()
    return find_faults((AuditRecord(**row) for row in rows), begin, end)


def is_over(before: float) -> ColumnElement[bool]:
    """Whether a row is of the whole days that ended before a moment (Unix s)."""
    c, day = audit.c, before // DAY_S * DAY_S
    first_kept = select(func.min(c.seq)).where(c.stored_at >= day).scalar_subquery()
    return or_(c.seq < first_kept, first_kept.is_(None))


def seal(connection: Connection, before: float, now: float) -> None:
    """Seal the days of the chain that are over; the hash of their last row stays."""
    c = audit.c
    newest = select(c.seq, c.hash).where(is_over(before)).order_by(c.seq.desc())
    last = connection.execute(newest.limit(1)).first()
    if last is not None and last.seq > sealed_end(connection).seq:
        sealed = {"seq": last.seq, "hash": last.hash, "at": now}
        connection.execute(insert(audit_sealed).values(**sealed))
