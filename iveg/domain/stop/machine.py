"""The life of a STOP, as a pure state machine (safety.md §2.3).

The operator's press is one fact; that the robot stands still is another.  This module
keeps every step between the two apart, so the page never shows a wish as a result; the
steps are drawn in ``table``.

STOP is a level: it is sent again until the robot reports our own hold, for ever.  A
RELEASE is an edge: sent once, for the holds that a person saw; unconfirmed it becomes
a STOP under a new id.
"""

from collections import deque
from collections.abc import Iterable
from typing import Literal

from iveg.domain.errors import CommandRefusedError
from iveg.domain.observations import (
    CommandAnswer,
    Hold,
    Instant,
    Origin,
    Road,
    SafetyReport,
)
from iveg.domain.stop.commands import Command, Press, Times
from iveg.domain.stop.effects import (
    Changed,
    Closed,
    Effect,
    SendOnce,
    SendStop,
    SetLevel,
)
from iveg.domain.stop.sends import Sends
from iveg.domain.stop.standstill import Standstill
from iveg.domain.stop.table import STEPS, SendRoad, State
from iveg.domain.world import STANDING_SPEED

UNCONFIRMED_S = 1.0
STALE_S = 1.5
FRESH_S = 1.0
RELEASE_S = 2.0
UNSEEN_S = 2.0
"""A release is confirmed by holding a control this long; a STOP that joined in that
time was not seen by whoever releases."""
ASSUMED_BRAKING = 0.5
"""Least braking that may be counted on (m/s²)."""
BRAKING_EXTRA_S, BRAKING_CAP_S = 1.5, 5.0
CRAWL_SPEED = 0.2
"""At most this fast a robot may be stopped for a drill (m/s)."""
_ANSWERS_REMEMBERED = 64
_PLAIN = Press()


