"""Feedback of iVeg to the fleet (Algorithm 2), evaluated by every robot (Algorithm 3).

One ``Feedback`` goes out for each robot that observes; it carries the alerts that are
alive and the speed limits of the whole fleet (docs/interfaces/mqtt.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Origin
from iveg.domain.parameters import Class, Sent

FULL_SPEED = 1.0
LONGEST_BACKLOG_S = 60.0
HALF_SPEED = LIMITS.slow_factor
"""The factor inside a zone; a constant of the paper, not a setting."""


@dataclass(frozen=True, slots=True)
class FeedbackAlert:
    """A confirmed person or robot, or (``class_`` None) the stamp of another object.

    Attributes:
        position: In ``map`` (m).
        radius_m: The zone at ``stamp``, grown with the age of the sighting.
        velocity: How it goes on in ``map`` (m/s); None: it was not seen for a second,
            so nobody knows.
    """

    decision_id: str
    stamp: str
    class_: Class | None = None
    class_id: str | None = None
    confidence: float | None = None
    position: tuple[float, float, float] | None = None
    radius_m: float | None = None
    observer: str | None = None
    velocity: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class SpeedLimit:
    """The speed factor that one robot must keep, and the reason.

    Attributes:
        speed_factor: 0, 0.5 or 1.
        reason: ``clear``, ``person``, ``robot``, ``obstacle``, ``stale``, ``doubt``
            or ``unsupervised``.
        cause: The person or robot that it is for; None of what only a laser sees.
        distance_m: From ``base_link`` to the centre of the cause (m).
        foretold_s: When it will reach the zone of the cause (s); None: it is inside.
        over: Its reason has ended: it is lifted a second after that, and so is what the
            robot judges itself.
    """

    speed_factor: float = FULL_SPEED
    reason: str = "clear"
    cause: str | None = None
    distance_m: float | None = None
    decision_id: str | None = None
    foretold_s: float | None = None
    over: bool = False


CLEAR = SpeedLimit()
UNSUPERVISED = SpeedLimit(HALF_SPEED, "unsupervised")
"""Of a robot that nobody has judged, or that a feedback does not name."""


@dataclass(frozen=True, slots=True)
class Feedback:
    """One message on ``/{robot_id}/mqtt_feedback``.

    Attributes:
        robot_id: The observer that this topic belongs to.
        alert: The newest; None without one.
        alerts: All that are alive.
        pose: Where iVeg believes the observer to be; None when unknown.
        speed_limits: Of every robot that is judged, clear ones included.
        seen: Newest safety-report ``seq`` that iVeg has of each robot.
        backlog_s: How far Orion is behind (s), at most ``LONGEST_BACKLOG_S``; None
            where nobody knows.
        foresight: Robots slow before they reach a zone, too: the rule asks for it.
        rule: Values of the rule that robots judge by themselves.
    """

    robot_id: str
    origin: Origin
    alert: FeedbackAlert | None = None
    alerts: tuple[FeedbackAlert, ...] = ()
    pose: Pose2D | None = None
    twist: Twist2D | None = None
    pose_stamp: str | None = None
    speed_limits: Mapping[str, SpeedLimit] = field(default_factory=dict)
    seen: Mapping[str, int] = field(default_factory=dict)
    backlog_s: float | None = None
    foresight: bool = False
    rule: Sent = field(default_factory=dict)
