"""A small greenhouse with robots and people, moved by hand."""

from dataclasses import dataclass, field, replace

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import JudgedFrame, judge_frame
from iveg.domain.feedback import SpeedLimit
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    Navigation,
    Origin,
    Received,
    ReportedObstacle,
)
from iveg.domain.rule.judge import SpeedLimits
from iveg.domain.rule.zones import LimitChange
from iveg.domain.tracking.people import People, Placed
from iveg.domain.tracking.sight import BlindCameras, Look, OwnSight
from iveg.domain.tracking.tracker import TrackedPerson
from iveg.domain.world import World
from tests.builders import (
    at,
    detection,
    detection_frame,
    fleet_of,
    odometry,
    origin,
    received,
    safety_report,
)

FIELD = Greenhouse("field", Rectangle(-100, -100, 100, 100))
HEDGE = Greenhouse(
    "hedge", Rectangle(-100, -100, 100, 100), rows=(Rectangle(2.9, -50, 3.1, 50),)
)


@dataclass
class Scene:
    """World, people and speed limits on one clock.

    Attributes:
        robots: As ``IVEG_ROBOTS`` names them, recordings included.
        now: Seconds since the start.
        replay: The map frame by which every message is marked.
    """

    robots: tuple[str, ...] = ("AGI", "AGII")
    greenhouse: Greenhouse = FIELD
    rule: DetectionRule = field(default_factory=DetectionRule)
    now: float = 0.0
    replay: str | None = None
    changes: list[LimitChange] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.world = World(fleet_of(*self.robots))
        self.people = People(self.greenhouse)
        self.speed_limits = SpeedLimits(self.greenhouse)
        self.own_sight = OwnSight(self.greenhouse)
        self.blind = BlindCameras(self.greenhouse)
        self.ended: list[TrackedPerson] = []
        self._seq = 0

    # --- what robots say ----------------------------------------------------------

    def drive(
        self,
        robot_id: str,
        x: float,
        y: float = 0.0,
        yaw: float = 0.0,
        *,
        linear: float = 0.5,
    ) -> None:
        """A robot says where it is."""
        self._seq += 1
        said = odometry(robot_id, x, y, yaw, linear=linear, origin=self._origin())
        self._apply(received(said, after=self.now))

    def look(
        self,
        robot_id: str,
        *detections: Detection,
        unreadable: int = 0,
        late_s: float = 0.0,
    ) -> list[Placed]:
        """A robot says what it sees, or saw so long ago."""
        self._seq += 1
        frame = detection_frame(
            robot_id, *detections, unreadable=unreadable, origin=self._origin(late_s)
        )
        return self.take(frame)

    def take(self, frame: DetectionFrame) -> list[Placed]:
        """A frame comes in."""
        self._apply(received(frame, after=self.now))
        placed, robot = self.sight(frame), self.world.robot(frame.robot_id)
        judged = self.judge_frame(frame)
        if robot.detector.take_frame(judged, self.people.turned_away, 0, has_pose=True):
            robot.detector.note_flaw("unreadable", at(self.now))
        else:
            robot.detector.note_whole(robot.detections_at)
        look = Look.from_frame(robot, frame, placed, at(self.now))
        self.blind.take(look, self.people, self.world)
        self.ended += self.own_sight.take(look, self.people)
        return placed

    def sight(self, frame: DetectionFrame) -> list[Placed]:
        return self.people.sight(
            self.judge_frame(frame),
            self.world.robot(frame.robot_id),
            self.world,
            at(self.now),
            f"look{self._seq}",
        )

    def judge_frame(self, frame: DetectionFrame) -> JudgedFrame:
        return judge_frame(frame, self.rule, (), self.world.word_answers)

    def walks_by(
        self, robot_id: str, x: float, y: float = 0.0, *, moved: bool = True
    ) -> TrackedPerson | None:
        """A robot reports what its laser sees: somebody who walks, or a thing."""
        self._seq += 1
        seen = ReportedObstacle(x, y, 0.4, moved)
        said = safety_report(robot_id, speed_factor=0.5, reason="obstacle")
        said = replace(said, obstacle=seen, origin=self._origin())
        self._apply(received(said, after=self.now))
        return self.people.track_obstacle(said, at(self.now), f"laser{self._seq}")

    def navigate(
        self, robot_id: str, task: str, path: tuple[tuple[float, float], ...] = ()
    ) -> None:
        """A robot says what it is about, and where it will drive."""
        self._seq += 1
        said = Navigation(robot_id, self._origin(), task, None, path)
        self._apply(received(said))

    def _origin(self, late_s: float = 0.0) -> Origin:
        return replace(origin(self._seq, after=self.now - late_s), replay=self.replay)

    def _apply(self, one: Received) -> None:
        self.world.apply(replace(one, at=at(self.now)))

    # --- what is judged -----------------------------------------------------------

    def judge(self) -> dict[str, SpeedLimit]:
        speed_limits, changes = self.speed_limits.evaluate(
            self.world, self.people, self.rule, at(self.now), f"d{self.now}"
        )
        self.changes += changes
        return speed_limits

    @property
    def everyone(self) -> list[TrackedPerson]:
        return list(self.people.known.values())


def person(x: float, y: float = 0.0, *, probability: float = 0.94) -> Detection:
    return detection("farmer", x, y, probability=probability)


def machine(x: float, y: float = 0.0) -> Detection:
    return detection("husky", x, y)
