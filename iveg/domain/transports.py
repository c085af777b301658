"""The transports to a robot and back, as a table: another one is one entry.

Orders, their times, JSON and pages are keyed by a transport's id.  Transports share
nothing, so that a fault of one leaves the others alone.
"""

from dataclasses import dataclass, replace
from typing import Literal, NewType

TransportId = NewType("TransportId", str)
"""In JSON, columns, file names and translations."""


@dataclass(frozen=True, slots=True)
class Transport:
    """One way to a robot and back.

    Attributes:
        id: Its name everywhere.
        can_stop: Whether it carries STOP; ``can_release`` RELEASE and RESUME.
        confirms: Its word that it took a STOP says that it is on its way (PUBACK);
            without, only the robot's answer says anything.
        one_at_a_time: A STOP waits until the one before came back, and is sent to a
            robot that has it only where there is no other way.
    """

    id: TransportId
    can_stop: bool = True
    can_release: bool = True
    confirms: bool = False
    one_at_a_time: bool = False

    def carries(self, order: Literal["stop", "release", "resume"]) -> bool:
        """Whether it takes such an order."""
        return self.can_stop if order == "stop" else self.can_release

    def switched(self, *, on: bool) -> "Transport":
        """This transport, or one like it that carries no order."""
        return self if on else replace(self, can_stop=False, can_release=False)


DIRECT = Transport(TransportId("direct"), confirms=True)
"""Straight over MQTT; its word is the broker's PUBACK."""
FIWARE = Transport(TransportId("fiware"), one_at_a_time=True)
"""Through Orion and the IoT Agent; a 204 says nothing."""

TRANSPORTS = (DIRECT, FIWARE)
