"""What the ROS 2 side of a robot costs: ``python -m benchmarks.ros2_cost``.

In one run, on the same messages: ``iveg robot`` (with a broker and a small iVeg) beside
a bare subscriber that decodes them, and beside an echo of twists.  Wanted:
processor time ≤ 2 × the subscriber's, twist in → twist out P95 ≤ 15 ms.
"""

import asyncio
import math
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from cyclonedds.core import (
    InstanceState,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from benchmarks.process import Usage, machine, pause, percentile, print_table
from iveg.adapters.dds import Dds, DdsReader, DdsWriter, announced, write_qos
from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.domain.feedback import CLEAR, Feedback
from iveg.domain.observations import Origin, SafetyReport
from iveg.ngsi import codec
from iveg.ros2 import cdr, names
from iveg.ros2 import messages as ros
from iveg.ros2.messages import Message
from tests.brokers import broker_on
from tests.dds import free_domain, loopback
from tests.ports import free_ports
from tests.processes import Site, site

RATE_HZ, TWISTS_HZ = 30.0, 15.0
WARM_UP_S, MEASURED_S = 6.0, 40.0
SENSORS: dict[str, type[Message]] = {
    "/odom": ros.Odometry,
    "/scan": ros.LaserScan,
    "/tf": ros.TFMessage,
    "/detections_3d": ros.Detection3DArray,
}
WISHES: dict[str, type[Message]] = {"/cmd_vel_nav": ros.Twist}
_HEARD = write_qos(names.SENSOR_DATA.newest(50))
_ANY = SampleState.NotRead | ViewState.Any | InstanceState.Any


# --- the two that are compared with --------------------------------------------------


def bare(domain: int) -> None:
    """Take and decode every message that the robot is sent, as they come."""
    participant, waitset, readers = _participant(domain)
    for name, message in (SENSORS | WISHES).items():
        kind = announced(message.ROS)
        topic = Topic(participant, names.dds_topic(name), kind)
        readers.append((message, DataReader(participant, topic, _HEARD)))
    conditions = [ReadCondition(reader, _ANY) for _, reader in readers]
    for condition in conditions:
        waitset.attach(condition)
    while True:
        waitset.wait(duration(seconds=1))
        for message, reader in readers:
            for sample in reader.take(50):
                if sample.sample_info.valid_data:  # else its writer has gone
                    cdr.read(message, sample.payload)


def echo(domain: int) -> None:
    """Answer each twist with itself, decoded and encoded."""
    participant, waitset, _ = _participant(domain)
    kind = announced(ros.Twist.ROS)
    heard = Topic(participant, names.dds_topic("/echo_in"), kind)
    said = Topic(participant, names.dds_topic("/echo_out"), kind)
    reader = DataReader(participant, heard, _HEARD)
    writer = DataWriter(participant, said, write_qos(names.DEFAULT))
    condition = ReadCondition(reader, _ANY)
    waitset.attach(condition)
    while True:
        waitset.wait(duration(seconds=1))
        for twist in reader.take(50):
            if twist.sample_info.valid_data:  # else its writer has gone
                read = cdr.read(ros.Twist, twist.payload)
                writer.write(kind.deserialize(cdr.write(read)))


_kept: list[Any] = []


def _participant(domain: int) -> tuple[Any, Any, list[Any]]:
    _kept.append(Domain(domain, loopback(domain).config()))
    participant = DomainParticipant(domain)
    return participant, WaitSet(participant), []


# --- what they are given -------------------------------------------------------------


class Robot:
    """Publishes what a robot's sensors say, and asks it to drive."""

    def __init__(self, dds: Dds) -> None:
        self._writers = {
            name: dds.writer(name, kind, names.DEFAULT)
            for name, kind in SENSORS.items()
        }
        self._static = dds.writer("/tf_static", ros.TFMessage, names.TF_STATIC)
        header = ros.Header(ros.Time.from_seconds(time.time()), "base_link")
        mount = ros.TransformStamped(header, "laser")
        self._static.write(cdr.write(ros.TFMessage((mount,))))
        self._ranges = np.linspace(1.0, 20.0, 720, dtype=np.float32)

    def say(self) -> None:
        """Everything once."""
        stamp = ros.Time.from_seconds(time.time())
        in_map, in_odom = ros.Header(stamp, "map"), ros.Header(stamp, "odom")
        base = ros.Header(stamp, "base_link")
        sure = ros.ObjectHypothesisWithPose(ros.ObjectHypothesis("tomato", 0.9))
        said: dict[str, Message] = {
            "/tf": ros.TFMessage(
                (
                    ros.TransformStamped(in_map, "odom"),
                    ros.TransformStamped(in_odom, "base_link"),
                )
            ),
            "/odom": ros.Odometry(in_odom, "base_link"),
            "/scan": ros.LaserScan(
                ros.Header(stamp, "laser"),
                *(-math.pi, math.pi, math.tau / 720, 0.0, 0.03, 0.1, 25.0),
                self._ranges,
            ),
            "/detections_3d": ros.Detection3DArray(
                base, tuple(ros.Detection3D(base, (sure,)) for _ in range(3))
            ),
        }
        for name, message in said.items():
            self._writers[name].write(cdr.write(message))


async def iveg(address: BrokerAddress, ended: asyncio.Event) -> None:
    """A small iVeg: names the robot's newest report five times a second."""
    seen = {"AGI": 0}

    def take(topic: str, payload: bytes) -> None:
        for one in codec.read_measure(topic.split("/")[2], payload).observations:
            if isinstance(one, SafetyReport):
                seen["AGI"] = one.origin.seq or 0

    link = MqttLink(address, "iveg", {"/iveg/AGI_safety/attrs": 1}, take)
    running = asyncio.create_task(link.run())
    seq = 0
    while not ended.is_set():
        await asyncio.sleep(0.1)
        seq += 1
        clear = {"AGI": CLEAR}
        said = Feedback("AGI", Origin("b", seq), speed_limits=clear, seen=dict(seen))
        link.enqueue("/AGI/mqtt_feedback", codec.write_feedback(said), 1)
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)


