"""Detections with depth, of any family, as boxes in ``map``."""

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import UNKNOWN_ORIGIN, Detection, DetectionFrame
from iveg.robot.grounding.locate import Ungrounded, frame_of
from iveg.robot.ros2 import reading
from iveg.robot.ros2.detectors import BOXES
from iveg.robot.ros2.input_faults import InputFaults
from iveg.robot.ros2.places import Places
from iveg.robot.ros2.rigid import RigidTransform
from iveg.ros2 import vision_msgs
from iveg.ros2.schema import Message


class Boxes:
    """Places each box by the frame of its header, or of the message's.

    Args:
        topic: Its full name, for faults.
        classes: A detector's class names by number; none: as sent.
        places: Transforms of the robot.
        input_faults: Record of faults.
    """

    def __init__(
        self,
        topic: str,
        classes: tuple[str, ...],
        places: Places,
        input_faults: InputFaults,
    ) -> None:
        self._topic = topic
        self._classes = classes
        self._places = places
        self._input_faults = input_faults

    def locate(self, message: Message, now: float) -> DetectionFrame:
        """The detection frame of a message of one of ``BOXES``; ``now`` monotonic."""
        found = BOXES[type(message)](message)
        usual, stamp = found.header.frame_id, found.header.stamp.seconds
        frames = dict.fromkeys(one.header.frame_id or usual for one in found.detections)
        places = {frame: self._places.in_map(frame, stamp, now) for frame in frames}
        answers = [
            self._detection(one, places[one.header.frame_id or usual], now)
            for one in found.detections
        ]
        return frame_of("", UNKNOWN_ORIGIN, answers)

    def _detection(
        self, one: vision_msgs.Detection3D, place: RigidTransform | None, now: float
    ) -> tuple[str | None, Detection | Ungrounded]:
        """A detection, or that it has no place, and the class that it is of."""
        if place is not None:
            try:
                found = reading.read_detection(one, place, self._classes)
            except UnreadableError as error:
                self._input_faults.note(error.reason, self._topic, now)
            else:
                return found.class_id, found
        return reading.class_id_of(one.results, self._classes), "unreadable"
