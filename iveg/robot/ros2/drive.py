"""The drive's side of Algorithm 3: twists of navigation in, gated twists out.

A twist that cannot be read counts as zero.  The speed limit is decided by the gate of
the safety node; this module only converts messages.
"""

from functools import lru_cache

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import REST, Twist2D
from iveg.robot.ros2.config import DriveConfig
from iveg.robot.ros2.input_faults import InputFaults
from iveg.robot.ros2.reading import read_twist, write_twist
from iveg.ros2 import cdr, geometry_msgs, std_msgs
from iveg.ros2.schema import Message


def message_of(*, stamped: bool) -> type[Message]:
    """Message type of a topic of twists."""
    return geometry_msgs.TwistStamped if stamped else geometry_msgs.Twist


class DriveTopics:
    """Reads ``cmd_vel_in``, writes ``cmd_vel_out``.

    Args:
        drive: Type of each of the two topics.
        topic: Full name of ``cmd_vel_in``, for faults.
        base_link: Frame of stamped twists.
        input_faults: Record of faults.
    """

    def __init__(
        self, drive: DriveConfig, topic: str, base_link: str, input_faults: InputFaults
    ) -> None:
        self._drive = drive
        self._topic = topic
        self._base_link = base_link
        self._input_faults = input_faults
        self._newest = 0.0

    def read(self, payload: bytes, now: float) -> Twist2D | None:
        """The twist that upstream requests; None if older than the one before."""
        try:
            if not self._drive.stamped_in:
                return read_twist(cdr.read(geometry_msgs.Twist, payload))
            stamped = cdr.read(geometry_msgs.TwistStamped, payload)
            return None if self._is_old(stamped, now) else read_twist(stamped.twist)
        except UnreadableError as error:
            self._input_faults.note(error.reason, self._topic, now)
            return REST

    def _is_old(self, stamped: geometry_msgs.TwistStamped, now: float) -> bool:
        stamp = stamped.header.stamp.seconds
        if stamp == 0.0:  # the sender sets no stamp
            return False
        # A clock that was set back by more than the lifetime of a twist is accepted.
        if self._newest - 1.0 < stamp <= self._newest:
            self._input_faults.note("time_back", self._topic, now)
            return True
        self._newest = stamp
        return False

    def write(self, twist: Twist2D, wall: float) -> bytes:
        """Bytes for the base; ``wall`` is the robot's clock (Unix s)."""
        if self._drive.stamped_out:
            header = std_msgs.Header(std_msgs.Time.of(wall), self._base_link)
            return cdr.write(geometry_msgs.TwistStamped(header, write_twist(twist)))
        return _unstamped(twist)


@lru_cache(maxsize=1)
def _unstamped(twist: Twist2D) -> bytes:
    """Bytes of a twist, which stays the same for long."""
    return cdr.write(write_twist(twist))
