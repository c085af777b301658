"""A small greenhouse with robots and people, moved by hand."""

from dataclasses import dataclass, field, replace

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import flaw_of
from iveg.domain.feedback import SpeedLimit
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    LaserScan,
    Navigation,
    Origin,
    Received,
)
from iveg.domain.rule.crossings import LimitChange
from iveg.domain.rule.obstacles import Obstacles
from iveg.domain.rule.speed_limits import SpeedLimits
from iveg.domain.tracking.calibration import Calibrations
from iveg.domain.tracking.people import People, Placed
from iveg.domain.tracking.person import TrackedPerson
from iveg.domain.tracking.sight import AllClear
from iveg.domain.witness import Plan
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
        calibrations: How sure a look of a detector makes.
    """

    robots: tuple[str, ...] = ("AGI", "AGII")
    greenhouse: Greenhouse = FIELD
    rule: DetectionRule = field(default_factory=DetectionRule)
    now: float = 0.0
    replay: str | None = None
    calibrations: Calibrations = field(default_factory=Calibrations)
    changes: list[LimitChange] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.world = World(fleet_of(*self.robots))
        self.people = People(self.greenhouse, calibrations=self.calibrations)
        plan = Plan.of(self.greenhouse)
        self.obstacles = Obstacles(self.world, self.people, plan)
        self.speed_limits = SpeedLimits(self.greenhouse, self.obstacles.seen)
        self.all_clear = AllClear()
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
        self, robot_id: str, *detections: Detection, unreadable: int = 0
    ) -> list[Placed]:
        """A robot says what it sees."""
        self._seq += 1
        frame = detection_frame(
            robot_id, *detections, unreadable=unreadable, origin=self._origin()
        )
        self._apply(received(frame, after=self.now))
        placed, robot = self.sight(frame), self.world.robot(robot_id)
        if flaw_of(frame, self.rule, self.people.turned_away):
            robot.detector.note_flaw("unreadable", at(self.now))
        else:
            robot.detector.note_whole(robot.detections_at)
        return placed

    def sight(self, frame: DetectionFrame) -> list[Placed]:
        return self.people.sight(
            frame, self.world, self.rule, at(self.now), f"look{self._seq}"
        )

    def scan(self, robot_id: str, said: LaserScan) -> None:
        """A robot says what its laser measures."""
        self._seq += 1
        self._apply(received(replace(said, robot_id=robot_id, origin=self._origin())))
        robot = self.world.robot(robot_id)
        if isinstance(robot.scan, LaserScan):
            self.obstacles.look(robot, robot.scan, at(self.now))
        for name, when, spots in self.obstacles.walkers():
            seer = self.world.robot(name)
            self.people.witness(seer, spots, when, f"laser{self._seq}")

    def report(
        self,
        robot_id: str,
        *,
        factor: float,
        decision_id: str | None = None,
        reason: str = "clear",
        cause: str | None = None,
    ) -> None:
        """A robot says what it applies, and for which decision."""
        self._seq += 1
        said = safety_report(
            robot_id,
            speed_factor=factor,
            reason=reason,
            cause=cause,
            decision_id=decision_id,
            origin=self._origin(),
        )
        self._apply(received(said, after=self.now))

    def navigate(
        self, robot_id: str, task: str, path: tuple[tuple[float, float], ...] = ()
    ) -> None:
        """A robot says what it is about, and where it will drive."""
        self._seq += 1
        said = Navigation(robot_id, self._origin(), task, None, path)
        self._apply(received(said))

    def _origin(self) -> Origin:
        return replace(origin(self._seq, after=self.now), replay=self.replay)

    def _apply(self, one: Received) -> None:
        self.world.apply(replace(one, at=at(self.now)))

    # --- what is judged -----------------------------------------------------------

    def judge(self) -> dict[str, SpeedLimit]:
        speed_limits, changes = self.speed_limits.evaluate(
            self.world, self.people, self.rule, at(self.now), f"d{self.now}"
        )
        self.changes += changes
        return speed_limits

    def sweep(self) -> list[TrackedPerson]:
        return self.all_clear.sweep(
            self.people, self.world, self.greenhouse, at(self.now)
        )

    @property
    def everyone(self) -> list[TrackedPerson]:
        return list(self.people.known.values())


def person(x: float, y: float = 0.0, *, probability: float = 0.94) -> Detection:
    return detection("farmer", x, y, probability=probability)


def machine(x: float, y: float = 0.0) -> Detection:
    return detection("husky", x, y)
