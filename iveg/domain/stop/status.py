"""Desired state of one robot, its progress, and the guards that refuse orders.

The guards stand before the machine's table: a request that must not happen is refused
here, and changes nothing.
"""

from collections.abc import Iterable
from dataclasses import replace
from math import inf

from iveg.domain.errors import CommandRefusedError
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, SafetyReport
from iveg.domain.stop.attempt import Attempt
from iveg.domain.stop.commands import Command, State
from iveg.domain.stop.effects import Changed, Closed, Key
from iveg.domain.stop.evidence import Evidence, stands
from iveg.domain.stop.wanted import NEW_HOLD, Kept


class StopStatus(Evidence):
    """The state of one robot's STOP, added to the robot's own reports.

    Attributes:
        robot_id: Whose.
        stop: The STOP of this episode, as it is now.
        attempt: The release or resume under way.
    """

    def __init__(self, robot_id: str) -> None:
        super().__init__()
        self.robot_id = robot_id
        self.state: State = "RUNNING"
        self.stop: Command | None = None
        self.attempt: Attempt | None = None
        self._joined_at = self._begun_at = -inf
        self._doubt: str | None = None
        """The challenge of a release that may still lift the hold that is kept."""

    @property
    def wants_stop(self) -> bool:
        """Whether a STOP stands that no reported release has ended."""
        return self.stop is not None and self.state not in ("RUNNING", "READY")

    def follows(self, command: Command) -> bool:
        """Whether this is the STOP that stands now."""
        stop = self.stop if self.wants_stop else None
        return stop is not None and stop.command_id == command.command_id

    @property
    def once(self) -> Command | None:
        """The release or resume under way."""
        return None if self.attempt is None else self.attempt.command

    @property
    def commands(self) -> tuple[Command, ...]:
        """The STOP, and the release or resume under way, as they are now."""
        return tuple(one for one in (self.stop, self.once) if one is not None)

    def _find(self, command_id: str) -> Command | None:
        return next(
            (one for one in self.commands if one.command_id == command_id), None
        )

    def _keep(self, command: Command) -> None:
        """Store the new value of one of the two commands."""
        if command.kind == "stop":
            self.stop = command
        elif self.attempt is not None:
            self.attempt = replace(self.attempt, command=command)

    @property
    def hold_id(self) -> str | None:
        """Our hold of this episode."""
        return None if self.stop is None else self.stop.hold_id

    def _hold_to_keep(self, at: Instant, *, expired: bool) -> Kept:
        """The hold of iVeg, reported by the robot, that the next STOP holds on to.

        As a rule none: its hold is new.  But the robot may have just reported so many
        that one more would only make a pile; or a release has ``expired`` and nothing
        can lift any more what was reported after it.
        """
        is_fresh = self.report_age(at) <= LIMITS.report_fresh_s
        many = is_fresh and len(self.ours) >= LIMITS.most_holds
        is_spent = self.attempt is not None and self.attempt.is_spent(self.report)
        ours = self.ours if many or (expired and is_spent) else []
        if not ours:
            return NEW_HOLD
        doubt = self._doubt if self.attempt is None else self.attempt.challenge
        kept = self.hold_id if self.hold_id in ours else ours[-1]
        return Kept(kept, None if is_spent else doubt)

    def _is_doubtful(self, now: Instant) -> bool:
        """Whether a hold that may have been lifted goes unreported for too long."""
        if self._doubt is None or not self.wants_stop or self.state == "RELEASING":
            return False
        heard_at = -inf if self.report_at is None else self.report_at.mono
        return now.mono - max(heard_at, self._begun_at) > LIMITS.report_fresh_s

    # --- what is told of it -------------------------------------------------------

    def _changed(self, key: Key, about: Command | None, why: str | None) -> Changed:
        command_id = "" if about is None else about.command_id
        return Changed(command_id, self.state, key, why, self.commands)

    def _closed_by(self, key: Key) -> list[Closed]:
        """Effects that close the commands of the ended episode."""
        return [Closed(one.ended(key), key) for one in reversed(self.commands)]

    # --- guards -------------------------------------------------------------------

    def _guard_drill(self, at: Instant) -> None:
        """Refuse a drill of a robot that moves."""
        if self.state != "RUNNING":
            raise self._refused("Drill", f"its state is {self.state}")
        if self.report is None or not self._is_fresh(at):
            raise self._refused("Drill", "its report is not fresh")
        if max(self.speed, abs(self.report.linear)) > LIMITS.drill_speed_m_s:
            raise self._refused("Drill", "it is moving")

    def _guard_release(
        self, at: Instant, seen: Iterable[str]
    ) -> tuple[str, tuple[str, ...]]:
        """The challenge that a release must echo, and what it lifts."""
        if at.mono - self._joined_at < LIMITS.joined_unseen_s:
            raise self._refused("Release", "somebody has pressed STOP just now")
        report, challenge = self._guard_order("Release", at, "STANDING")
        remote = tuple(hold.id for hold in report.holds if hold.ack == "remote")
        if set(seen) not in (set(remote), {hold.id for hold in report.holds}):
            raise self._refused("Release", "the holds changed")
        if not remote:
            raise self._refused("Release", "nothing holds it that iVeg may lift")
        return challenge, remote

    def _guard_resume(self, at: Instant) -> str:
        """The challenge that a resume must echo."""
        report, challenge = self._guard_order("Resume", at, "READY")
        if report.holds:
            raise self._refused("Resume", "it is still held")
        return challenge

    def _guard_order(
        self, asked: str, at: Instant, wanted: State
    ) -> tuple[SafetyReport, str]:
        """The fresh report of a robot that stands, and its challenge."""
        report = self.report
        if self.state not in (wanted, "RUNNING"):
            raise self._refused(asked, f"its state is {self.state}")
        if report is None or not self._is_fresh(at):
            raise self._refused(asked, "its report is not fresh")
        if not stands(report):
            raise self._refused(asked, "it is moving")
        if report.challenge is None:
            raise self._refused(asked, "it gave no challenge")
        return report, report.challenge

    def _refused(self, asked: str, why: str) -> CommandRefusedError:
        return CommandRefusedError(self.robot_id, asked, why)

    def _is_fresh(self, at: Instant) -> bool:
        """Whether the robot's newest report is recent, and was not old on arrival."""
        if self.report_age(at) > LIMITS.report_fresh_s:
            return False
        return self.evidence_age(at) <= LIMITS.report_stale_s
