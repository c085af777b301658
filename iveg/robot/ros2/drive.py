"""The drive's side of Algorithm 3: wishes in, what the safety node lets through out.

A wish that nobody can mean is a wish to rest.  Nothing is decided here about how fast
the robot may be: that is the safety node's gate, and this module writes its word.
"""

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Twist2D
from iveg.robot.gate import REST
from iveg.robot.ros2.config import DriveConfig
from iveg.robot.ros2.input_faults import InputFaults
from iveg.robot.ros2.reading import read_twist, write_twist
from iveg.ros2 import cdr
from iveg.ros2 import messages as m
from iveg.ros2.schema import Message


def message_of(*, stamped: bool) -> type[Message]:
    """Which type a topic of twists has."""
    return m.TwistStamped if stamped else m.Twist


class DriveTopics:
    """Reads ``cmd_vel_in``, writes ``cmd_vel_out``.

    Args:
        drive: Which of the two types each has.
        topic: Full name of ``cmd_vel_in``, for troubles.
        base_link: Frame of stamped twists.
        input_faults: Where what is wrong is noted.
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
        """What upstream asks for; None for what is older than what it asked before."""
        try:
            if not self._drive.stamped_in:
                return read_twist(cdr.read(m.Twist, payload))
            stamped = cdr.read(m.TwistStamped, payload)
            return None if self._is_old(stamped, now) else read_twist(stamped.twist)
        except UnreadableError as error:
            self._input_faults.note(error.reason, self._topic, now)
            return REST

    def _is_old(self, stamped: m.TwistStamped, now: float) -> bool:
        stamp = stamped.header.stamp.seconds
        if stamp == 0.0:  # the sender stamps nothing
            return False
        # A clock that was set back by more than a wish lives is believed again.
        if self._newest - 1.0 < stamp <= self._newest:
            self._input_faults.note("time_back", self._topic, now)
            return True
        self._newest = stamp
        return False

    def write(self, twist: Twist2D, wall: float) -> bytes:
        """The bytes for the base; ``wall`` is the robot's clock (Unix s)."""
        written = write_twist(twist)
        if not self._drive.stamped_out:
            return cdr.write(written)
        header = m.Header(m.Time.of(wall), self._base_link)
        return cdr.write(m.TwistStamped(header, written))
