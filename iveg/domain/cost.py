"""What limits cost over a range, and how near it was: from rows of the history alone.

Aisles are where robots were, so that they are known as long as telemetry is kept; near
misses as long as people's places are.  Time lost is estimated against the same robot's
free speed (docs/interfaces/resources.md, "TaskCost").
"""

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from iveg.domain.fleet import as_counted
from iveg.domain.greenhouse import Greenhouse

SLOT_S = 10.0
"""Slow driving is read in slots of this: a few metres of an aisle (s)."""
MOST_MISSES, MOST_TASKS = 20, 200


@dataclass(frozen=True, slots=True)
class SlowSlot:
    """A robot that drove under a limit, in one slot; means over it.

    Attributes:
        at: When the slot begins (Unix s).
        seconds: How long it drove so; ``half_s`` of it at half speed or less.
        speed: (m/s).
    """

    robot_id: str
    at: float
    seconds: float
    half_s: float
    x: float
    y: float
    speed: float


@dataclass(frozen=True, slots=True)
class SpeedChange:
    """A robot said that it applies another factor, and why."""

    robot_id: str
    at: float
    factor: float
    reason: str
    decision_id: str | None = None


@dataclass(frozen=True, slots=True)
class Task:
    """A goal of a robot, from the order to its end (Unix s)."""

    task_id: str
    robot_id: str
    state: str
    since: float
    until: float


@dataclass(frozen=True, slots=True)
class TaskCost:
    """What limits cost a robot in one task; ``task`` None: outside tasks.

    Attributes:
        slowed_s: How long it drove under a limit.
        held_s: How long it was held in the task; outside tasks nobody knows whether
            it would have driven.
        free_speed: What it drives when it is free (m/s); None where it never was.
    """

    robot_id: str
    task: Task | None
    free_speed: float | None
    slowed_s: float = 0.0
    held_s: float = 0.0
    slow_m: float = 0.0
    """Metres driven under a limit."""

    @property
    def lost_m(self) -> float | None:
        """Metres that it would have driven more (m); None where nobody knows."""
        if self.free_speed is None:
            return None
        return max(0.0, (self.slowed_s + self.held_s) * self.free_speed - self.slow_m)

    @property
    def lost_s(self) -> float | None:
        """The time that these metres take at free speed (s)."""
        if self.lost_m is None or not self.free_speed:
            return None
        return self.lost_m / self.free_speed


class SpeedChanges:
    """What robots said that they applied, to be looked up by time."""

    def __init__(self, changes: Iterable[SpeedChange]) -> None:
        self._of: dict[str, list[SpeedChange]] = defaultdict(list)
        for one in sorted(changes, key=lambda it: it.at):
            self._of[one.robot_id].append(one)
        self._slow = {
            robot: [one for one in own if 0.0 < one.factor < 1.0]
            for robot, own in self._of.items()
        }
        self._at = {r: [one.at for one in own] for r, own in self._slow.items()}

    def why_slow(self, robot_id: str, at: float) -> SpeedChange | None:
        """The newest limit, none that held it, that it told until then."""
        place = bisect_right(self._at.get(robot_id, ()), at)
        return self._slow[robot_id][place - 1] if place else None

    def held_s(self, robot_id: str, since: float, until: float) -> float:
        """How long it was held between two moments (s)."""
        changes = self._of.get(robot_id, [])
        ends = [one.at for one in changes[1:]] + [until]
        return sum(
            max(0.0, min(end, until) - max(one.at, since))
            for one, end in zip(changes, ends, strict=bool(changes))
            if one.factor <= 0.0
        )


def slowed_by_aisle(
    slots: Iterable[SlowSlot], changes: SpeedChanges, greenhouse: Greenhouse
) -> dict[tuple[str, str | None], float]:
    """(reason, aisle of the robot) → minutes at half speed or less."""
    minutes: dict[tuple[str, str | None], float] = defaultdict(float)
    for one in slots:
        if one.half_s > 0.0:
            change = changes.why_slow(one.robot_id, one.at + SLOT_S)
            why = "" if change is None else change.reason
            minutes[why, greenhouse.lane_at(one.x, one.y)] += one.half_s / 60.0
    return dict(minutes)


def costs(
    slots: Iterable[SlowSlot],
    tasks: Sequence[Task],
    changes: SpeedChanges,
    free_speed: Mapping[str, float],
) -> list[TaskCost]:
    """What each task cost, oldest first, and each robot outside of any, last."""
    found = {
        one.task_id: TaskCost(
            one.robot_id,
            one,
            free_speed.get(one.robot_id),
            held_s=changes.held_s(one.robot_id, one.since, one.until),
        )
        for one in sorted(tasks, key=lambda it: it.since)
    }
    outside: dict[str, TaskCost] = {}
    for slot in slots:
        task = _task_at(tasks, slot)
        if task is None:
            robot = slot.robot_id
            before = outside.get(robot) or TaskCost(robot, None, free_speed.get(robot))
            outside[robot] = _with(before, slot)
        else:
            found[task.task_id] = _with(found[task.task_id], slot)
    return [
        *found.values(),
        *(outside[robot] for robot in sorted(outside, key=as_counted)),
    ]


def _with(cost: TaskCost, slot: SlowSlot) -> TaskCost:
    return replace(
        cost,
        slowed_s=cost.slowed_s + slot.seconds,
        slow_m=cost.slow_m + slot.seconds * slot.speed,
    )


def _task_at(tasks: Iterable[Task], slot: SlowSlot) -> Task | None:
    return next(
        (
            one
            for one in tasks
            if one.robot_id == slot.robot_id and one.since <= slot.at < one.until
        ),
        None,
    )
