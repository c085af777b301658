"""JSON as browsers and integrators see it: the same shapes in REST and live topics.

Lengths in metres, angles in radians, times ISO-8601 UTC, ages in seconds
(docs/interfaces.md §5 and §8).
"""

from typing import Any, Literal

# pydantic takes the standard library's TypedDict from Python 3.12 on only.
from typing_extensions import TypedDict


class Point(TypedDict):
    """A place in ``map`` (m)."""

    x: float
    y: float


class Point3(TypedDict):
    """A place in ``map`` with its height (m)."""

    x: float
    y: float
    z: float


class PoseJson(TypedDict):
    """Pose of ``base_link`` in ``map``."""

    x: float
    y: float
    yaw: float


class TwistJson(TypedDict):
    """Speed (m/s) and turn rate (rad/s)."""

    linear: float
    angular: float


class HoldJson(TypedDict):
    """A reason why a robot may not move."""

    id: str
    source: str
    ack: str


class FaultJson(TypedDict):
    """What a robot finds wrong with its own data."""

    code: str
    about: str
    for_s: float | None


class AppliedJson(TypedDict):
    """What the robot itself says it applies."""

    reason: str
    cause: str | None
    age_s: float
    feedback_age_s: float | None
    faults: list[FaultJson]


class MandateJson(TypedDict):
    """What iVeg tells the robot."""

    speed_factor: float
    reason: str
    cause: str | None
    distance_m: float | None
    decision_id: str | None


class NavigationJson(TypedDict):
    """The robot's intent."""

    task: str
    goal: Point | None
    path: list[list[float]]


class ProfileJson(TypedDict):
    """What is known of this kind of robot."""

    drive: str
    length: float
    width: float
    max_speed: float
    turning_radius: float


class TimesJson(TypedDict):
    """When each step of a command was taken; ``pressed`` if a page told and can be."""

    pressed: str | None
    requested: str
    sent_fiware: str | None
    sent_direct: str | None
    answer_fiware: str | None
    answer_direct: str | None
    standing: str | None


class CommandRobotJson(TypedDict):
    """The robot's last word, while a command is open."""

    v: float
    report_age_s: float | None
    moved_m: float


class NoteJson(TypedDict):
    """A sentence: the name of its template and what fills its holes."""

    key: str
    slots: dict[str, float]


class CommandJson(TypedDict):
    """One STOP, release or resume; ``roads`` is ``transports`` for one version more."""

    command_id: str
    hold_id: str | None
    robot_id: str
    kind: str
    drill: bool
    state: str
    requested_by: str
    requesters: list[str]
    times: TimesJson
    pressed_doubted: bool
    standstill_ms: float | None
    age_s: float
    tries: int
    reason: str | None
    transports: dict[str, str]
    roads: dict[str, str]
    agent_lag_s: float | None
    note: NoteJson | None
    robot: CommandRobotJson
    challenge_fresh: bool


class MarginPartsJson(TypedDict):
    """What stopping takes, term by term (m)."""

    person_walks_m: float
    reaction_m: float
    braking_m: float
    uncertainty_m: float


class MarginJson(TypedDict):
    """The gap to a person less what stopping takes; shown, never acted on."""

    robot_id: str
    person_id: str
    gap_m: float
    needs_m: float
    margin_m: float
    band: Literal["clear", "tight", "inside", "unknown"]
    parts: MarginPartsJson
    age_s: float
    braking: float
    walking_speed: float


class RobotJson(TypedDict):
    """One robot with the age of what is said of it."""

    robot_id: str
    link: str
    mode: Literal["RUNNING", "SLOW", "STOPPED"]
    pose: PoseJson | None
    twist: TwistJson | None
    stamp: str | None
    received_at: str | None
    age_s: float | None
    age_estimated: bool
    speed_factor: float | None
    applied: AppliedJson | None
    mandate: MandateJson
    holds: list[HoldJson]
    stop: CommandJson | None
    stop_state: str
    navigation: NavigationJson | None
    replay: bool
    clock_offset_s: float | None
    road: str
    transport: Literal["direct", "fiware"]
    profile: ProfileJson
    margin: MarginJson | None
    cmd_status: str | None


class ActingJson(TypedDict):
    """A robot that is slowed for somebody."""

    robot_id: str
    distance_m: float
    in_sight: bool


PersonJson = TypedDict(
    "PersonJson",
    {
        "person_id": str,
        "class": str,
        "class_id": str,
        "stage": str,
        "position": Point3,
        "radius_m": float | None,
        "confidence": float,
        "first_seen": str,
        "last_seen": str,
        "age_s": float,
        "observers": list[str],
        "possible": bool,
        "doubtful": bool,
        "decision_id": str | None,
        "lane": str | None,
        "acting": list[ActingJson],
        "margin": MarginJson | None,
    },
)
"""A person, or a robot that is none of the fleet."""

