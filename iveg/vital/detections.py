"""Detection frames become persons on the map, lines of the log and rows of history.

A detector sends thirty frames a second.  With all of them, a person who stands before a
camera would fill log and disk.  A sighting is logged at its start.  The history gets a
row each half second for each robot and subject: a person, a peer, or all other boxes
with the same verdict (docs/interfaces/http.md, "Detections that are kept").  Memory has
each detection for a while.
"""

from collections import deque
from collections.abc import Callable
from itertools import islice
from math import inf
from typing import NamedTuple

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import judge_frame
from iveg.domain.events import LogEvent, Slot
from iveg.domain.limits import LIMITS
from iveg.domain.observations import DetectionFrame, Instant, Received, SafetyReport
from iveg.domain.records import DetectionRecord
from iveg.domain.stream_order import Freshness
from iveg.domain.tracking.people import Placed
from iveg.domain.tracking.sight import BlindCameras, Look, OwnSight
from iveg.domain.tracking.tracker import TrackedPerson
from iveg.vital import topics
from iveg.vital.core import Core
from iveg.vital.event_log import detection_of
from iveg.vital.record import ODOMETRY_PERIOD_S

_NEW_AFTER_S = 4.0
"""Gap after which a subject that comes back gets a new line in the log (s)."""
# Frames come at 10 or 30 Hz: one that is half a frame early must not wait for the next.
_KEPT_EVERY_S = 0.95 * ODOMETRY_PERIOD_S
MOST_DETECTIONS = 5000
"""Two robots that see three objects, at 30 frames a second, fill it in 30 s."""
_MAX_FRAMES = 20
"""Most names of unknown frames that are logged for each robot."""
_Subject = tuple[str, str]
"""A robot, and the subject that it saw."""
_KEYS = {
    "alert": "log.detection",
    "faint": "log.detection_faint",
    "other": "log.detection_unmapped",
}


class JudgedDetection(NamedTuple):
    """A detection with its frame and receipt; its row is made on request.

    Rows of all detections at once would cost the rule loop time, and nobody reads most.
    """

    placed: Placed
    frame: DetectionFrame
    received: Received


class NewestDetections:
    """Newest detections of the whole fleet; the oldest gives way."""

    def __init__(self) -> None:
        self._newest: deque[JudgedDetection] = deque(maxlen=MOST_DETECTIONS)

    def note(self, placed: Placed, frame: DetectionFrame, received: Received) -> None:
        """Remember one detection."""
        self._newest.append(JudgedDetection(placed, frame, received))

    def rows(
        self, admits: Callable[[JudgedDetection], bool], most: int
    ) -> tuple[DetectionRecord, ...]:
        """Rows of the newest admitted detections, newest first, ``most`` at most."""
        admitted = filter(admits, reversed(self._newest))
        return tuple(detection_of(*judged) for judged in islice(admitted, most))


