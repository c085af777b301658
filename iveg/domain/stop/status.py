"""Everything that is kept of the STOP of one robot, and what follows from it."""

from collections.abc import Iterable
from dataclasses import replace
from math import inf

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.stop.attempt import Attempt
from iveg.domain.stop.commands import FollowedCommand, State
from iveg.domain.stop.effects import Changed, Closed, Key
from iveg.domain.stop.evidence import StopEvidence
from iveg.domain.stop.sends import Sends
from iveg.domain.stop.wanted import NEW_HOLD, Kept
from iveg.domain.transports import Transport


class StopStatus:
    """The state of one robot's STOP.

    Attributes:
        robot_id: Whose.
        stop: The STOP of this episode, as it is now.
        attempt: The release or resume under way.
        evidence: What the robot itself reports.
    """

    def __init__(self, robot_id: str, transports: Iterable[Transport]) -> None:
        self.robot_id = robot_id
        self.state: State = "RUNNING"
        self.stop: FollowedCommand | None = None
        self.attempt: Attempt | None = None
        self.evidence = StopEvidence(robot_id)
        self._transports = {one.id: one for one in transports}
        self._sends = Sends(self._transports.values())
        self._joined_at = self._begun_at = -inf
        self._deadline = 0.0
        self._doubt: str | None = None
        """The challenge of a release that may still lift the hold that is kept."""
        self._is_lost = False
        """An event had no row in the state that still is."""

    @property
    def wants_stop(self) -> bool:
        """Whether a STOP stands that no reported release has ended."""
        return self.stop is not None and self.state not in ("RUNNING", "READY")

    def follows(self, command: FollowedCommand) -> bool:
        """Whether this is the STOP that stands now."""
        stop = self.stop if self.wants_stop else None
        return stop is not None and stop.command_id == command.command_id

    @property
    def once(self) -> FollowedCommand | None:
        """The release or resume under way."""
        return None if self.attempt is None else self.attempt.command

    @property
    def commands(self) -> tuple[FollowedCommand, ...]:
        """The STOP, and the release or resume under way, as they are now."""
        return tuple(one for one in (self.stop, self.once) if one is not None)

    def _find(self, command_id: str) -> FollowedCommand | None:
        return next(
            (one for one in self.commands if one.command_id == command_id), None
        )

    def _keep(self, command: FollowedCommand) -> None:
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
        evidence, attempt = self.evidence, self.attempt
        is_fresh = evidence.report_age(at) <= LIMITS.report_fresh_s
        many = is_fresh and len(evidence.ours) >= LIMITS.most_holds
        is_spent = attempt is not None and attempt.is_spent(evidence.report)
        ours = evidence.ours if many or (expired and is_spent) else []
        if not ours:
            return NEW_HOLD
        doubt = self._doubt if attempt is None else attempt.challenge
        kept = self.hold_id if self.hold_id in ours else ours[-1]
        return Kept(kept, None if is_spent else doubt)

    def _is_doubtful(self, now: Instant) -> bool:
        """Whether a hold that may have been lifted goes unreported for too long."""
        if self._doubt is None or not self.wants_stop or self.state == "RELEASING":
            return False
        since_report = self.evidence.report_age(now)
        return min(since_report, now.mono - self._begun_at) > LIMITS.report_fresh_s

    # --- what is recorded of it ---------------------------------------------------

    def _changed(
        self, key: Key, about: FollowedCommand | None, why: str | None
    ) -> Changed:
        command_id = "" if about is None else about.command_id
        return Changed(command_id, self.state, key, why, self.commands)

    def _closed_by(self, key: Key) -> list[Closed]:
        """Effects that close the commands of the ended episode."""
        return [Closed(one.ended(key), key) for one in reversed(self.commands)]