DetectionJson = TypedDict(
    "DetectionJson",
    {
        "robot_id": str,
        "stamp": str | None,
        "class": str | None,
        "class_id": str,
        "probability": float,
        "position": Point3,
        "box": dict[str, Any],
        "confident": bool,
        "person_id": str | None,
        "peer": str | None,
        "road": str,
    },
)
"""One box of one look, placed in ``map``."""


class FrameJson(TypedDict):
    """One look of one robot."""

    robot_id: str
    stamp: str | None
    road: str
    age_s: float
    items: list[DetectionJson]


class OccurrenceJson(TypedDict):
    """One time that an alert was raised."""

    priority: str
    raised_at: str
    cleared_at: str | None
    acknowledged_at: str | None
    acknowledged_by: str | None
    note: str | None


class AlertJson(TypedDict):
    """A notice to people: all occurrences of one kind and subject as one."""

    alert_id: str
    priority: str
    key: str
    slots: dict[str, Any]
    robot_id: str | None
    raised_at: str
    last_raised_at: str
    cleared_at: str | None
    acknowledged_at: str | None
    acknowledged_by: str | None
    note: str | None
    count: int
    members: list[OccurrenceJson]


class FloodJson(TypedDict):
    """How many alerts sounded within the window; ``since`` null: no flood."""

    count: int
    limit: int
    window_s: float
    since: str | None


LogJson = TypedDict(
    "LogJson",
    {
        "id": int,
        "at": str,
        "kind": str,
        "robot_id": str | None,
        "key": str,
        "slots": dict[str, Any],
        "class": str | None,
        "decision_id": str | None,
    },
)
"""One line of the action and inference log."""


class HopJson(TypedDict):
    """One hop of the chain from robot to screen."""

    hop: str
    state: Literal["ok", "late", "down", "unknown"]
    age_s: float | None
    key: str
    detail: str
    lag_s: float | None
    growing: bool


class AlertLatencyJson(TypedDict):
    """From the look that a slow-down rests on to the robot's own report (ms)."""

    p50_ms: float | None
    p95_ms: float | None
    p99_ms: float | None
    count: int
    window_s: float
    age_s: float | None


class NotEchoedJson(TypedDict):
    """Alerts that a robot did not answer in time, of those that it should have."""

    count: int
    of: int
    within_s: float
    window_s: float
    age_s: float | None


class NegativeMarginJson(TypedDict):
    """How much of today's known time some margin was below zero (0 to 1)."""

    share: float | None
    known_s: float
    unknown_s: float
    count: int
    since: str | None
    age_s: float | None


class WorstMarginJson(TypedDict):
    """The least margin of today, when it was, and of how many looks."""

    margin: MarginJson | None
    at: str | None
    count: int
    since: str | None
    age_s: float | None


class SafetyJson(TypedDict):
    """How soon the fleet obeys and how close it comes to people; never "safe"."""

    alert_latency: AlertLatencyJson
    not_echoed: NotEchoedJson
    negative_margin: NegativeMarginJson
    worst_margin: WorstMarginJson


class HealthJson(TypedDict):
    """Whether the chain is whole, what was counted, and how the fleet is told."""

    ok: bool
    hops: list[HopJson]
    counters: dict[str, int]
    safety: SafetyJson
    earlier: Literal["known", "reading", "unknown"]


class ClimateJson(TypedDict):
    """Air in the greenhouse."""

    temperature: float | None
    relative_humidity: float | None
    co2: float | None
    received_at: str
    age_s: float


class ScanJson(TypedDict):
    """One sweep in ``map``."""

    robot_id: str
    stamp: str | None
    frame_id: str
    points: list[list[float]]


class RuleJson(TypedDict):
    """One version of the alert rule."""

    id: str
    version: int
    confidence_threshold: float
    class_thresholds: dict[str, float]
    radius_m: float
    factor: float
    aliases: dict[str, str]
    possible_people: bool
    author: str
    since: str | None


class CostmapJson(TypedDict):
    """Cells from the south-western corner, row by row: 0-100, -1 unknown."""

    resolution: float
    width: int
    height: int
    origin: Point
    data: list[int]


class PressedJson(TypedDict):
    """A STOP, release or resume that was accepted."""

    robot_id: str
    command_id: str
    state: str


class FleetPressedJson(TypedDict):
    """A fleet STOP: one command a robot."""

    commands: list[PressedJson]


class LinkJson(TypedDict):
    """One step of a decision's chain."""

    link: str
    at: str | None
    value: str | float | None
    verdict: str
