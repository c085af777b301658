"""One attempt to release a robot or to let it drive, and what its copies can still do.

An order carries a challenge that the robot spends on the first copy, whatever it makes
of it.  So a newer report with another challenge says that no copy can act any more:
what it shows has come to stay.
"""

from dataclasses import dataclass

from iveg.domain.observations import CommandAnswer, SafetyReport
from iveg.domain.stop.commands import Command


@dataclass(slots=True)
class Attempt:
    """A release or resume that was sent and not yet decided.

    Attributes:
        challenge: That of the report that a person saw.
        ids: What a release lifts; none in a resume.
        refused: Why one of its copies was refused.
    """

    command: Command
    challenge: str
    ids: tuple[str, ...] = ()
    refused: str | None = None

    def is_spent(self, report: SafetyReport | None) -> bool:
        """Whether no copy can act any more.

        Args:
            report: The robot's newest, by (boot, seq): not older than the one that the
                order was made from.
        """
        return report is not None and report.challenge != self.challenge

    def is_meant_by(self, answer: CommandAnswer) -> bool:
        """Whether this answers it; a robot of the earlier version names no attempt."""
        if answer.attempt is not None:
            return answer.attempt == self.command.command_id
        if answer.result == "REFUSED":
            return answer.id is None or answer.id in self.ids
        if self.command.kind == "resume":
            return answer.result == "RESUMED"
        return answer.result == "RELEASED" and answer.id in self.ids
