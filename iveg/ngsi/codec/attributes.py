"""The attributes of an entity, one reader each."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from pydantic import ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.kinds import SENSED
from iveg.domain.observations import (
    Climate,
    CommandAnswer,
    CommandStatus,
    DetectionFrame,
    GoalAnswer,
    HeartbeatProbe,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Overtaken,
    RefusedFrame,
    RobotFault,
    SafetyReport,
)
from iveg.ngsi import names, payloads, texts
from iveg.ngsi.codec.boxes import read_frame, read_single_detection
from iveg.ngsi.codec.fields import (
    read_holds,
    read_origin,
    read_stamped,
    refuse_unplaced,
)
from iveg.ngsi.codec.scans import read_scan, read_single_scan
from iveg.ngsi.codec.sensors import read_sensed
from iveg.ngsi.codec.untrusted import ReadResult, first_complaint, merge, unread

Reader = Callable[[str, Mapping[str, object]], Observation]
Readers = Mapping[str, Reader]
NO_OTHERS: Readers = {}
IsPast = Callable[[str, type[Observation], str, int], bool]
"""Whether robot, kind, boot and seq tell that a message cannot be news."""


def read_attributes(
    robot_id: str,
    attributes: Mapping[str, object],
    is_past: IsPast | None = None,
    instead: Readers = NO_OTHERS,
) -> ReadResult:
    """Read every attribute of a robot that the contract knows; skip the others.

    Args:
        robot_id: Whose they are.
        attributes: By name.
        is_past: Tells by its identity what need not be read; None reads all.
        instead: Other readers of some attributes.
    """
    readings = []
    known = attributes.keys() & _READERS.keys()
    # In the order of the table: where a robot is counts for what it sees there.
    for name in sorted(known, key=_RANK.__getitem__):
        if attributes[name] is None:
            continue
        old = (
            None if is_past is None else _overtaken(robot_id, name, attributes, is_past)
        )
        reader = instead.get(name) or _READERS[name]
        readings.append(old or read_one(robot_id, reader, attributes, name))
    return readings[0] if len(readings) == 1 else merge(readings)


def _overtaken(
    robot_id: str, name: str, attributes: Mapping[str, object], is_past: IsPast
) -> ReadResult | None:
    """Remains of a message that is older than its stream; None where it may be new."""
    if name not in _IDENTITY:
        return None
    kind, holder = _IDENTITY[name]
    raw = attributes.get(holder)
    if type(raw) is not dict:
        return None
    boot, seq = raw.get("boot"), raw.get("seq")
    if type(boot) is not str or type(seq) is not int:
        return None
    if not is_past(robot_id, kind, texts.clean_text(boot), seq):
        return None
    try:
        origin = read_origin(payloads.OriginFields.model_validate(raw))
    except ValidationError:
        return None
    return ReadResult((Overtaken(robot_id, origin, kind),))


def read_one(
    source: str, reader: Reader, attributes: Mapping[str, object], name: str = ""
) -> ReadResult:
    """Result of one reader on an entity, or the reason of its failure."""
    try:
        names.refuse_another_robot(source, attributes, name)
        return ReadResult((reader(source, attributes),))
    except ValidationError as error:
        read = unread(source, f"bad_{name or 'entity'}", first_complaint(error))
    except UnreadableError as error:
        read = unread(source, error.reason, error.detail)
    except Exception as error:
        # A value that no bound foresaw is that message's end and nobody else's.
        read = unread(source, f"bad_{name or 'entity'}", repr(error))
    return refused_frame(source, read) if name in _FRAMES else read


def refused_frame(robot_id: str, read: ReadResult) -> ReadResult:
    """A detection frame that cannot be read: a problem, and no empty picture."""
    return replace(read, observations=(RefusedFrame(robot_id),))


def _odometry(robot_id: str, attributes: Mapping[str, object]) -> Odometry:
    refuse_unplaced(attributes[names.ODOMETRY])
    return _odometry_of(
        robot_id, payloads.OdometryValue.model_validate(attributes[names.ODOMETRY])
    )


def _odometry_of(robot_id: str, value: payloads.OdometryValue) -> Odometry:
    return Odometry(
        robot_id,
        read_origin(value),
        Pose2D(value.x, value.y, value.yaw),
        Twist2D(value.linear_velocity, value.angular_velocity),
    )


def _safety(robot_id: str, attributes: Mapping[str, object]) -> SafetyReport:
    value = payloads.SafetyValue.model_validate(attributes[names.SAFETY])
    return SafetyReport(
        robot_id,
        read_origin(value),
        value.speed_factor,
        value.reason,
        value.cause,
        value.decision_id,
        read_holds(value.holds),
        tuple(value.released),
        value.ch,
        value.v,
        value.w,
        value.feedback_age_s,
        tuple(RobotFault(one.code, one.about, one.for_s) for one in value.faults),
        value.peer_scans is True,
    )


def _navigation(robot_id: str, attributes: Mapping[str, object]) -> Navigation:
    value = payloads.NavigationValue.model_validate(attributes[names.NAVIGATION])
    return Navigation(
        robot_id,
        read_origin(value),
        value.task,
        None if value.goal is None else (value.goal.x, value.goal.y),
        tuple((point[0], point[1]) for point in value.path),
    )


def _command_status(robot_id: str, attributes: Mapping[str, object]) -> CommandStatus:
    return CommandStatus(
        robot_id, texts.clean_text(str(attributes[names.COMMAND_STATUS]))
    )


def _command_info(robot_id: str, attributes: Mapping[str, object]) -> CommandAnswer:
    return command_answer(robot_id, {names.COMMAND: attributes[names.COMMAND_INFO]})


def command_answer(robot_id: str, attributes: Mapping[str, object]) -> CommandAnswer:
    """A robot's own answer to a command (docs/interfaces/commands.md)."""
    value = payloads.AnswerValue.model_validate(attributes.get(names.COMMAND))
    return CommandAnswer(
        robot_id,
        read_origin(value),
        value.id,
        value.r,
        read_holds(value.holds),
        value.ch,
        value.v,
        value.why,
        value.attempt,
    )


