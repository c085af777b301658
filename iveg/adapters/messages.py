"""Messages to people outside the page: a settings file of addresses, and apprise.

An address holds passwords and tokens, so no part of it is logged: the log lines of
apprise and its HTTP library are dropped.
"""

import asyncio
import contextlib
import logging
import threading
from typing import TYPE_CHECKING, Annotated

from pydantic import ConfigDict, Field

from iveg.adapters.toml_files import Table, complaint, read_table, read_text
from iveg.domain.events import Address, Language, Level, MessagePlan, MessageText

if TYPE_CHECKING:
    from apprise import Apprise

_Minutes = Annotated[float, Field(gt=0, le=1440)]


class _Address(Table):
    name: Annotated[str, Field(min_length=1, max_length=40)]
    url: Annotated[str, Field(min_length=1, max_length=2048)]
    least: Level = "P1"


_List = Annotated[list[_Address], Field(max_length=10)]


class _FileTable(Table):
    model_config = ConfigDict(hide_input_in_errors=True)

    language: Language = "es"
    escalate_after_min: _Minutes = 10.0
    address: _List = Field(default_factory=list)
    escalation: _List = Field(default_factory=list)


def load_messages(file: str) -> MessagePlan:
    """Plan of a file; without a file nobody gets messages.

    Raises:
        DataFileError: the file cannot be used; of an address it names only the place.
    """
    if not file:
        return MessagePlan()
    page = read_table(read_text(file), file, _FileTable)
    addresses = []
    for key, rows in (("address", page.address), ("escalation", page.escalation)):
        for index, row in enumerate(rows):
            if _opened(row.url) is None:
                raise complaint(file, (key, index, "url"), "is not one of apprise")
            addresses.append(Address(row.name, row.url, row.least, key == "escalation"))
    return MessagePlan(tuple(addresses), page.escalate_after_min * 60, page.language)


async def send_message(to: Address, text: MessageText) -> str | None:
    """Send a message by apprise; returns the reason of a failure, or None.

    Each message has a thread, which ends with the process at the latest.
    """
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[str | None] = loop.create_future()

    def tell(failed: str | None) -> None:
        if not answer.done():
            answer.set_result(failed)

    def work() -> None:
        try:
            service = _opened(to.url)
            is_taken = service and service.notify(title=text.title, body=text.body)
            failed = None if is_taken else "not taken"
        except Exception as error:
            # The name of the error alone: its text may hold the address.
            failed = type(error).__name__
        with contextlib.suppress(RuntimeError):  # the loop has ended
            loop.call_soon_threadsafe(tell, failed)

    threading.Thread(target=work, name="message", daemon=True).start()
    return await answer


def _opened(url: str) -> "Apprise | None":
    # Imported here: it takes 45 MB and a second, which only sites with messages pay.
    from apprise import Apprise

    for name in ("apprise", "urllib3"):
        logging.getLogger(name).propagate = False
        logging.getLogger(name).handlers = [logging.NullHandler()]
    service = Apprise()
    return service if service.add(url) else None
