"""A robot that speaks ROS 2 over the whole path, every part a process, and a witness.

Emulated base and navigation ── DDS ── ``iveg robot`` ── MQTT ── FIWARE ── iVeg.
"""

import itertools
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from iveg.domain.errors import UnreadableError
from iveg.ros2 import cdr, names
from iveg.ros2 import messages as ros
from tests.dds import Dds, free_domain, loopback
from tests.processes import Program, Site, until

ROBOT = "AGI"
STAND_S = 1.5
"""The robot's time-out for iVeg's silence here."""
SETTINGS = {
    "IVEG_ROBOTS": ROBOT,
    "IVEG_FEEDBACK_SLOW_S": "1.0",
    "IVEG_FEEDBACK_STAND_S": str(STAND_S),
}
_DRIVES = 0.25
_STANDS = 0.02
_STEP_S = 0.1
"""A base that was not let run for longer moves on by only so much."""


class Witness:
    """Hears the base's odometry by the base's own stamps (Unix s, m/s)."""

    def __init__(self, dds: Dds) -> None:
        self._reader = dds.reader(
            f"/{names.namespace_of(ROBOT)}/odom",
            ros.Odometry,
            names.SENSOR_DATA.newest(200),
        )
        self._heard: deque[tuple[float, float]] = deque(maxlen=5000)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._ended.set()
        self._thread.join(5)

    def _listen(self) -> None:
        while not self._ended.wait(0.01):
            for one in self._reader.take():
                try:
                    said = cdr.read(ros.Odometry, one)
                except UnreadableError:
                    continue
                speed = said.twist.twist.linear.x
                self._heard.append((said.header.stamp.seconds, abs(speed)))

    @property
    def drives(self) -> bool:
        """Whether the base moves at this moment."""
        stamp, speed = self._heard[-1] if self._heard else (0.0, 0.0)
        return time.time() - stamp < 0.3 and speed > _DRIVES

    def stood_after(self, since: float) -> float | None:
        """Seconds from ``since`` (Unix s) to the standstill; None while it moves."""
        after = [(at, speed) for at, speed in list(self._heard) if at >= since]
        moved = [at for at, speed in after if speed > _STANDS]
        last = moved[-1] if moved else since
        rested = [at for at, _ in after if at > last]
        return last - since if rested and rested[-1] - last > 0.5 else None

    def starved_s(self, since: float, until_: float) -> float:
        """For how long a busy machine let the emulated base not move at all (s)."""
        stamps = [at for at, _ in list(self._heard) if since <= at <= until_]
        gaps = (later - at for at, later in itertools.pairwise([since, *stamps]))
        return sum(max(0.0, gap - _STEP_S) for gap in gaps)

    def speed_at(self, when: float) -> float:
        """Newest speed before a moment (Unix s)."""
        before = [speed for at, speed in list(self._heard) if at <= when]
        return before[-1] if before else 0.0


class Ros2Field:
    """Every part a process of its own, each killed and started again by name."""

    def __init__(self, place: Site) -> None:
        self.place = place
        self.domain = free_domain()
        self.parts: dict[str, Program] = {}

    @property
    def network(self) -> list[str]:
        """Words that name the network."""
        where = ["--ros-domain", str(self.domain), "--ros-interface", "127.0.0.1"]
        return [*where, "--ros-peer", "127.0.0.1"]

    def start(self, part: str) -> None:
        """Start a part; returns when it says that it is up."""
        words = {
            "fiware": ["fiware"],
            "serve": ["serve", "--demo"],
            "emulator": [
                *("emulator", "--dds", "--scenario", "viewpoints", "--robots", "1"),
                *self.network,
            ],
            "robot": [
                *("robot", "--id", ROBOT, "--attended", "--namespace"),
                *(f"/{names.namespace_of(ROBOT)}", *self.network),
            ],
        }
        self.parts[part] = self.place.start(*words[part])
        self.parts[part].wait_until_ready()

    def kill(self, part: str) -> float:
        """What a power cut does; when it did (Unix s)."""
        program = self.parts.pop(part)
        now = time.time()
        program.kill()
        return now

    def drive(self, witness: Witness) -> None:
        """Start what is dead; until the base moves.

        A robot that iVeg's silence held more than thrice a minute waits for somebody:
        its software is started anew by the crew.
        """
        for part in ("fiware", "serve", "emulator", "robot"):
            if part not in self.parts:
                self.start(part)
        try:
            until(lambda: witness.drives, "the base moves")
        except AssertionError:
            self.kill("robot")
            for file in self.place.directory.rglob(f"{ROBOT}.holds.json"):
                file.unlink()
            self.start("robot")
            until(lambda: witness.drives, "the base moves")


@contextmanager
def ros2_field(place: Site) -> Iterator[tuple[Ros2Field, Witness]]:
    """All of it, and somebody who watches the base."""
    field = Ros2Field(place)
    with Dds(loopback(field.domain)) as dds:
        witness = Witness(dds)
        try:
            yield field, witness
        finally:
            witness.close()
