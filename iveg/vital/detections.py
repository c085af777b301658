"""Detection frames become persons on the map, lines of the log and rows.

A detector sends thirty frames a second, by which a person who stands before a camera
would fill log and disk.  A sighting is logged at its start; the history gets one row in
half a second for each robot and subject (a person, a peer, or all boxes of one class
that are neither), and each detection that a decision rests on
(docs/interfaces/http.md, "Detections that are kept").  Memory has each for a while.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import islice
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
from iveg.domain.tracking.person import Sighting, TrackedPerson
from iveg.domain.tracking.sight import BlindCameras, Look, OwnSight
from iveg.domain.words import HeardWords, meaning_of, name_numbers, plain
from iveg.vital import topics
from iveg.vital.core import Core
from iveg.vital.event_log import EventLog, detection_of
from iveg.vital.record import ODOMETRY_PERIOD_S

_LOGGED_S = 2.0
_MAX_SUBJECTS = 1000
KEPT_EVERY_S = ODOMETRY_PERIOD_S
MOST_DETECTIONS = 5000
"""Two robots that see three objects, at 30 frames a second, fill it in 30 s."""
_MAX_FRAMES = 20
"""Names of unknown frames that are logged, of each robot."""
_KEYS = {
    "alert": "log.detection",
    "faint": "log.detection_faint",
    "other": "log.detection_unmapped",
}


@dataclass(frozen=True, slots=True)
class _Look:
    """One detection with what its row needs; ``is_kept``: it has its row."""

    one: Placed
    frame: DetectionFrame
    received: Received
    is_kept: bool


class KeptDetections:
    """Chooses the detections that become rows.

    A look is remembered while it is the newest of a chain of sightings, because a robot
    may enter the zone of a person seconds after they were seen.
    """

    def __init__(self, event_log: EventLog) -> None:
        self._event_log = event_log
        self._kept_at: dict[tuple[str, str], float] = {}
        self._looks: dict[tuple[str, str], Sequence[_Look]] = {}

    def look(
        self, one: Placed, subject: str, frame: DetectionFrame, received: Received
    ) -> None:
        """Keep a detection if one of its subject is due, and remember it."""
        key, now = (frame.robot_id, subject), received.at.mono
        # Frames come at 10 or 30 Hz: half a frame early must not wait a whole one.
        is_due = now - self._kept_at.get(key, -1e9) >= 0.95 * KEPT_EVERY_S
        if not is_due and one.person is None:
            return
        look = _Look(one, frame, received, is_kept=is_due)
        if is_due:
            self._kept_at[key] = now
            self._record(look)
        if one.person is not None:
            alive = one.person.sightings
            before = self._looks.get(key, ())
            self._looks[key] = [
                *(old for old in before if _is_among(old, alive)),
                look,
            ]

    def keep_evidence(self, person_id: str, sighting: Sighting) -> None:
        """Keep the detection that a decision rests on, unless it has its row."""
        key = sighting.observer, person_id
        looks = self._looks.get(key, ())
        # The newest first: twins of two transports are told apart by nothing.
        for look in reversed(looks):
            if _is_of(look, sighting):
                if not look.is_kept:
                    self._record(look)
                self._looks[key] = [
                    replace(one, is_kept=True) if one is look else one for one in looks
                ]
                return

    def forget(self, now: Instant) -> None:
        """Forget subjects who are gone."""
        if len(self._kept_at) > _MAX_SUBJECTS:
            self._kept_at = {
                key: at
                for key, at in self._kept_at.items()
                if now.mono - at < LIMITS.zone_lasts_s
            }
            self._looks = {
                key: looks for key, looks in self._looks.items() if key in self._kept_at
            }

    def _record(self, look: _Look) -> None:
        self._event_log.detection(look.one, look.frame, look.received)


def _is_among(look: _Look, sightings: Sequence[Sighting]) -> bool:
    return any(_is_of(look, one) for one in sightings)


def _is_of(look: _Look, sighting: Sighting) -> bool:
    """Whether a sighting is of this detection; of one without a place its confidence.

    A doubtful position is its observer's own (``Sighting``).
    """
    one = look.one
    x, y, z = one.position
    is_there = bool(sighting.reach_m) or (sighting.x, sighting.y, sighting.z) == (
        x,
        y,
        z,
    )
    is_same = one.detection.probability == sighting.confidence
    return is_same and is_there and look.frame.robot_id == sighting.observer


class JudgedDetection(NamedTuple):
    """A detection, the frame that it came in and how that came; its row is made later.

    Making every row at once would cost the rule loop what nobody may ask for.
    """

    one: Placed
    frame: DetectionFrame
    received: Received


class NewestDetections:
    """The last detections of the whole fleet; the oldest gives way."""

    def __init__(self) -> None:
        self._newest: deque[JudgedDetection] = deque(maxlen=MOST_DETECTIONS)

    def note(self, one: Placed, frame: DetectionFrame, received: Received) -> None:
        """Remember one detection."""
        self._newest.append(JudgedDetection(one, frame, received))

    def rows(
        self, admits: Callable[[JudgedDetection], bool], most: int
    ) -> tuple[DetectionRecord, ...]:
        """At most so many of those that are admitted, newest first."""
        admitted = filter(admits, reversed(self._newest))
        return tuple(detection_of(*one) for one in islice(admitted, most))


class DetectionTracking:
    """Takes the detection frames of the fleet.

    Attributes:
        placed: What each robot's newest look found, faint ones included.
        other: When the newest confident object of another class came, by robot.
        kept: Chooses the detections that become rows.
        newest: Each detection of the last moments.
    """

    def __init__(self, core: Core) -> None:
        self.placed: dict[str, list[Placed]] = {}
        self.other: dict[str, Instant] = {}
        self.kept = KeptDetections(core.event_log)
        self.newest = NewestDetections()
        self._world, self._people = core.world, core.people
        self._greenhouse = core.greenhouse
        self._own_sight = OwnSight(core.greenhouse)
        self._blind = BlindCameras(core.greenhouse)
        self._event_log, self._new_id = core.event_log, core.ports.new_id
        self._tell = core.supervision.tell
        self._logged_at: dict[tuple[str, str], float] = {}
        self._unknown_frames: dict[str, set[str]] = {}

    @property
    def subjects(self) -> int:
        """Number of persons whose last log line is remembered."""
        return len(self._logged_at)

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
            self._world.counters["pictures.not_judged"] += 1
            detector.note_flaw("overload", received.at)
            return
        frame = name_numbers(frame, robot.description.classes)
        name = frame.detector or robot_id
        rule = rule.also_naming(self._world.word_answers.persons(name))
        frame = detector.bounded(frame, rule)
        words = self._hear_words(frame, name, rule)
        placed = self._look(frame, received, rule, seen_at)
        turned_away, unplaced = self._people.turned_away, self._people.unplaced
        if turned_away:
            self._world.counters["people.turned_away"] += turned_away
        if unplaced:
            self._world.counters["people.unplaced"] += unplaced
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
        for person in self._own_sight.take(look, self._people):
            self._log_clear(person, at)

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

        lists_people = any(rule.class_of(one) == "person" for one in listed)
        said = [(one.class_id, one.probability) for one in frame.detections]
        said += [(one, 1.0) for one in frame.unread if one is not None]
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
        for one in placed:
            self._describe(one, frame, received)
        if any(one.person is not None for one in placed):
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

    def _describe(self, one: Placed, frame: DetectionFrame, received: Received) -> None:
        at, robot_id = received.at, frame.robot_id
        subject = one.peer or (one.person.person_id if one.person else "")
        subject = subject or f"{one.kind}:{one.detection.class_id}"
        self.kept.look(one, subject, frame, received)
        self.newest.note(one, frame, received)
        last = self._logged_at.get((robot_id, subject))
        if one.kind == "other":
            self.other[robot_id] = at
        if last is not None and at.mono - last < _LOGGED_S:
            return
        self._logged_at[robot_id, subject] = at.mono
        if last is None or at.mono - last >= 2 * _LOGGED_S:
            self._event_log.log(_line(one, robot_id, subject), at)

    def witness(self, report: SafetyReport, at: Instant) -> bool:
        """Track who walks near a robot of today by its own laser; whether one does."""
        if report.obstacle is None or self._world.robot(report.robot_id).is_replay:
            return False
        one = self._people.witness(report, at, self._new_id())
        self._tell("obstacle_reported", report, at)
        if one is not None:
            self._event_log.changed(topics.PEOPLE.name)
            if one.first_seen == at:
                self._event_log.log(_walker_line(one, report.robot_id), at)
        return one is not None

    def _log_clear(self, person: TrackedPerson, now: Instant) -> None:
        self._event_log.changed(topics.PEOPLE.name)
        newest = person.newest
        if person.sightings or person.stage(now) == "seen":
            return
        lane = self._greenhouse.lane_at(newest.x, newest.y) or ""
        slots = {"person": person.person_id, "lane": lane}
        self._event_log.log(
            LogEvent("detection", "log.person_cleared", slots, None, person.class_), now
        )

    def forget(self, now: Instant) -> None:
        """Forget log lines and rows about persons who are gone."""
        self.kept.forget(now)
        if len(self._logged_at) > _MAX_SUBJECTS:
            self._logged_at = {
                key: at
                for key, at in self._logged_at.items()
                if now.mono - at < LIMITS.zone_lasts_s
            }


def _walker_line(one: TrackedPerson, robot_id: str) -> LogEvent:
    place = {"x": round(one.newest.x, 2), "y": round(one.newest.y, 2)}
    slots: dict[str, Slot] = {"robot": robot_id, "person": one.person_id, **place}
    return LogEvent("detection", "log.walker", slots, robot_id, one.class_)


def _line(one: Placed, robot_id: str, subject: str) -> LogEvent:
    x, y, _ = one.position
    slots: dict[str, Slot] = {
        "robot": robot_id,
        "class": one.class_ or one.detection.class_id,
        "class_id": one.detection.class_id,
        "confidence": one.detection.probability,
        "x": round(x, 2),
        "y": round(y, 2),
        "person": subject,
    }
    key, looks = _KEYS[one.kind], one.looks
    if one.doubtful is not None:
        key = "log.detection_doubtful"
    elif one.possible and looks is not None:
        key = "log.detection_possible"
        slots |= {
            "looks": looks.count,
            "least": looks.least,
            "most": looks.most,
            "over": looks.over_s,
            "probability": round(looks.probability, 4),
        }
    return LogEvent("detection", key, slots, robot_id, one.class_)
