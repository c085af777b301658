"""Right of way between robots by their tasks, while no person is near.

The paper: "in the absence of human presence, the system manages multi-robot
interactions by evaluating the task status of detected peers".  Where the paths of two
meet, the one with the lesser task slows as soon as the encounter is foretold; for the
other everything stays as it is.  So nobody is ever faster for it
(docs/decisions/0007-right-of-way.md).
"""

from collections.abc import Collection, Mapping

from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.paths import PLAN_LASTS_S
from iveg.domain.world import World

RANKS: Mapping[str, int] = {
    "waiting": 0,
    "watching": 1,
    "scouting": 1,
    "goal": 2,
    "hauling": 3,
}
"""Tasks by their word (``task`` of a robot's navigation): the greater goes first, a
load before an errand, that before a look around.  Any other word gives no right."""


def gives_way_to(
    robot: RobotState, causes: Collection[str], world: World, now: Instant
) -> frozenset[str]:
    """The peers among these causes whose task is the greater one."""
    rank = _rank(robot, now)
    if rank is None:
        return frozenset()
    peers = (world.robots[cause] for cause in causes if cause in world.robots)
    theirs = {peer.robot_id: _rank(peer, now) for peer in peers}
    return frozenset(
        peer for peer, other in theirs.items() if other is not None and other > rank
    )


def _rank(robot: RobotState, now: Instant) -> int | None:
    """The rank of a task that was told lately; None: unknown."""
    heard, navigation = robot.navigation_received, robot.navigation
    if navigation is None or heard is None or now.mono - heard.mono > PLAN_LASTS_S:
        return None
    return RANKS.get(navigation.task.strip().lower())
