"""Floods of log messages by libraries, logged once at their beginning and their end.

Under load aiomqtt complains of every message that waits.  That is one fact with a
beginning and an end: the first complaint passes, the others are counted, and when none
has come for a while one line says that it is over and how many there were.
"""

import asyncio
import logging
import re
from collections import Counter
from dataclasses import dataclass

OVER_S = 10.0
"""A complaint that has not come for so long is over."""
_NUMBER = re.compile(r"'?\b\d+\b'?")
_log = logging.getLogger(__name__)

counted: Counter[str] = Counter()
"""Complaints of this process that were held back or told, by a short name."""
_NAMES = {
    "Message queue is full": "mqtt.queue_full",
    "pending publish calls": "mqtt.unconfirmed",
    "PUBACK waiter": "broker.late_puback",
}


@dataclass(slots=True)
class _Flood:
    """One complaint that goes on: how often, and when it came last (loop's time)."""

    count: int
    last: float


class LossFilter(logging.Filter):
    """Lets a complaint through when it begins and logs when it is over.

    Numbers do not matter: the 17th message that waits is the same complaint as the
    first.  Tracebacks are left out.
    """

    def __init__(self) -> None:
        super().__init__()
        self._floods: dict[str, _Flood] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether this complaint is new."""
        said = record.getMessage()
        complaint = _NUMBER.sub("…", said).partition(":")[0].partition(" for ")[0]
        counted.update(name for words, name in _NAMES.items() if words in said)
        flood = self._floods.get(complaint)
        loop = _running_loop()
        if flood is not None:
            flood.count += 1
            flood.last = flood.last if loop is None else loop.time()
            return False
        self._floods[complaint] = _Flood(1, 0.0 if loop is None else loop.time())
        if loop is not None:
            loop.call_later(OVER_S, self._look, loop, complaint, record.name)
        record.exc_info = None
        return True

    def _look(
        self, loop: asyncio.AbstractEventLoop, complaint: str, source: str
    ) -> None:
        flood = self._floods[complaint]
        left = flood.last + OVER_S - loop.time()
        if left > 0.0:
            loop.call_later(left, self._look, loop, complaint, source)
            return
        del self._floods[complaint]
        if flood.count > 1:
            over = "%s: over after %d times: %s"
            _log.warning(over, source, flood.count, complaint.rstrip(". "))


def _running_loop() -> asyncio.AbstractEventLoop | None:
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None


def quiet(*loggers: str) -> None:
    """Log each complaint of these loggers once."""
    for name in loggers:
        logging.getLogger(name).addFilter(LossFilter())
