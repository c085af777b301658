"""Values of the domain in the shapes of ``schemas``, one function a shape.

What is asked of the whole pipeline stands in ``views``; here nothing is looked up.
"""

import json
from dataclasses import asdict
from math import isfinite
from typing import Any

from iveg.domain.alarms import Alarm, Occurrence
from iveg.domain.alerts import Rule
from iveg.domain.echoes import ECHO_S, WINDOW_S, Echoes
from iveg.domain.exposure import Exposure
from iveg.domain.feedback import HALF_SPEED
from iveg.domain.fleet import RobotProfile
from iveg.domain.flood import FLOOD_LIMIT, FLOOD_WINDOW_S, Flood
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.margins import Margin
from iveg.domain.observations import Detection, Instant
from iveg.domain.people import Placed
from iveg.domain.records import LogRecord
from iveg.domain.stop import Command, StopMachine
from iveg.domain.world import RobotState
from iveg.ngsi.codec import format_stamp
from iveg.web import schemas

AGENT_LATE_S = 1.0
"""An agent that is less behind than this is not worth a sentence."""


def command(of: Command, machine: StopMachine, now: Instant) -> schemas.CommandJson:
    """One command with the robot's last word."""
    report, age = machine.report, machine.evidence_age(now)
    times = of.times
    return {
        "command_id": of.command_id,
        "hold_id": of.hold_id,
        "robot_id": of.robot_id,
        "kind": of.kind,
        "drill": of.drill,
        "state": of.state,
        "requested_by": of.requesters[0],
        "requesters": list(of.requesters),
        "times": {
            "pressed": None if times.pressed is None else format_stamp(times.pressed),
            "requested": format_stamp(times.requested.wall),
            "sent_fiware": moment(times.sent_fiware),
            "sent_direct": moment(times.sent_direct),
            "answer_fiware": moment(times.answer_fiware),
            "answer_direct": moment(times.answer_direct),
            "standing": moment(times.standing),
        },
        "pressed_doubted": times.pressed_doubted,
        "standstill_ms": rounded(of.standstill_ms),
        "age_s": round(now.mono - times.requested.mono, 3),
        "tries": of.tries,
        "reason": of.reason,
        "transports": dict(of.roads.items()),
        "roads": dict(of.roads.items()),
        "agent_lag_s": rounded(of.agent_lag_s, 1),
        "note": _note(of),
        "robot": {
            "v": 0.0 if report is None else report.linear,
            "report_age_s": rounded(age) if isfinite(age) else None,
            "moved_m": round(machine.moved_m(now), 2),
        },
        "challenge_fresh": machine.report_age(now) <= LIMITS.report_fresh_s,
    }


def _note(of: Command) -> schemas.NoteJson | None:
    """What a late agent means for an order that went through it."""
    lag = of.agent_lag_s
    if lag is None or lag <= AGENT_LATE_S:
        return None
    direct = of.roads["direct"] not in ("off", "failed")
    key = "stop.note.direct" if direct else "stop.note.fiware"
    return {"key": key, "slots": {"lag": round(lag, 1)}}


def house(greenhouse: Greenhouse) -> dict[str, Any]:
    """The greenhouse as the page draws it."""
    return {
        "name": greenhouse.name,
        "bounds": asdict(greenhouse.bounds),
        "lanes": [
            {"label": lane.label, **asdict(lane.area)} for lane in greenhouse.lanes
        ],
        "rows": [asdict(row) for row in greenhouse.rows],
        "posts": [asdict(post) for post in greenhouse.posts],
        "obstacles": [
            {"kind": one.kind, **asdict(one.area)} for one in greenhouse.obstacles
        ],
    }


def rule(of: Rule) -> schemas.RuleJson:
    """One version of the of."""
    return {
        "id": of.id,
        "version": of.version,
        "confidence_threshold": of.threshold,
        "class_thresholds": {str(k): v for k, v in of.class_thresholds.items()},
        "radius_m": of.radius_m,
        "factor": HALF_SPEED,
        "aliases": {name: str(class_) for name, class_ in of.aliases.items()},
        "possible_people": of.possible_people,
        "author": of.author,
        "since": None if of.since is None else format_stamp(of.since),
    }


def alert(alarm: Alarm) -> schemas.AlertJson:
    """One alarm with its newest occurrences."""
    condition, last = alarm.condition, alarm.last
    return {
        "alert_id": alarm.alert_id,
        "priority": alarm.priority,
        "key": condition.key,
        "slots": dict(condition.slots),
        "robot_id": condition.robot_id,
        "raised_at": format_stamp(alarm.raised.wall),
        "last_raised_at": format_stamp(last.raised.wall),
        "cleared_at": moment(last.cleared),
        "acknowledged_at": moment(last.acknowledged),
        "acknowledged_by": last.acknowledged_by,
        "note": last.note or None,
        "count": alarm.count,
        "members": [_member(one) for one in alarm.members],
    }


