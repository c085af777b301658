"""Transports to a robot and back, as a table: a further transport is one entry.

Orders, their times, JSON and pages are keyed by a transport's id.  Transports share
nothing, so a fault in one leaves the others alone.
"""

from dataclasses import dataclass, replace
from typing import Literal, NewType

TransportId = NewType("TransportId", str)
"""Id of a transport, also in JSON, columns, file names and translations."""


@dataclass(frozen=True, slots=True)
class Transport:
    """One way to a robot and back.

    Attributes:
        id: Its name everywhere.
        can_stop: Whether it carries STOP; ``can_release``: RELEASE and RESUME.
        confirms: Whether its acceptance of a STOP (PUBACK) proves that it is on its
            way; else only the robot's answer proves anything.
        is_serial: Whether a STOP waits for the end of the earlier one.  A robot that
            has the STOP gets no other this way, unless all transports are serial.
    """

    id: TransportId
    can_stop: bool = True
    can_release: bool = True
    confirms: bool = False
    is_serial: bool = False

    def carries(self, order: Literal["stop", "release", "resume"]) -> bool:
        """Whether it takes such an order."""
        return self.can_stop if order == "stop" else self.can_release

    def switched(self, *, on: bool) -> "Transport":
        """This transport, or its copy that carries no order."""
        return self if on else replace(self, can_stop=False, can_release=False)


DIRECT = Transport(TransportId("direct"), confirms=True)
"""Straight over MQTT; the broker's PUBACK confirms."""
FIWARE = Transport(TransportId("fiware"), is_serial=True)
"""Through Orion and the IoT Agent; a 204 confirms nothing."""

TRANSPORTS = (DIRECT, FIWARE)
