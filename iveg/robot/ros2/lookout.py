"""Who else is on the network: faults of a running gate that endpoints give away.

Without I/O: endpoints and times (monotonic, s) are arguments.
"""

from collections.abc import Iterable, Sequence

from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.drive import message_of
from iveg.robot.ros2.input_faults import InputFaults
from iveg.robot.ros2.topics import TOPICS, sensed_topics
from iveg.ros2.names import Endpoint, Qos
from iveg.ros2.schema import Message

_MET_WITHIN_S = 5.0


class Lookout:
    """Notes what is wrong with the endpoints of others.

    Args:
        config: Names and types of the robot's topics.
        input_faults: Record of faults.
        now: Start (monotonic, s).
    """

    def __init__(
        self, config: RobotConfig, input_faults: InputFaults, now: float
    ) -> None:
        self._config, self._names = config, config.full_topics
        self._input_faults = input_faults
        self._alone_since = self._unheard_since = now

    def look(self, endpoints: Iterable[Endpoint], now: float) -> None:
        """Judge the endpoints of this moment."""
        others = [one for one in endpoints if not one.own]
        out = self._names["cmd_vel_out"]
        if any(one.writes and one.topic == out for one in others):
            self._input_faults.note("second_publisher", out, now)
        if others:
            self._alone_since = now
            self._note_unheard(others, now)
            self._note_types(others, now)
        elif now - self._alone_since > _MET_WITHIN_S:
            domain = f"DDS {self._config.domain}"
            self._input_faults.note("nobody_there", domain, now)

    def _note_unheard(self, others: Sequence[Endpoint], now: float) -> None:
        """A base that cannot hear the gate obeys no STOP either."""
        out = self._names["cmd_vel_out"]
        message = message_of(stamped=self._config.drive.stamped_out)
        offered = self._config.qualities["cmd_vel_out"]
        readers = [one for one in others if one.topic == out and not one.writes]
        for reader in readers:
            why = deafness(reader, message, offered)
            if why:
                self._input_faults.note("drive_unheard", f"{out}: {why}", now)
        if readers:
            self._unheard_since = now
        elif now - self._unheard_since > _MET_WITHIN_S:
            self._input_faults.note("drive_unheard", out, now)

    def _note_types(self, others: Sequence[Endpoint], now: float) -> None:
        for topic, name in sensed_topics(self._names).items():
            kinds = {one.type for one in others if one.writes and one.topic == name}
            if kinds and not any(map(TOPICS[topic].form, kinds)):
                about = f"{name}: {min(kinds).replace('/msg/', '/')}"
                self._input_faults.note("wrong_type", about, now)


def deafness(reader: Endpoint, message: type[Message], offered: Qos) -> str:
    """Why a reader does not hear a writer: what is sent → what it wants; else empty."""
    if reader.type != message.ROS:
        return f"{_short(message.ROS)} → {_short(reader.type)}"
    if reader.qos.reliable and not offered.reliable:
        return "best effort → reliable"
    if reader.qos.transient_local and not offered.transient_local:
        return "volatile → transient local"
    return ""


def _short(ros_type: str) -> str:
    return ros_type.rpartition("/")[2]


def forms_published(
    topic: str, name: str, endpoints: Iterable[Endpoint]
) -> list[type[Message]]:
    """Types in which others publish a topic (key and full name), of those read."""
    kinds = {
        one.type: None
        for one in endpoints
        if one.writes and not one.own and one.topic == name
    }
    return [form for kind in kinds if (form := TOPICS[topic].form(kind)) is not None]
