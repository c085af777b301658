"""The life of a STOP, as a pure state machine (safety.md §2.3).

The operator's press is one fact; that the robot stands still is another.  This module
keeps every step between the two apart, so the page never shows a wish as a result; the
steps are drawn in ``table``.

STOP is a level: it is sent again until the robot reports our own hold, for ever.  A
RELEASE is an edge: sent once on each transport, for the holds that a person saw;
unconfirmed it becomes a STOP.
"""

from collections.abc import Iterable
from math import inf

from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    CommandAnswer,
    Instant,
    Origin,
    Road,
    SafetyReport,
)
from iveg.domain.stop import people, releasing, words
from iveg.domain.stop.commands import Command, Press
from iveg.domain.stop.effects import Effect
from iveg.domain.stop.episode import PLAIN, Episode
from iveg.domain.stop.table import Transport
from iveg.domain.stop.wanted import Wanted

_UNKNOWN = Origin()


class StopMachine(Episode):
    """What iVeg wants of one robot, and how far that has come.

    Everything that can happen to it is a method here; each returns what the world is
    asked to do, in this order.
    """

    def __init__(self, robot_id: str, *, direct: bool = True) -> None:
        super().__init__(robot_id, direct=direct)
        self._heard = words.Heard()

    # --- people -------------------------------------------------------------------

    def press(
        self,
        by: str,
        at: Instant,
        new_id: str,
        *,
        key: str = "requested",
        press: Press = PLAIN,
    ) -> list[Effect]:
        """STOP: always accepted; a press during an episode joins it."""
        return people.press(self, by, at, new_id, key, press)

    def restore(self, wanted: Wanted, at: Instant, new_id: str) -> list[Effect]:
        """STOP once more what an earlier run had stopped."""
        return people.restore(self, wanted, at, new_id)

    def drill(self, by: str, at: Instant, new_id: str, press: Press) -> list[Effect]:
        """Press STOP to prove that it works, on a robot that hardly moves.

        Raises:
            CommandRefusedError: stopped already, faster than a crawl, or unheard.
        """
        return people.drill(self, by, at, new_id, press)

    def release(
        self, by: str, seen: Iterable[str], at: Instant, new_id: str
    ) -> list[Effect]:
        """Lift exactly the holds that a person saw.

        Raises:
            CommandRefusedError: not standing, no fresh report, the set has changed, or
                somebody has just joined the STOP.
        """
        return people.release(self, by, seen, at, new_id)

    def resume(self, by: str, at: Instant, new_id: str) -> list[Effect]:
        """Let a released robot drive.

        Raises:
            CommandRefusedError: still held, not standing, or no fresh report.
        """
        return people.resume(self, by, at, new_id)

    # --- transports ---------------------------------------------------------------

    def sent(
        self,
        road: Transport,
        command_id: str,
        at: Instant,
        *,
        ok: bool,
        doubtful: bool = False,
        left: Instant | None = None,
    ) -> list[Effect]:
        """A transport took our message (PUBACK, 2xx) or failed; neither is evidence.

        Args:
            road: The transport.
            command_id: What was sent.
            at: This moment.
            ok: Whether it was taken.
            doubtful: It is known that what lies behind does not pass anything on.
            left: When it was handed to the transport; this moment, if nobody says.
        """
        command = self._command(command_id)
        if command is None:
            return []
        if road == "fiware" and command is self.stop:
            self.sends.came_back(at)
        command.note_sent(road, left or at, ok=ok, doubtful=doubtful)
        if not ok or doubtful:
            return []
        return [self.enter("SENT", "sent")] if self.state == "REQUESTED" else []

    def _command(self, command_id: str) -> Command | None:
        """Our command of that id; None when an episode has ended meanwhile."""
        for command in (self.once, self.stop):
            if command is not None and command.command_id == command_id:
                return command
        return None

    # --- what comes back ----------------------------------------------------------

    def answered(
        self, answer: CommandAnswer, at: Instant, road: Road, new_id: str
    ) -> list[Effect]:
        """The robot's own answer on ``cmdexe`` or ``cmd_info``."""
        news = self._heard.is_news(answer.origin)
        return words.answered(self, answer, at, road, new_id, news=news)

    def reported(
        self,
        report: SafetyReport,
        at: Instant,
        road: Road,
        new_id: str,
        age_s: float = 0.0,
        *,
        sparse: bool = False,
    ) -> list[Effect]:
        """The robot's safety report, new by (boot, seq), ``age_s`` old at most.

        ``sparse``: it came on a topic that has two of them a second, not ten.
        """
        return words.reported(self, report, at, road, new_id, age_s, sparse=sparse)

    def odometry(
        self,
        linear: float,
        angular: float,
        at: Instant,
        new_id: str,
        origin: Origin = _UNKNOWN,
        age_s: float = inf,
    ) -> list[Effect]:
        """A speed, proven to be no older than ``age_s``; see ``words.moved``."""
        return words.moved(self, linear, angular, at, new_id, origin, age_s)

    # --- time ---------------------------------------------------------------------

    def tick(self, now: Instant, new_id: str) -> list[Effect]:
        """Let time pass: deadlines first, then what must be sent again."""
        effects = self._overdue(now, new_id)
        if not self.wants_stop or self.state == "RELEASING":
            return effects
        return [*effects, *self.send_due(now)]

    def _overdue(self, now: Instant, new_id: str) -> list[Effect]:
        late = now.mono >= self.deadline
        if self._is_doubtful(now):
            return self.begin("iveg", now, new_id, "release_unconfirmed")
        match self.state:
            case "REQUESTED" | "SENT" if late:
                return [self.enter("UNCONFIRMED", "unconfirmed")]
            case "DELIVERED" if late:
                return [self.enter("STILL_MOVING", "still_moving")]
            case "STANDING" if self.evidence_age(now) > LIMITS.report_stale_s:
                self.standstill.forget()
                self.sends.direct_now()
                return [self.enter("STALE", "stale")]
            case "RELEASING" if late and self.attempt is not None:
                return releasing.unconfirmed(self, self.attempt, now, new_id)
        return []

    def _is_doubtful(self, now: Instant) -> bool:
        """Whether a hold that may have been lifted goes unreported for too long."""
        if self.doubt is None or not self.wants_stop or self.state == "RELEASING":
            return False
        heard_at = float("-inf") if self.report_at is None else self.report_at.mono
        return now.mono - max(heard_at, self.begun_at) > LIMITS.report_fresh_s
