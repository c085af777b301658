r"""The safety machine of one robot, pure: facts and times in, frozen effects out.

::

    boot / unreadable file             release names every remote hold AND challenge
    HELD ── brake ──> STANDING ───────────────────────────────────────────> READY
                        ^   \__ any stop / hw / bumper, in any state __        │
                        │                                             \       │ resume
                     BRAKING <────────────────────────────────── RUNNING <────┘
    RUNNING: upstream at zero for 0.5 s first, then the ramp;  factor = min(caps)
             an author's feedback older than 1.0 s, or a person or peer near  -> cap 0.5
             all feedback older than 3.0 s -> hold `link`, which clears itself when
             feedback was fresh for 2.0 s, three times a minute, if no other hold came

The state is never stored: it follows from the holds, the measured speed and whether
a resume was accepted.  The paper's Algorithm 3 is ``PeerFeedback`` in ``feedback.py``.
The paper takes silence for permission; iVeg does not.  R1 to R10 are the invariants of
docs/safety.md.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from iveg.domain.feedback import Feedback
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import (
    CommandAnswer,
    Hold,
    LaserScan,
    Origin,
    SafetyReport,
)
from iveg.ngsi.codec import (
    ReleaseOrder,
    ResumeOrder,
    StopOrder,
    read_desired_state,
    read_order,
)
from iveg.robot.feedback import Authors
from iveg.robot.gate import Cap, Gate
from iveg.robot.holds import HoldSet
from iveg.robot.judgement import DEFAULT_LIMITS, Judgement, Limits

State = Literal["HELD", "BRAKING", "STANDING", "READY", "RUNNING"]

CHALLENGE_LIVES_S = 5.0
REPORT_EVERY_S, REPORT_HELD_EVERY_S = 0.4, 0.075
"""Periods of the safety report (s); the second while held or near somebody who walks.

