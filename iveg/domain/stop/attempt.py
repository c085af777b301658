"""One attempt to release or resume a robot, and the effect its copies can still have.

An order carries a challenge that the robot spends on the first copy, whatever it makes
of it.  So a newer report with another challenge says that no copy can act any more:
what it shows has come to stay.

The copies go out once on each transport and come in any order, late, or not at all.
The robot's reports decide, not its answers: one that shows the release makes it true,
and a refusal counts once a report shows that the challenge is spent.
"""

from dataclasses import dataclass, replace
from typing import Literal

from iveg.domain.observations import CommandAnswer, Instant, SafetyReport
from iveg.domain.stop.commands import FollowedCommand, State
from iveg.domain.transports import TransportId


@dataclass(frozen=True, slots=True)
class Attempt:
    """A release or resume that was sent and not yet decided.

    Attributes:
        challenge: That of the report that a person saw.
        ids: What a release lifts; none in a resume.
        before: The state that it began in, and goes back to if it is refused.
        refused: Why one of its copies was refused.
    """

    command: FollowedCommand
    challenge: str
    ids: tuple[str, ...] = ()
    before: State = "STANDING"
    refused: str | None = None

    def is_spent(self, report: SafetyReport | None) -> bool:
        """Whether no copy can act any more.

        Args:
            report: The robot's newest, by (boot, seq): not older than the one that the
                order was made from.
        """
        return report is not None and report.challenge != self.challenge

    def answered(
        self, answer: CommandAnswer, transport: TransportId, at: Instant
    ) -> "Attempt":
        """The robot answers a copy."""
        command = self.command.answered(transport, at)
        refused = self.refused
        if answer.result == "REFUSED":
            refused = answer.why or "refused"
        return replace(self, command=command, refused=refused)

    def verdict(
        self, report: SafetyReport, hold_id: str | None
    ) -> Literal["running", "ready", "refused"] | None:
        """What a report makes of it, if that decides it.

        Args:
            report: The robot's newest.
            hold_id: Our hold; None where iVeg has not stopped the robot.
        """
        if self.command.kind == "resume" and drives(report):
            return "running"
        if self.command.kind == "release" and _is_released(report, hold_id):
            return "ready"
        return "refused" if self.is_refused(report, hold_id) else None

    def is_refused(self, report: SafetyReport | None, hold_id: str | None) -> bool:
        """Whether one copy was refused and none can act any more; args likewise."""
        if self.refused is None or not self.is_spent(report):
            return False
        is_resume = self.command.kind == "resume"
        return is_resume or (report is not None and _is_held(report, hold_id))


def drives(report: SafetyReport) -> bool:
    """Whether a robot reports that it is free to drive."""
    return not report.holds and report.speed_factor > 0


def _is_released(report: SafetyReport, hold_id: str | None) -> bool:
    if hold_id is None:
        return not _is_held(report, None)
    return not _is_held(report, hold_id) and hold_id in report.released


def _is_held(report: SafetyReport, hold_id: str | None) -> bool:
    if hold_id is None:
        return any(hold.ack == "remote" for hold in report.holds)
    return hold_id in {hold.id for hold in report.holds}
