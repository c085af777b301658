"""One robot between its broker and its drive."""

import asyncio
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import cast

import pytest

from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.feedback import CLEAR, Feedback
from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.observations import (
    CommandAnswer,
    FeedbackRef,
    Instant,
    Odometry,
    Origin,
    SafetyReport,
)
from iveg.ngsi import codec
from iveg.robot.node import NodeSettings, RobotNode
from tests.unit.robot.rig import AHEAD, release, resume, stop

COMMANDS, DESIRED = "/iveg/AGI/cmd", "/AGI/iveg/desired"
_Take = Callable[[str, bytes], None]


class Link:
    """A broker in memory: keeps what the node sends, and hands it messages."""

    connected = True

    def __init__(self) -> None:
        self.sent: list[tuple[str, bytes]] = []

    def attach(self, _: Mapping[str, int], take: _Take, *, on_stored: _Take) -> None:
        self.take, self.take_stored = take, on_stored

    def enqueue(self, topic: str, payload: bytes) -> None:
        self.sent.append((topic, payload))

    async def publish(self, topic: str, payload: bytes, **_: int) -> None:
        self.enqueue(topic, payload)

    def newest_report(self) -> int:
        """Number of the newest safety report."""
        sent = [raw for topic, raw in self.sent if topic == "/AGI/iveg/safety"]
        if not sent:
            return 0
        (report,) = codec.read_measure("AGI_safety", sent[-1]).observations
        assert isinstance(report, SafetyReport)
        return report.origin.seq or 0

    async def run(self) -> None:
        await asyncio.Event().wait()

    def answers(self) -> list[str]:
        """Results of the answers to orders, in order."""
        read = [
            said
            for topic, payload in self.sent
            if topic == "/iveg/AGI/cmdexe"
            for said in codec.read_answer("AGI", payload).observations
        ]
        return [said.result for said in read if isinstance(said, CommandAnswer)]


class Bench:
    """A node with a clock that is moved by hand, and a drive that obeys at once."""

    def __init__(self, folder: Path) -> None:
        self.link, self.now, self.driven = Link(), 100.0, [REST]
        self.seq = 0
        settings = NodeSettings(
            address=BrokerAddress("127.0.0.1", 1),
            apikey="iveg",
            directory=folder,
            read_clock=lambda: Instant(self.now, self.now),
            open_link=lambda *_: cast("MqttLink", self.link),
        )
        self.node = RobotNode(
            "AGI", settings, profile=RobotProfile(), drive=self.driven.append
        )

    async def run(self, seconds: float, wish: Twist2D) -> None:
        """Odometry, feedback and wishes twenty times a second."""
        for _ in range(round(seconds * 20)):
            self.now, self.seq = self.now + 0.05, self.seq + 1
            pose = Pose2D(0.0, 0.0, 0.0)
            self.node.sense(Odometry("", Origin(), pose, self.driven[-1]))
            said = Feedback(
                "AGII",
                Origin("cloud", self.seq),
                speed_limits={"AGI": CLEAR},
                seen={"AGI": self.link.newest_report()},
            )
            self.link.take("/AGII/mqtt_feedback", codec.write_feedback(said))
            self.node.request_twist(wish)
            await asyncio.sleep(0.001)  # the node's own tasks send


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


async def test_a_released_and_resumed_robot_drives_and_a_stop_zeroes_it(
    bench: Bench,
) -> None:
    task = asyncio.create_task(bench.node.run())
    await bench.run(1.0, REST)
    machine = bench.node.machine
    held = [hold.id for hold in bench.node.machine.holds.holds]
    bench.link.take(COMMANDS, release(held, machine.challenge))
    bench.link.take(COMMANDS, resume(machine.challenge))
    await bench.run(1.0, REST)
    await bench.run(1.5, AHEAD)
    drove = bench.driven[-1]
    bench.link.take(COMMANDS, stop("01STOP"))
    stood = bench.driven[-1]
    async with asyncio.timeout(10.0):
        while len(bench.link.answers()) < 3:  # noqa: ASYNC110 - after the disk
            await asyncio.sleep(0.01)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)

    assert drove.linear_x > 0.4
    assert (stood, bench.driven[-1]) == (REST, REST)
    assert bench.link.answers() == ["RELEASED", "RESUMED", "LATCHED"]


async def test_the_drive_is_told_25_times_a_second_while_it_is_held(
    bench: Bench,
) -> None:
    task = asyncio.create_task(bench.node.run())
    await asyncio.sleep(0.5)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)

    assert len(bench.driven) >= 8
    assert set(bench.driven) == {REST}


def test_a_retained_stop_holds_and_retained_feedback_is_no_author(bench: Bench) -> None:
    bench.node.release_locally()
    assert not bench.node.machine.holds.holds

    old = codec.write_feedback(Feedback("AGII", Origin("old", 7)))
    bench.link.take_stored("/AGII/mqtt_feedback", old)
    bench.link.take_stored(DESIRED, codec.write_desired("stopped", ["01STOP"]))

    assert bench.node.machine.holds.find("01STOP") is not None
    assert bench.node.machine.authors.echoes(bench.now) == ()


def test_a_measurement_echoes_the_feedback_that_had_come_by_its_moment(
    bench: Bench,
) -> None:
    for bench.now, seq in ((100.5, 1), (101.0, 2)):
        said = codec.write_feedback(Feedback("AGII", Origin("cloud", seq)))
        bench.link.take("/AGII/mqtt_feedback", said)
    bench.node.sense(Odometry("", Origin(), Pose2D(0.0, 0.0, 0.0), REST), age_s=0.25)

    (sent,) = codec.read_measure("AGI_odom", bench.link.sent[-1][1]).observations
    assert (sent.origin.mono, sent.origin.echoes) == (0.75, (FeedbackRef("cloud", 1),))
