"""Feedback of iVeg to the fleet (Algorithm 2), evaluated by every robot (Algorithm 3).

One ``Feedback`` goes out for each robot that observes.  It has the present alerts and
the speed limits of the whole fleet (docs/interfaces/mqtt.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from pydantic import BeforeValidator, Field, Strict

from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Origin
from iveg.domain.parameters import Class, Sent
from iveg.domain.wire import (
    IF_ANY,
    MAX_BOXES,
    MAX_ROBOTS,
    Flag,
    Metres,
    Seconds,
    Share,
    Speed,
    Text,
    digits,
    place,
)

FULL_SPEED = 1.0
LONGEST_BACKLOG_S = 60.0
"""Greatest backlog of Orion in a feedback (s)."""
HALF_SPEED = LIMITS.slow_factor
"""The factor inside a zone; a constant of the paper, not a setting."""


Radius = Annotated[float, Strict(), Field(gt=0, le=100), digits(4)]
Distance = Annotated[float, Strict(), Field(ge=0, le=1e7), digits(4)]


def _or_empty(text: object) -> object:
    return "" if text is None else text


@dataclass(frozen=True, slots=True)
class FeedbackAlert:
    """A confirmed person or robot, or (``class_`` None) the stamp of another object.

    Attributes:
        position: Position in ``map`` (m).
        radius_m: Radius of the zone at ``stamp``, grown with the age of the sighting.
        velocity: Velocity in ``map`` (m/s); None: unknown, since it was not seen for a
            second.
    """

    decision_id: Annotated[Text, BeforeValidator(_or_empty), IF_ANY] = ""
    stamp: Annotated[Text, BeforeValidator(_or_empty)] = ""
    class_: Annotated[Class | None, Field(alias="class")] = None
    class_id: Text | None = None
    confidence: Annotated[Share | None, Field(alias="conf")] = None
    position: Annotated[tuple[Metres, Metres, Metres], *place("xyz")] | None = None
    radius_m: Radius | None = None
    observer: Text | None = None
    velocity: Annotated[tuple[Speed, Speed], *place("xy")] | None = None


@dataclass(frozen=True, slots=True)
class SpeedLimit:
    """The speed factor that one robot must keep, and the reason for it.

    Attributes:
        speed_factor: 0, 0.5 or 1.
        reason: ``clear``, ``person``, ``robot``, ``obstacle``, ``stale``, ``doubt``
            or ``unsupervised``.
        cause: The person or robot that is the cause; None: only a laser sees it.
        distance_m: Distance from ``base_link`` to the centre of the cause (m).
        decision_id: Decision that the limit follows; None: it follows none.
        foretold_s: Time until it reaches the zone of the cause (s); None: it is inside.
        over: Whether its reason has ended: a second later the limit is lifted, and with
            it the robot's own.
    """

    speed_factor: Annotated[float, Strict(), Field(ge=0, le=1)]
    reason: Text = "clear"
    cause: Text | None = None
    distance_m: Distance | None = None
    decision_id: Text | None = None
    foretold_s: Seconds | None = None
    over: Annotated[Flag, IF_ANY] = False


CLEAR = SpeedLimit(FULL_SPEED)
UNSUPERVISED = SpeedLimit(HALF_SPEED, "unsupervised")
"""Limit of a robot that was not judged yet, or that a feedback does not name."""


@dataclass(frozen=True, slots=True)
class Feedback:
    """One message on ``/{robot_id}/mqtt_feedback``.

    Attributes:
        robot_id: The observer that this topic belongs to.
        alert: The newest alert; None: there is none.
        alerts: All present alerts.
        pose: Pose of the observer by iVeg; None: unknown.
        speed_limits: Limits of all judged robots, clear ones included.
        seen: Robot → ``seq`` of the newest safety report that iVeg has received.
        backlog_s: Time by which Orion is late (s), at most ``LONGEST_BACKLOG_S``; None:
            unknown.
        foresight: Whether robots also slow before they reach a zone, by the rule.
        rule: Values of the rule by which robots judge themselves.
    """

    robot_id: Text
    origin: Origin
    alert: FeedbackAlert | None = None
    alerts: Annotated[tuple[FeedbackAlert, ...], Field(max_length=MAX_BOXES)] = ()
    pose: Pose2D | None = None
    twist: Twist2D | None = None
    pose_stamp: Text | None = None
    speed_limits: Annotated[Mapping[str, SpeedLimit], Field(max_length=MAX_ROBOTS)] = (
        field(default_factory=dict)
    )
    seen: Annotated[
        Mapping[str, Annotated[int, Strict()]], Field(max_length=MAX_ROBOTS)
    ] = field(default_factory=dict)
    backlog_s: float | None = None
    foresight: Flag = False
    rule: Sent = field(default_factory=dict)