class Times:
    """When each twist went and came back, by its own forward speed."""

    def __init__(self, reader: DdsReader, writer: DdsWriter) -> None:
        self._reader, self._writer = reader, writer
        self._sent: dict[float, float] = {}
        self.took: list[float] = []

    def send(self, speed: float) -> None:
        """Ask for this speed."""
        payload = cdr.write(ros.Twist(ros.Vector3(speed)))
        self._sent[speed] = time.perf_counter()
        self._writer.write(payload)

    def listen(self) -> None:
        """Take what came back."""
        for one in self._reader.take():
            now = time.perf_counter()
            speed = cdr.read(ros.Twist, one).linear.x
            if speed in self._sent:
                self.took.append(now - self._sent.pop(speed))


# --- the run -------------------------------------------------------------------------


def measure(dds: Dds, programs: dict[str, int]) -> tuple[dict[str, Times], Any]:
    """Say and ask for ``MEASURED_S``; processor time of each program."""
    robot = Robot(dds)
    times = {
        name: Times(
            dds.reader(out, ros.Twist, names.SENSOR_DATA.newest(50)),
            dds.writer(in_, ros.Twist, names.DEFAULT.newest(1)),
        )
        for name, in_, out in (
            ("iveg robot", "/cmd_vel_nav", "/cmd_vel"),
            ("echo", "/echo_in", "/echo_out"),
        )
    }
    ended = threading.Event()

    def listen() -> None:
        while not ended.is_set():
            for one in times.values():
                one.listen()
            pause(0.00005)

    def every(hz: float, work: Callable[[], object]) -> None:
        due = time.perf_counter()
        while not ended.is_set():
            work()
            due += 1 / hz
            pause(max(0.0, due - time.perf_counter()))

    threads = [
        threading.Thread(target=listen),
        threading.Thread(target=every, args=(RATE_HZ, robot.say)),
    ]
    for thread in threads:
        thread.start()
    _ask(times, WARM_UP_S, rests_s=2.0)
    for one in times.values():
        one.took.clear()
    before = {name: Usage.of(pid).cpu_s for name, pid in programs.items()}
    _ask(times, MEASURED_S)
    used = {name: Usage.of(pid).cpu_s - before[name] for name, pid in programs.items()}
    ended.set()
    for thread in threads:
        thread.join()
    return times, used


def _ask(times: dict[str, Times], seconds: float, rests_s: float = 0.0) -> None:
    """Twists that fall ever so little, so that the gate passes each as it is."""
    for number in range(round(seconds * TWISTS_HZ)):
        speed = 0.2 - number * 1e-6
        if number < rests_s * TWISTS_HZ:
            speed = 0.0
        for one in times.values():
            one.send(speed)
            pause(0.5 / TWISTS_HZ)


async def run(place: Site) -> None:
    domain = free_domain()
    (port,) = free_ports(1)
    network = ["--ros-domain", str(domain), "--ros-interface", "127.0.0.1"]
    network += ["--ros-peer", "127.0.0.1"]
    place.settings["IVEG_MQTT_URL"] = f"mqtt://127.0.0.1:{port}"
    ended = asyncio.Event()
    others = {}
    for name in ("bare", "echo"):
        others[name] = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "benchmarks.ros2_cost", name, str(domain)
        )
    try:
        async with broker_on(port, place.directory) as address:
            cloud = asyncio.create_task(iveg(address, ended))
            robot = place.start("robot", "--id", "AGI", "--attended", *network)
            await asyncio.to_thread(robot.wait_until_ready)
            programs = {name: one.pid for name, one in others.items()}
            with Dds(loopback(domain)) as dds:
                times, used = await asyncio.to_thread(
                    measure, dds, {"iveg robot": robot.pid, **programs}
                )
            ended.set()
            await cloud
            place.stop_all()
    finally:
        for one in others.values():
            if one.returncode is None:
                one.kill()
            await one.wait()
    report(times, used)


def report(times: dict[str, Times], used: dict[str, float]) -> None:
    rows = []
    for name, one in times.items():
        took = sorted(one.took)
        rows.append(
            (
                name,
                str(len(took)),
                *(f"{percentile(took, p) * 1e3:.2f} ms" for p in (0.5, 0.95, 0.99)),
            )
        )
    print_table(
        f"Twist in → twist out ({machine()})", ("", "n", "P50", "P95", "P99"), rows
    )
    cpu = {name: spent / MEASURED_S for name, spent in used.items()}
    shares = [(name, f"{share:.1%}") for name, share in cpu.items()]
    print_table("Processor, share of one core", ("", "core"), shares)
    p95_ms = 1e3 * percentile(sorted(times["iveg robot"].took), 0.95)
    print(f"\nCPU {cpu['iveg robot'] / cpu['bare']:.2f} × the bare subscriber (≤ 2)")
    print(f"P95 {p95_ms:.1f} ms (≤ 15)")


def main() -> None:
    match sys.argv[1:]:
        case ["bare", domain]:
            bare(int(domain))
        case ["echo", domain]:
            echo(int(domain))
        case _:
            with (
                tempfile.TemporaryDirectory() as folder,
                site(Path(folder)) as place,
            ):
                asyncio.run(run(place))


if __name__ == "__main__":
    main()
