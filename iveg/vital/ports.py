"""Ports of the pipeline: what it needs of the outside, a few verbs each."""

from collections.abc import Iterable, Sequence
from typing import Literal, Protocol, TypeVar

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.events import Address, MessageText
from iveg.domain.feedback import Feedback
from iveg.domain.goals import CancelOrder, GoalOrder
from iveg.domain.observations import Instant
from iveg.domain.peer_scan import PeerScan

_Kept = TypeVar("_Kept", contravariant=True)


class GoalPort(Protocol):
    """A transport's port for goals, each sent once; 2xx or PUBACK is no evidence."""

    async def goal(self, robot_id: str, order: GoalOrder | CancelOrder) -> None:
        """Send a goal, or its cancellation.

        Raises:
            HopError: it was not taken.
        """


class CommandPort(GoalPort, Protocol):
    """A transport's port for orders; an answer of 2xx or a PUBACK is no evidence.

    A release or resume is sent once: never retained, never sent again.
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
    """Append-only file that outlives a crash and a lost database."""

    async def log_desired(
        self,
        robot_id: str,
        desired: Literal["stopped", "run"],
        hold_id: str | None,
        by: str,
        at: Instant,
    ) -> None:
        """Write a robot's desired state down; returns when it is on disk."""

    async def log_release(
        self,
        robot_id: str,
        hold_id: str,
        ids: Sequence[str],
        challenge: str,
        by: str,
        at: Instant,
    ) -> None:
        """Write down that a release is about to name these STOPs; likewise.

        The robot is still to stand: only a desired state of ``run`` ends that.
        """


class RuleStore(Protocol):
    """Every version of the rule that ever was in force."""

    async def append(self, rule: DetectionRule) -> None:
        """Write a new version down; returns when it is on disk. Raises HopError."""


class ChoiceStore(Protocol[_Kept]):
    """Storage of what people chose, such as the trial of a rule."""

    async def save(self, kept: _Kept, /) -> None:
        """Put it in the place of what was before; returns on disk. Raises HopError."""


class MessageSender(Protocol):
    """Way to people who are not before a page."""

    async def send(self, to: Address, text: MessageText) -> str | None:
        """Why an address did not take a message; None where it did."""


class Ids(Protocol):
    """Source of new ids: random, sortable, never reused (ULID)."""

    def __call__(self) -> str:
        """A new id."""


class Clock(Protocol):
    """Reads both clocks of this machine."""

    def __call__(self) -> Instant:
        """This moment."""
