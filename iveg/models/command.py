"""STOP, release and resume as people follow them, live and remembered.

The answer to a press of STOP, release or resume.

Times of the newest STOPs.
"""

from collections.abc import Iterable, Sequence
from math import isfinite
from typing import Any, Literal

from pydantic import Field, ValidationError

from iveg.domain import stop
from iveg.domain.alerts import nearest_rank
from iveg.domain.goals import GoalKind
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.records import ByTransport, CommandEventRecord, CommandRecord, Json
from iveg.domain.stamps import format_stamp
from iveg.domain.stop import StopMachine
from iveg.domain.stop.commands import Outcome, Times, outcome_of, was_loud
from iveg.domain.transports import DIRECT, TRANSPORTS, TransportId
from iveg.models.base import Model, Slots, rounded, stamp

AGENT_LATE_S = 1.0
"""An agent that is less behind than this is not worth a sentence."""


class CommandTimes(Model):
    """When each step came to be known; null where it has not yet.

    When each step came to be known (ISO-8601); null where it has not. ``sent`` is when
    the order left for that transport, not when that took it.

    Attributes:
        requested: Accepted by the server.
    """

    pressed: str | None = Field(
        description=(
            "By the browser's corrected clock; null where no page told, or it cannot "
            "be."
        )
    )
    requested: str
    sent: dict[TransportId, str] = Field(
        description="By transport, when it took it; one that has not is not there."
    )
    answer: dict[TransportId, str] = Field(
        description="By transport, when the robot said by it that it has it."
    )
    standing: str | None = Field(description="The first standing sample.")

    @classmethod
    def of(
        cls,
        pressed: float | None,
        requested: float,
        sent: ByTransport,
        answer: ByTransport,
        standing: float | None,
    ) -> "CommandTimes":
        """All in Unix seconds."""
        return cls(
            pressed=stamp(pressed),
            requested=format_stamp(requested),
            sent={one: format_stamp(at) for one, at in sent.items()},
            answer={one: format_stamp(at) for one, at in answer.items()},
            standing=stamp(standing),
        )

    def columns(self) -> dict[str, Any]:
        """The same under the names that a CSV has."""
        by_transport = {
            f"{step}_{one.id}_at": times.get(one.id)
            for step, times in (("sent", self.sent), ("answer", self.answer))
            for one in TRANSPORTS
        }
        return {
            "pressed_at": self.pressed,
            "requested_at": self.requested,
            "standing_at": self.standing,
            **by_transport,
        }


class CommandRobot(Model):
    """The robot's last word, while a command is open.

    Attributes:
        v: Speed (m/s).
        report_age_s: At most, its way included; null while nobody knows (s).
        moved_m: How far it may have driven since (m).
    """

    v: float
    report_age_s: float | None
    moved_m: float


class CommandStep(Model):
    """One line of the audit trail of a command.

    Attributes:
        at: When.
        state: State from then on.
        why: What led to it.
    """

    at: str
    state: str
    why: str


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


