"""Messages to people outside the page: recipients, channels, results.

A message says how grave it is and when, never where or about whom: it passes through
other people's servers (docs/interfaces/http.md, "Messages").
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from iveg.domain.observations import Instant

Channel = Literal["push", "email", "webhook"]
Language = Literal["es", "en"]
Level = Literal["P1", "P2"]
Priority = Literal["P1", "P2", "P3"]

CHANNELS: Final[tuple[Channel, ...]] = ("push", "email", "webhook")
MOST_DEVICES = 20
MOST_RECIPIENTS = 10


@dataclass(frozen=True, slots=True)
class AlertItem:
    """One occurrence of one alert, in a message.

    Attributes:
        tries: How often it was sent to nobody's reach.
    """

    alert_id: str
    priority: Priority
    key: str
    raised: Instant
    tries: int = 0


@dataclass(frozen=True, slots=True)
class OutboundMessage:
    """A message to people; without items a test."""

    items: Sequence[AlertItem] = ()

    @property
    def is_test(self) -> bool:
        """Whether somebody only tries the channel."""
        return not self.items

    @property
    def priority(self) -> Priority:
        """The gravest of them."""
        return min((one.priority for one in self.items), default="P3")


@dataclass(frozen=True, slots=True)
class MessageText:
    """A message in one language."""

    title: str
    body: str


@dataclass(frozen=True, slots=True)
class MessageDelivery:
    """Result of a message to one person or device.

    Attributes:
        failed: None where it was taken, else why not, as a code.
        device_id: Of a push.
    """

    channel: Channel
    to: str
    at: Instant
    failed: str | None = None
    device_id: str | None = None


def newest(deliveries: Sequence[MessageDelivery]) -> tuple[MessageDelivery, ...]:
    """The last word on each person and channel, in the order of the first ones."""
    return tuple({(one.channel, one.to): one for one in deliveries}.values())
