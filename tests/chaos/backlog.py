"""Stands between the field broker and the IoT Agent, and is as late as an agent can be.

A real agent is one process with one queue: measures, answers and commands wait in it
behind each other, nothing is lost, and the queue has no bound (measured: about 150
measures a second on two cores, then seconds and minutes of delay).
"""

import asyncio
import contextlib
from collections import deque
from dataclasses import dataclass

from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.errors import HopError
from tests.threads import running

_MEASURES, _ANSWERS, _COMMANDS = "/+/+/attrs", "/+/+/cmdexe", "/+/+/cmd"
_STEP_S = 0.005


@dataclass(frozen=True)
class Pace:
    """How the agent does.

    Attributes:
        late_s: Each message waits at least this long.
        per_s: Messages that it can carry a second.
        frozen: Nothing passes; what has come meanwhile passes after the thaw.
    """

    late_s: float = 0.0
    per_s: float = 2000.0
    frozen: bool = False


PROMPT = Pace()


class Backlog:
    """Carries messages between two brokers in order of their arrival.

    Attributes:
        pace: Read for every message, so that it can change at any moment.
        carried: Messages that have passed.
    """

    def __init__(self, field_port: int, south_port: int) -> None:
        self.pace = PROMPT
        self.carried = 0
        self._queue: deque[tuple[float, MqttLink, str, bytes]] = deque()
        field = BrokerAddress("127.0.0.1", field_port)
        south = BrokerAddress("127.0.0.1", south_port)
        up = {_MEASURES: 1, _ANSWERS: 1}
        self._field = MqttLink(field, "backlog field", up, self._from_field)
        self._south = MqttLink(south, "backlog south", {_COMMANDS: 0}, self._from_south)
        self._life = contextlib.ExitStack()

    def __enter__(self) -> "Backlog":
        self._life.enter_context(running(self._serve(), "backlog"))
        return self

    def __exit__(self, *_: object) -> None:
        self._life.close()

    @property
    def waiting(self) -> int:
        """Messages in the queue."""
        return len(self._queue)

    async def _serve(self) -> None:
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._field.run())
            tasks.create_task(self._south.run())
            tasks.create_task(self._carry_forever())

    def _from_field(self, topic: str, payload: bytes) -> None:
        self._queue.append((_now(), self._south, topic, payload))

    def _from_south(self, topic: str, payload: bytes) -> None:
        self._queue.append((_now(), self._field, topic, payload))

    async def _carry_forever(self) -> None:
        credit, at = 0.0, _now()
        while True:
            await asyncio.sleep(_STEP_S)
            now, pace = _now(), self.pace
            credit = min(credit + (now - at) * pace.per_s, max(1.0, pace.per_s / 20))
            at = now
            while credit >= 1.0 and self._is_due(now, pace):
                credit -= 1.0
                await self._carry(*self._queue.popleft()[1:])

    def _is_due(self, now: float, pace: Pace) -> bool:
        if pace.frozen or not self._queue:
            return False
        return now - self._queue[0][0] >= pace.late_s

    async def _carry(self, link: MqttLink, topic: str, payload: bytes) -> None:
        # An agent subscribes and publishes at QoS 0: what a broker misses is lost.
        with contextlib.suppress(HopError):
            await link.publish(topic, payload, qos=0)
        self.carried += 1


def _now() -> float:
    return asyncio.get_running_loop().time()