def _member(one: Occurrence) -> schemas.OccurrenceJson:
    return {
        "priority": one.priority,
        "raised_at": format_stamp(one.raised.wall),
        "cleared_at": moment(one.cleared),
        "acknowledged_at": moment(one.acknowledged),
        "acknowledged_by": one.acknowledged_by,
        "note": one.note or None,
    }


def flood(of: Flood) -> schemas.FloodJson:
    """How fast alarms come."""
    return {
        "count": of.count,
        "limit": FLOOD_LIMIT,
        "window_s": FLOOD_WINDOW_S,
        "since": moment(of.since),
    }


def log_line(line: LogRecord) -> schemas.LogJson:
    """One log line."""
    return {
        "id": line.id,
        "at": format_stamp(line.at),
        "kind": line.kind,
        "robot_id": line.robot_id,
        "key": line.key,
        "slots": json.loads(line.slots),
        "class": line.class_,
        "decision_id": line.decision_id,
    }


def detection(
    one: Placed, robot_id: str, stamp: str | None, road: str
) -> schemas.DetectionJson:
    """One box of one look, placed in ``map``."""
    x, y, z = one.position
    detection = one.detection
    return {
        "robot_id": robot_id,
        "stamp": stamp,
        "class": one.class_,
        "class_id": detection.class_id,
        "probability": detection.probability,
        "position": {"x": x, "y": y, "z": z},
        "box": _box(detection),
        "confident": one.kind != "faint",
        "person_id": None if one.person is None else one.person.person_id,
        "peer": one.peer,
        "road": road,
    }


def _box(detection: Detection) -> dict[str, Any]:
    box = detection.box
    return {
        "xmin": box.xmin,
        "xmax": box.xmax,
        "ymin": box.ymin,
        "ymax": box.ymax,
        "zmin": box.zmin,
        "zmax": box.zmax,
        "frame_id": detection.frame_id,
    }


def navigation(robot: RobotState) -> schemas.NavigationJson | None:
    """What a robot says it is about to do; None while it says nothing."""
    intent = robot.navigation
    if intent is None:
        return None
    goal = intent.goal
    return {
        "task": intent.task,
        "goal": None if goal is None else {"x": goal[0], "y": goal[1]},
        "path": [[x, y] for x, y in intent.path],
    }


def profile(body: RobotProfile) -> schemas.ProfileJson:
    """The body of a robot."""
    return {
        "drive": body.drive,
        "length": body.length,
        "width": body.width,
        "max_speed": body.max_speed,
        "turning_radius": body.turning_radius,
    }


def margin(of: Margin | None) -> schemas.MarginJson | None:
    """What is left between a robot and a person; None where there is no pair."""
    if of is None:
        return None
    return {
        "robot_id": of.robot_id,
        "person_id": of.person_id,
        "gap_m": round(of.gap_m, 2),
        "needs_m": round(of.needs_m, 2),
        "margin_m": round(of.margin_m, 2),
        "band": of.band,
        "parts": {
            "person_walks_m": round(of.walks_m, 2),
            "reaction_m": round(of.reaction_m, 2),
            "braking_m": round(of.braking_m, 2),
            "uncertainty_m": LIMITS.uncertainty_m,
        },
        "age_s": round(of.age_s, 3),
        "braking": of.braking,
        "walking_speed": LIMITS.walking_m_s,
    }


def safety(
    echoes: Echoes, exposure: Exposure | None, now: Instant
) -> schemas.SafetyJson:
    """How soon the fleet obeys, and how close it comes to people."""
    day = exposure or Exposure(now, now)
    age = None if exposure is None else round(now.mono - day.looked.mono, 1)
    since = None if exposure is None else moment(day.since)
    return {
        "alert_latency": {
            "p50_ms": _ms(echoes.p50_s),
            "p95_ms": _ms(echoes.p95_s),
            "p99_ms": _ms(echoes.p99_s),
            "count": echoes.timed,
            "window_s": WINDOW_S,
            "age_s": rounded(echoes.echo_age_s, 1),
        },
        "not_echoed": {
            "count": echoes.missed,
            "of": echoes.asked,
            "within_s": ECHO_S,
            "window_s": WINDOW_S,
            "age_s": rounded(echoes.asked_age_s, 1),
        },
        "negative_margin": {
            "share": rounded(day.share, 5),
            "known_s": round(day.known_s, 1),
            "unknown_s": round(day.unknown_s, 1),
            "count": day.looks,
            "since": since,
            "age_s": age,
        },
        "worst_margin": {
            "margin": None if day.worst is None else margin(day.worst.margin),
            "at": None if day.worst is None else moment(day.worst.at),
            "count": day.looks,
            "since": since,
            "age_s": age,
        },
    }


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else round(1000.0 * seconds, 1)


def moment(at: Instant | None) -> str | None:
    """An instant as ISO-8601 UTC with milliseconds."""
    return None if at is None else format_stamp(at.wall)


def rounded(value: float | None, digits: int = 3) -> float | None:
    """A number with no more decimals than it can mean."""
    return None if value is None else round(value, digits)
