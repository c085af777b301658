"""Random days of two robots among people, and what iVeg tells of them meanwhile."""

import asyncio
from typing import Any, NamedTuple

from hypothesis import strategies as st

from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import DriveLane, Greenhouse
from iveg.domain.observations import Hold
from iveg.web.views import Views
from tests.builders import detection
from tests.unit.vital.desk import Desk, settle

ROBOTS = ("AGI", "AGII")
HOLDS = (
    Hold("red", "hw", "local"),
    Hold("start", "boot", "remote"),
    Hold("silence", "link", "auto"),
)
REASONS = ("clear", "person", "robot", "stale", "doubt", "watchdog", "obstacle", "hold")
AISLES = Greenhouse(
    "aisles",
    Rectangle(-100, -100, 100, 100),
    lanes=(DriveLane("3", Rectangle(-20, -2, 20, 2)),),
)

_robot = st.sampled_from(ROBOTS)
_x = st.floats(0.0, 9.0).map(lambda x: round(x, 1))
_speed = st.sampled_from((0.0, 0.3, 0.8, 2.0))
_holds = st.sampled_from(((), (), (), HOLDS[:1], HOLDS[1:2], HOLDS[2:], HOLDS[:2]))
_step = st.one_of(
    st.tuples(st.just("drive"), _robot, _x, _speed),
    st.tuples(st.just("look"), _robot, st.lists(_x, max_size=2)),
    st.tuples(
        st.just("report"),
        _robot,
        st.sampled_from((0.0, 0.3, 0.5, 1.0, 1.0)),
        st.sampled_from(REASONS),
        _holds,
        _speed,
    ),
    st.tuples(st.just("press"), _robot),
    st.tuples(st.just("hold"), _robot),
    st.tuples(st.just("let go"), _robot),
    st.tuples(st.just("wait"), st.sampled_from((0.1, 0.1, 0.6, 1.2, 2.2, 3.5))),
    st.tuples(st.just("healthy"), st.sampled_from((0.3, 1.2, 2.5)), _speed),
)
days = st.lists(_step, min_size=3, max_size=14)
"""What happens, one after the other."""


class Moment(NamedTuple):
    """The fleet as it was told, with everybody in it and the P1 alerts that held.

    Attributes:
        alerts: Robot and key of each.
    """

    robots: list[dict[str, Any]]
    people: list[dict[str, Any]]
    alerts: list[tuple[str, str]]

    @property
    def alerted(self) -> set[str]:
        """Robots of which a P1 held."""
        return {robot for robot, _ in self.alerts}


def told(day: list[tuple[Any, ...]]) -> list[Moment]:
    """The fleet after each step of a day."""
    return asyncio.run(_live(day))


async def _live(day: list[tuple[Any, ...]]) -> list[Moment]:
    desk = Desk(ROBOTS, AISLES)
    views = Views(desk.parts)
    moments = []
    for step in day:
        await _do(desk, step)
        await settle()
        desk.loop.step([], desk.clock())
        now = desk.clock()
        active = (one for one in desk.evaluator.alerts.waiting if not one.cleared)
        alerts = [
            (str(one.condition.robot_id), one.condition.key)
            for one in active
            if one.condition.priority == "P1"
        ]
        robots = [one.model_dump(mode="json") for one in views.robots(now)]
        people = [one.model_dump(mode="json") for one in views.people(now)]
        moments.append(Moment(robots, people, alerts))
    return moments


async def _do(desk: Desk, step: tuple[Any, ...]) -> None:
    match step:
        case "drive", robot, x, speed:
            desk.drive(robot, x, linear=speed)
        case "look", robot, people:
            desk.look(robot, *(detection("farmer", x, 1.0) for x in people))
        case "report", robot, factor, reason, holds, speed:
            desk.report(robot, *holds, factor=factor, reason=reason, linear=speed)
        case "press", robot:
            await desk.commander.stop([robot], "ana", desk.clock())
        case "hold", robot:
            await _hold(desk, robot)
        case "let go", robot:
            released = (desk.commander.machine(robot).hold_id or "",)
            desk.report(robot, factor=1.0, reason="clear", released=released)
        case "wait", seconds:
            await desk.wait(seconds)
        case "healthy", seconds, speed:
            await _go_on(desk, seconds, speed)


async def _hold(desk: Desk, robot: str) -> None:
    """A robot that was told to stop stands, and says so."""
    hold = Hold(desk.commander.machine(robot).hold_id or "x", "iveg", "remote")
    for _ in range(14):
        desk.drive(robot, linear=0.0)
        desk.report(robot, hold)
        await desk.wait(0.1)


async def _go_on(desk: Desk, seconds: float, speed: float) -> None:
    """Both robots say and see all that they should, and nobody is there."""
    for step in range(round(seconds / 0.1)):
        for n, robot in enumerate(ROBOTS):
            desk.drive(robot, 30.0 * n + 0.1 * step * speed, linear=speed)
            desk.look(robot)
            desk.report(robot, factor=1.0, reason="clear", linear=speed)
        await desk.wait(0.1)
