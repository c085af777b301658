"""Ports of the pipeline to the outside."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from iveg.domain.feedback import Feedback
from iveg.domain.goals import CancelOrder, GoalOrder
from iveg.domain.observations import Instant
from iveg.domain.peer_scan import PeerScan
from iveg.domain.transports import Transport
from iveg.vital.health_monitor import HopState
from iveg.vital.record import RecordSink

Clock = Callable[[], Instant]
"""Reads both clocks of this machine."""
Ids = Callable[[], str]
"""Source of new ids: random, sortable, never reused (ULID)."""


class CommandPort(Protocol):
    """Port of a transport for orders; a 2xx or PUBACK proves nothing of a robot.

    A release, resume or goal is sent once: never retained, never sent again.
    """

    async def stop(self, robot_id: str, hold_id: str, by: str) -> None:
        """Send a STOP; returns when the next hop has it.

        Raises:
            HopError: it was not taken.
        """

    async def release(
        self, robot_id: str, ids: Iterable[str], challenge: str, attempt: str
    ) -> None:
        """Send a release, once; ``attempt`` names it in the robot's answer.

        Raises:
            HopError: it was not taken.
        """

    async def resume(self, robot_id: str, challenge: str, attempt: str) -> None:
        """Send a resume, once.

        Raises:
            HopError: it was not taken.
        """

    async def goal(self, robot_id: str, order: GoalOrder | CancelOrder) -> None:
        """Send a goal, or its cancellation.

        Raises:
            HopError: it was not taken.
        """


class FleetPort(Protocol):
    """The fleet's topics on MQTT: feedback and desired states."""

    def publish_feedback(self, feedback: Feedback) -> None:
        """Publish feedback to the fleet; the newest of each topic counts."""

    def publish_peer_scan(self, scan: PeerScan) -> None:
        """Publish a scan for peers, which may be lost."""

    async def set_desired_state(
        self, robot_id: str, desired: Literal["stopped", "run"], ids: Iterable[str]
    ) -> None:
        """Publish the retained desired state.

        Raises:
            HopError: the broker did not take it.
        """


class StopJournal(Protocol):
    """Append-only file of desired states; outlives a crash and a lost database."""

    async def log_desired(
        self,
        robot_id: str,
        desired: Literal["stopped", "run"],
        hold_id: str | None,
        by: str,
        at: Instant,
        *,
        named: Sequence[str] = (),
        challenge: str | None = None,
    ) -> None:
        """Write a robot's desired state; returns when it is on disk.

        ``named``: STOPs that a release is about to name, with its ``challenge``.  The
        robot must still stand: only a desired state of ``run`` ends that.
        """


@dataclass(frozen=True, slots=True)
class Ports:
    """Ports of the pipeline to the outside.

    Attributes:
        fleet: Feedback and desired states of all robots.
        transports: Ways of an order to a robot.
        journal: Desired state of each robot, on disk.
        sink: The history.
        clock: Reads both clocks.
        new_id: Makes ids.
        history_state: State of the history.
    """

    fleet: FleetPort
    transports: Mapping[Transport, CommandPort]
    journal: StopJournal
    sink: RecordSink
    clock: Clock
    new_id: Ids
    history_state: Callable[[], HopState]
