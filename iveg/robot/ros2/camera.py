"""A robot's camera: detections in a picture wait for the depth of that picture."""

from collections import deque
from collections.abc import Mapping

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import UNKNOWN_ORIGIN, DetectionFrame, Instant
from iveg.robot.grounding.locate import Grounding
from iveg.robot.ros2 import pictures
from iveg.robot.ros2.detectors import LOOKS, Look
from iveg.robot.ros2.input_faults import InputFaults
from iveg.robot.ros2.places import Places
from iveg.robot.ros2.reading import class_id_of
from iveg.ros2 import sensor_msgs
from iveg.ros2.schema import Message

_PICTURES = 6
_SAME_PICTURE_S = 0.05
_DEPTH_LATE_S = 0.3


class Camera:
    """The newest detection frame without depth, and the pictures that locate it.

    Args:
        names: Full names of topics, for faults.
        classes: A detector's class names by number; none: as sent.
        settings: Parameters that the paper leaves open.
        places: Transforms of the robot.
        input_faults: Record of faults.
    """

    def __init__(
        self,
        names: Mapping[str, str],
        classes: tuple[str, ...],
        settings: Grounding,
        places: Places,
        input_faults: InputFaults,
    ) -> None:
        self._names = names
        self._classes = classes
        self._settings = settings
        self._places = places
        self._input_faults = input_faults
        self._depths: deque[sensor_msgs.Image] = deque(maxlen=_PICTURES)
        self._masks: deque[sensor_msgs.Image] = deque(maxlen=_PICTURES)
        self._info: sensor_msgs.CameraInfo | None = None
        self._look: tuple[Look, float] | None = None

    def add_depth(self, picture: sensor_msgs.Image, _: Instant) -> None:
        """Keep a depth picture."""
        self._depths.append(picture)

    def add_mask(self, picture: sensor_msgs.Image, _: Instant) -> None:
        """Keep a mask picture."""
        self._masks.append(picture)

    def set_info(self, info: sensor_msgs.CameraInfo, _: Instant) -> None:
        """Note the calibration."""
        self._info = info

    def replace_look(self, look: Message, now: Instant) -> None:
        """Note a detection frame of one of ``LOOKS``; one that waits is replaced."""
        self._look = LOOKS[type(look)](look), now.mono

    def locate(self, now: float) -> DetectionFrame | None:
        """The detection frame once its depth picture arrived, or is overdue."""
        if self._look is None:
            return None
        look, since = self._look
        stamp = look.header.stamp.seconds
        depth = pictures.nearest(self._depths, stamp, _SAME_PICTURE_S)
        incomplete = depth is None or self._info is None
        if incomplete and now - since < _DEPTH_LATE_S:
            return None
        self._look = None
        if not look.detections:
            return DetectionFrame("", UNKNOWN_ORIGIN, ())
        frame = None if depth is None else self._located(look, depth, now)
        if incomplete:
            self._input_faults.note("no_depth", self._names["detections_2d"], now)
        lost = (class_id_of(one.results, self._classes) for one in look.detections)
        return frame or DetectionFrame("", UNKNOWN_ORIGIN, (), tuple(lost))

    def _located(
        self, look: Look, depth: sensor_msgs.Image, now: float
    ) -> DetectionFrame | None:
        """Boxes of a detection frame; None where nothing of it can be located."""
        stamp = look.header.stamp.seconds
        place = self._places.in_map(depth.header.frame_id, stamp, now)
        if place is None or self._info is None:
            return None
        mask = pictures.nearest(self._masks, stamp, _SAME_PICTURE_S)
        try:
            picture = pictures.read_depth(depth, self._info)
            return pictures.grounded(
                look, picture, mask, place, self._classes, self._settings
            )
        except UnreadableError as error:
            self._input_faults.note(error.reason, self._names["depth"], now)
            return None
