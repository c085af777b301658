"""``iveg audit``: whether the audit is whole, and its newest hash."""

from iveg.adapters.database_check import check_database
from iveg.adapters.history.asking import ask_once
from iveg.adapters.history.audit import chain_end, faults, sealed_end
from iveg.adapters.history.engine import history_url
from iveg.cli.arguments import CommandCall
from iveg.domain.audit import AuditFault

_MOST_TOLD = 20
_SAYS = {
    "changed": "was changed: its hash is not that of its values",
    "missing": "is missing",
    "unlinked": "does not follow the row before it",
}


def run(call: CommandCall) -> int:
    """One question to the audit; returns the exit code.

    Raises:
        IvegError: the database cannot be read.
    """
    url = history_url(call.settings.database_url, call.data)
    check_database(url)
    end = ask_once(url, chain_end)
    if call.options.action == "end":
        print(end.seq, end.hash)
        return 0
    found = ask_once(url, lambda connection: list(faults(connection)))
    for fault in found[:_MOST_TOLD]:
        print(_sentence(fault))
    if found:
        print(f"{len(found)} fault(s): the audit is not as it was written.")
        return 1
    gone = ask_once(url, sealed_end).seq
    print(f"Rows {gone + 1} to {end.seq} are as they were written.")
    print(f"The chain ends with {end.hash}.")
    return 0


def _sentence(fault: AuditFault) -> str:
    return f"Row {fault.seq} {_SAYS[fault.what]}."
