"""One robot's episode: what is wanted, how far it has come, and the steps of both.

What people, robots and time do to an episode is in ``people``, ``words`` and
``machine``; all of them take the steps that are here.
"""

from math import isfinite

from iveg.domain.errors import CommandRefusedError
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Hold, Instant, SafetyReport
from iveg.domain.stop.attempt import Attempt
from iveg.domain.stop.commands import Command, Press, Times
from iveg.domain.stop.effects import Changed, Closed, Effect, SendStop, SetLevel
from iveg.domain.stop.sends import Progress, Sends
from iveg.domain.stop.standstill import Standstill
from iveg.domain.stop.table import STEPS, State

PLAIN = Press()


class Episode:
    """The STOP that stands, the release or resume that is under way, and their state.

    Attributes:
        stop: The STOP of this episode.
        attempt: The release or resume under way.
        doubt: The challenge of a release that may still lift the hold that this
            episode holds on to; None where none can.
        report: The robot's last word, which came at ``report_at`` and was at most
            ``report_age_then`` old then (s).
        deadline: When the present state has lasted too long (monotonic s).
        joined_at: When somebody last joined the STOP (monotonic s).
        speed: Last measured (m/s).
    """

    def __init__(self, robot_id: str, *, direct: bool = True) -> None:
        self.robot_id = robot_id
        self.state: State = "RUNNING"
        self.stop: Command | None = None
        self.attempt: Attempt | None = None
        self.doubt: str | None = None
        self.begun_at = float("-inf")
        self.report: SafetyReport | None = None
        self.report_at: Instant | None = None
        self.report_age_then = 0.0
        self.sends = Sends(direct=direct)
        self.standstill = Standstill()
        self.deadline = 0.0
        self.joined_at = float("-inf")
        self.speed = 0.0

    # --- what is wanted -----------------------------------------------------------

    @property
    def wants_stop(self) -> bool:
        """Whether a STOP stands that no reported release has ended."""
        return self.stop is not None and self.state not in ("RUNNING", "READY")

    def follows(self, command: Command) -> bool:
        """Whether this is the STOP that stands now."""
        return self.wants_stop and command is self.stop

    @property
    def once(self) -> Command | None:
        """The release or resume under way, as people follow it."""
        return None if self.attempt is None else self.attempt.command

    @property
    def hold_id(self) -> str | None:
        """Our hold of this episode."""
        return None if self.stop is None else self.stop.hold_id

    @property
    def holds(self) -> tuple[Hold, ...]:
        """The holds that the robot last reported."""
        return () if self.report is None else self.report.holds

    @property
    def shown(self) -> str | None:
        """A hold of iVeg's that the robot last reported: ours, or else the newest."""
        ours = [hold.id for hold in self.holds if hold.source == "iveg"]
        if self.hold_id in ours:
            return self.hold_id
        return ours[-1] if ours else None

    def report_age(self, now: Instant) -> float:
        """Since the robot's last word (s); infinite when it never said any."""
        if self.report_at is None:
            return float("inf")
        return now.mono - self.report_at.mono

    def evidence_age(self, now: Instant) -> float:
        """How old the robot's last word is at most, its way included (s)."""
        return self.report_age(now) + self.report_age_then

    def moved_m(self, now: Instant) -> float:
        """How far it may have driven since its last word (m)."""
        if self.report_at is None:
            return 0.0
        age = self.evidence_age(now)
        return self.speed * max(0.0, age if isfinite(age) else self.report_age(now))

    # --- its steps ----------------------------------------------------------------

    def begin(
        self,
        by: str,
        at: Instant,
        new_id: str,
        key: str,
        press: Press = PLAIN,
        *,
        kept: str | None = None,
        doubt: str | None = None,
    ) -> list[Effect]:
        """A new episode, under an id that was never used before.

        Args:
            by: Who wants it.
            at: This moment.
            new_id: Names the command, and its hold unless one is kept.
            key: Why it begins.
            press: What the page says of it.
            kept: A hold that the robot has already: it is held on to, none is added.
            doubt: The challenge of a release that may still lift that hold.
        """
        closed = self.close(key)
        times = Times.of(at, press)
        self.stop = Command(new_id, self.robot_id, "stop", "REQUESTED", times, [by])
        self.stop.drill, self.stop.held_as = press.drill, kept
        if key != "requested":
            self.stop.reason = key
        if not self.sends.has_direct:
            self.stop.roads["direct"] = "off"
        self.attempt, self.begun_at = None, at.mono
        self.doubt = None if kept is None else doubt
        self.standstill.forget()
        self.deadline = at.mono + LIMITS.unconfirmed_after_s
        self.sends.begin()
        # First, because sends to a standing robot are planned five seconds apart.
        changed = self.enter("REQUESTED", key)
        level = SetLevel(self.robot_id, "stopped", (kept or new_id,))
        return [*self.send_now(at), level, *closed, changed]

    def again(
        self, by: str, at: Instant, new_id: str, key: str, press: Press = PLAIN
    ) -> list[Effect]:
        """A new episode of a robot that may be held already.

        Its hold is new, too, unless the robot has just reported so many that one more
        would only make a pile; then one of those is held on to.
        """
        ours = [hold for hold in self.holds if hold.source == "iveg"]
        is_fresh = self.report_age(at) <= LIMITS.report_fresh_s
        many = len(ours) >= LIMITS.most_holds and is_fresh
        kept = self.shown if many else None
        doubt = self.doubt
        if self.attempt is not None:
            spent = self.attempt.is_spent(self.report)
            doubt = None if spent else self.attempt.challenge
        return self.begin(by, at, new_id, key, press, kept=kept, doubt=doubt)

    def close(self, key: str) -> list[Closed]:
        """What is followed no more says so in its own row."""
        closed = []
        if self.once is not None:
            late = key == "release_unconfirmed"
            self.once.state = "EXPIRED" if late else "REPLACED"
            self.once.reason = key
            closed.append(Closed(self.robot_id, self.once, key))
        if self.stop is not None:
            self.stop.state = "REPLACED"
            closed.append(Closed(self.robot_id, self.stop, key))
        return closed

    def finish(self, key: str) -> list[Effect]:
        """The robot drives: nothing is wanted of it any more."""
        changed = self.enter("RUNNING", key)
        self.stop = self.attempt = None
        return [changed]

    def send_now(self, at: Instant) -> list[Effect]:
        """On both transports at once, whatever was due when."""
        self.sends.now(at)
        return self.send_due(at)

    def send_due(self, at: Instant) -> list[Effect]:
        """On the transports that are due."""
        assert self.stop is not None  # noqa: S101 - callers have begun an episode
        stop = self.stop
        age_s = at.mono - stop.times.requested.mono
        due = self.sends.due(at, age_s, self.progress)
        if due and self.state != "STANDING":
            stop.tries += 1
        hold_id = self.hold_id or stop.command_id
        return [SendStop(self.robot_id, hold_id, one, stop.command_id) for one in due]

    @property
    def progress(self) -> Progress:
        """What the robot has said of the STOP that stands."""
        if self.state == "STANDING":
            return "standing"
        return "delivered" if self.state in ("DELIVERED", "STILL_MOVING") else "asked"

    def enter(self, state: State, key: str, why: str | None = None) -> Changed:
        """Take a step of the table.

        Raises:
            CommandRefusedError: no step leads there.
        """
        if state not in STEPS[self.state]:
            raise CommandRefusedError(
                self.robot_id, state, f"no step leads there from {self.state}"
            )
        self.state = state
        for command in (self.stop, self.once):
            if command is not None:
                command.state = state
        about = self.once or self.stop
        command_id = "" if about is None else about.command_id
        return Changed(self.robot_id, command_id, state, key, why)
