"""``iveg db``: the schema of the history's database."""

from iveg.adapters.history.engine import history_url, upgrade
from iveg.cli.arguments import CommandCall


def run(call: CommandCall) -> int:
    """Upgrade the database; returns the exit code.

    Raises:
        IvegError: it cannot be done.
    """
    call.data.mkdir(parents=True, exist_ok=True)
    upgrade(history_url(call.settings.database_url, call.data))
    print("The database is up to date.")
    return 0