class DetectionTracking:
    """Takes the detection frames of the fleet.

    Attributes:
        placed: Detections in each robot's newest frame, faint ones included.
        other: Receipt of the newest confident object of another class, by robot.
        newest: Each detection of the last moments.
    """

    def __init__(self, core: Core) -> None:
        self.placed: dict[str, list[Placed]] = {}
        self.other: dict[str, Instant] = {}
        self.newest = NewestDetections()
        self._world, self._people = core.world, core.people
        self._own_sight = OwnSight(core.greenhouse)
        self._blind = BlindCameras(core.greenhouse)
        self._event_log, self._new_id = core.event_log, core.ports.new_id
        self._tell = core.supervision.tell
        self._kept_at: dict[_Subject, float] = {}
        """Receipt of the detection in a subject's newest row (monotonic, s)."""
        self._unknown_frames: dict[str, set[str]] = {}

    def track_frame(
        self,
        frame: DetectionFrame,
        received: Received,
        freshness: Freshness,
        rule: DetectionRule,
    ) -> None:
        """Track people in a new frame, or in another that still protects somebody.

        A frame that is later than a zone lasts protects nobody.
        """
        robot_id, robot = frame.robot_id, self._world.robot(frame.robot_id)
        detector = robot.detector
        seen_at = robot.sighted_at or received.at
        is_young = received.at.mono - seen_at.mono <= LIMITS.zone_lasts_s
        if freshness == "duplicate" or (freshness != "new" and not is_young):
            return
        # A frame that is not judged counts as a flaw: somebody may be in it.
        if not detector.admits_frame(received.at):
            detector.note_flaw("overload", received.at)
            return
        judged = judge_frame(
            frame, rule, robot.description.classes, self._world.word_answers
        )
        placed = self._people.sight(judged, robot, self._world, seen_at, self._new_id())
        self._describe(placed, judged.frame, received)
        flaw = detector.take_frame(
            judged,
            self._people.turned_away,
            self._people.unplaced,
            has_pose=robot.odometry is not None,
        )
        if flaw is not None:
            detector.note_flaw(flaw, received.at)
        elif freshness == "new":
            # A late frame is no evidence of the detector's work now.
            detector.note_whole(robot.detections_at)
        look = Look.from_frame(robot, judged.frame, placed, received.at)
        # Blindness is judged first: a blind camera ends no zone.
        if robot.description.has_detector and not robot.is_replay:
            self._blind.take(look, self._people, self._world)
        if self._own_sight.take(look, self._people):
            self._event_log.changed(topics.PEOPLE.name)
        self._tell("frame_taken", frame, seen_at, received.at)
        if freshness == "new":
            self.placed[robot_id] = placed
            self._event_log.changed(topics.DETECTIONS.for_id(robot_id))

    def _describe(
        self, placed: list[Placed], frame: DetectionFrame, received: Received
    ) -> None:
        """Log frames of reference that are unknown, and keep and log detections."""
        for name in self._people.unknown_frames:
            self._name_unknown_frame(frame.robot_id, name, received.at)
        for box in placed:
            self._keep(box, frame, received)
        if any(box.person is not None for box in placed):
            self._event_log.changed(topics.PEOPLE.name)

    def _name_unknown_frame(self, robot_id: str, frame_id: str, at: Instant) -> None:
        """Count a frame that nobody described; log it once for each robot."""
        self._world.counters["detections.unknown_frame"] += 1
        named = self._unknown_frames.setdefault(robot_id, set())
        if frame_id in named or len(named) >= _MAX_FRAMES:
            return
        named.add(frame_id)
        slots = {"robot": robot_id, "frame": frame_id}
        self._event_log.log(
            LogEvent("detection", "log.unknown_frame", slots, robot_id), at
        )

    def _keep(self, placed: Placed, frame: DetectionFrame, received: Received) -> None:
        """Remember a detection; write its row and line at the pace of its subject."""
        at, robot_id = received.at, frame.robot_id
        self.newest.note(placed, frame, received)
        if placed.kind == "other":
            self.other[robot_id] = at
        subject = robot_id, _subject_name(placed)
        since_s = at.mono - self._kept_at.get(subject, -inf)
        if since_s < _KEPT_EVERY_S:
            return
        self._kept_at[subject] = at.mono
        if since_s >= _NEW_AFTER_S:
            self._event_log.log(_line(placed, *subject), at)
        self._event_log.detection(placed, frame, received)

    def track_obstacle(self, report: SafetyReport, at: Instant) -> bool:
        """Track a walking obstacle of a live robot's laser; returns whether it did."""
        if report.obstacle is None or self._world.robot(report.robot_id).is_replay:
            return False
        person = self._people.track_obstacle(report, at, self._new_id())
        self._tell("obstacle_reported", report, at)
        if person is not None:
            self._event_log.changed(topics.PEOPLE.name)
            if person.first_seen == at:
                self._event_log.log(_laser_line(person, report.robot_id), at)
        return person is not None

    def forget(self, now: Instant) -> None:
        """Forget subjects without a row for longer than a zone lasts."""
        gone = [
            subject
            for subject, at in self._kept_at.items()
            if now.mono - at > LIMITS.zone_lasts_s
        ]
        for subject in gone:
            del self._kept_at[subject]


def _subject_name(placed: Placed) -> str:
    """Subject of a detection: a person, a peer, or all with the same verdict."""
    if placed.person is not None:
        return placed.person.person_id
    return placed.peer or f"{placed.kind}:{placed.class_ or ''}"


def _laser_line(person: TrackedPerson, robot_id: str) -> LogEvent:
    place = {"x": round(person.newest.x, 2), "y": round(person.newest.y, 2)}
    slots: dict[str, Slot] = {"robot": robot_id, "person": person.person_id, **place}
    return LogEvent("detection", "log.walker", slots, robot_id, person.class_)


def _line(placed: Placed, robot_id: str, subject: str) -> LogEvent:
    x, y, _ = placed.position
    slots: dict[str, Slot] = {
        "robot": robot_id,
        "class": placed.class_ or placed.detection.class_id,
        "class_id": placed.detection.class_id,
        "confidence": placed.detection.probability,
        "x": round(x, 2),
        "y": round(y, 2),
        "person": subject,
    }
    key, looks = _KEYS[placed.kind], placed.looks
    if placed.doubtful is not None:
        key = "log.detection_doubtful"
    elif placed.possible and looks is not None:
        key = "log.detection_possible"
        slots |= {
            "looks": looks.count,
            "least": looks.least,
            "most": looks.most,
            "over": looks.over_s,
            "probability": round(looks.probability, 4),
        }
    return LogEvent("detection", key, slots, robot_id, placed.class_)