def _goal_info(robot_id: str, attributes: Mapping[str, object]) -> GoalAnswer:
    return goal_answer(robot_id, {names.GOAL: attributes[names.GOAL_INFO]})


def goal_answer(robot_id: str, attributes: Mapping[str, object]) -> GoalAnswer:
    """A robot's own word of a goal (docs/interfaces/commands.md)."""
    value = payloads.GoalAnswerValue.model_validate(attributes[names.GOAL])
    return GoalAnswer(robot_id, read_origin(value), value.id, value.r, value.why)


def _single_pose(robot_id: str, attributes: Mapping[str, object]) -> Odometry:
    value = payloads.OdometryValue.model_validate(attributes["pose"])
    odometry = _odometry_of(robot_id, value)
    if odometry.origin.stamp is None:
        origin = read_stamped(attributes)
        return Odometry(robot_id, origin, odometry.pose, odometry.twist)
    return odometry


_READERS: Mapping[str, Reader] = {
    names.ODOMETRY: _odometry,
    names.LIDAR: read_scan,
    names.BOXES: read_frame,
    names.SAFETY: _safety,
    names.NAVIGATION: _navigation,
    names.COMMAND_STATUS: _command_status,
    names.COMMAND_INFO: _command_info,
    names.GOAL_INFO: _goal_info,
    "pose": _single_pose,
    "laser_scan": read_single_scan,
    "class": read_single_detection,
    **{one.name: partial(read_sensed, one) for one in SENSED},
}

_FRAMES = frozenset({names.BOXES, "class"})

_RANK = {name: rank for rank, name in enumerate(_READERS)}

_IDENTITY: Mapping[str, tuple[type[Odometry | LaserScan | DetectionFrame], str]] = {
    names.ODOMETRY: (Odometry, names.ODOMETRY),
    names.LIDAR: (LaserScan, names.LIDAR_HEADER),
    names.BOXES: (DetectionFrame, names.BOXES_HEADER),
}
"""Headers that carry the origin (boot, seq) of telemetry."""


def climate(_: str, attributes: Mapping[str, object]) -> Climate:
    """Climate of the greenhouse."""
    value = payloads.ClimateValue.model_validate(dict(attributes))
    return Climate(value.temperature, value.relativeHumidity, value.co2)


def heartbeat(_: str, attributes: Mapping[str, object]) -> HeartbeatProbe:
    """The probe that iVeg sends through the whole chain."""
    return HeartbeatProbe(
        read_origin(payloads.OriginFields.model_validate(attributes["probe"]))
    )
