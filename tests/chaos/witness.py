"""A witness on the field broker: what robots do, beside what people allowed them."""

import contextlib
from dataclasses import dataclass, field

from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Odometry, SafetyReport
from iveg.ngsi import codec
from tests.threads import running


@dataclass
class Seen:
    """One robot, as the witness knows it.

    Attributes:
        allowed: Whether a person has resumed it since it last reported a hold.
        starts: Times it began to move; ``unlicensed`` those that nobody allowed.
        report: Boot and count of its newest report.
        held_at: Its own clock at the first report of this hold (s).
        moved: Boot and own clock of its newest odometry.
    """

    speed: float = 0.0
    held: bool = False
    allowed: bool = False
    starts: int = 0
    unlicensed: int = 0
    factor: float = 0.0
    words: int = 0
    report: tuple[str | None, int] = (None, 0)
    held_at: float = 0.0
    moved: tuple[str | None, float] = (None, 0.0)


@dataclass
class Witness:
    """Listens in a thread of its own, so that no test's pause is its own."""

    port: int
    robots: dict[str, Seen] = field(default_factory=dict)

    def __post_init__(self) -> None:
        # What the agent is told, and what iVeg alone is told past it.
        topics = {"/iveg/+/attrs": 0, "/+/iveg/odom": 0, "/+/iveg/safety": 0}
        address = BrokerAddress("127.0.0.1", self.port)
        self._link = MqttLink(address, "witness", topics, self.take)
        self._life = contextlib.ExitStack()

    def __enter__(self) -> "Witness":
        self._life.enter_context(running(self._link.run(), "witness"))
        return self

    def __exit__(self, *_: object) -> None:
        self._life.close()

    def of(self, robot_id: str) -> Seen:
        return self.robots.setdefault(robot_id, Seen())

    def allow(self, robot_id: str) -> None:
        """A person is about to resume this robot."""
        self.of(robot_id).allowed = True

    @property
    def unlicensed(self) -> int:
        """Motions that nobody allowed."""
        return sum(one.unlicensed for one in self.robots.values())

    @property
    def starts(self) -> int:
        return sum(one.starts for one in self.robots.values())

    def take(self, topic: str, payload: bytes) -> None:
        """One message of the field broker."""
        _, first, second, last = topic.split("/")
        device = second if first == "iveg" else f"{first}_{last}"
        if not device.endswith(("_odom", "_safety")):
            return
        for word in codec.read_measure(device, payload).observations:
            if isinstance(word, Odometry):
                self._moves(self.of(word.robot_id), word)
            elif isinstance(word, SafetyReport):
                self._reports(self.of(word.robot_id), word)

    def _reports(self, seen: Seen, report: SafetyReport) -> None:
        """Each counts once: it comes on two topics, and again after a lost line."""
        boot, seq = report.origin.boot, report.origin.seq or 0
        if boot == seen.report[0] and seq <= seen.report[1]:
            return
        held = any(hold.ack != "auto" for hold in report.holds)
        if held and not (seen.held and boot == seen.report[0]):
            seen.held_at = report.origin.own_s or 0.0
        seen.report = boot, seq
        seen.words += 1
        seen.factor = report.speed_factor
        seen.held = held

    def _moves(self, seen: Seen, word: Odometry) -> None:
        """Motion by the robot's own clock: a report overtakes odometry that waits.

        Only a robot that was at rest after it was held may not start: one that brakes
        has not been stopped yet.
        """
        speed, at = abs(word.twist.linear_x), word.origin.own_s or 0.0
        if word.origin.boot == seen.moved[0] and at <= seen.moved[1]:
            return
        seen.moved = word.origin.boot, at
        begins = seen.speed < LIMITS.standing_speed <= speed
        seen.starts += begins
        seen.unlicensed += begins and not seen.allowed
        seen.speed = speed
        if seen.held and at > seen.held_at and speed < LIMITS.standing_speed:
            seen.allowed = False
