"""The pipeline with fakes round it, on one clock that is moved by hand."""

import asyncio
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from iveg.domain.equipment import Tile
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import (
    CommandAnswer,
    Detection,
    Hold,
    Observation,
    Origin,
    Received,
)
from iveg.domain.stop import FollowedCommand
from iveg.domain.transports import DIRECT, FIWARE, Transport, TransportId
from iveg.pipeline import Choices, Pipeline
from iveg.vital.ports import CommandPort, Ports
from tests.builders import detection_frame, fleet_of, odometry, origin, safety_report
from tests.fakes.clock import FakeClock
from tests.fakes.context_broker import FakeContextBroker
from tests.fakes.fleet import FakeFleet
from tests.fakes.ids import FakeIds
from tests.fakes.journal import FakeJournal
from tests.fakes.kept import FakeChoices
from tests.fakes.recorder import FakeRecorder

OneRecord = TypeVar("OneRecord")
FIELD = Greenhouse("field", Rectangle(-100, -100, 100, 100))


class Desk:
    """Everything between the doors; ``Desk.clock.now`` is the time (s)."""

    def __init__(
        self,
        robots: tuple[str, ...] = ("AGI", "AGII"),
        greenhouse: Greenhouse = FIELD,
        *,
        direct: bool = True,
        also: Mapping[Transport, CommandPort] | None = None,
        tiles: Sequence[Tile] = (),
        refused: Sequence[str] = (),
    ) -> None:
        self.clock = FakeClock()
        self.fleet = FakeFleet()
        self.broker = FakeContextBroker()
        self.journal = FakeJournal()
        self.ids = FakeIds()
        self.sink = FakeRecorder()
        self.choices = FakeChoices()
        self.description = fleet_of(*robots)
        self.parts = parts = Pipeline(
            self.description,
            greenhouse,
            Ports(
                self.fleet,
                {
                    DIRECT.switched(on=direct): self.fleet,
                    FIWARE: self.broker,
                    **(also or {}),
                },
                self.journal,
                self.sink,
                self.clock,
                self.ids,
                lambda: "ok",
            ),
            Choices(self.choices.kept, tiles=tiles, refused=refused),
        )
        self.hub, self.event_log, self.health_monitor = (
            parts.hub,
            parts.core.event_log,
            parts.core.health_monitor,
        )
        self.latency, self.ingest, self.loop = parts.latency, parts.ingest, parts.loop
        self.evaluator, self.commander = parts.evaluator, parts.commander
        self.world = parts.core.world
        self.seq = 0

    # --- what arrives -------------------------------------------------------------

    def lag(self, seconds: float) -> None:
        """The newest heartbeat probe has been out for so long."""
        left = self.clock().later(-seconds)
        self.health_monitor.probe.sent(Origin("iveg", 1), left)

    def hear(
        self,
        observation: Observation,
        transport: TransportId = DIRECT.id,
        *,
        is_query_answer: bool = False,
    ) -> None:
        """One observation goes through the rule loop."""
        received = Received(observation, self.clock(), transport, is_query_answer)
        self.loop.step([received], self.clock())

    def drive(self, robot_id: str, x: float = 0.0, *, linear: float = 0.5) -> None:
        self.hear(odometry(robot_id, x, linear=linear, origin=self.next_origin()))

    def look(self, robot_id: str, *seen: Detection, unreadable: int = 0) -> None:
        frame = detection_frame(
            robot_id, *seen, unreadable=unreadable, origin=self.next_origin()
        )
        self.hear(frame)

    def report(
        self,
        robot_id: str = "AGI",
        *holds: Hold,
        factor: float = 0.0,
        reason: str = "hold",
        linear: float = 0.0,
        released: tuple[str, ...] = (),
        decision_id: str | None = None,
    ) -> None:
        report = safety_report(
            robot_id,
            *holds,
            speed_factor=factor,
            reason=reason,
            linear=linear,
            released=released,
            decision_id=decision_id,
            origin=self.next_origin(),
        )
        self.hear(report)

    def answer(self, result: str, *, why: str | None = None) -> None:
        """AGI answers for the hold that it was last stopped with."""
        machine = self.commander.machine("AGI")
        attempt = None if machine.order is None else machine.order.command_id
        said = replace(self.next_origin(), stamp=None, stamp_s=None)
        self.hear(
            CommandAnswer(
                "AGI", said, machine.hold_id, result, why=why, attempt=attempt
            )
        )

    def next_origin(self) -> Origin:
        self.seq += 1
        return origin(self.seq, after=self.clock.now)

    # --- time ---------------------------------------------------------------------

    async def wait(self, seconds: float) -> None:
        """Tick through this time; tasks get their turn at each tick."""
        for _ in range(round(seconds / 0.05)):
            self.clock.now = round(self.clock.now + 0.05, 6)
            self.loop.step([], self.clock())
            await settle()

    async def stand(self, robot_id: str = "AGI") -> None:
        """The robot reports our hold at rest until it is believed."""
        machine = self.commander.machine(robot_id)
        for _ in range(12):
            self.report(robot_id, Hold(machine.hold_id or "", "iveg", "remote"))
            await self.wait(0.1)
        assert machine.state == "STANDING"
        self.report(robot_id, Hold(machine.hold_id or "", "iveg", "remote"))

    def now(self, command: FollowedCommand) -> FollowedCommand:
        """A command as it is by now."""
        return self.commander.commands[command.command_id]

    # --- what was told ------------------------------------------------------------

    def sentences(self) -> list[str]:
        """The sentences of the log, in order."""
        return [line.key for line in self.event_log.lines]

    def records(self, kind: type[OneRecord]) -> list[OneRecord]:
        return [one for one in self.sink.records if isinstance(one, kind)]


async def settle() -> None:
    """Let every task that can go on go on."""
    for _ in range(5):
        await asyncio.sleep(0)


def conditions_of(desk: Desk) -> Iterable[str]:
    """What is wrong, by key."""
    return [one.condition.key for one in desk.evaluator.alerts.waiting]
