"""A safety machine on a bench: its own clock, an obedient drive, a small iVeg."""

import asyncio
import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import orjson

from iveg.domain.feedback import CLEAR, Feedback, FeedbackAlert, SpeedLimit
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import CommandAnswer, Hold, Origin, SafetyReport
from iveg.domain.parameters import Class
from iveg.ngsi import codec
from iveg.robot.holds import HoldSet
from iveg.robot.judgement import Limits
from iveg.robot.safety import Drive, Effect, Persist, Report, SafetyMachine, SendAnswer
from tests.patience import PATIENCE_S

STEP_S = 0.05
_ATTEMPTS = itertools.count(1)
REST = Twist2D(0.0, 0.0)
AHEAD = Twist2D(1.0, 0.4)


def person(
    x: float,
    y: float = 0.0,
    *,
    decision_id: str = "d-1",
    radius_m: float | None = 2.0,
    class_: Class = "person",
    class_id: str = "farmer",
    observer: str = "AGII",
    velocity: tuple[float, float] | None = None,
) -> FeedbackAlert:
    place = x, y, 0.9
    return FeedbackAlert(
        decision_id, "", class_, class_id, 0.9, place, radius_m, observer, velocity
    )


async def until(true: Callable[[], object]) -> None:
    async with asyncio.timeout(PATIENCE_S):
        while not true():  # noqa: ASYNC110 - of no event
            await asyncio.sleep(0.002)


def release(ids: list[str], challenge: str, attempt: str = "") -> bytes:
    named = attempt or f"try-{next(_ATTEMPTS)}"
    return codec.write_command(codec.ReleaseOrder(challenge, named, tuple(ids)))


def resume(challenge: str, attempt: str = "") -> bytes:
    named = attempt or f"try-{next(_ATTEMPTS)}"
    return codec.write_command(codec.ResumeOrder(challenge, named))


def stop(hold_id: str) -> bytes:
    return codec.write_command(codec.StopOrder(hold_id, "opaque"))


@dataclass
class Rig:
    """Runs one machine; ``told`` is what iVeg says at 5 Hz while ``speaks``.

    Attributes:
        obeys: The drive reaches what it is told at once.
        disk: The hold set that was kept last.
    """

    now: float = 100.0
    boot: str = "b1"
    disk: HoldSet | None = field(default_factory=HoldSet)
    limits: Limits = field(default_factory=Limits)
    pose: Pose2D = field(default_factory=lambda: Pose2D(0.0, 0.0, 0.0))
    speed: Twist2D = field(default_factory=lambda: REST)
    wished: Twist2D | None = None
    obeys: bool = True
    odometry: bool = True
    speaks: bool = True
    speed_limits: Mapping[str, SpeedLimit] = field(default_factory=dict)
    alerts: tuple[FeedbackAlert, ...] = ()
    foresight: bool = False
    log: list[tuple[float, Effect]] = field(default_factory=list)
    report_seq: int = 500
    feedback_seq: int = 0

    def __post_init__(self) -> None:
        self._names = itertools.count(1)
        self.machine = self.start()
        self._spoke_at = self.now

    def start(self) -> SafetyMachine:
        return SafetyMachine(
            "AGI",
            self.boot,
            self.now,
            stored=self.disk,
            fresh=lambda: f"{self.boot}n{next(self._names)}",
            limits=self.limits,
        )

    # --- time -------------------------------------------------------------------

    def run(self, seconds: float) -> "Rig":
        for _ in range(round(seconds / STEP_S)):
            self.step()
        return self

    def step(self) -> None:
        self.now = round(self.now + STEP_S, 6)
        machine = self.machine
        if self.odometry:
            self.call(lambda: machine.odometry(self.pose, self.speed, self.now))
        if self.speaks and self.now - self._spoke_at >= 0.199:
            self._spoke_at = self.now
            self.hear()
        self.ask()

    def ask(self) -> None:
        """What upstream wishes for, if it says anything."""
        machine, wished = self.machine, self.wished
        if wished is None:
            self.call(lambda: machine.tick(self.now))
        else:
            self.call(lambda: machine.request_twist(wished, self.now))

    def call(self, machine: Callable[[], tuple[Effect, ...]]) -> tuple[Effect, ...]:
        """One call of the machine, and what follows from it."""
        return self.perform(machine())

    def perform(self, effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
        for effect in effects:
            self.log.append((self.now, effect))
            if isinstance(effect, Persist):
                self.disk = effect.holds
            elif isinstance(effect, Report):
                self.report_seq += 1
                self.machine.reported(self.report_seq, self.now)
            elif isinstance(effect, Drive) and self.obeys:
                self.speed = effect.twist
        return effects

    # --- what happens to it -----------------------------------------------------

    def hear(self, feedback: Feedback | None = None, topic: str = "AGII") -> None:
        told = feedback or self.feedback()
        self.call(lambda: self.machine.feedback(topic, told, self.now))

    def feedback(self, **parts: object) -> Feedback:
        self.feedback_seq += 1
        values: dict[str, object] = {
            "robot_id": "AGII",
            "origin": Origin("cloud", self.feedback_seq),
            "alerts": self.alerts,
            "speed_limits": {"AGI": CLEAR, **self.speed_limits},
            "seen": {"AGI": self.report_seq},
            "foresight": self.foresight,
        }
        return Feedback(**(values | parts))  # type: ignore[arg-type]

    def command(self, payload: bytes) -> CommandAnswer:
        effects = self.call(lambda: self.machine.command(payload, self.now))
        return next(one.answer for one in effects if isinstance(one, SendAnswer))

    def stop(self, hold_id: str = "01STOP") -> CommandAnswer:
        return self.command(stop(hold_id))

    def release(self) -> CommandAnswer:
        """What a perfect iVeg does."""
        ids = sorted(self.machine.holds.remote)
        return self.command(release(ids, self.machine.challenge))

    def resume(self) -> CommandAnswer:
        return self.command(resume(self.machine.challenge))

    def level(self, desired: str, *ids: str) -> None:
        payload = orjson.dumps({"desired": desired, "ids": ids})
        self.call(lambda: self.machine.desired(payload, self.now))

    def drive_on(self) -> "Rig":
        """Bring it to full speed: released, resumed, neutral, ramped."""
        self.wished = REST
        self.run(1.5)
        self.release()
        self.resume()
        self.run(1.5)
        self.wished = AHEAD
        return self.run(3.0)

    # --- what is seen of it -----------------------------------------------------

    @property
    def state(self) -> str:
        return self.machine.state(self.now)

    @property
    def twist(self) -> Twist2D:
        return next(
            one.twist for _, one in reversed(self.log) if isinstance(one, Drive)
        )

    @property
    def reports(self) -> list[SafetyReport]:
        return [one.report for _, one in self.log if isinstance(one, Report)]

    @property
    def holds(self) -> tuple[Hold, ...]:
        return self.machine.holds.holds

    @property
    def factor(self) -> float:
        return self.machine.cap.factor

    @property
    def reason(self) -> str:
        return self.machine.cap.reason

    def factor_changes(self) -> int:
        told = [report.speed_factor for report in self.reports]
        return sum(a != b for a, b in itertools.pairwise(told))