class Command(Model):
    """One STOP, release, resume or goal.

    What only a command that goes on has is null, empty or false in the history.

    A STOP ends as ``RUNNING``. ``REPLACED``: another command took over. ``EXPIRED``:
    the robot never confirmed a release or resume, or a crash of the server left the
    command open.

    A transport is ``ok`` when the robot's answer has come back on it, and ``direct`` of
    a STOP when the broker has it (PUBACK). It is ``pending`` when the order was handed
    over and nothing more is known: Orion's 204 is no evidence. It is ``unknown`` when
    Orion took the order while the agent or the broker is known to be cut off;
    ``failed`` when the order was not taken; ``off`` by ``IVEG_STOP_DIRECT``. The keys
    are the ids of ``iveg/domain/transports.py``; another transport is one more key.

    Attributes:
        command_id: ULID.
        robot_id: Whom it is for.
        kind: What was asked.
        drill: A proof of STOP, not a need.
        state: One of the nine states of [safety.md](../safety.md), ``RUNNING``,
            ``REPLACED`` or ``EXPIRED``, see below; of a goal that of [Goal](#goal).
        requested_by: Who pressed first.
        times: When each step came to be known.
        requested_at: Likewise; this and the five below iVeg's clock (ISO-8601 UTC, ms).
        sent_fiware_at: When it left by each transport that took it (ISO-8601 UTC, ms).
        sent_direct_at: When it left by each transport that took it (ISO-8601 UTC, ms).
        answer_fiware_at: When the robot first said by it that it has it (ISO-8601 UTC,
            ms).
        answer_direct_at: When the robot first said by it that it has it (ISO-8601 UTC,
            ms).
        standing_at: The first standing sample (ISO-8601 UTC, ms).
        standstill_ms: First standing sample less the press; null while unknown (ms).
        tries: How often it was sent before the robot stood, all transports at once
            counted once.
        reason: Null, ``moved``, ``reasserted``, ``restarted`` (the server was; the
            audit row names the id that took over), ``release_unconfirmed``, or the
            robot's code.
        requesters: All who pressed.
        hold_id: What a STOP is called at the robot: its own ``command_id`` unless it
            keeps an earlier hold; null for others.
        pressed_doubted: The page told a time that cannot be.
        age_s: Since it was requested (s).
        transports: By transport: ``ok``, ``failed``, ``off``, ``pending`` or
            ``unknown``, see below.
        agent_lag_s: How late the IoT Agent was when it was last sent; null if unknown
            (s).
        note: The sentence of that; null where the agent keeps up or nobody knows.
        robot: The robot's last word while it is open.
        challenge_fresh: A release may be composed now.
        was_loud: It was UNCONFIRMED or STILL_MOVING at any time.
    """

    command_id: str
    robot_id: str
    kind: Literal["stop", "release", "resume", "goal"]
    state: str
    requested_by: str
    times: CommandTimes
    pressed_at: str | None = Field(
        description="As in ``times``, under the name of the CSV; so the six below."
    )
    requested_at: str
    sent_fiware_at: str | None
    sent_direct_at: str | None
    answer_fiware_at: str | None
    answer_direct_at: str | None
    standing_at: str | None
    standstill_ms: float | None
    tries: int
    reason: str | None
    requesters: list[str]
    hold_id: str | None = None
    pressed_doubted: bool = False
    age_s: float | None = None
    transports: dict[str, str]
    agent_lag_s: float | None = None
    note: Sentence | None = None
    robot: CommandRobot | None = None
    challenge_fresh: bool = False
    outcome: Outcome | None = Field(
        default=None,
        description=(
            "How it ended; null on ``/live``, where ``state`` says how it stands."
        ),
    )
    was_loud: bool = False
    goal: CommandGoal | None = Field(
        default=None, description="Of a goal; on ``/live`` goals are the robot's."
    )
    steps: list[CommandStep] = Field(
        description=(
            "Steps of the audit trail; empty on ``/live``, which reports each step "
            "itself."
        )
    )

    @classmethod
    def of(
        cls, of: stop.FollowedCommand, machine: StopMachine, now: Instant
    ) -> "Command":
        """One command with the robot's last word."""
        times = _times(of.times)
        return cls(
            command_id=of.command_id,
            robot_id=of.robot_id,
            kind=of.kind,
            state=of.state,
            requested_by=of.requesters[0],
            times=times,
            **times.columns(),
            standstill_ms=rounded(of.standstill_ms),
            tries=of.tries,
            reason=of.reason,
            hold_id=of.hold_id,
            requesters=list(of.requesters),
            pressed_doubted=of.times.pressed_doubted,
            age_s=round(now.mono - of.times.requested.mono, 3),
            transports=dict(of.transports.items()),
            agent_lag_s=rounded(of.agent_lag_s, 1),
            note=_note(of),
            robot=_robot(machine, now),
            challenge_fresh=machine.evidence.report_age(now) <= LIMITS.report_fresh_s,
            steps=[],
        )

    @classmethod
    def of_record(
        cls, record: CommandRecord, steps: Sequence[CommandEventRecord] = ()
    ) -> "Command":
        """One command as it is remembered, with each of its steps."""
        times = CommandTimes.of(
            record.pressed_at,
            record.requested_at,
            record.sent_at,
            record.answer_at,
            record.standing_at,
        )
        return cls(
            command_id=record.command_id,
            robot_id=record.robot_id,
            kind=record.kind,
            state=record.state,
            requested_by=record.requested_by,
            times=times,
            **times.columns(),
            standstill_ms=record.standstill_ms,
            tries=record.tries,
            reason=record.reason,
            requesters=[record.requested_by],
            transports={},
            outcome=outcome_of(record),
            was_loud=was_loud((record.state, *(one.state for one in steps))),
            goal=_goal(record.goal),
            steps=[
                CommandStep(at=format_stamp(one.at), state=one.state, why=one.why)
                for one in steps
            ],
        )