Both are below the contract's 0.5 s and 0.1 s, so that a late timer still keeps them.
The second goes to iVeg alone: ten a second are most of what one agent can carry.
"""


ATTEMPTS_KEPT = 64
"""Attempts whose answer is remembered; the challenge of a forgotten one is spent, so
that no copy of it can succeed."""

_AnswerCode = Literal["LATCHED", "RELEASED", "RESUMED", "REFUSED"]
_Verdict = tuple[str | None, _AnswerCode, str | None]
"""Answer to a release or resume: the hold that it names, its code, and the reason of a
refusal.  Every copy of an order gets the answer of the first, even when the robot's
state has changed: a refused order stays refused."""


@dataclass(frozen=True, slots=True)
class Drive:
    """Send this command to the drive at once."""

    twist: Twist2D


@dataclass(frozen=True, slots=True)
class Persist:
    """Store this hold set so that it survives a loss of power."""

    holds: HoldSet


@dataclass(frozen=True, slots=True)
class SendAnswer:
    """Answer a command on ``cmdexe``; the uplink fills in the origin."""

    answer: CommandAnswer


@dataclass(frozen=True, slots=True)
class Report:
    """Publish a safety report; the uplink fills in the origin and returns its ``seq``.

    Attributes:
        is_measure: Also for the IoT Agent, which gets changes and two a second.
    """

    report: SafetyReport
    is_measure: bool = True


Effect = Drive | Persist | SendAnswer | Report
"""Effect that the machine requests: first the zero command, then the hold set on disk,
then the answer, then the report."""


class SafetyMachine:
    """Decides whether and how fast one robot may drive.

    Every method takes ``now`` (monotonic, s) and returns effects in the order in which
    they must be performed; the first is always the command for the drive.

    Args:
        robot_id: This robot.
        boot: Random text of this start.
        now: Monotonic (s).
        stored: The hold set of the last run; None when it could not be read, which
            counts as a STOP without an id.
        fresh: Returns a new random text, for challenges and hold ids.
        limits: Speeds and waiting times.
    """

    def __init__(
        self,
        robot_id: str,
        boot: str,
        now: float,
        *,
        stored: HoldSet | None,
        fresh: Callable[[], str],
        limits: Limits = DEFAULT_LIMITS,
    ) -> None:
        self._id, self._fresh = robot_id, fresh
        self._gate = Gate(limits.profile.max_speed, limits.profile.max_turn)
        self._judgement = Judgement(robot_id, now, limits)
        self._resumed = False
        self._resumed_by: str | None = None
        self._challenge, self._challenge_at = fresh(), now
        self._verdicts: dict[str, _Verdict] = {}
        self._holds = (stored or HoldSet()).after_reboot()
        self._persisted: HoldSet | None = None
        self._reported: tuple[Cap, HoldSet, str, bool] | None = None
        """Content of the newest report without speeds and ages; a change is news."""
        self._reported_at = self._measured_at = now
        if stored is None:
            # R2: the file that cannot be read may have held a STOP.
            self._latch(self._nameless_stop(), now)
        # R4: a robot that crashed beside somebody must not start again by itself.
        self._latch(Hold(f"boot-{boot}", "boot", "remote"), now)

    # --- state --------------------------------------------------------------------

    def state(self, now: float) -> State:
        """State of the robot in the drawing above."""
        if not self._holds.holds:
            return "RUNNING" if self._resumed else "READY"
        if self._judgement.motion(now) is None:
            # Without fresh odometry neither braking nor standing is measured.
            return "HELD"
        return "STANDING" if self._judgement.stands(now) else "BRAKING"

    def stands(self, now: float) -> bool:
        """Whether fresh odometry shows the robot at rest."""
        return self._judgement.stands(now)

    def pose(self, now: float) -> Pose2D | None:
        """Pose in ``map`` (m, rad); None while it is unknown or old."""
        return self._judgement.pose(now)

    @property
    def holds(self) -> HoldSet:
        """Current holds and those already released."""
        return self._holds

    @property
    def challenge(self) -> str:
        """Text that a release or resume must echo."""
        return self._challenge

    @property
    def authors(self) -> Authors:
        """Authors of the feedback that this robot receives."""
        return self._judgement.authors

    @property
    def may_drive(self) -> bool:
        """Whether a twist would move the robot: no holds, and neutral was seen.

        If not, upstream should request zero: after a resume the robot moves only once
        upstream has requested zero, or sent no twist at all, for 0.5 s.
        """
        return self._free and not self._gate.neutral_needed

    @property
    def cap(self) -> Cap:
        """The cap that the gate applies."""
        return self._judgement.cap

    # --- inputs -------------------------------------------------------------------

    def tick(self, now: float) -> tuple[Effect, ...]:
        """Advance time; call at least 20 times a second."""
        self._judge(now)
        return self._effects(now)

    def request_twist(self, twist: Twist2D, now: float) -> tuple[Effect, ...]:
        """Take the twist that upstream navigation requests."""
        self._gate.request_twist(twist, now)
        return self.tick(now)

    def odometry(
        self, pose: Pose2D | None, twist: Twist2D, now: float
    ) -> tuple[Effect, ...]:
        """Take measured pose (None: not in ``map``) and speed."""
        self._judgement.note_odometry(pose, twist, now)
        return self.tick(now)

    def scan(self, scan: LaserScan, now: float) -> tuple[Effect, ...]:
        """Take a sweep of the robot's own laser, which shows people without iVeg."""
        self._judgement.note_scan(scan, now)
        return self.tick(now)

    def note_path(self, path: Sequence[tuple[float, float]], now: float) -> None:
        """Take the path of the robot's own navigation, in ``map`` (m)."""
        self._judgement.note_path(path, now)

    def limit(self, cap: Cap) -> None:
        """Set the cap of the robot's own software; it holds until the next call."""
        self._judgement.local = cap

    def feedback(
        self, topic: str, feedback: Feedback, now: float
    ) -> tuple[Effect, ...]:
        """Take a message of ``/{topic}/mqtt_feedback``."""
        self._judgement.note_feedback(topic, feedback, now)
        return self.tick(now)

    def reported(self, seq: int, now: float) -> None:
        """Note that the requested safety report was sent as ``seq``."""
        self._judgement.watchdog.sent(seq, now)

    def command(self, payload: bytes, now: float) -> tuple[Effect, ...]:
        """Take a message of ``/{apikey}/{robot}/cmd``."""
        # First: the order is judged by the challenge and standstill of this moment.
        self._judge(now)
        order = read_order(payload)
        if isinstance(order, StopOrder):
            answer = self._stop(order.id, now)
        elif isinstance(order, ReleaseOrder | ResumeOrder):
            answer = self._attempt(order, now)
        else:
            answer = self._answer(None, "REFUSED", order.why)
        # Again: R7 holds a robot that this order set free during iVeg's silence.
        self._judge(now)
        return self._effects(now, answer)

    def desired(self, payload: bytes, now: float) -> tuple[Effect, ...]:
        """Take the retained desired state; ``run`` releases nothing."""
        level = read_desired_state(payload)
        if level is not None:
            # R2: a STOP without an id, an empty list, holds as well.
            for hold_id in level or (None,):
                self._stop(hold_id, now)
        return self.tick(now)

    def local_hold(
        self, source: Literal["hw", "bumper"], now: float
    ) -> tuple[Effect, ...]:
        """Hold the robot because its red button or bumper was pressed."""
        # A contact that bounces must not fill the room that a report has for holds.
        if all(hold.source != source for hold in self._holds.holds):
            self._latch(Hold(f"{source}-{self._fresh()}", source, "local"), now)
        return self.tick(now)

    def release_locally(self, now: float) -> tuple[Effect, ...]:
        """Lift boot, button and bumper holds and resume, for the crew at the robot.

        A STOP from iVeg stays in force (R2).
        """
        local = {"boot", "hw", "bumper"}
        self._holds = self._holds.lift(
            hold.id for hold in self._holds.holds if hold.source in local
        )
        if not self._holds.holds and not self._resumed:
            self._let_go()
        return self.tick(now)

    # --- commands -----------------------------------------------------------------

    def _stop(self, hold_id: str | None, now: float) -> CommandAnswer:
        # Ids are never reused, so this is a late copy of a STOP that is over.
        if hold_id in self._holds.released:
            return self._answer(hold_id, "RELEASED")
        hold = self._held_as(hold_id)
        if self._holds.find(hold.id) is None:
            self._latch(hold, now)
        return self._answer(hold_id or hold.id, "LATCHED")

    def _held_as(self, hold_id: str | None) -> Hold:
        """The hold for a STOP: an existing one or a new one."""
        held = None if hold_id is None else self._holds.find(hold_id)
        if held is not None and held.ack == "remote":
            return held
        # R2: a STOP under the id of a local or link hold must outlive that hold.
        if hold_id is None or held is not None:
            return self._nameless_stop()
        return Hold(hold_id, "iveg", "remote")

    def _nameless_stop(self) -> Hold:
        """The hold that all STOPs without a usable id share, so they fill no set."""
        for hold in self._holds.holds:
            if hold.source == "iveg" and hold.id.startswith("local-"):
                return hold
        return Hold(f"local-{self._fresh()}", "iveg", "remote")

    def _attempt(self, order: ReleaseOrder | ResumeOrder, now: float) -> CommandAnswer:
        """Judge the first copy of an order; answer every other copy alike (R9)."""
        verdict = self._verdicts.get(order.attempt)
        if verdict is None:
            if isinstance(order, ReleaseOrder):
                verdict = self._release(order, now)
            else:
                verdict = self._resume(order, now)
            self._verdicts[order.attempt] = verdict
            if len(self._verdicts) > ATTEMPTS_KEPT:
                del self._verdicts[next(iter(self._verdicts))]
        return self._answer(*verdict, attempt=order.attempt)

    def _release(self, order: ReleaseOrder, now: float) -> _Verdict:
        first = order.ids[0]
        if set(order.ids) <= set(self._holds.released):
            # A second attempt at a release that succeeded: there is nothing to lift.
            return first, "RELEASED", None
        reason = self._why_not_release(order, now)
        if reason is not None:
            return self._refuse(first, order.challenge, reason, now)
        # R3, R8: named and remote; a release may name local holds and lifts none.
        self._holds = self._holds.lift(self._holds.remote & frozenset(order.ids))
        self._renew_challenge(now)
        return first, "RELEASED", None

    def _why_not_release(self, order: ReleaseOrder, now: float) -> str | None:
        """Code of the refusal of a release; None when it is valid."""
        remote = self._holds.remote
        if not remote:
            return "not_held"
        # R2: the person who released did not see a hold that the order lacks.
        if not remote <= set(order.ids):
            return "holds_missing"
        if order.challenge != self._challenge:
            return "challenge"
        return None if self._judgement.stands(now) else "not_standing"

    def _resume(self, order: ResumeOrder, now: float) -> _Verdict:
        # A second attempt at a resume that succeeded: the robot drives already.
        if self._resumed and order.challenge == self._resumed_by:
            return None, "RESUMED", None
        reason = self._why_not_resume(order)
        if reason is not None:
            return self._refuse(None, order.challenge, reason, now)
        self._let_go()
        self._resumed_by = order.challenge
        self._renew_challenge(now)
        return None, "RESUMED", None

    def _why_not_resume(self, order: ResumeOrder) -> str | None:
        if self._holds.holds:
            return "held"
        if self._resumed:
            return "not_ready"
        return None if order.challenge == self._challenge else "challenge"

    def _refuse(
        self, answered: str | None, challenge: str, why: str, now: float
    ) -> _Verdict:
        """Refuse an order and spend its challenge, so that no later copy succeeds."""
        if challenge == self._challenge:
            self._renew_challenge(now)
        return answered, "REFUSED", why

    def _answer(
        self,
        answered: str | None,
        code: _AnswerCode,
        why: str | None = None,
        *,
        attempt: str | None = None,
    ) -> CommandAnswer:
        return CommandAnswer(
            self._id,
            Origin(),
            answered,
            code,
            self._holds.holds,
            self._challenge,
            self._judgement.twist.linear_x,
            why,
            attempt,
        )

    # --- judgement ----------------------------------------------------------------

    def _judge(self, now: float) -> None:
        """Evaluate caps, the ``link`` hold and the challenge at this moment."""
        self._judgement.settle(now)
        self._judge_link(now)
        # While it drives no order needs a challenge, and a new one would be news.
        if not self._free and now - self._challenge_at >= CHALLENGE_LIVES_S:
            self._renew_challenge(now)

    def _judge_link(self, now: float) -> None:
        watchdog = self._judgement.watchdog
        # Beside another hold ``link`` waits for a release (docs/safety.md, "Holds").
        link = self._holds.link_alone
        if link is not None and watchdog.steady(now):
            self._holds = self._holds.lift([link.id])
            watchdog.cleared(now)
        if self._judgement.must_stand(now) and not self._holds.holds:
            ack: Literal["auto", "remote"] = (
                "auto" if watchdog.may_clear(now) else "remote"
            )
            self._latch(Hold(f"link-{self._fresh()}", "link", ack), now)

    def _latch(self, hold: Hold, now: float) -> None:
        self._holds = self._holds.latch(hold)
        # R2: a release on its way was meant for the earlier holds.
        self._renew_challenge(now)
        # R10: a lost link alone keeps the resume, so that its hold can lift itself.
        if hold.ack != "auto":
            self._resumed = False

    def _renew_challenge(self, now: float) -> None:
        self._challenge, self._challenge_at = self._fresh(), now

    def _let_go(self) -> None:
        self._resumed = True
        self._gate.require_neutral()

    @property
    def _free(self) -> bool:
        return self._resumed and not self._holds.holds

    # --- effects ------------------------------------------------------------------

    def _effects(self, now: float, *answers: CommandAnswer) -> tuple[Effect, ...]:
        twist = self._gate.output(self.cap.factor, self._free, now)
        # R5: zero for the drive goes before anything that may take time.
        effects: list[Effect] = [Drive(twist)]
        # Before the answer: a hold that was confirmed must outlive a loss of power.
        if self._holds != self._persisted:
            self._persisted = self._holds
            effects.append(Persist(self._holds))
        effects += [SendAnswer(answer) for answer in answers]
        return *effects, *self._due_report(now)

    def _due_report(self, now: float) -> Iterator[Report]:
        """The report of a change, or one whose time has come; else nothing."""
        obstacle = self._judgement.obstacle(now)
        walks = obstacle is not None and obstacle.moved
        content = self._limit, self._holds, self._challenge, walks
        is_news = content != self._reported
        is_often = walks or self._holds.holds
        period_s = REPORT_HELD_EVERY_S if is_often else REPORT_EVERY_S
        if is_news or now - self._reported_at >= period_s:
            self._reported, self._reported_at = content, now
            is_measure = is_news or now - self._measured_at >= REPORT_EVERY_S
            if is_measure:  # the agent gets changes and two reports a second, no more
                self._measured_at = now
            yield Report(self._report(now), is_measure)

    @property
    def _limit(self) -> Cap:
        """The applied limit; a robot that waits for resume reports 0, ``hold``."""
        if self._free:
            return self.cap
        holds = self._holds.holds
        return Cap(0.0, "hold", holds[0].id if holds else None)

    def _report(self, now: float) -> SafetyReport:
        limit, twist = self._limit, self._judgement.twist
        return SafetyReport(
            self._id,
            Origin(),
            limit.factor,
            limit.reason,
            limit.cause,
            limit.decision_id,
            self._holds.holds,
            self._holds.released,
            self._challenge,
            twist.linear_x,
            twist.angular_z,
            self._judgement.watchdog.age(now),
            obstacle=self._judgement.obstacle(now),
        )
