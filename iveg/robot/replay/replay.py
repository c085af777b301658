"""Replays recorded runs as robots: the safety node decides the speed of the playback.

The node's drive output is the pace of the log: full speed plays it as recorded, a limit
of 0.5 at half the pace, a hold pauses it, and the replayed robot then reports a
standstill.  Poses between two recorded ones are interpolated, because a safety node
requires odometry more often than logs have it.  While the log pauses, the newest scan
and detections are repeated, as the sensors of a robot at rest do.
"""

import asyncio
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from iveg.adapters import clock
from iveg.domain.errors import DataFileError
from iveg.domain.fleet import NOBODY, FleetDescription, RobotProfile
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.observations import (
    DetectionFrame,
    LaserScan,
    Navigation,
    Odometry,
    Origin,
)
from iveg.robot.node import NodeSettings, RobotNode, every
from iveg.robot.replay.bags import Bag, NamedTopics
from iveg.robot.replay.logs import LogReader, OwnRecording, RecordingEntry, is_own

# --- playback ---------------------------------------------------------------------
#
# A recording at a moment of its own time, independent of the pace it is played at.

_READ_AHEAD = 256
"""Entries searched for the next pose; beyond, the last pose is kept."""

_SILENT_S = 1.0
"""Time that a frame counts (s): a detector without one since is silent."""


class Playback:
    """Position in a recording.

    Args:
        open_: Returns the entries from the start; at least one is odometry.
        loop: Starts over at the end.

    Attributes:
        ended: Whether the last entry was played; never with ``loop``.
        scan: The newest scan; the same object until the next.
        frame: The newest detection frame; None while the detector is silent.
    """

    def __init__(
        self, open_: Callable[[], Iterator[RecordingEntry]], *, loop: bool
    ) -> None:
        self._open = open_
        self._loop = loop
        self.ended = False
        self._start_over()

    def _start_over(self) -> None:
        self._source = self._open()
        self._upcoming: deque[RecordingEntry] = deque()
        self._poses_ahead: deque[tuple[float, Odometry]] = deque()
        self.frame: DetectionFrame | None = None
        self._frame_at = 0.0
        self.scan: LaserScan | None = None
        self._read_ahead()
        self._at = self._upcoming[0].at if self._upcoming else 0.0
        # Up to the first pose: without it there is no motion to report.
        while not self._poses_ahead and self._upcoming:
            self._apply(self._upcoming.popleft())
            self._read_ahead()
        self._last = self._poses_ahead[0]

    def advance(self, seconds: float) -> None:
        """Advance by ``seconds`` of the recording."""
        self._at += seconds
        while self._upcoming and self._upcoming[0].at <= self._at:
            self._apply(self._upcoming.popleft())
            self._read_ahead()
        if self._at - self._frame_at >= _SILENT_S:
            self.frame = None
        if not self._upcoming and self._loop:
            self._start_over()
        self.ended = not self._upcoming and not self._loop

    def _read_ahead(self) -> None:
        while not self._poses_ahead and len(self._upcoming) < _READ_AHEAD:
            entry = next(self._source, None)
            if entry is None:
                return
            self._upcoming.append(entry)
            if isinstance(entry.observation, Odometry):
                self._poses_ahead.append((entry.at, entry.observation))

    def _apply(self, entry: RecordingEntry) -> None:
        match entry.observation:
            case Odometry():
                self._last = self._poses_ahead.popleft()
            case LaserScan() as scan:
                self.scan = scan
            case DetectionFrame() as frame:
                self.frame, self._frame_at = frame, entry.at

    # --- sensor values at this moment ---------------------------------------------

    @property
    def motion(self) -> tuple[Pose2D, Twist2D]:
        """Pose and speeds, interpolated between two recorded poses."""
        at, last = self._last
        if not self._poses_ahead or self._poses_ahead[0][0] <= at:
            return last.pose, last.twist
        then, following = self._poses_ahead[0]
        part = min(max((self._at - at) / (then - at), 0.0), 1.0)
        twist = Twist2D(
            last.twist.linear_x
            + part * (following.twist.linear_x - last.twist.linear_x),
            last.twist.angular_z
            + part * (following.twist.angular_z - last.twist.angular_z),
        )
        return last.pose.interpolate(following.pose, part), twist


