"""Runs migrations on the connection that iVeg hands in.

From the command line there is none: an empty database in memory is then brought to the
newest revision first, so that a new one can be generated without a database at hand.
"""

from alembic import context
from alembic.operations import Operations
from alembic.runtime.migration import MigrationContext
from sqlalchemy import Connection, create_engine

from iveg.adapters.history.tables import EARLIER, metadata


def run(connection: Connection) -> None:
    context.configure(
        connection=connection,
        target_metadata=metadata,
        include_name=lambda name, kind, _: kind != "table" or name not in EARLIER,
        transactional_ddl=True,
        render_as_batch=connection.dialect.name == "sqlite",
    )
    with context.begin_transaction():
        context.run_migrations()


def bring_to_head(connection: Connection) -> None:
    def steps(found, _):
        return context.script._upgrade_revs("head", found)

    migration = MigrationContext.configure(connection, opts={"fn": steps})
    with migration.begin_transaction(), Operations.context(migration):
        migration.run_migrations()


def run_in_memory() -> None:
    with create_engine("sqlite://").connect() as connection:
        bring_to_head(connection)
        run(connection)


handed_in = context.config.attributes.get("connection")
if handed_in is None:
    run_in_memory()
else:
    run(handed_in)
