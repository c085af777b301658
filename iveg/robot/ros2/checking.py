"""Faults that show in the endpoints on DDS: of a running gate, and ``robot check``."""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from iveg.domain.observations import RobotFault
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.outputs import message_of
from iveg.robot.ros2.reading import InputFaults
from iveg.robot.ros2.topics import TOPICS, sensed_topics
from iveg.ros2.cdr import type_hash
from iveg.ros2.messages import Message
from iveg.ros2.names import Endpoint, Qos

# --- lookout ----------------------------------------------------------------------
#
# Faults of a running gate that show in the endpoints of others.
#
# Without I/O: endpoints and times (monotonic, s) are arguments.

_BASE_JOINS_WITHIN_S = 5.0


class Lookout:
    """Notes faults of the endpoints of others.

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
        self._unread_since = now

    def look(self, endpoints: Iterable[Endpoint], now: float) -> None:
        """Judge the endpoints of this moment."""
        for code, about in self._faults([end for end in endpoints if not end.own], now):
            self._input_faults.note(code, about, now)

    def _faults(
        self, others: Sequence[Endpoint], now: float
    ) -> Iterator[tuple[str, str]]:
        """Code of each fault, and its topic."""
        out, offered = self._names["cmd_vel_out"], self._config.quality("cmd_vel_out")
        at_drive = [end for end in others if end.topic == out]
        if any(end.writes for end in at_drive):
            yield "second_publisher", out
        # A base that does not receive the gate's twists obeys no STOP either (R5).
        readers = [end for end in at_drive if not end.writes]
        message = message_of(stamped=self._config.drive.stamped_out)
        for reader in readers:
            if difference := mismatch(reader, message, offered):
                yield "drive_unheard", f"{out}: {difference}"
        if readers:
            self._unread_since = now
        elif now - self._unread_since > _BASE_JOINS_WITHIN_S:
            yield "drive_unheard", out
        for topic, name in sensed_topics(self._names).items():
            for kind in {end.type for end in others if end.writes_to(name)}:
                if TOPICS[topic].form(kind) is None:
                    yield "wrong_type", f"{name}: {kind.replace('/msg/', '/')}"


def mismatch(reader: Endpoint, message: type[Message], offered: Qos) -> str:
    """Difference that keeps a writer from a reader, offer → request; empty without."""
    if reader.type != message.ROS:
        return f"{_short(message.ROS)} → {_short(reader.type)}"
    return reader.qos.lacks(offered)


def _short(ros_type: str) -> str:
    return ros_type.rpartition("/")[2]


# --- checking ---------------------------------------------------------------------
#
# ``iveg robot check``: a list of topics, and the faults of each.
#
# Without I/O: a few seconds of the gate's own inputs, and the endpoints on DDS.

_LEAST_HZ = {"odometry": 5.0, "tf": 2.0, "scan": 2.0, "camera_info": 0.3}
_LEAST_HZ |= dict.fromkeys(("detections_3d", "detections_2d", "depth"), 1.0)
"""Rates below which a topic is called slow."""
_DETECTORS = "detections_3d", "detections_2d"


@dataclass(frozen=True, slots=True)
class CheckRow:
    """One line of the table; ``verdict`` is empty where nothing is wrong."""

    topic: str
    type: str = ""
    writers: int = 0
    rate_hz: float = 0.0
    qos: str = ""
    frame: str = ""
    verdict: str = ""


Traffic = tuple[float, str]
"""Rate of a topic's messages (Hz), and the frame of the newest."""


