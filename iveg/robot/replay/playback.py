"""A recording at a moment of its own time, independent of the pace it is played at."""

from collections import deque
from collections.abc import Callable, Iterator

from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    LaserScan,
    Odometry,
)
from iveg.robot.replay.logs import RecordingEntry

_READ_AHEAD = 256
"""Entries searched for the next pose; beyond, the last pose is kept."""

_SEEN_FOR_S = 0.4
"""How long (s of the recording) detections count, unless others follow."""
_SILENT_S = 1.0
"""How long a whole frame counts: a detector that then tells none has fallen silent."""
_ONE_PICTURE_S = 0.02
"""Detections within this time (s) are one frame; frames come 30 times a second."""


class Playback:
    """Position in a recording.

    Args:
        open_: Returns the entries from the start; at least one is odometry.
        loop: Starts over at the end.

    Attributes:
        ended: Whether the last entry was played; never with ``loop``.
        has_detector: Whether a detection was read: then none means an empty frame; of
            whole frames, empty ones too, whether one is at most a second old.
        unread: Class of each box of the newest frame that has no place.
    """

    def __init__(
        self, open_: Callable[[], Iterator[RecordingEntry]], *, loop: bool
    ) -> None:
        self._open = open_
        self._loop = loop
        self.ended = False
        self.has_detector = self._is_frame = False
        self._start_over()

    def _start_over(self) -> None:
        self._source = self._open()
        self._ahead: deque[RecordingEntry] = deque()
        self._poses_ahead: deque[tuple[float, Odometry]] = deque()
        self._picture: tuple[Detection, ...] = ()
        self.unread: tuple[str | None, ...] = ()
        self.has_detector = self.has_detector and not self._is_frame
        self._seen_at = 0.0
        self._scan: LaserScan | None = None
        self._read_ahead()
        self._at = self._ahead[0].at if self._ahead else 0.0
        while not self._poses_ahead and self._ahead:
            self._apply(self._ahead.popleft())
            self._read_ahead()
        self._last = self._poses_ahead[0]

    def advance(self, seconds: float) -> None:
        """Advance by ``seconds`` of the recording."""
        self._at += seconds
        while self._ahead and self._ahead[0].at <= self._at:
            self._apply(self._ahead.popleft())
            self._read_ahead()
        age = self._at - self._seen_at
        if age >= (_SILENT_S if self._is_frame else _SEEN_FOR_S):
            self._picture, self.unread = (), ()
            self.has_detector = self.has_detector and not self._is_frame
        if not self._ahead and self._loop:
            self._start_over()
        self.ended = not self._ahead and not self._loop

    def _read_ahead(self) -> None:
        while not self._poses_ahead and len(self._ahead) < _READ_AHEAD:
            entry = next(self._source, None)
            if entry is None:
                return
            self._ahead.append(entry)
            if isinstance(entry.observation, Odometry):
                self._poses_ahead.append((entry.at, entry.observation))

    def _apply(self, entry: RecordingEntry) -> None:
        match entry.observation:
            case Odometry():
                self._last = self._poses_ahead.popleft()
            case LaserScan() as scan:
                self._scan = scan
            case Detection() as detection:
                self.has_detector = True
                self._see(detection, entry.at)
            case DetectionFrame(detections=seen, unread=unread):
                self.has_detector = self._is_frame = True
                self._picture, self.unread, self._seen_at = seen, unread, entry.at

    def _see(self, detection: Detection, at: float) -> None:
        """The newest frame replaces the one before: a walking person counts once."""
        if not self._picture or abs(at - self._seen_at) > _ONE_PICTURE_S:
            self._picture, self._seen_at = (), at
        self._picture = (*self._picture, detection)

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

    @property
    def scan(self) -> LaserScan | None:
        """The newest scan; the same object until the next."""
        return self._scan

    @property
    def detections(self) -> tuple[Detection, ...]:
        """Detections of the newest frame; none when it is too old."""
        return self._picture
