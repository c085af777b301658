"""Feedback of iVeg to the fleet (Algorithm 2), evaluated by every robot (Algorithm 3).

One ``Feedback`` goes out for each robot that observes; it carries the alerts that are
alive and the speed limits of the whole fleet (docs/interfaces/mqtt.md).
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
        position: In ``map`` (m).
        radius_m: The zone at ``stamp``, grown with the age of the sighting.
        velocity: How it goes on in ``map`` (m/s); None: it was not seen for a second,
            so nobody knows.
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

    speed_factor: Annotated[float, Strict(), Field(ge=0, le=1)]
    reason: Text = "clear"
    cause: Text | None = None
    distance_m: Distance | None = None
    decision_id: Text | None = None
    foretold_s: Seconds | None = None
    over: Annotated[Flag, IF_ANY] = False


CLEAR = SpeedLimit(FULL_SPEED)
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
