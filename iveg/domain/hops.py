"""The hops of the data path, and how each is tried.

One vocabulary for both judges.  The running health monitor judges hops by the
heartbeat probe that passes them all; ``iveg doctor`` tries them one by one, each check
by using its hop once.
"""

from collections.abc import Mapping
from enum import StrEnum


class Hop(StrEnum):
    """One hop, in the order in which a datum passes them.

    The value is its id in JSON, metrics, errors and translations.
    """

    MQTT = "mqtt"
    AGENT = "iot_agent"
    ORION = "orion"
    NOTIFICATIONS = "notifications"
    DATABASE = "database"
    PAGE = "server"

    @property
    def label(self) -> str:
        """Key of its name in the translations."""
        return f"hop.{self.value}"


class Check(StrEnum):
    """One use of a hop, in the order of an examination; the value names it there."""

    BROKER = "MQTT broker: connect, echo"
    ORION = "Orion answers"
    AGENT = "IoT Agent answers"
    DEVICE = "probe device can be made"
    MEASURE = "measure: MQTT > agent > Orion"
    NOTIFICATION = "notification: Orion > here"
    COMMAND = "command: Orion > agent > MQTT"
    ANSWER = "answer: MQTT > agent > Orion"
    DIRECT = "command straight over MQTT"
    DATABASE = "database, newest migration"
    PAGE = "iVeg's own page, /healthz"

    @property
    def hop(self) -> Hop:
        """The hop that it tries."""
        return _TRIES[self]


_TRIES: Mapping[Check, Hop] = {
    Check.BROKER: Hop.MQTT,
    Check.ORION: Hop.ORION,
    Check.AGENT: Hop.AGENT,
    Check.DEVICE: Hop.AGENT,
    Check.MEASURE: Hop.AGENT,
    Check.NOTIFICATION: Hop.NOTIFICATIONS,
    Check.COMMAND: Hop.AGENT,
    Check.ANSWER: Hop.AGENT,
    Check.DIRECT: Hop.MQTT,
    Check.DATABASE: Hop.DATABASE,
    Check.PAGE: Hop.PAGE,
}
NEEDS: Mapping[Check, tuple[Check, ...]] = {
    Check.BROKER: (),
    Check.ORION: (),
    Check.AGENT: (),
    Check.DEVICE: (Check.ORION, Check.AGENT),
    Check.MEASURE: (Check.BROKER, Check.DEVICE),
    Check.NOTIFICATION: (Check.ORION,),
    Check.COMMAND: (Check.BROKER, Check.DEVICE),
    Check.ANSWER: (Check.COMMAND, Check.MEASURE),
    Check.DIRECT: (Check.BROKER,),
    Check.DATABASE: (),
    Check.PAGE: (),
}
"""Checks that each check depends on."""
