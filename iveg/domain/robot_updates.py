"""Updates of one robot's state by the newest observation of each kind."""

from iveg.domain.feedback import HALF_SPEED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    CommandAnswer,
    CommandStatus,
    DetectionFrame,
    GoalAnswer,
    Instant,
    LaserScan,
    Navigation,
    Odometry,
    Origin,
    Received,
    SafetyReport,
    UnreadScan,
)
from iveg.domain.robot_state import RobotState, Sensed


def learn_kind(robot: RobotState, received: Received, origin: Origin) -> None:
    """Learn of a recording which frame it is in, and whether it is none at all.

    Orion's answer may be of a time when the robot was live; a safety node that speaks
    now is live unless it says that it plays a recording.
    """
    if robot.description.kind == "live" or received.asked:
        return
    if origin.replay is not None:
        robot.map_frame = origin.replay
    elif isinstance(received.observation, SafetyReport | CommandAnswer):
        robot.live_at = received.at.mono


def apply_newest(robot: RobotState, received: Received, moment: float | None) -> None:
    """Take the newest of its kind in; ``moment`` is when it was measured, or None."""
    observation, at = received.observation, received.at
    if isinstance(observation, Odometry | SafetyReport) and not received.asked:
        robot.note_heard(at.mono if moment is None else moment)
    match observation:
        case Odometry():
            _drive(robot, observation, at, moment)
        case LaserScan() | UnreadScan():
            robot.scan, robot.scan_received = observation, dated(at, moment)
            robot.scan_pose = robot.pose_at_stamp(observation.origin.own_s)
        case DetectionFrame():
            _see(robot, observation, received, moment)
        case SafetyReport():
            _hear(robot, observation, received, moment)
        case Navigation():
            robot.navigation, robot.navigation_received = observation, at
        case CommandStatus():
            robot.command_status = observation.status
        case CommandAnswer() | GoalAnswer():
            pass  # an event: the machine of its command takes it
        case _:
            robot.sensed[type(observation)] = Sensed(observation, dated(at, moment))


def _see(
    robot: RobotState, frame: DetectionFrame, received: Received, moment: float | None
) -> None:
    """Take the newest detection frame in."""
    robot.detections_at = _not_before(
        robot.detections_at, robot.frame, frame.origin, moment
    )
    robot.frame, robot.frame_transport = frame, received.transport
    if frame.detections:
        robot.unlabelled = any(one.frame_id is None for one in frame.detections)


def _hear(
    robot: RobotState, report: SafetyReport, received: Received, moment: float | None
) -> None:
    """Take the newest safety report in."""
    known = robot.safety_received
    before = None if known is None else known.mono
    moment = _not_before(before, robot.safety, report.origin, moment)
    was_limited = robot.safety and robot.safety.speed_factor <= HALF_SPEED
    if was_limited and report.speed_factor > HALF_SPEED:
        robot.freed_at = received.at.mono
    robot.safety, robot.safety_received = report, dated(received.at, moment)


def _drive(
    robot: RobotState, odometry: Odometry, at: Instant, moment: float | None
) -> None:
    """Take the newest odometry in."""
    origin, pose, before = odometry.origin, odometry.pose, robot.odometry
    moment = _not_before(robot.pose_at, before, origin, moment)
    robot.pose_at = moment
    robot.unproven_since = _since(robot.unproven_since, at, holds=moment is None)
    robot.estimated_since = _since(
        robot.estimated_since, at, holds=not origin.acknowledgements
    )
    if before is not None and not (robot.trusted_pose and robot.doubts.is_open(at)):
        robot.trusted_pose = before.pose
    heard = robot.odometry_received
    if heard is None or at.mono - heard.mono > LIMITS.silence_s:
        robot.alive_since = at.mono
    robot.odometry, robot.odometry_received = odometry, at
    if before is not None and before.origin.boot != origin.boot:
        robot.forget_poses()  # another boot counts its seconds anew
    robot.remember_pose(at.wall if origin.own_s is None else origin.own_s, pose)
    likely = at.mono if moment is None else moment
    robot.remember_speed(likely, odometry.twist.linear_x)


def _since(before: float | None, at: Instant, *, holds: bool) -> float | None:
    """When something began that holds now (monotonic, s)."""
    if not holds:
        return None
    return at.mono if before is None else before


def _not_before(
    known: float | None,
    before: Odometry | DetectionFrame | SafetyReport | None,
    origin: Origin,
    moment: float | None,
) -> float | None:
    """The moment of the newest message, which was measured after the one before it.

    That holds within a boot, and where messages are counted.
    """
    if known is None or before is None:
        return moment
    if origin.seq is None or origin.boot is None or origin.boot != before.origin.boot:
        return moment
    return known if moment is None else max(known, moment)


def dated(at: Instant, moment: float | None) -> Instant | None:
    """A monotonic moment on both clocks."""
    return None if moment is None else at.later(moment - at.mono)
