"""One robot's episode: what is wanted, how far it has come, and the steps of both.

What people, robots and time do to an episode is in ``people``, ``words`` and
``machine``; all of them take the steps that are here.
"""

from math import isfinite

from iveg.domain.errors import CommandRefusedError
from iveg.domain.observations import Hold, Instant, SafetyReport
from iveg.domain.stop.commands import Command, Press, Times
from iveg.domain.stop.effects import Changed, Closed, Effect, SendStop, SetLevel
from iveg.domain.stop.sends import Sends
from iveg.domain.stop.standstill import Standstill
from iveg.domain.stop.table import STEPS, State

UNCONFIRMED_S = 1.0
STALE_S = 1.5
"""A standstill that was measured longer ago may be over (docs/safety.md, "Age")."""
PLAIN = Press()


class Episode:
    """The STOP that stands, the release or resume that is under way, and their state.

    Attributes:
        stop: The STOP of this episode; ``once`` the release or resume under way.
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
        self.once: Command | None = None
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
    def hold_id(self) -> str | None:
        """Our hold of this episode."""
        return None if self.stop is None else self.stop.command_id

    @property
    def holds(self) -> tuple[Hold, ...]:
        """The holds that the robot last reported."""
        return () if self.report is None else self.report.holds

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
        self, by: str, at: Instant, new_id: str, key: str, press: Press = PLAIN
    ) -> list[Effect]:
        """A new episode under an id that was never used before."""
        closed = self.close(key)
        times = Times.of(at, press)
        self.stop = Command(new_id, self.robot_id, "stop", "REQUESTED", times, [by])
        self.stop.drill = press.drill
        if key != "requested":
            self.stop.reason = key
        if not self.sends.has_direct:
            self.stop.roads["direct"] = "off"
        self.once = None
        self.standstill.forget()
        self.deadline = at.mono + UNCONFIRMED_S
        self.sends.begin()
        # First, because sends to a standing robot are planned five seconds apart.
        changed = self.enter("REQUESTED", key)
        level = SetLevel(self.robot_id, "stopped", (new_id,))
        return [*self.send_now(at), level, *closed, changed]

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
        self.stop = self.once = None
        return [changed]

    def send_now(self, at: Instant) -> list[Effect]:
        """On both roads at once, whatever was due when."""
        self.sends.now(at)
        return self.send_due(at)

    def send_due(self, at: Instant) -> list[Effect]:
        """On the roads that are due."""
        assert self.stop is not None  # noqa: S101 - callers have begun an episode
        stop, standing = self.stop, self.state == "STANDING"
        age_s = at.mono - stop.times.requested.mono
        roads = self.sends.due(at, age_s, standing=standing)
        if roads and not standing:
            stop.tries += 1
        return [SendStop(self.robot_id, stop.command_id, road) for road in roads]

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
