"""Detection frames become persons on the map, lines of the log and rows.

A detector sends thirty frames a second, by which a person who stands before a camera
would fill log and disk.  A sighting is logged at its start; the history gets one row in
half a second for each robot and subject: a person, a peer, or all boxes that are
neither and are judged alike (docs/interfaces/http.md, "Detections that are kept").
Memory has each for a while.
"""

from collections import deque
from collections.abc import Callable
from itertools import islice
from math import inf
from typing import NamedTuple

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import flaw_of
from iveg.domain.events import LogEvent, Slot
from iveg.domain.limits import LIMITS
from iveg.domain.observations import DetectionFrame, Instant, Received, SafetyReport
from iveg.domain.records import DetectionRecord
from iveg.domain.robot_state import RobotState
from iveg.domain.stream_order import OrderVerdict
from iveg.domain.tracking.people import Placed
from iveg.domain.tracking.person import TrackedPerson
from iveg.domain.tracking.sight import BlindCameras, Look, OwnSight
from iveg.domain.words import HeardWords, meaning_of, name_numbers, plain
from iveg.vital import topics
from iveg.vital.core import Core
from iveg.vital.event_log import detection_of
from iveg.vital.record import ODOMETRY_PERIOD_S

_NEW_AFTER_S = 4.0
"""Whoever comes back after so long is another sighting, and a line of the log."""
# Frames come at 10 or 30 Hz: half a frame early must not wait a whole one.
_KEPT_EVERY_S = 0.95 * ODOMETRY_PERIOD_S
MOST_DETECTIONS = 5000
"""Two robots that see three objects, at 30 frames a second, fill it in 30 s."""
_MAX_FRAMES = 20
"""Names of unknown frames that are logged, of each robot."""
_Subject = tuple[str, str]
"""A robot, and what it saw."""
_KEYS = {
    "alert": "log.detection",
    "faint": "log.detection_faint",
    "other": "log.detection_unmapped",
}


class JudgedDetection(NamedTuple):
    """A detection, the frame that it came in and how that came; its row is made later.

    Making every row at once would cost the rule loop what nobody may ask for.
    """

    found: Placed
    frame: DetectionFrame
    received: Received


class NewestDetections:
    """The last detections of the whole fleet; the oldest gives way."""

    def __init__(self) -> None:
        self._newest: deque[JudgedDetection] = deque(maxlen=MOST_DETECTIONS)

    def note(self, found: Placed, frame: DetectionFrame, received: Received) -> None:
        """Remember one detection."""
        self._newest.append(JudgedDetection(found, frame, received))

    def rows(
        self, admits: Callable[[JudgedDetection], bool], most: int
    ) -> tuple[DetectionRecord, ...]:
        """At most so many of those that are admitted, newest first."""
        admitted = filter(admits, reversed(self._newest))
        return tuple(detection_of(*judged) for judged in islice(admitted, most))


