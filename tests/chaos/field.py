"""A field broker that is a real Mosquitto, bridged to the embedded FIWARE behind it.

Robots and iVeg meet on Mosquitto; measures and answers go through the bridge to the
embedded agent, its commands come back.  Each direction has its own topics, so nothing
goes round in circles.
"""

import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

from tests.bonds import bound
from tests.brokers import MOSQUITTO, PLAIN
from tests.ports import free_ports
from tests.processes import EMULATOR, Program, Site, until

_BRIDGE = """connection fiware
address 127.0.0.1:{south}
bridge_protocol_version mqttv311
try_private false
notifications false
bridge_attempt_unsubscribe false
cleansession true
restart_timeout 1
topic +/+/attrs out 0 / /
topic +/+/cmdexe out 1 / /
topic +/+/cmd in 1 / /
"""


class Field:
    """Every part a process of its own: broker, FIWARE, iVeg and robots.

    Attributes:
        radio: Port through which robots reach the broker; None: straight.
        bridged: Mosquitto carries to the agent; False: a test does (``backlog``).
        south: Port of the agent's own broker.
    """

    def __init__(self, place: Site, *emulator: str) -> None:
        self.place = place
        self.radio: int | None = None
        self.bridged = True
        self._emulator = emulator or ("--held",)
        (self.south,) = free_ports(1)
        self.port = int(urlsplit(place.settings["IVEG_MQTT_URL"]).port or 0)
        self._broker: subprocess.Popen[bytes] | None = None
        self._running: dict[str, Program] = {}

    def start_all(self) -> None:
        for part in ("broker", "fiware", "serve", "emulator"):
            self.start(part)
        self.place.wait_until_live()

    def start(self, part: str) -> None:
        """Start one part; it may take its time."""
        if part == "broker":
            self._start_broker()
        elif part == "fiware":
            # FIWARE has a broker of its own, behind the bridge.
            self._start_at(self.south, part)
        elif part == "emulator":
            broker = self.radio or self.port
            self._start_at(broker, *EMULATOR, *self._emulator)
        else:
            self._start_at(self.port, part)

    def _start_at(self, broker: int, part: str, *words: str) -> None:
        field = self.place.settings["IVEG_MQTT_URL"]
        self.place.settings["IVEG_MQTT_URL"] = f"mqtt://127.0.0.1:{broker}"
        self._running[part] = self.place.start(part, *words)
        self.place.settings["IVEG_MQTT_URL"] = field

    def kill(self, part: str) -> None:
        """What a power cut does."""
        if part == "broker":
            assert self._broker is not None
            self._broker.kill()
            self._broker.wait(10)
        else:
            self._running[part].kill()

    def freeze(self, part: str) -> None:
        self._running[part].process.send_signal(signal.SIGSTOP)

    def thaw(self, part: str) -> None:
        self._running[part].process.send_signal(signal.SIGCONT)

    def close(self) -> None:
        """End the broker; the programs are ended by their place."""
        if self._broker is not None:
            self._broker.kill()
            self._broker.wait(10)

    def _start_broker(self) -> None:
        assert MOSQUITTO is not None
        conf = Path(self.place.directory) / "field.conf"
        bridge = _BRIDGE if self.bridged else ""
        conf.write_text((PLAIN + bridge).format(port=self.port, south=self.south))
        self._broker = subprocess.Popen(bound(MOSQUITTO, "-c", str(conf)))
        until(self._listens, "mosquitto listens")

    def _listens(self) -> bool:
        try:
            socket.create_connection(("127.0.0.1", self.port), 1.0).close()
        except OSError:
            return False
        return True


@contextmanager
def running(place: Site, radio: int | None = None) -> Iterator[Field]:
    """Everything runs; the robots are held, and nobody is in their way.

    Args:
        radio: Port through which the robots meet the broker, if not its own.
    """
    field = Field(place, "--held", "--scenario", "peers")
    field.radio = radio
    try:
        field.start_all()
        yield field
    finally:
        place.stop_all()
        field.close()
