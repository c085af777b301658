"""Which topics of a bag are read, and why the others are not."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from iveg.robot.replay.bag_files import BagFile, BagTopic
from iveg.robot.ros2.detectors import BOXES, LOOKS
from iveg.ros2 import geometry_msgs, nav_msgs, sensor_msgs
from iveg.ros2.schema import Message
from iveg.ros2.type_hash import type_hash

DETECTORS: tuple[type[Message], ...] = tuple(dict.fromkeys((*BOXES, *LOOKS)))
_PREFERRED: tuple[tuple[type[Message], ...], ...] = (
    tuple(one for one in BOXES if one not in LOOKS),
    tuple(one for one in BOXES if one in LOOKS),
    tuple(one for one in LOOKS if one not in BOXES),
)
"""Detectors of one row exclude each other."""
_FORMS: tuple[type[Message], ...] = (
    nav_msgs.Odometry,
    sensor_msgs.LaserScan,
    geometry_msgs.TFMessage,
    sensor_msgs.Image,
    sensor_msgs.CameraInfo,
    *DETECTORS,
)
_LONGEST = 160


@dataclass(frozen=True, slots=True)
class BagOptions:
    """How a bag is read.

    Attributes:
        odometry: Topic to read; None takes the only one of its type; ``scan`` likewise.
        detections: Likewise, boxes with depth before those without.
        depth: Depth picture for boxes without; None takes the only picture whose
            topic names depth.
        camera_info: Of the depth picture; None takes the one beside it.
        bag_time: A bag is timed by its recording times, not by sensor stamps.
    """

    odometry: str | None = None
    scan: str | None = None
    bag_time: bool = False
    detections: str | None = None
    depth: str | None = None
    camera_info: str | None = None


AS_RECORDED = BagOptions()
"""The only topic of each type, by sensor stamps."""


@dataclass(frozen=True, slots=True)
class Use:
    """What a topic is read as, in which type."""

    topic: BagTopic
    role: str
    form: type[Message]


class BagPlan:
    """Uses of all topics of a bag.

    Args:
        file: The bag.
        options: Topics that are named.

    Raises:
        DataFileError: its topics leave open which is meant.
    """

    def __init__(self, file: BagFile, options: BagOptions) -> None:
        self._file = file
        self._uses: dict[BagTopic, Use] = {}
        self._whys: dict[BagTopic, str] = {}
        self._choose("odometry", (nav_msgs.Odometry,), options.odometry, "--odom-topic")
        self._choose("scan", (sensor_msgs.LaserScan,), options.scan, "--scan-topic")
        for one in self._of(geometry_msgs.TFMessage):
            self._use(one, "tf_static" if one.name.endswith("tf_static") else "tf")
        if not file.is_ros1:
            self._choose_detector(options)

    @property
    def read(self) -> Mapping[str, Use]:
        """Uses of the topics that are read, by name."""
        return {topic.name: use for topic, use in self._uses.items()}

    def has(self, *roles: str) -> bool:
        """Whether a topic is read as one of these."""
        return any(use.role in roles for use in self._uses.values())

    def table(self) -> list[str]:
        """One line a topic: name, type, messages, and what becomes of it."""
        rows = [
            (one.name, one.type, str(one.count), self._fate(one))
            for one in self._file.topics
        ]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]

    def _fate(self, topic: BagTopic) -> str:
        if topic in self._uses:
            return self._uses[topic].role
        return f"ignored: {self._whys.get(topic) or self._why(topic)}"

    # --- choices ------------------------------------------------------------------

    def _of(self, *forms: type[Message]) -> list[BagTopic]:
        kinds = {one.ROS for one in forms}
        return [one for one in self._file.topics if one.type in kinds]

    def _choose(
        self,
        role: str,
        forms: Sequence[type[Message]],
        wanted: str | None,
        option: str,
    ) -> Use | None:
        """Choose the topic of a role; None where there is none.

        Raises:
            DataFileError: several, or the named one is not there.
        """
        found, chosen = self._of(*forms), self._named(forms, wanted, option)
        if len(chosen) > 1:
            reason = f"{option} must name one of those of {self._there(forms)}"
            raise self._file.unusable(reason)
        others = [one for one in found if one not in chosen]
        self._whys |= dict.fromkeys(others, f"{option} names another")
        return self._use(chosen[0], role) if chosen else None

    def _named(
        self, forms: Sequence[type[Message]], wanted: str | None, option: str
    ) -> list[BagTopic]:
        """Topics of these types, or the one that is named.

        Raises:
            DataFileError: that one is not there.
        """
        named = [one for one in self._of(*forms) if wanted in (None, one.name)]
        if wanted is not None and not named:
            reason = f"{option} {wanted} is not among those of {self._there(forms)}"
            raise self._file.unusable(reason)
        return named

    def _there(self, forms: Sequence[type[Message]]) -> str:
        names = ", ".join(sorted({one.name for one in self._of(*forms)})) or "none"
        return f"{' or '.join(one.ROS for one in forms)}: {names}"

    def _use(self, topic: BagTopic, role: str) -> Use | None:
        """Read a topic, unless its type has other fields under the same name."""
        form = next(one for one in _FORMS if topic.type == one.ROS)
        if topic.type_hash not in ("", type_hash(form)):
            self._whys[topic] = f"another definition, {topic.type_hash}"
            return None
        return self._uses.setdefault(topic, Use(topic, role, form))

    def _choose_detector(self, options: BagOptions) -> None:
        """Boxes with depth first; those without need a depth picture and its camera."""
        wanted, option = options.detections, "--detections-topic"
        kinds = _PREFERRED if wanted is None else (DETECTORS,)
        choices = (self._choose("detections", one, wanted, option) for one in kinds)
        chosen = next((one for one in choices if one is not None), None)
        for other in self._of(*DETECTORS):
            if other not in self._uses:
                self._whys.setdefault(other, "another detector is read")
        if chosen is None or chosen.form not in LOOKS or self._take_depth(options):
            return
        if chosen.form not in BOXES:
            del self._uses[chosen.topic]
            self._whys[chosen.topic] = (
                "boxes in a picture; no --depth-topic with its --camera-info-topic"
            )

    def _take_depth(self, options: BagOptions) -> bool:
        """Take the depth picture and its camera; whether both are there."""
        depth = [
            one
            for one in self._named((sensor_msgs.Image,), options.depth, "--depth-topic")
            if options.depth or "depth" in one.name.lower()
        ]
        wanted, option = options.camera_info, "--camera-info-topic"
        cameras = self._named((sensor_msgs.CameraInfo,), wanted, option)
        if len(depth) != 1:
            return False
        beside = f"{depth[0].name.rpartition('/')[0]}/camera_info"
        info = [one for one in cameras if one.name == beside] or cameras
        if len(info) != 1:
            return False
        taken = self._use(depth[0], "depth"), self._use(info[0], "camera_info")
        return None not in taken

    def _why(self, topic: BagTopic) -> str:
        if topic.type in {one.ROS for one in DETECTORS}:
            return "of ROS 1 only odometry, scans and transforms are read"
        if topic.type in {
            one.ROS for one in (sensor_msgs.Image, sensor_msgs.CameraInfo)
        }:
            return "no boxes need it"
        fields = _fields(topic.definition)
        return f"of no use here{fields}"


def _fields(definition: str) -> str:
    """Fields of a type as the recorder wrote them down, without those within."""
    own = definition.partition("=" * 80)[0].splitlines()
    words = [" ".join(line.partition("#")[0].split()) for line in own]
    said = ", ".join(word for word in words if word)
    if not said or "IDL:" in said:
        return ""
    return f" ({said if len(said) <= _LONGEST else said[:_LONGEST] + '…'})"