class DetectionTracking:
    """Takes the detection frames of the fleet.

    Attributes:
        placed: What each robot's newest look found, faint ones included.
        other: When the newest confident object of another class came, by robot.
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
        """When a subject's newest row was made (monotonic, s)."""
        self._unknown_frames: dict[str, set[str]] = {}

    def track_frame(
        self,
        frame: DetectionFrame,
        received: Received,
        verdict: OrderVerdict,
        rule: DetectionRule,
    ) -> None:
        """Track who is in a frame; a late one may still protect, Orion's answer not.

        A frame that is later than a zone lives protects nobody, and would only show
        ghosts.
        """
        robot_id, robot = frame.robot_id, self._world.robot(frame.robot_id)
        detector, has_pose = robot.detector, robot.odometry is not None
        seen_at = robot.sighted_at or received.at
        late = verdict == "late" and not received.asked
        protects = late and received.at.mono - seen_at.mono <= LIMITS.zone_lasts_s
        if verdict != "new" and not protects:
            return
        if not detector.admits_frame(received.at):
            detector.note_flaw("overload", received.at)
            return
        frame = name_numbers(frame, robot.description.classes)
        name = frame.detector or robot_id
        rule = rule.also_naming(self._world.word_answers.persons(name))
        words = self._hear_words(frame, name, rule)
        placed = self._look(frame, received, rule, seen_at)
        turned_away, unplaced = self._people.turned_away, self._people.unplaced
        flaw = flaw_of(frame, rule, turned_away, unplaced, has_pose=has_pose)
        if flaw is None and words.is_strange:
            flaw = "strange"
        if flaw is not None:
            detector.note_flaw(flaw, received.at)
        elif verdict == "new":
            detector.note_whole(robot.detections_at)
        self._compare(robot, frame, placed, received.at)
        self._tell("frame_taken", frame, seen_at, received.at)
        if verdict == "new":
            self.placed[robot_id] = placed
            self._event_log.changed(topics.DETECTIONS.of(robot_id))

    def _compare(
        self,
        robot: RobotState,
        frame: DetectionFrame,
        placed: list[Placed],
        at: Instant,
    ) -> None:
        """Hold a frame against known people: somebody is gone, or it is blind."""
        look = Look.of_frame(robot, frame, placed, at)
        if robot.description.has_detector and not robot.is_replay:
            self._blind.take(look, self._people, self._world)
        if self._own_sight.take(look, self._people):
            self._event_log.changed(topics.PEOPLE.name)

    def _hear_words(
        self, frame: DetectionFrame, name: str, rule: DetectionRule
    ) -> HeardWords:
        """Note which words of a frame anybody understands, and ask of the others."""
        robot, answers = self._world.robot(frame.robot_id), self._world.word_answers
        listed = robot.description.classes

        def is_known(word: str) -> bool:
            return (
                rule.class_of(word) is not None
                or meaning_of(word) is not None
                or word in self._world.robots
                or answers.is_person(name, word) is not None
            )

        lists_people = any(rule.class_of(word) == "person" for word in listed)
        said = [
            (detection.class_id, detection.probability)
            for detection in frame.detections
        ]
        said += [(word, 1.0) for word in frame.unread if word is not None]
        heard = robot.detector.words_of(name)
        heard.hear(
            [lists_people, *(is_known(word) for word, _ in said)],
            [
                plain(word)
                for word, probability in said
                if probability >= rule.threshold.every
                and not is_known(word)
                and not (lists_people and word in listed)
            ],
        )
        return heard

    def _look(
        self,
        frame: DetectionFrame,
        received: Received,
        rule: DetectionRule,
        seen_at: Instant,
    ) -> list[Placed]:
        placed = self._people.sight(frame, self._world, rule, seen_at, self._new_id())
        for name in self._people.unknown_frames:
            self._name_unknown_frame(frame.robot_id, name, received.at)
        for found in placed:
            self._describe(found, frame, received)
        if any(found.person is not None for found in placed):
            self._event_log.changed(topics.PEOPLE.name)
        return placed

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

    def _describe(
        self, found: Placed, frame: DetectionFrame, received: Received
    ) -> None:
        """Remember a detection, and keep and log it as often as it is worth."""
        at, robot_id = received.at, frame.robot_id
        self.newest.note(found, frame, received)
        if found.kind == "other":
            self.other[robot_id] = at
        subject = robot_id, _name_of(found)
        since_s = at.mono - self._kept_at.get(subject, -inf)
        if since_s < _KEPT_EVERY_S:
            return
        self._kept_at[subject] = at.mono
        self._event_log.detection(found, frame, received)
        if since_s >= _NEW_AFTER_S:
            self._event_log.log(_line(found, *subject), at)

    def witness(self, report: SafetyReport, at: Instant) -> bool:
        """Track who walks near a robot of today by its own laser; whether one does."""
        if report.obstacle is None or self._world.robot(report.robot_id).is_replay:
            return False
        walker = self._people.witness(report, at, self._new_id())
        self._tell("obstacle_reported", report, at)
        if walker is not None:
            self._event_log.changed(topics.PEOPLE.name)
            if walker.first_seen == at:
                self._event_log.log(_walker_line(walker, report.robot_id), at)
        return walker is not None

    def forget(self, now: Instant) -> None:
        """Forget subjects who are gone."""
        gone = [
            subject
            for subject, at in self._kept_at.items()
            if now.mono - at > LIMITS.zone_lasts_s
        ]
        for subject in gone:
            del self._kept_at[subject]


def _name_of(found: Placed) -> str:
    """The subject of a detection: a peer, a person, or all that is judged alike."""
    if found.person is not None:
        return found.person.person_id
    return found.peer or f"{found.kind}:{found.class_ or ''}"


def _walker_line(walker: TrackedPerson, robot_id: str) -> LogEvent:
    place = {"x": round(walker.newest.x, 2), "y": round(walker.newest.y, 2)}
    slots: dict[str, Slot] = {"robot": robot_id, "person": walker.person_id, **place}
    return LogEvent("detection", "log.walker", slots, robot_id, walker.class_)


def _line(found: Placed, robot_id: str, subject: str) -> LogEvent:
    x, y, _ = found.position
    slots: dict[str, Slot] = {
        "robot": robot_id,
        "class": found.class_ or found.detection.class_id,
        "class_id": found.detection.class_id,
        "confidence": found.detection.probability,
        "x": round(x, 2),
        "y": round(y, 2),
        "person": subject,
    }
    key, looks = _KEYS[found.kind], found.looks
    if found.doubtful is not None:
        key = "log.detection_doubtful"
    elif found.possible and looks is not None:
        key = "log.detection_possible"
        slots |= {
            "looks": looks.count,
            "least": looks.least,
            "most": looks.most,
            "over": looks.over_s,
            "probability": round(looks.probability, 4),
        }
    return LogEvent("detection", key, slots, robot_id, found.class_)