class StopMachine:
    """What iVeg wants of one robot, and how far that has come."""

    def __init__(self, robot_id: str, *, direct: bool = True) -> None:
        self.robot_id = robot_id
        self.state: State = "RUNNING"
        self.stop: Command | None = None
        self.once: Command | None = None
        self.report: SafetyReport | None = None
        self.report_at: Instant | None = None
        self._sends = Sends(direct=direct)
        self._standstill = Standstill()
        self._deadline = 0.0
        self._joined_at = float("-inf")
        self._answers: deque[tuple[str, int]] = deque(maxlen=_ANSWERS_REMEMBERED)
        self._speed = 0.0

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

    def moved_m(self, now: Instant) -> float:
        """How far it may have driven since its last word (m)."""
        if self.report_at is None:
            return 0.0
        return self._speed * max(0.0, now.mono - self.report_at.mono)

    # --- people -------------------------------------------------------------------

    def press(
        self,
        by: str,
        at: Instant,
        new_id: str,
        *,
        key: str = "requested",
        press: Press = _PLAIN,
    ) -> list[Effect]:
        """STOP: always accepted; a press during an episode joins it."""
        if self.wants_stop and self.state != "RELEASING" and self.stop is not None:
            self._joined_at = at.mono
            effects = [] if self.state == "STANDING" else self._send_now(at)
            return [*effects, *self._join(self.stop, by)]
        return self._begin(by, at, new_id, key, press)

    def drill(self, by: str, at: Instant, new_id: str, press: Press) -> list[Effect]:
        """Press STOP to prove that it works, on a robot that hardly moves.

        Raises:
            CommandRefusedError: stopped already, faster than a crawl, or unheard.
        """
        if self.state != "RUNNING":
            why = f"its state is {self.state}"
            raise CommandRefusedError(self.robot_id, "Drill", why)
        if self.report is None or self._report_age(at) > FRESH_S:
            raise CommandRefusedError(self.robot_id, "Drill", "its report is not fresh")
        if max(self._speed, abs(self.report.linear)) > CRAWL_SPEED:
            raise CommandRefusedError(self.robot_id, "Drill", "it is moving")
        return self._begin(by, at, new_id, "requested", press)

    def _join(self, stop: Command, by: str) -> list[Effect]:
        """One more person wants it: nothing changes but the audit."""
        if by in stop.requesters:
            return []
        stop.requesters.append(by)
        return [Changed(self.robot_id, stop.command_id, self.state, "requested")]

    def _begin(
        self, by: str, at: Instant, new_id: str, key: str, press: Press = _PLAIN
    ) -> list[Effect]:
        """A new episode under an id that was never used before."""
        closed = self._close(key)
        times = Times.of(at, press)
        self.stop = Command(new_id, self.robot_id, "stop", "REQUESTED", times, [by])
        self.stop.drill = press.drill
        if key != "requested":
            self.stop.reason = key
        if not self._sends.has_direct:
            self.stop.roads["direct"] = "off"
        self.once = None
        self._standstill.forget()
        self._deadline = at.mono + UNCONFIRMED_S
        self._sends.begin()
        # First, because sends to a standing robot are planned five seconds apart.
        changed = self._enter("REQUESTED", key)
        level = SetLevel(self.robot_id, "stopped", (new_id,))
        return [*self._send_now(at), level, *closed, changed]

    def _close(self, key: str) -> list[Closed]:
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

    def release(
        self, by: str, seen: Iterable[str], at: Instant, new_id: str
    ) -> list[Effect]:
        """Lift exactly the holds that a person saw.

        Raises:
            CommandRefusedError: not standing, no fresh report, the set has changed, or
                somebody has just joined the STOP.
        """
        if at.mono - self._joined_at < UNSEEN_S:
            why = "somebody has pressed STOP just now"
            raise CommandRefusedError(self.robot_id, "Release", why)
        report = self._may_release("release", at, allowed=("STANDING", "RUNNING"))
        remote = [hold.id for hold in report.holds if hold.ack == "remote"]
        asked = set(seen)
        if asked not in (set(remote), {hold.id for hold in report.holds}):
            raise CommandRefusedError(self.robot_id, "Release", "the holds changed")
        if not remote:
            raise CommandRefusedError(
                self.robot_id, "Release", "nothing holds it that iVeg may lift"
            )
        return self._send_once("release", by, at, new_id, tuple(remote), report)

    def resume(self, by: str, at: Instant, new_id: str) -> list[Effect]:
        """Let a released robot drive.

        Raises:
            CommandRefusedError: still held, not standing, or no fresh report.
        """
        report = self._may_release("resume", at, allowed=("READY", "RUNNING"))
        if report.holds:
            raise CommandRefusedError(self.robot_id, "Resume", "it is still held")
        return self._send_once("resume", by, at, new_id, (), report)

    def _may_release(
        self, kind: str, at: Instant, allowed: tuple[State, ...]
    ) -> SafetyReport:
        report, asked = self.report, kind.capitalize()
        if self.state not in allowed:
            why = f"its state is {self.state}"
            raise CommandRefusedError(self.robot_id, asked, why)
        if report is None or self._report_age(at) > FRESH_S:
            raise CommandRefusedError(self.robot_id, asked, "its report is not fresh")
        if not _stands(report):
            raise CommandRefusedError(self.robot_id, asked, "it is moving")
        if report.challenge is None:
            raise CommandRefusedError(self.robot_id, asked, "it gave no challenge")
        return report

    def _send_once(
        self,
        kind: Literal["release", "resume"],
        by: str,
        at: Instant,
        new_id: str,
        ids: tuple[str, ...],
        report: SafetyReport,
    ) -> list[Effect]:
        self.once = Command(
            new_id, self.robot_id, kind, "RELEASING", Times(at), [by], tries=1
        )
        self.once.roads["direct"] = "off"
        self._deadline = at.mono + RELEASE_S
        changed = self._enter("RELEASING", "releasing")
        return [
            SendOnce(self.robot_id, new_id, kind, report.challenge or "", ids),
            changed,
        ]

    # --- roads --------------------------------------------------------------------

    def sent(
        self, road: SendRoad, command_id: str, at: Instant, *, ok: bool
    ) -> list[Effect]:
        """A road took our message (PUBACK, 2xx) or failed; neither is evidence."""
        command = self._command(command_id)
        if command is None:
            return []
        if road == "fiware" and command is self.stop:
            self._sends.came_back(at)
        command.roads[road] = "ok" if ok else "failed"
        if not ok:
            return []
        times = command.times
        if road == "direct":
            times.sent_direct = times.sent_direct or at
        else:
            times.sent_fiware = times.sent_fiware or at
        return [self._enter("SENT", "sent")] if self.state == "REQUESTED" else []

    def _command(self, command_id: str) -> Command | None:
        """Our command of that id; None when an episode has ended meanwhile."""
        for command in (self.once, self.stop):
            if command is not None and command.command_id == command_id:
                return command
        return None

    def _send_now(self, at: Instant) -> list[Effect]:
        """On both roads at once, whatever was due when."""
        self._sends.now(at)
        return self._send_due(at)

    def _send_due(self, at: Instant) -> list[Effect]:
        assert self.stop is not None  # noqa: S101 - callers have begun an episode
        stop, standing = self.stop, self.state == "STANDING"
        age_s = at.mono - stop.times.requested.mono
        roads = self._sends.due(at, age_s, standing=standing)
        if roads and not standing:
            stop.tries += 1
        return [SendStop(self.robot_id, stop.command_id, road) for road in roads]

    # --- what comes back ----------------------------------------------------------

    def answered(self, answer: CommandAnswer, at: Instant, road: Road) -> list[Effect]:
        """The robot's own answer on ``cmdexe`` or ``cmd_info``."""
        news = self._is_news(answer.origin)
        if self.state == "RELEASING" and self.once is not None:
            if answer.result == "REFUSED" and not news:
                # The other road's copy of a refusal that a person has seen already.
                return []
            return self._answered_once(answer, at, road)
        if self.stop is None or answer.result != "LATCHED":
            return []
        if self.hold_id not in {answer.id, *(hold.id for hold in answer.holds)}:
            return []
        _note_answer(self.stop.times, at, road)
        return self._delivered(at)

    def _is_news(self, origin: Origin) -> bool:
        if origin.boot is None or origin.seq is None:
            return True
        # The agent's copy has lost its stamp.
        identity = origin.boot, origin.seq
        if identity in self._answers:
            return False
        self._answers.append(identity)
        return True

    def _answered_once(
        self, answer: CommandAnswer, at: Instant, road: Road
    ) -> list[Effect]:
        assert self.once is not None  # noqa: S101 - checked by the caller
        if answer.result == "REFUSED":
            _note_answer(self.once.times, at, road)
            self.once.reason = answer.why
            changed = self._enter(self._before_once(), "refused", answer.why)
            self.once = None
            return [changed]
        if answer.result in ("RELEASED", "RESUMED"):
            _note_answer(self.once.times, at, road)
        return []

    def _before_once(self) -> State:
        """Where a refused release or resume came from."""
        assert self.once is not None  # noqa: S101 - checked by the caller
        if self.stop is None:
            return "RUNNING"
        return "STANDING" if self.once.kind == "release" else "READY"

    def _delivered(self, at: Instant) -> list[Effect]:
        if self.state not in ("REQUESTED", "SENT", "UNCONFIRMED"):
            return []
        braking = min(self._speed / ASSUMED_BRAKING + BRAKING_EXTRA_S, BRAKING_CAP_S)
        # From the robot's word on: before it, a robot out of reach could not brake.
        self._deadline = at.mono + braking
        return [self._enter("DELIVERED", "delivered")]

    def reported(
        self, report: SafetyReport, at: Instant, road: Road, new_id: str
    ) -> list[Effect]:
        """The robot's safety report, new by (boot, seq), on either road."""
        self.report, self.report_at = report, at
        self._speed = abs(report.linear)
        if self.state in ("RUNNING", "READY"):
            return self._reported_free(report, at)
        assert self.stop is not None or self.once is not None  # noqa: S101
        if self.state == "RELEASING":
            return self._reported_releasing(report)
        assert self.stop is not None  # noqa: S101 - every other state has an episode
        if self.hold_id not in {hold.id for hold in report.holds}:
            self._standstill.forget()
            # A name that was released never holds again: only a new one can.
            released = self.hold_id in report.released
            if released or self.state in ("STANDING", "STALE"):
                return self._begin("iveg", at, new_id, "moved")
            return []
        _note_answer(self.stop.times, at, road)
        effects = self._delivered(at)
        if not _stands(report):
            self._standstill.forget()
            if self.state in ("STANDING", "STALE"):
                return [*effects, *self._begin("iveg", at, new_id, "moved")]
            return effects
        return [*effects, *self._stood(at)]

    def _stood(self, at: Instant) -> list[Effect]:
        """One more sample at rest; five over a second are a standstill."""
        assert self.stop is not None  # noqa: S101 - called with an episode
        measured = self._standstill.rested(at)
        if not measured or self.state == "STANDING":
            return []
        if self.stop.times.standing is None:
            self.stop.times.standing = first = self._standstill.since
            assert first is not None  # noqa: S101 - a rest has a first sample
            self.stop.standstill_ms = self.stop.times.ms_from_press(first)
        return [self._enter("STANDING", "standing")]

    def _reported_free(self, report: SafetyReport, at: Instant) -> list[Effect]:
        if self.state == "READY" and not report.holds and report.speed_factor > 0:
            return self._finish("running")
        ours = [hold.id for hold in report.holds if hold.source == "iveg"]
        if not ours:
            return []
        # A hold of iVeg that this process did not ask for: adopt it, never drop it.
        closed = self._close("adopted")
        self.stop = Command(
            ours[-1], self.robot_id, "stop", "DELIVERED", Times(at), ["iveg"]
        )
        self._standstill.forget()
        self._sends.begin()
        self._sends.now(at)
        self._deadline = at.mono + BRAKING_CAP_S
        level = SetLevel(self.robot_id, "stopped", (ours[-1],))
        return [level, *closed, self._enter("DELIVERED", "adopted")]

    def _reported_releasing(self, report: SafetyReport) -> list[Effect]:
        assert self.once is not None  # noqa: S101 - RELEASING has one
        if self.once.kind == "resume":
            drives = not report.holds and report.speed_factor > 0
            return self._finish("running") if drives else []
        held = {hold.id for hold in report.holds}
        ours = self.hold_id
        if ours in held or (ours is not None and ours not in report.released):
            return []
        if ours is None and any(hold.ack == "remote" for hold in report.holds):
            return []
        changed = self._enter("READY", "ready")
        self.once = None
        return [SetLevel(self.robot_id, "run", ()), changed]

    def _finish(self, key: str) -> list[Effect]:
        changed = self._enter("RUNNING", key)
        self.stop = self.once = None
        return [changed]

    def odometry(
        self, linear: float, angular: float, at: Instant, new_id: str
    ) -> list[Effect]:
        """A fresh speed; three moving ones in a row contradict a standstill."""
        moves = max(abs(linear), abs(angular)) >= STANDING_SPEED
        contradicted = self._standstill.odometry(at, moves=moves)
        self._speed = abs(linear)
        if self.state == "STANDING" and contradicted:
            return self._begin("iveg", at, new_id, "moved")
        return []

    # --- time ---------------------------------------------------------------------

    def tick(self, now: Instant, new_id: str) -> list[Effect]:
        """Let time pass: deadlines first, then what must be sent again."""
        effects = self._overdue(now, new_id)
        if not self.wants_stop or self.state == "RELEASING":
            return effects
        return [*effects, *self._send_due(now)]

    def _overdue(self, now: Instant, new_id: str) -> list[Effect]:
        late = now.mono >= self._deadline
        match self.state:
            case "REQUESTED" | "SENT" if late:
                return [self._enter("UNCONFIRMED", "unconfirmed")]
            case "DELIVERED" if late:
                return [self._enter("STILL_MOVING", "still_moving")]
            case "STANDING" if self._report_age(now) > STALE_S:
                self._standstill.forget()
                self._sends.direct_now(now)
                return [self._enter("STALE", "stale")]
            case "RELEASING" if late:
                return self._begin("iveg", now, new_id, "release_unconfirmed")
        return []

    def _report_age(self, now: Instant) -> float:
        if self.report_at is None:
            return float("inf")
        return now.mono - self.report_at.mono

    def _enter(self, state: State, key: str, why: str | None = None) -> Changed:
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


def _stands(report: SafetyReport) -> bool:
    return max(abs(report.linear), abs(report.angular)) < STANDING_SPEED


def _note_answer(times: Times, at: Instant, road: Road) -> None:
    if road == "mqtt":
        times.answer_direct = times.answer_direct or at
    else:
        times.answer_fiware = times.answer_fiware or at
