"""STOP, release and resume, live and from the history."""

from collections.abc import Sequence
from math import isfinite
from typing import Annotated, Any, Self

from iveg.domain import stop
from iveg.domain.goals import GoalKind
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.records import SHOWN_COLUMNS, CommandEventRecord, CommandRecord
from iveg.domain.stop import StopMachine
from iveg.domain.stop.commands import Outcome, outcome_of, was_loud, write_command
from iveg.domain.transports import TransportId
from iveg.models.base import (
    OR_NONE,
    Hundredth,
    Model,
    Row,
    Slots,
    Stamp,
    Thousandth,
    members_of,
    row_of,
)


class CommandTimes(Model):
    """When each step came to be known; null where it has not yet.

    When each step came to be known (ISO-8601); null where it has not. ``sent`` is when
    the order left for that transport, not when that took it.

    Attributes:
        pressed: By the browser's corrected clock; null where no page sent it, or where
            it is impossible.
        requested: Accepted by the server.
        sent: By transport, when the order left; a transport that has not taken it has
            no key.
        answer: By transport, when the robot said by it that it has it.
        standing: The first standing sample.
    """

    pressed: Stamp | None
    requested: Stamp
    sent: dict[TransportId, Stamp]
    answer: dict[TransportId, Stamp]
    standing: Stamp | None


class CommandRobot(Model):
    """The robot's last word, while a command is open.

    Attributes:
        v: Speed (m/s).
        report_age_s: At most, its way included; null while nobody knows (s).
        moved_m: How far it may have driven since (m).
    """

    v: float
    report_age_s: Thousandth | None
    moved_m: Hundredth


@members_of(CommandEventRecord, "state", "why")
class CommandStep(Model):
    """One line of the audit trail of a command.

    Attributes:
        at: When.
        state: State from then on.
        why: What led to it.
    """

    at: Stamp


class Sentence(Model):
    """The name of a template and what fills its holes.

    Attributes:
        key: Template.
        slots: Values.
    """

    key: str
    slots: Slots


class CommandGoal(Model):
    """Where a goal sends a robot, in ``map`` (m).

    Attributes:
        kind: What was asked for.
        x: The place in ``map`` (m).
        y: The place in ``map`` (m).
        aisle: Label of the lane, of ``aisle``.
    """

    kind: GoalKind
    x: float
    y: float
    aisle: str | None


@row_of(CommandRecord)
class Command(Row):
    """One STOP, release, resume or goal.

    Members of an open command alone are null, empty or false in the history.

    A STOP ends as ``RUNNING``. ``REPLACED``: another command took over. ``EXPIRED``:
    the robot never confirmed a release or resume, or a crash of the server left the
    command open. The states are those of [safety.md](../safety.md), of a goal those of
    [Goal](#goal).

    The ``reason`` is null, ``moved``, ``reasserted``, ``restarted`` (the server was;
    the audit row names the id that took over), ``release_unconfirmed``, or the robot's
    code.

    A transport is ``ok`` when the robot's answer has come back on it, and ``direct`` of
    a STOP when the broker has it (PUBACK). It is ``pending`` when the order was handed
    over without an answer: Orion's 204 is no evidence. It is ``unknown`` when
    Orion took the order while the agent or the broker is known to be cut off;
    ``failed`` when the order was not taken; ``off`` by ``IVEG_STOP_DIRECT``. The keys
    are the ids of ``iveg/domain/transports.py``; another transport is one more key.

    Attributes:
        times: When each step came to be known; each has a key of its own, too, named as
            in the CSV.
        standstill_ms: First standing sample less the press; null while unknown (ms).
        requesters: All people who pressed.
        hold_id: What a STOP is called at the robot: its own ``command_id`` unless it
            keeps an earlier hold; null for others.
        age_s: Since it was requested (s).
        transports: By transport: ``ok``, ``failed``, ``off``, ``pending`` or
            ``unknown``, see above.
        robot: The robot's last word while it is open.
        challenge_fresh: A release may be composed now.
        outcome: How it ended; null on ``/live``, where ``state`` says how it stands.
        was_loud: It was UNCONFIRMED or STILL_MOVING at any time.
        goal: Of a goal; on ``/live`` goals are the robot's.
        steps: Steps of the audit trail; empty on ``/live``, which reports each step
            itself.
    """

    times: CommandTimes
    standstill_ms: Thousandth | None
    requesters: list[str]
    hold_id: str | None = None
    age_s: Thousandth | None = None
    transports: dict[str, str]
    robot: CommandRobot | None = None
    challenge_fresh: bool = False
    outcome: Outcome | None = None
    was_loud: bool = False
    goal: Annotated[CommandGoal | None, OR_NONE] = None
    steps: list[CommandStep]

    @classmethod
    def from_command(
        cls, command: stop.FollowedCommand, machine: StopMachine, now: Instant
    ) -> Self:
        """A command of this run, with the robot's newest report."""
        return cls._from_row(
            write_command(command),
            requesters=list(command.requesters),
            hold_id=command.hold_id,
            age_s=now.mono - command.times.requested.mono,
            transports=dict(command.transports),
            robot=_robot(machine, now),
            # A release lifts the holds that a person sees: their report must be fresh.
            challenge_fresh=machine.evidence.report_age(now) <= LIMITS.report_fresh_s,
            steps=[],
        )

    @classmethod
    def from_record(
        cls, record: CommandRecord, steps: Sequence[CommandEventRecord] = ()
    ) -> Self:
        """A command of the history, with each of its steps."""
        return cls._from_row(
            record,
            requesters=[record.requested_by],
            transports={},
            outcome=outcome_of(record),
            was_loud=was_loud((record.state, *(step.state for step in steps))),
            steps=steps,
        )

    @classmethod
    def _from_row(cls, record: CommandRecord, **other: Any) -> Self:
        times = {
            "pressed": record.pressed_at,
            "requested": record.requested_at,
            "sent": record.sent_at,
            "answer": record.answer_at,
            "standing": record.standing_at,
        }
        by_transport = {
            column.name: column.read(record)
            for column in SHOWN_COLUMNS[CommandRecord]
            if column.transport
        }
        return cls.from_value(record, times=times, **by_transport, **other)


def _robot(machine: StopMachine, now: Instant) -> CommandRobot:
    report, age = machine.evidence.report, machine.evidence.evidence_age(now)
    return CommandRobot(
        v=0.0 if report is None else report.linear,
        # JSON has no infinity, which is the age before the first report.
        report_age_s=age if isfinite(age) else None,
        moved_m=machine.evidence.moved_m(now),
    )


class Pressed(Model):
    """A STOP, release or resume that was accepted.

    Attributes:
        robot_id: Robot that the order is for.
        command_id: Id of the order.
        state: ``REQUESTED``, or its present state.
    """

    robot_id: str
    command_id: str
    state: str


class FleetPressed(Model):
    """A fleet STOP: one command a robot.

    Attributes:
        commands: One for each robot.
    """

    commands: list[Pressed]
