"""STOP, release and resume as people follow them, live and remembered."""

from collections.abc import Sequence
from math import isfinite
from typing import Any, Literal

from pydantic import Field, ValidationError

from iveg.domain import stop
from iveg.domain.goals import GoalKind
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.records import ByTransport, CommandEventRecord, CommandRecord, Json
from iveg.domain.stamps import format_stamp
from iveg.domain.stop import StopMachine
from iveg.domain.stop.commands import Times
from iveg.domain.stop.outcome import Outcome, outcome_of, was_loud
from iveg.domain.transports import DIRECT, TRANSPORTS, TransportId
from iveg.models.base import Model, Slots, rounded, stamp

AGENT_LATE_S = 1.0
"""An agent that is less behind than this is not worth a sentence."""


class CommandTimes(Model):
    """When each step came to be known; null where it has not yet."""

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
    """The robot's last word, while a command is open."""

    v: float
    report_age_s: float | None
    moved_m: float


class CommandStep(Model):
    """One line of the audit trail of a command."""

    at: str
    state: str
    why: str


class Sentence(Model):
    """The name of a template and what fills its holes."""

    key: str
    slots: Slots


class CommandGoal(Model):
    """Where a goal sends a robot, in ``map`` (m)."""

    kind: GoalKind
    x: float
    y: float
    aisle: str | None


class Command(Model):
    """One STOP, release, resume or goal.

    What only a command that goes on has is null, empty or false in the history.
    """

    command_id: str
    robot_id: str
    kind: Literal["stop", "release", "resume", "goal"]
    drill: bool
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
            drill=of.drill,
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
            drill=record.drill,
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
