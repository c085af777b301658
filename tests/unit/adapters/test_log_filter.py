"""A flood of complaints is one line at its beginning and one at its end."""

import asyncio
import logging

import pytest

from iveg.adapters import log_filter
from iveg.adapters.log_filter import OVER_S, LossFilter


class Clockwork(asyncio.SelectorEventLoop):
    """A loop whose time is set; what falls due by then is run."""

    now = 1000.0

    def time(self) -> float:
        return self.now


@pytest.fixture
def logger() -> logging.Logger:
    name = "tests.floods"
    told = logging.getLogger(name)
    told.filters.clear()
    told.addFilter(LossFilter())
    return told


def run_at(loop: Clockwork, now: float, *complaints: str) -> None:
    async def complain() -> None:
        for one in complaints:
            logging.getLogger("tests.floods").warning(one)
        await asyncio.sleep(0)

    loop.now = now
    loop.run_until_complete(complain())


def said(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [one.getMessage() for one in caplog.records]


def test_a_thousand_complaints_are_one_line_a_loss_and_one_a_return(
    logger: logging.Logger, caplog: pytest.LogCaptureFixture
) -> None:
    assert logger.filters
    many = [f"PUBACK waiter with Id '{number}' already done" for number in range(1000)]
    before = log_filter.counted["broker.late_puback"]
    loop = Clockwork()

    run_at(loop, 1000.0, *many[:500])
    run_at(loop, 1000.0 + OVER_S - 1.0, *many[500:])
    run_at(loop, 1000.0 + OVER_S + 0.1)
    during = said(caplog)
    run_at(loop, 1000.0 + 2 * OVER_S)
    loop.close()

    assert during == ["PUBACK waiter with Id '0' already done"]
    assert said(caplog)[1:] == [
        "tests.floods: over after 1000 times: PUBACK waiter with Id … already done"
    ]
    assert log_filter.counted["broker.late_puback"] - before == 1000


def test_different_complaints_do_not_hide_each_other(
    logger: logging.Logger, caplog: pytest.LogCaptureFixture
) -> None:
    logger.warning("There are %d pending publish calls.", 11)
    logger.warning("Message queue is full. Discarding message.")
    logger.warning("There are %d pending publish calls.", 12)

    assert said(caplog) == [
        "There are 11 pending publish calls.",
        "Message queue is full. Discarding message.",
    ]