# --- recordings -------------------------------------------------------------------
#
# Recordings of any format as entries in time: logs of JSON lines, ROS bags, iVeg's.

AS_RECORDED: NamedTopics = {}
"""The only topic of each type."""
_LOGS, _BAGS = (".jsonl", ".gz"), (".db3", ".mcap")


Recording = Callable[[], Iterator[RecordingEntry]]
"""Plays one recorded run of one robot from the start; at least one entry is odometry.
It raises DataFileError when the recording is truncated."""


def open_recording(
    path: Path,
    mount: Pose2D,
    named: NamedTopics = AS_RECORDED,
) -> Recording:
    """Open a recording by its file name.

    Args:
        path: ``.jsonl``, ``.jsonl.gz``, ``.db3``, ``.mcap``, or a directory;
            of iVeg's own recordings also ``FILE.mcap#ROBOT``.
        mount: Pose of a bag's laser in ``base_link``; logs contain it.
        named: Topics of a bag to read, by role.

    Raises:
        DataFileError: unknown format, unreadable file, or no odometry.
    """
    recording = _opened(path, mount, named)
    if not any(isinstance(entry.observation, Odometry) for entry in recording()):
        raise DataFileError(str(path), "", "holds no odometry that can be used.")
    return recording


def _opened(path: Path, mount: Pose2D, named: NamedTopics) -> Recording:
    stem, _, robot_id = str(path).partition(".mcap#")
    own = Path(f"{stem}.mcap") if robot_id else path
    if own.suffix == ".mcap" and is_own(own):
        return OwnRecording(own, robot_id or None).entries
    if robot_id and own.is_file():
        reason = (
            "is no recording of iVeg's that can be read, so # names no robot in it."
        )
        raise DataFileError(str(own), "", reason)
    if path.is_dir() or path.suffix in _BAGS:
        return Bag(path, named, mount).entries
    if path.suffix in _LOGS:
        return LogReader(path).entries
    known = ", ".join((*_LOGS[:1], ".jsonl.gz", *_BAGS))
    reason = f"is none of {known}, and no directory of a bag."
    raise DataFileError(str(path), "", reason)


# --- replay -----------------------------------------------------------------------

TASK = "replay"
"""Task of a replayed robot; iVeg recognises replays by the mark of their messages."""

_PERIOD_S = 0.05
_SCAN_AGAIN_S = 0.5
_LOOK_EVERY_S = 0.2
_NAVIGATION_EVERY_S = 1.0
_LONGEST_STEP_S = 0.2
_STANDS_AT_END_S = 2.0


@dataclass(frozen=True, slots=True)
class ReplaySettings:
    """Settings shared by all replayed robots of a run.

    Attributes:
        speed: Pace; 2 is twice as fast as recorded.
        loop: Starts over at the end.
        frame: Map frame of all recordings; None: each has a frame of its own, and its
            detections slow no other robot.
    """

    node: NodeSettings
    speed: float = 1.0
    loop: bool = False
    frame: str | None = None


async def run_replay(
    files: Sequence[Path],
    robots: Sequence[str],
    settings: ReplaySettings,
    *,
    named: NamedTopics = AS_RECORDED,
    fleet: FleetDescription = NOBODY,
) -> None:
    """Play recordings until all have ended; with ``loop`` for ever.

    Args:
        files: One recording a robot.
        robots: Their ids, in the order of the files.
        settings: Those of all robots.
        named: Topics of ROS bags to read, by role.
        fleet: Fleet description.

    Raises:
        DataFileError: files and robots do not match, or a file cannot be used.
    """
    _check(files, robots)
    replayed = []
    for file, robot_id in zip(files, robots, strict=True):
        profile = fleet.of_robot(robot_id).profile
        recording = open_recording(file, profile.laser, named)
        playback = Playback(recording, loop=settings.loop)
        replayed.append(ReplayedRobot(robot_id, profile, playback, settings))
    try:
        await _play(replayed)
    except BaseExceptionGroup as group:
        broken = _file_error(group)
        if broken is None:
            raise
        raise broken from group


