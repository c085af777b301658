"""Fleets of one, two and ten robots in situations of which each looks different."""

from collections.abc import Callable
from typing import Any

from tests.e2e.frozen import HOLD, STANDS, Frozen, frozen, order

Told = dict[str, Any]
IDS = ("AGI", "AGII", *(f"R{n}" for n in range(3, 11)))

_IN_AISLE: Told = {"distance": 1.4, "lane": "Pasillo 3"}


def _is(level: str, kind: str, state: str, action: str = "none", **found: Any) -> Told:
    """A situation, as ``/live`` tells it."""
    nothing: Told = {
        "cause": "alarm",
        "why": None,
        "about": None,
        "factor": 1.0,
        "slots": {},
    }
    told = {"level": level, "kind": kind, "state": state, "action": action}
    return {**told, **nothing, **found}


_CALM = _is("working", "working", "clear", cause="clear")
_NOT_SLOWING = _is(
    "danger", "disobeys", "not_slowing", "press_stop", why="person_in", slots=_IN_AISLE
)
_LOST = _is("danger", "lost_moving", "lost_moving", "red_button", slots={"age": 4.2})
_LATE = _is("doubt", "unsure", "late", "as_moving", cause="link", slots={"age": 1.4})
_STANDING = _is("locked", "locked", "standing", "release", cause="stop")
_STILL_MOVING = _is("danger", "stop_failed", "still_moving", "red_button")


def fleet(count: int, situation: str) -> Frozen:
    """What ``/live`` says of so many robots in one of ``SITUATIONS``."""
    told = frozen()
    seen = told["snapshot"]
    seen["robots"] = [_robot(seen["robots"][n % 2], n) for n in range(count)]
    seen["alerts"] = []
    if count == 1:
        told["scans"] = told["scans"][:1]
    SITUATIONS[situation](seen)
    return told


def _robot(like: Told, n: int) -> Told:
    """The n-th, each in a place of its own; nothing is near any of them."""
    aisle, along = n % 5, n // 5
    pose = {"x": 2.0 + 4.0 * aisle, "y": 11.2 - 5.0 * along, "yaw": like["pose"]["yaw"]}
    changes = {} if n < 2 else {"pose": pose, "navigation": None}
    return {**like, "robot_id": IDS[n], "margin": None, **changes, "situation": _CALM}


def _calm(seen: Told) -> None:
    seen["people"] = []


def _slow(seen: Told) -> None:
    """As it was recorded: the second robot is slow for a person."""
    recorded = frozen()["snapshot"]["robots"]
    last = seen["robots"][-1]
    for name in ("situation", "margin", "applied", "speed_limit", "mode", "twist"):
        last[name] = recorded[1][name]


def _danger(seen: Told) -> None:
    seen["robots"][-1]["situation"] = _NOT_SLOWING
    slots = {"robot": seen["robots"][-1]["robot_id"], "person": "P1", "distance": 1.4}
    seen["alerts"] = [alert(0, "P1", "alert.person_not_slowing", slots)]


def _lost(seen: Told) -> None:
    """One is late; of a fleet the last one was lost while it moved."""
    seen["robots"][0].update(situation=_LATE, age_s=1.4, link="LATE")
    last = seen["robots"][-1]
    last.update(situation=_LOST, age_s=4.2, link="LOST")
    slots = {"robot": last["robot_id"], "age": 4.2}
    seen["alerts"] = [alert(0, "P1", "alert.moving_robot_lost", slots)]


def _stopped(seen: Told) -> None:
    """All stand."""
    for robot in seen["robots"]:
        robot_id = robot["robot_id"]
        robot.update(situation=_STANDING, **STANDS, holds=[HOLD])
        robot.update(stop=order(robot_id, "STANDING"), stop_state="STANDING")


def _disobeyed(seen: Told) -> None:
    first = seen["robots"][0]
    stop = order(first["robot_id"], "STILL_MOVING")
    first.update(situation=_STILL_MOVING, stop=stop, stop_state="STILL_MOVING")
    slots = {"robot": first["robot_id"]}
    seen["alerts"] = [alert(0, "P1", "alert.stop_still_moving", slots)]


def _flooded(seen: Told) -> None:
    """More alerts in ten minutes than anybody reads."""
    _danger(seen)
    robots = [robot["robot_id"] for robot in seen["robots"]]
    seen["alerts"] += [
        alert(n, "P2", "alert.robot_lost", {"robot": robots[n % len(robots)]})
        for n in range(1, 13)
    ]
    seen["alerts"] += [
        alert(n, "P3", "alert.battery_low", {"robot": robots[n % len(robots)]})
        for n in range(13, 25)
    ]


SITUATIONS: dict[str, Callable[[Told], None]] = {
    "calm": _calm,
    "slow": _slow,
    "danger": _danger,
    "lost": _lost,
    "stopped": _stopped,
    "disobeyed": _disobeyed,
    "flooded": _flooded,
    "no server": _slow,
}


def alert(n: int, priority: str, key: str, slots: Told) -> Told:
    """The n-th alert, as ``/live`` tells it."""
    at = "2026-11-21T03:25:30.091Z"
    past = dict.fromkeys(("cleared_at", "acknowledged_at", "acknowledged_by", "note"))
    return {
        "alert_id": f"A{n}",
        "priority": priority,
        "key": key,
        "slots": slots,
        "robot_id": slots.get("robot"),
        "raised_at": at,
        "last_raised_at": at,
        "count": 1,
        "told": [],
        **past,
    }
