"""Messages to people outside the page: a settings file of addresses, and apprise.

An address holds passwords and tokens, so that nothing of it is logged: what apprise and
its HTTP library say goes nowhere.
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
    """The plan of a file; nobody gets messages where none is named.

    Raises:
        DataFileError: the file cannot be used; of an address it says the place alone.
    """
    if not file:
        return MessagePlan()
    text = read_text(file)
    page = read_table(text, file, _FileTable)
    found = []
    for key, rows in (("address", page.address), ("escalation", page.escalation)):
        for index, row in enumerate(rows):
            if _opened(row.url) is None:
                raise complaint(file, (key, index, "url"), "is not one of apprise")
            found.append(Address(row.name, row.url, row.least, key == "escalation"))
    return MessagePlan(tuple(found), page.escalate_after_min * 60, page.language)


class AppriseSender:
    """Sends by apprise; each message in a thread that ends with the process."""

    async def send(self, to: Address, text: MessageText) -> str | None:
        """Why an address did not take a message; None where it did."""
        loop = asyncio.get_running_loop()
        answer: asyncio.Future[str | None] = loop.create_future()

        def tell(failed: str | None) -> None:
            if not answer.done():
                answer.set_result(failed)

        def work() -> None:
            try:
                way = _opened(to.url)
                is_taken = way and way.notify(title=text.title, body=text.body)
                failed = None if is_taken else "not taken"
            except Exception as error:
                failed = type(error).__name__
            with contextlib.suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(tell, failed)

        threading.Thread(target=work, name="message", daemon=True).start()
        return await answer


def _opened(url: str) -> "Apprise | None":
    # Takes 45 MB and a second, which only sites with messages pay.
    from apprise import Apprise

    for name in ("apprise", "urllib3"):
        logging.getLogger(name).propagate = False
        logging.getLogger(name).handlers = [logging.NullHandler()]
    way = Apprise()
    return way if way.add(url) else None