async def _play(replayed: "Sequence[ReplayedRobot]") -> None:
    async with asyncio.TaskGroup() as tasks:
        playing = [
            tasks.create_task(robot.run(), name=f"replay-{robot.robot_id}")
            for robot in replayed
        ]
        for robot in replayed:
            await robot.ended.wait()
        for task in playing:
            task.cancel()


def _check(files: Sequence[Path], robots: Sequence[str]) -> None:
    if len(files) != len(robots) or not files:
        reason = f"{len(files)} files for {len(robots)} robots: each robot needs one."
        raise DataFileError("replay", "", reason)
    if len(set(robots)) != len(robots):
        raise DataFileError("replay", "", "a robot is named twice.")


def _file_error(group: BaseExceptionGroup[BaseException]) -> DataFileError | None:
    """The first error about a file among those that ended the tasks."""
    error: BaseException | None = group.subgroup(DataFileError)
    while isinstance(error, BaseExceptionGroup):
        error = error.exceptions[0]
    return error if isinstance(error, DataFileError) else None


# --- one replayed robot -----------------------------------------------------------


class ReplayedRobot:
    """One recording under its own safety node."""

    def __init__(
        self,
        robot_id: str,
        profile: RobotProfile,
        playback: Playback,
        settings: ReplaySettings,
    ) -> None:
        self.robot_id = robot_id
        self.ended = asyncio.Event()
        self._playback = playback
        self._speed, self._profile = settings.speed, profile
        self._sent_at = dict.fromkeys((LaserScan, DetectionFrame, Navigation), -1e9)
        self._sent_scan: LaserScan | None = None
        self._command, self._pace, self._stood_s = REST, 0.0, 0.0
        self._node = RobotNode(
            robot_id,
            replace(settings.node, replay=settings.frame or robot_id),
            profile=profile,
            drive=self._drive,
        )

    async def run(self) -> None:
        """Play until cancelled; ``ended`` is set when the recording is over."""
        # A recording has no crew that could lift its boot hold.
        self._node.release_locally()
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._node.run(), name=f"node-{self.robot_id}")
            await every(_PERIOD_S, self._step)

    def _drive(self, command: Twist2D) -> None:
        self._command = command

    def _step(self, dt: float) -> None:
        node, dt = self._node, min(dt, _LONGEST_STEP_S)
        full = Twist2D(self._profile.max_speed, 0.0)
        node.request_twist(
            full if node.machine.may_drive and not self._playback.ended else REST
        )
        self._pace = self._slowed(self._command.linear_x, dt)
        self._playback.advance(self._pace * self._speed * dt)
        if self._playback.ended:
            self._pace = 0.0
            self._stood_s += dt
        if self._stood_s >= _STANDS_AT_END_S:
            self.ended.set()
        self._tell(clock.mono())

    def _slowed(self, command: float, dt: float) -> float:
        """The pace, 0 to 1: it falls no faster than the robot's brakes allow."""
        wanted = max(0.0, command / self._profile.max_speed)
        braking = self._profile.braking / self._profile.max_speed
        return max(wanted, self._pace - braking * dt)

    def _tell(self, now: float) -> None:
        pose, twist = self._playback.motion
        rate = self._pace * self._speed
        moving = Twist2D(twist.linear_x * rate, twist.angular_z * rate)
        self._node.sense(Odometry(self.robot_id, Origin(), pose, moving))
        if self._is_due(Navigation, _NAVIGATION_EVERY_S, now):
            self._node.sense(Navigation(self.robot_id, Origin(), TASK))
        scan = self._playback.scan
        is_new = scan is not self._sent_scan
        if scan and (is_new or self._is_due(LaserScan, _SCAN_AGAIN_S, now)):
            self._sent_scan, self._sent_at[LaserScan] = scan, now
            self._node.sense(scan)
        frame = self._playback.frame
        if frame is not None and self._is_due(DetectionFrame, _LOOK_EVERY_S, now):
            boxes, unread = frame.detections, frame.unread
            self._node.sense(DetectionFrame(self.robot_id, Origin(), boxes, unread))

    def _is_due(self, kind: type, period: float, now: float) -> bool:
        if now - self._sent_at[kind] < period:
            return False
        self._sent_at[kind] = now
        return True