def judge(
    config: RobotConfig,
    endpoints: Iterable[Endpoint],
    traffic: Mapping[str, Traffic],
    faults: Iterable[RobotFault],
    *,
    robot_id: str,
    has_detector: bool,
) -> tuple[CheckRow, ...]:
    """Evaluate a few seconds; the robot's own gate may run beside the check.

    Args:
        config: Names of the robot's topics.
        endpoints: Readers and writers on DDS.
        traffic: Messages by topic key.
        faults: Present faults of the gate's inputs.
        robot_id: The robot.
        has_detector: The fleet file says so.
    """
    names = config.full_topics
    others = [end for end in endpoints if not end.own and end.gate != robot_id]
    noted = InputFaults()
    Lookout(config, noted, -math.inf).look(others, 0.0)
    verdicts: defaultdict[str, list[str]] = defaultdict(list)
    for fault in (*faults, *noted.faults(0.0)):
        about, _, detail = fault.about.partition(": ")
        verdicts[about].append(f"{fault.code} ({detail})" if detail else fault.code)
    needed = _needed(names, others, has_detector=has_detector)
    drive = {key: names[key] for key in ("cmd_vel_in", "cmd_vel_out")}
    rows = []
    for topic, name in (sensed_topics(names) | drive).items():
        on_topic = [end for end in others if end.topic == name]
        ends = [end for end in on_topic if end.writes != (topic == "cmd_vel_out")]
        rate_hz, frame = traffic.get(topic, (0.0, ""))
        complaint = _badness(topic, config, ends, rate_hz, topic in needed)
        if topic == "cmd_vel_in" and len(on_topic) > len(ends):
            complaint = "somebody listens beside the gate: a base would go round it"
        rows.append(
            _row(name, ends, rate_hz, frame, complaint, *verdicts.pop(name, ()))
        )
    rows += [CheckRow(about, verdict=", ".join(v)) for about, v in verdicts.items()]
    return *rows, *_unnamed(names, others)


def _needed(
    names: Mapping[str, str], others: Sequence[Endpoint], *, has_detector: bool
) -> set[str]:
    """Keys of topics without which the robot cannot work."""
    published = {end.topic for end in others if end.writes}
    needed = {"odometry", "tf", "scan", "cmd_vel_in"}
    if has_detector and not any(names[key] in published for key in _DETECTORS):
        needed.add("detections_3d" if names["detections_3d"] else "detections_2d")
    if names["detections_2d"] in published:
        needed |= {"depth", "camera_info"}
    return needed


def _row(
    name: str, ends: Sequence[Endpoint], rate_hz: float, frame: str, *said: str
) -> CheckRow:
    kinds = " and ".join(sorted({end.type for end in ends}))
    qos = " and ".join(sorted({str(end.qos) for end in ends}))
    verdict = ", ".join(dict.fromkeys(filter(None, said)))
    return CheckRow(name, kinds, len(ends), rate_hz, qos, frame, verdict)


def _badness(
    topic: str,
    config: RobotConfig,
    ends: Sequence[Endpoint],
    rate_hz: float,
    needed: bool,
) -> str:
    """Fault by endpoints and rate, beside those of ``Lookout``; or empty."""
    row, twist = TOPICS[topic], message_of(stamped=config.drive.stamped_in)
    if not ends:
        return f"nobody publishes it ({row.message.ROS})" if needed else ""
    if topic == "cmd_vel_out":
        return ""
    if topic == "cmd_vel_in" and twist.ROS not in {end.type for end in ends}:
        return f"not {twist.ROS}: drive.stamped_in"
    for end in ends:
        form = row.form(end.type)
        if form and end.type_hash not in ("", type_hash(form)):
            return f"other fields: {end.type_hash} there, {type_hash(form)} here"
        if config.quality(topic).lacks(end.qos):
            return f"another quality of service is asked for: qos.{topic}"
    if rate_hz < _LEAST_HZ.get(topic, 0.0):
        return "slow" if rate_hz else "silent"
    return ""


def _unnamed(names: Mapping[str, str], others: Sequence[Endpoint]) -> list[CheckRow]:
    """Detectors on topics that the file does not name, unless it names a live one."""
    writers = {end.topic: end for end in others if end.writes}
    if any(names[key] in writers for key in _DETECTORS):
        return []
    return [
        _row(topic, [end], 0.0, "", f"a detector's: topics.{' or topics.'.join(keys)}")
        for topic, end in sorted(writers.items())
        if (keys := [key for key in _DETECTORS if TOPICS[key].form(end.type)])
    ]


def lines(rows: Sequence[CheckRow]) -> list[str]:
    """The table as text."""
    table = [("topic", "type", "n", "Hz", "QoS", "frame", "verdict")]
    for row in rows:
        verdict = row.verdict or ("ok" if row.writers else "-")
        count, rate = (f"{row.writers}", f"{row.rate_hz:.1f}") if row.type else ("", "")
        table.append((row.topic, row.type, count, rate, row.qos, row.frame, verdict))
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in table]