def _goal(found: Json | None) -> CommandGoal | None:
    """A remembered goal; None where a row holds none that is whole."""
    try:
        return None if found is None else CommandGoal.model_validate(found)
    except ValidationError:
        return None


def _times(of: Times) -> CommandTimes:
    return CommandTimes.of(
        of.pressed,
        of.requested.wall,
        {one: at.wall for one, at in of.sent.items()},
        {one: at.wall for one, at in of.answered.items()},
        None if of.standing is None else of.standing.wall,
    )


def _robot(machine: StopMachine, now: Instant) -> CommandRobot:
    report, age = machine.evidence.report, machine.evidence.evidence_age(now)
    return CommandRobot(
        v=0.0 if report is None else report.linear,
        report_age_s=rounded(age) if isfinite(age) else None,
        moved_m=round(machine.evidence.moved_m(now), 2),
    )


def _note(of: stop.FollowedCommand) -> Sentence | None:
    """Note about a late agent for an order that went through it."""
    lag = of.agent_lag_s
    if lag is None or lag <= AGENT_LATE_S:
        return None
    direct = of.transports[DIRECT.id] not in ("off", "failed")
    key = "stop.note.direct" if direct else "stop.note.fiware"
    return Sentence(key=key, slots={"lag": round(lag, 1)})


class Pressed(Model):
    """A STOP, release or resume that was accepted.

    Attributes:
        robot_id: What was asked of whom.
        command_id: What was asked of whom.
        state: ``REQUESTED``, or how it stands.
    """

    robot_id: str
    command_id: str
    state: str

    @classmethod
    def of(cls, command: stop.FollowedCommand) -> "Pressed":
        """As it stands just after the press."""
        return cls(
            robot_id=command.robot_id,
            command_id=command.command_id,
            state=command.state,
        )


class FleetPressed(Model):
    """A fleet STOP: one command a robot.

    Attributes:
        commands: One for each robot.
    """

    commands: list[Pressed]


class LatencySpread(Model):
    """Times of one step (ms); null where nothing was measured.

    Attributes:
        count: Samples.
        p50_ms: Null where nothing was measured (ms).
        p95_ms: Null where nothing was measured (ms).
        max_ms: Null where nothing was measured (ms).
    """

    count: int
    p50_ms: float | None
    p95_ms: float | None
    max_ms: float | None

    @classmethod
    def of(cls, values: Iterable[float | None]) -> "LatencySpread":
        """Of measured times, to a tenth of a millisecond; missing ones do not count."""
        known = sorted(value for value in values if value is not None)
        return cls(
            count=len(known),
            p50_ms=rounded(nearest_rank(known, 0.50), 1),
            p95_ms=rounded(nearest_rank(known, 0.95), 1),
            max_ms=rounded(nearest_rank(known, 1.0), 1),
        )


class RobotLatency(Model):
    """One robot's STOPs: how many, and each step from the press on.

    Attributes:
        robot_id: The robot.
        stops: How many.
        accepted: Times of the step.
        answer: By transport, until it left and until the robot answered.
        standing: Times of the step.
    """

    robot_id: str
    stops: int
    accepted: LatencySpread
    sent: dict[TransportId, LatencySpread] = Field(
        description=(
            "By transport, until it left; ``answer`` until the robot said that it has"
            " it."
        )
    )
    answer: dict[TransportId, LatencySpread]
    standing: LatencySpread


class Latency(Model):
    """Times of the newest STOPs of a range.

    Attributes:
        since: The range.
        until: The range.
        robots: One for each robot.
    """

    since: str
    until: str
    robots: list[RobotLatency]
