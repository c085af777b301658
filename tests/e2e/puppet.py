"""A robot on strings: it speaks the contract, and its brakes do what a test wants.

The emulator's robots always brake.  This one shows what iVeg makes of a robot that
obeys slowly, never, only in words, or for a while.
"""

import asyncio
import contextlib
import secrets
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import orjson

from iveg.adapters import clock
from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.errors import UnreadableError
from iveg.domain.observations import Origin
from iveg.ngsi import names
from iveg.ngsi.codec import format_stamp, read_feedback
from iveg.ngsi.codec.fields import write_origin
from tests.fakes.echo import Echo
from tests.processes import Site, site
from tests.threads import running

_APIKEY = "iveg"
_EVERY_S = 0.1
CRUISE = 0.4
"""How fast it drives when nothing holds it (m/s)."""


@dataclass
class Puppet:
    """One robot in a thread of its own; a test pulls its strings.

    Attributes:
        brakes: It comes to rest when it is held.
        answers: It obeys and says so; else it is deaf to commands.
        speaks: It reports; else it is silent.
        speed: (m/s).
        holds: What holds it, by id.
    """

    robot_id: str
    address: BrokerAddress
    brakes: bool = True
    answers: bool = True
    speaks: bool = True
    speed: float = CRUISE
    holds: list[str] = field(default_factory=list)
    released: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._boot = secrets.token_hex(4)
        self._seq = 0
        self._challenge = secrets.token_hex(8)
        self._echo = Echo()
        self._started = clock.mono()
        self._orders = names.command_topic(_APIKEY, self.robot_id)
        topics = {self._orders: 1, names.FEEDBACK_FILTER: 1}
        self._link = MqttLink(self.address, self.robot_id, topics, self._hear)

    def behave(self) -> None:
        """Obey, brake and report, as robots should."""
        self.brakes = self.answers = self.speaks = True

    async def live(self) -> None:
        """Report ten times a second until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._link.run(), name="puppet-link")
            while True:
                if self.holds and self.brakes:
                    self.speed = 0.0
                if self.speaks:
                    self._report()
                await asyncio.sleep(_EVERY_S)

    def _hear(self, topic: str, payload: bytes) -> None:
        if topic != self._orders:
            with contextlib.suppress(UnreadableError):
                self._echo.note(read_feedback(payload).origin, clock.mono())
        elif self.answers:
            self._obey(payload)

    def _obey(self, payload: bytes) -> None:
        order = orjson.loads(payload).get(names.COMMAND, {})
        if "stop" in order:
            self._latch(order["stop"]["id"])
        elif "release" in order and set(order["release"]["ids"]) == set(self.holds):
            self.released += self.holds
            self.holds.clear()
            self._answer("RELEASED", None)
        elif "resume" in order and not self.holds:
            self.speed = CRUISE
            self._answer("RESUMED", None)

    def _latch(self, hold_id: str) -> None:
        if hold_id not in self.holds and hold_id not in self.released:
            self.holds.append(hold_id)
        self._answer("LATCHED", hold_id)

    def _answer(self, result: str, hold_id: str | None) -> None:
        word = {"id": hold_id, "r": result, "v": self.speed, "why": None}
        answer = {"cmd": {**word, **self._held(), **self._origin()}}
        topic = names.answer_topic(_APIKEY, self.robot_id)
        self._link.enqueue(topic, orjson.dumps(answer), qos=1)

    def _report(self) -> None:
        pose = {"x": 2.0, "y": 2.0, "yaw": 0.0}
        motion = {"linear_velocity": self.speed, "angular_velocity": 0.0}
        self._measure("_odom", names.ODOMETRY, {**pose, **motion}, qos=0)
        is_moving = self.speed > 0.0 and not self.holds
        applied = {
            "speed_factor": 1 if is_moving else 0,
            "reason": "clear" if is_moving else "hold",
            "cause": self.holds[0] if self.holds else None,
            "decision_id": None,
            "released": self.released[-64:],
            "v": self.speed,
            "w": 0.0,
            "feedback_age_s": 0.1,
        }
        self._measure("_safety", names.SAFETY, {**applied, **self._held()}, qos=1)

    def _measure(
        self, suffix: str, attribute: str, value: dict[str, object], qos: int
    ) -> None:
        origin = self._origin()
        message = {attribute: {**value, **origin}, "TimeInstant": origin["stamp"]}
        topic = names.measure_topic(_APIKEY, self.robot_id + suffix)
        self._link.enqueue(topic, orjson.dumps(message), qos=qos)

    def _held(self) -> dict[str, object]:
        holds = [{"id": it, "source": "iveg", "ack": "remote"} for it in self.holds]
        return {"holds": holds, "ch": self._challenge}

    def _origin(self) -> dict[str, object]:
        self._seq += 1
        now = clock.now()
        stamp, mono = format_stamp(now.wall), now.mono - self._started
        said = Origin(self._boot, self._seq, stamp, mono=mono)
        return write_origin(self._echo.on(said, now.mono))


def described(directory: Path, *robots: str) -> str:
    """A file that says what these robots are, as IVEG_FLEET names it."""
    file = directory / "fleet.toml"
    file.write_text("".join(_DESCRIPTION.format(robot) for robot in robots))
    return str(file)


_DESCRIPTION = """
[[robots]]
id = "{}"
body = {{ length_m = 0.99, width_m = 0.57 }}
drive = {{ type = "differential", max_speed_m_s = 1.0 }}
camera = {{ x_m = 0.4, fov_deg = 69, range_m = 8 }}
"""


@contextlib.contextmanager
def stage(directory: Path, **settings: str) -> Iterator[tuple[Site, Puppet]]:
    """FIWARE, dashboard and one puppet; no emulator."""
    fleet = described(directory, "AGV")
    with site(directory, IVEG_FLEET=fleet, **settings) as place:
        place.serve()
        with puppet("AGV", place.settings["IVEG_MQTT_URL"]) as robot:
            place.wait_until_live(robots=1)
            yield place, robot


@contextlib.contextmanager
def puppet(robot_id: str, mqtt_url: str) -> Iterator[Puppet]:
    """A robot that lives as long as the block."""
    found = Puppet(robot_id, BrokerAddress.from_url(mqtt_url))
    with running(found.live(), robot_id):
        yield found
