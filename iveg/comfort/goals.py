"""Goals: from a person's wish to the robot's answer.

Comfort, and below STOP: the table of ``domain/goals`` decides, a STOP or a hold deletes
open goals, and no order here is repeated or reaches a STOP machine.
"""

import asyncio
import logging
from collections.abc import Iterable, Mapping
from dataclasses import replace

from iveg.domain.errors import HopError
from iveg.domain.events import LogEvent, Slot
from iveg.domain.geometry import Pose2D
from iveg.domain.goals import (
    CancelOrder,
    FollowedGoal,
    Goal,
    GoalEvent,
    GoalOrder,
    GoalWish,
    permit,
    place_of,
    refusal,
)
from iveg.domain.observations import GoalAnswer, Instant
from iveg.domain.records import CommandRecord
from iveg.domain.stop import StopMachine
from iveg.domain.transports import TransportId
from iveg.vital import topics
from iveg.vital.core import Core
from iveg.vital.ports import CommandPort

_log = logging.getLogger(__name__)
_EVENTS: Mapping[str, GoalEvent] = {
    "ACCEPTED": "accepted",
    "REFUSED": "refused",
    "REACHED": "reached",
    "DROPPED": "dropped",
}


class GoalDispatcher:
    """Keeps the newest goal of each robot.

    Args:
        core: Has robots, ports and log.
        machines: STOP of each robot; only read.
    """

    def __init__(self, core: Core, machines: Mapping[str, StopMachine]) -> None:
        self._world, self._greenhouse = core.world, core.greenhouse
        self._machines, self._event_log = machines, core.event_log
        self._ports = [
            port for way, port in core.ports.transports.items() if way.carries("resume")
        ]
        self._new_id = core.ports.new_id
        self._goals: dict[str, FollowedGoal] = {}
        self._given: set[str] = set()
        """Ids of all goals of this run, which ``close_earlier`` must leave open."""
        self._tasks: set[asyncio.Task[None]] = set()

    # --- people -------------------------------------------------------------------

    def give(self, robot_id: str, wish: GoalWish, by: str, at: Instant) -> FollowedGoal:
        """Send a robot somewhere, once on each transport.

        Raises:
            UnknownRobotError: not in the fleet.
            CommandRefusedError: the robot or the place does not allow it.
        """
        robot = self._world.robot(robot_id)
        pose = Pose2D(0.0, 0.0, 0.0) if robot.odometry is None else robot.odometry.pose
        start = self._start_of(robot_id)
        place = place_of(wish, self._greenhouse, robot.profile, pose, start)
        # A refusal by the robot's state comes before a fault of the goal itself.
        position = (pose.x, pose.y) if isinstance(place, str) else place
        goal = Goal(
            self._new_id(), wish.kind, round(position[0], 3), round(position[1], 3)
        )
        order = permit(robot, self._machines[robot_id].state, goal, at)
        if isinstance(place, str):
            raise refusal(robot_id, place)
        # The old goal ends in the log before the new one begins.
        self._change(robot_id, "replaced", at)
        followed = FollowedGoal(robot_id, goal, by, at, at, wish.aisle)
        self._goals[robot_id] = followed
        self._given.add(goal.goal_id)
        self._tell(followed, "sent", at)
        self._send(robot_id, order)
        return followed

    def cancel(self, robot_id: str, by: str, at: Instant) -> FollowedGoal:
        """Have a robot forget its goal and stay.

        Raises:
            UnknownRobotError: not in the fleet.
            CommandRefusedError: it has none.
        """
        self._world.robot(robot_id)
        goal = self.newest(robot_id, at)
        if goal is None or not (goal.is_open or goal.state == "REACHED"):
            raise refusal(robot_id, "no_goal")
        cancelled = self._change(robot_id, "cancel", at, by=by) or goal
        self._send(robot_id, CancelOrder(goal.goal.goal_id))
        return cancelled

    def _start_of(self, robot_id: str) -> Pose2D | None:
        """Home of a robot: the greenhouse names a place for each, in fleet order."""
        order = zip(self._world.robots, self._greenhouse.starts, strict=False)
        return dict(order).get(robot_id)

    # --- what comes back, and time ------------------------------------------------

    def take_answer(self, answer: GoalAnswer, at: Instant, _: TransportId) -> None:
        """Take a robot's answer about its goal; a copy changes nothing."""
        goal = self._goals.get(answer.robot_id)
        if goal is None or goal.goal.goal_id != answer.id:
            return
        event = _EVENTS[answer.result]
        if event == "dropped" and goal.forgotten is None:
            self._goals[answer.robot_id] = replace(goal, forgotten=at)
        # A goal that a hold ended is deleted, not given up by the robot.
        if answer.why == "held" and event == "dropped":
            event = "held"
        self._change(answer.robot_id, event, at, answer.why)

    def close_earlier(self, rows: Iterable[CommandRecord], now: Instant) -> None:
        """Close goals that an earlier run left open; nobody follows them any more."""
        for row in rows:
            if row.kind == "goal" and row.command_id not in self._given:
                self._event_log.left_over(row, None, now)

    def tick(self, now: Instant) -> None:
        """Delete goals of held robots, and end those whose answer is overdue."""
        for robot_id in list(self._goals):
            self.newest(robot_id, now)

    def newest(self, robot_id: str, now: Instant) -> FollowedGoal | None:
        """A robot's newest goal at this moment, open or not; None: it never had one."""
        goal = self._goals.get(robot_id)
        if goal is None or not goal.is_open:
            return goal
        if self._is_held(robot_id):
            self._change(robot_id, "held", now)
        elif goal.is_overdue(now):
            self._change(robot_id, "expired", now)
        return self._goals[robot_id]

    def _is_held(self, robot_id: str) -> bool:
        report = self._world.robot(robot_id).safety
        has_hold = report is not None and (report.holds or report.reason == "hold")
        return bool(has_hold) or self._machines[robot_id].state != "RUNNING"

    def _change(
        self,
        robot_id: str,
        event: GoalEvent,
        at: Instant,
        why: str | None = None,
        by: str | None = None,
    ) -> FollowedGoal | None:
        """A robot's goal after an event; None where that changes nothing."""
        before = self._goals.get(robot_id)
        after = None if before is None else before.after(event, at, why)
        if after is None or after is before:
            return None
        self._goals[robot_id] = after
        self._tell(after, event, at, by)
        return after

    def _tell(
        self, goal: FollowedGoal, event: str, at: Instant, by: str | None = None
    ) -> None:
        slots: dict[str, Slot] = {
            "robot": goal.robot_id,
            "by": by or goal.by,
            "id": goal.goal.goal_id,
            "goal": goal.goal.kind,
            "aisle": goal.aisle,
            "x": goal.goal.x,
            "y": goal.goal.y,
            "why": goal.why,
            "s": round(at.mono - goal.sent.mono, 1),
        }
        key = f"sent.{goal.goal.kind}" if event == "sent" else event
        line = LogEvent("command", f"log.goal.{key}", slots, goal.robot_id)
        self._event_log.log(line, at)
        self._event_log.goal(goal, event, at)
        self._event_log.changed(topics.ROBOT.for_id(goal.robot_id))

    # --- sending ------------------------------------------------------------------

    def _send(self, robot_id: str, order: GoalOrder | CancelOrder) -> None:
        for port in self._ports:
            work = self._attempt(port, robot_id, order)
            task = asyncio.get_running_loop().create_task(work, name=f"goal-{robot_id}")
            # The loop itself keeps only weak references to tasks.
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _attempt(
        self, port: CommandPort, robot_id: str, order: GoalOrder | CancelOrder
    ) -> None:
        # A STOP may have come while this send waited for its turn.
        if isinstance(order, GoalOrder) and self._is_held(robot_id):
            return
        try:
            await port.goal(robot_id, order)
        except HopError as error:
            # No repetition: a goal without an answer ends as UNCONFIRMED.
            _log.info("goal of %s not sent: %s", robot_id, error)

    async def close(self) -> None:
        """Cancel the sends that are under way."""
        for task in (tasks := list(self._tasks)):
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
