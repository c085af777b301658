"""Detection frames become persons on the map and lines of the log.

A sighting is logged at its start, so that a person who stands before a camera for an
hour does not fill the log.
"""

from collections.abc import Callable, Iterator

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import flaw_of
from iveg.domain.events import LogEvent, Slot
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import DetectionFrame, Instant, Received, SafetyReport
from iveg.domain.robot_state import RobotState
from iveg.domain.stream_order import OrderVerdict
from iveg.domain.tracking.people import People, Placed
from iveg.domain.tracking.person import TrackedPerson
from iveg.domain.tracking.sight import BlindCameras, Look, OwnSight
from iveg.domain.words import HeardWords, meaning_of, name_numbers, plain
from iveg.domain.world import World
from iveg.vital import topics
from iveg.vital.event_log import EventLog
from iveg.vital.kept_detections import KeptDetections
from iveg.vital.newest_detections import NewestDetections
from iveg.vital.ports import Ids

_LOGGED_S = 2.0
_MAX_SUBJECTS = 1000
_MAX_FRAMES = 20
"""Names of unknown frames that are logged, of each robot."""
_KEYS = {
    "alert": "log.detection",
    "faint": "log.detection_faint",
    "other": "log.detection_unmapped",
}


class DetectionTracking:
    """Takes the detection frames of the fleet.

    Attributes:
        placed: What each robot's newest look found, faint ones included.
        other: When the newest confident object of another class came, by robot.
        taken: Comfort, called with each frame that is judged, its source moment, and
            when it came.
        witnessed: The same with each report of an obstacle.
        kept: Chooses the detections that become rows.
        newest: Each detection of the last moments.
    """

    def __init__(
        self,
        world: World,
        people: People,
        greenhouse: Greenhouse,
        event_log: EventLog,
        new_id: Ids,
    ) -> None:
        self.placed: dict[str, list[Placed]] = {}
        self.other: dict[str, Instant] = {}
        self.taken: Callable[[DetectionFrame, Instant, Instant], None] = lambda *_: None
        self.witnessed: Callable[[SafetyReport, Instant], None] = lambda *_: None
        self.kept = KeptDetections(event_log)
        self.newest = NewestDetections()
        self._world = world
        self._people = people
        self._greenhouse = greenhouse
        self._own_sight, self._blind = OwnSight(greenhouse), BlindCameras(greenhouse)
        self._event_log = event_log
        self._new_id = new_id
        self._logged_at: dict[tuple[str, str], float] = {}
        self._unknown_frames: dict[str, set[str]] = {}

    @property
    def subjects(self) -> int:
        """Number of persons whose last log line is remembered."""
        return len(self._logged_at)

    def people_of(self, robot_id: str) -> Iterator[str]:
        """Ids of those whom a robot's newest look found."""
        for one in self.placed.get(robot_id, ()):
            if one.person is not None:
                yield one.person.person_id

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
        self.taken(frame, seen_at, received.at)
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
        slots: dict[str, Slot] = {"robot": robot_id, "frame": frame_id}
        line = LogEvent("detection", "log.unknown_frame", slots, robot_id)
        self._event_log.log(line, at)

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
        self.witnessed(report, at)
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
        slots: dict[str, Slot] = {
            "person": person.person_id,
            "lane": self._greenhouse.lane_at(newest.x, newest.y) or "",
        }
        line = LogEvent("detection", "log.person_cleared", slots, None, person.class_)
        self._event_log.log(line, now)

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
    slots: dict[str, Slot] = {
        "robot": robot_id,
        "person": one.person_id,
        "x": round(one.newest.x, 2),
        "y": round(one.newest.y, 2),
    }
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
