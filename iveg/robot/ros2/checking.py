"""``iveg robot check``: endpoints on DDS, missing ones, and bypasses of the gate.

Without I/O: from a few seconds of observed traffic it derives the report that an
operator needs before the robot moves.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.drive import message_of
from iveg.robot.ros2.lookout import deafness
from iveg.robot.ros2.topics import TOPICS, sensed_topics
from iveg.robot.ros2.transforms import NoTransformError, TransformBuffer
from iveg.robot.ros2.verdict import CheckRow, CheckVerdict
from iveg.ros2.names import Endpoint, Qos
from iveg.ros2.type_hash import definition, type_hash

_NEEDED = ("odometry", "tf")
_WANTED = ("scan",)
_LEAST_HZ = {"odometry": 5.0, "scan": 2.0, "tf": 2.0}


@dataclass(slots=True)
class Heard:
    """Messages received on one topic.

    Attributes:
        count: Number of messages.
        unreadable: Number that could not be read.
        age_s: Age of the newest by its stamp, on our clock (s); None: unstamped.
        frame: Frame of the newest.
    """

    count: int = 0
    unreadable: int = 0
    age_s: float | None = None
    frame: str = ""


def judge(
    config: RobotConfig,
    endpoints: Sequence[Endpoint],
    heard: Mapping[str, Heard],
    transforms: TransformBuffer,
    *,
    seconds: float,
    stamp: float,
    broker: str | None,
    robot_id: str = "",
) -> CheckVerdict:
    """Evaluate a few seconds of observed traffic.

    Args:
        config: Names of the robot's topics.
        endpoints: Readers and writers on DDS.
        heard: Received messages by topic key.
        transforms: Received transforms.
        seconds: Duration of the check (s).
        stamp: Newest stamp of odometry (s), at which transforms are looked up; 0:
            without odometry, at the newest transform.
        broker: Reason why the MQTT broker cannot be reached; None: it can.
        robot_id: The robot; its own gate may run beside the check.
    """
    names = config.full_topics
    out = names["cmd_vel_out"]
    gates = {one.gate for one in endpoints if one.writes and one.topic == out}
    gate = robot_id if robot_id in gates else ""
    others = [
        one for one in endpoints if not one.own and not (gate and one.gate == gate)
    ]
    rows, missing = [], [] if broker is None else [broker]
    if not others:
        missing.append(
            f"Nobody speaks ROS 2 on DDS domain {config.domain}: is ROS_DOMAIN_ID "
            "right, and does multicast pass (else name peers)?"
        )
    for topic, name in sensed_topics(names).items():
        row, faults = _row(topic, name, config, others, heard, seconds)
        rows.append(row)
        missing += faults if others else []
    chain, broken = _chain(config, heard, transforms, stamp or transforms.newest)
    missing += broken if others else []
    missing += _drive(config, others) if others else []
    missing += _unnamed_detectors(names, others)
    return CheckVerdict(tuple(rows), chain, tuple(missing), gate)


def _row(
    topic: str,
    name: str,
    config: RobotConfig,
    others: Sequence[Endpoint],
    heard: Mapping[str, Heard],
    seconds: float,
) -> tuple[CheckRow, list[str]]:
    writers = [one for one in others if one.topic == name and one.writes]
    fitting = [one for one in writers if TOPICS[topic].form(one.type)]
    one = heard.get(topic, Heard())
    rate = one.count / seconds
    asked = config.qualities[topic]
    deaf = [writer for writer in fitting if not asked.hears(writer.qos)]
    missing = _complaints(topic, name, writers)
    remark = ""
    if deaf:
        remark = "QoS mismatch"
        mismatch, key = _mismatch(asked, deaf[0].qos)
        missing.append(f"{name}: {mismatch}; qos.{topic}.{key} = false.")
    elif fitting and one.unreadable:
        remark = "unreadable"
        missing.append(f"{name}: {one.unreadable} messages of another layout.")
    elif fitting and rate < _LEAST_HZ.get(topic, 0.0):
        remark = "slow"
        missing.append(f"{name} has a publisher and comes {rate:.1f} times a second.")
    kind = writers[0].type if writers else TOPICS[topic].message.ROS
    return CheckRow(name, kind, len(writers), rate, one.age_s, remark), missing


def _complaints(
    topic: str,
    name: str,
    writers: Sequence[Endpoint],
) -> list[str]:
    kinds = sorted({one.type for one in writers})
    if len(kinds) > 1:
        return [f"{name} is published as {' and as '.join(kinds)}: one may be right."]
    if writers:
        return _foreign(topic, name, writers[0])
    if topic in _NEEDED + _WANTED:
        need = "without it the robot stands" if topic in _NEEDED else "if it has one"
        return [f"Nobody publishes {name} ({TOPICS[topic].message.ROS}): {need}."]
    return []


def _foreign(topic: str, name: str, writer: Endpoint) -> list[str]:
    """A type that is not read, or one of the same name with other fields."""
    there, form = writer.type_hash, TOPICS[topic].form(writer.type)
    if form is None:
        suffix = f" ({there})" if there else ""
        known = " or ".join(one.ROS for one in TOPICS[topic].forms)
        return [f"{name} is {writer.type}{suffix}, not {known}."]
    if there in ("", type_hash(form)):
        return []
    return [
        f"{name} is another {writer.type}: {there} there, {type_hash(form)} here "
        f"({definition(form)})."
    ]


def _mismatch(asked: Qos, offered: Qos) -> tuple[str, str]:
    """What does not match, and the key of ``qos`` that would."""
    if asked.reliable and not offered.reliable:
        return "asked for reliably, published best effort", "reliable"
    return "asked for transient local, published volatile", "transient_local"


def _unnamed_detectors(
    names: Mapping[str, str], others: Iterable[Endpoint]
) -> list[str]:
    """Detectors on topics that the file does not name, unless it names a live one."""
    written = {one.topic for one in others if one.writes}
    keys = "detections_3d", "detections_2d"
    if any(names[key] in written for key in keys):
        return []
    found = {one.topic: one.type for one in others if one.writes}
    return [
        f"{topic} is a detector's ({kind}): topics.{' or topics.'.join(fitting)}."
        for topic, kind in sorted(found.items())
        if (fitting := [key for key in keys if TOPICS[key].form(kind)])
    ]


def _chain(
    config: RobotConfig,
    heard: Mapping[str, Heard],
    transforms: TransformBuffer,
    stamp: float,
) -> tuple[str, list[str]]:
    frames = config.frames
    wanted = [frames.odom, frames.base_link]
    laser = heard.get("scan", Heard()).frame
    if laser:
        wanted.append(laser)
    missing: dict[str, None] = {}
    for inner in wanted:
        try:
            transforms.lookup(frames.map, inner, stamp)
        except NoTransformError as error:
            missing[f"TF: {error}."] = None
    names = " → ".join(reversed(transforms.chain(laser or frames.base_link)))
    return names, list(missing)


def _drive(config: RobotConfig, others: Iterable[Endpoint]) -> list[str]:
    names, drive = config.full_topics, config.drive
    cmd_vel_in, cmd_vel_out = names["cmd_vel_in"], names["cmd_vel_out"]
    found: list[str] = []
    by: dict[tuple[str, bool], list[Endpoint]] = {}
    for one in others:
        by.setdefault((one.topic, one.writes), []).append(one)
    for one in by.get((cmd_vel_out, True), [])[:1]:
        who = f"The gate of {one.gate}" if one.gate else "Somebody else"
        found.append(
            f"{who} publishes {cmd_vel_out}: only the gate may, remap it to "
            f"{cmd_vel_in}."
        )
    base = by.get((cmd_vel_out, False), [])
    if not base:
        found.append(f"Nobody listens on {cmd_vel_out}: is the base running?")
    if by.get((cmd_vel_in, False)):
        found.append(
            f"Somebody listens on {cmd_vel_in} beside the gate: a base that does "
            "goes round it."
        )
    wishes = by.get((cmd_vel_in, True), [])
    if not wishes:
        found.append(f"Nobody publishes {cmd_vel_in}: is navigation running?")
    wanted = message_of(stamped=drive.stamped_out).ROS
    if base and all(one.type != wanted for one in base):
        found.append(f"{cmd_vel_out} is {base[0].type} there: drive.stamped_out.")
    offered = config.qualities["cmd_vel_out"]
    fitting = [one for one in base if one.type == wanted]
    said = [
        deafness(one, message_of(stamped=drive.stamped_out), offered) for one in fitting
    ]
    if fitting and all(said):
        found.append(f"{cmd_vel_out}, offered → asked: {said[0]}; qos.cmd_vel_out.")
    given = message_of(stamped=drive.stamped_in).ROS
    if wishes and all(one.type != given for one in wishes):
        found.append(f"{cmd_vel_in} is {wishes[0].type} there: drive.stamped_in.")
    return found
