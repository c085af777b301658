"""Recordings of inputs, read back by the public tools of MCAP and by iVeg."""

import asyncio
import os
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import orjson
import pytest
from mcap.reader import make_reader

from iveg.adapters import clock
from iveg.adapters.recordings.incoming import WHOLE, Sort, pack, unpack
from iveg.adapters.recordings.mcap_file import (
    CHUNK_BYTES,
    PADDING,
    finish_broken,
    is_own,
    read_messages,
)
from iveg.adapters.recordings.recorder import (
    MOST_BYTES,
    MOST_WAITING,
    WRITE_S,
    InputRecorder,
)
from iveg.adapters.recordings.writer import WriterSetup
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.observations import Instant
from iveg.domain.parameters import ByClass
from iveg.domain.retention import DiskSpace
from iveg.ngsi import codec
from tests.builders import (
    START,
    at,
    detection,
    detection_frame,
    notification,
    odometry,
    origin,
    pose_value,
    scan,
)
from tests.fakes.clock import FakeClock
from tests.fakes.recordings import WriterInPlace

TWINS = "/ngsi/notifications"
ODOM, SCAN = "/iveg/AGI_odom/attrs", "/iveg/AGI_lidar2D/attrs"


class Site:
    """A recorder whose clock is moved by hand, and its writer in the same process."""

    def __init__(self, path: Path, *, is_on: bool = True) -> None:
        self.path, self.clock = path / "recordings", FakeClock()
        self.space = DiskSpace(free=10**12, total=10**12)
        setup = WriterSetup(self.path, robots=("AGI", "AGII"))
        self.recorder = InputRecorder(setup, self.clock, is_on=is_on)
        self._in_place = WriterInPlace(setup, lambda _: self.space)
        self.writer = self._in_place.writer
        self.close = self.writer.finish

    def hear(self, seconds: float, payload: bytes = b"{}", topic: str = ODOM) -> None:
        self.recorder.measure(topic, payload, at(seconds))

    def write(self, seconds: float) -> None:
        self.clock.now = seconds
        self._in_place.write(self.recorder, START.mono + seconds)

    def names(self) -> list[str]:
        return sorted(one.name for one in self.path.iterdir())

    def only(self) -> Path:
        (path,) = self.path.iterdir()
        return path


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    site = Site(tmp_path)
    yield site
    site.close()


def publicly(path: Path, topic: str | None = None) -> Iterator[tuple[str, str, object]]:
    """Topic, schema and value of each message, as MCAP's own reader has them."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_summary() is not None
        for schema, channel, message in reader.iter_messages(topics=topic):
            assert schema is not None
            assert schema.encoding == "jsonschema"
            assert orjson.loads(schema.data)["type"] == "object"
            if channel.topic != PADDING.topic:
                yield channel.topic, schema.name, orjson.loads(message.data)


def privately(path: Path) -> list[tuple[str, float, bytes]]:
    """Topic, seconds from the beginning and payload, as iVeg reads them."""
    with read_messages(path) as reading:
        return [(one.topic, reading.seconds(t), data) for one, t, data in reading]


async def test_what_came_in_is_there_byte_for_byte_with_its_time(site: Site) -> None:
    body = b'{ "subscriptionId": "1", "data": [] }'
    site.hear(0.0, b'{"x":  1}')
    site.recorder.notification(body, at(0.125))
    site.write(0.3)
    site.close()

    path = site.only()
    assert path.name == "2023-11-14T22-13-20Z.mcap"
    assert privately(path) == [
        (ODOM, 0.0, b'{"x":  1}'),
        ("/ngsi/notifications", 0.125, body),
    ]
    assert [one[:2] for one in publicly(path)] == [
        (ODOM, "iveg.Measure"),
        ("/ngsi/notifications", "ngsi.Notification"),
    ]
    assert site.writer.kept == 2


async def test_viewers_draw_poses_scans_and_boxes_thinned(site: Site) -> None:
    looked = codec.write_measure(detection_frame("AGI", detection(x=3.0)))
    for n in range(30):
        pose = pose_value(x=n, seq=n)
        body = notification({"base_pose_ground_truth": pose})
        site.hear(n / 30, codec.write_measure(odometry(x=n, origin=origin(n))))
        # The copy by FIWARE is no second picture, and a stranger none at all.
        site.recorder.notification(body, at(n / 30))
        strange = notification({"base_pose_ground_truth": pose}, robot_id="B1")
        site.recorder.notification(strange, at(n / 30))
        site.hear(n / 30, looked, "/iveg/AGI_yolox_bounding_boxes/attrs")
        site.hear(n / 30, codec.write_measure(scan()), SCAN)
    site.hear(0.99, b'{"no": "scan"}', SCAN)
    site.write(1.0)
    site.close()

    found = list(publicly(site.only()))
    told = [schema for _, schema, _ in found]
    assert told.count("foxglove.PoseInFrame") == 10
    assert told.count("foxglove.FrameTransform") == 10
    assert told.count("foxglove.LaserScan") == 5
    assert told.count("foxglove.SceneUpdate") == 5
    values = {schema: value for _, schema, value in found}
    ranges = values["foxglove.LaserScan"]["ranges"]  # type: ignore[index]
    assert ranges == [1.0, 2.0, None, 4.0]
    (box,) = values["foxglove.SceneUpdate"]["entities"]  # type: ignore[index]
    assert box["frame_id"] == "map"
    assert box["cubes"][0]["pose"]["position"] == {"x": 3.0, "y": 0.0, "z": 0.9}


async def test_an_hour_has_a_file_of_its_own_and_a_clock_set_back_spoils_none(
    site: Site,
) -> None:
    site.hear(0.0)
    site.write(0.0)
    site.hear(3600.0)
    site.write(3600.0)
    back = Instant(START.mono + 3601.0, START.wall)
    site.recorder.measure(ODOM, b"{}", back)
    site.write(3601.0)
    site.close()

    assert site.names() == [
        "2023-11-14T22-13-20Z.mcap",
        "2023-11-14T22-13-21Z.mcap",
        "2023-11-14T23-13-20Z.mcap",
    ]


async def test_a_crash_costs_the_open_chunk_and_nothing_before(site: Site) -> None:
    site.hear(0.0, b'{"n":1}')
    site.write(2.0)
    site.hear(2.5, b'{"n":2}')
    site.write(3.0)
    left = site.only()
    assert left.name.endswith(".mcap.open")

    found = privately(left)
    assert [payload for _, _, payload in found] == [b'{"n":1}']
    copied = left.with_name("2023-11-14T21-00-00Z.mcap.open")
    copied.write_bytes(left.read_bytes())
    finish_broken(copied)
    rescued = copied.with_suffix("")
    assert not copied.exists()
    assert privately(rescued) == found
    assert [value for _, _, value in publicly(rescued, ODOM)] == [{"n": 1}]


async def test_every_cut_of_a_file_is_read_as_far_as_it_goes(site: Site) -> None:
    pad = "x" * (CHUNK_BYTES // 9)
    for n in range(50):
        site.hear(0.04 * n, f'{{"n":{n},"pad":"{pad}"}}'.encode())
    site.write(2.0)
    site.close()
    whole = site.only().read_bytes()
    cut = site.path / "cut.mcap"
    counts = []
    for size in range(300, len(whole), len(whole) // 40):
        cut.write_bytes(whole[:size])
        counts.append(len(privately(cut)))
    assert counts == sorted(counts)
    assert counts[-1] >= 40


def test_a_foreign_file_is_told_from_ours(tmp_path: Path) -> None:
    for content in (b"", b"no MCAP at all", bytes(100)):
        path = tmp_path / "other.mcap"
        path.write_bytes(content)
        assert not is_own(path)
        with pytest.raises(DataFileError), read_messages(path):
            pass


async def test_what_does_not_fit_is_counted_and_told_once(
    site: Site, caplog: pytest.LogCaptureFixture
) -> None:
    for n in range(MOST_WAITING + 7):
        site.hear(n / 1000)
    site.write(30.0)
    assert site.recorder.counters["recordings_dropped"] == 7
    assert len(caplog.records) == 1
    site.hear(31.0)
    site.write(31.0)
    site.close()
    assert site.writer.kept == MOST_WAITING + 1


async def test_nothing_is_recorded_while_the_disk_is_low_and_no_other_can_go(
    site: Site,
) -> None:
    site.hear(0.0)
    site.write(0.0)
    site.space = replace(site.space, free=10**8)
    site.hear(60.0)
    site.write(60.0)
    site.hear(61.0)
    site.write(61.0)
    assert site.names() == ["2023-11-14T22-13-20Z.mcap"]
    assert (site.writer.kept, site.writer.dropped) == (2, 1)
    site.space = replace(site.space, free=10**12)
    site.write(121.0)
    site.hear(122.0)
    site.write(122.0)
    site.close()
    assert len(site.names()) == 2
    assert site.writer.kept == 3


async def test_each_version_of_the_rule_is_recorded_and_stands_in_each_file(
    site: Site,
) -> None:
    rule = DetectionRule()
    site.recorder.rule = lambda: rule
    site.recorder.note_rule()
    site.recorder.note_rule()
    rule = replace(rule, version=2, threshold=ByClass(0.9))
    site.recorder.note_rule()
    site.hear(3600.0)
    site.write(3600.0)
    site.close()

    first, second = sorted(site.path.iterdir())
    told = [list(publicly(one, "/iveg/rule")) for one in (first, second)]
    versions = [[value["version"] for _, _, value in one] for one in told]  # type: ignore[index]
    assert versions == [[1, 2], [2]]
    assert told[1][0][:2] == ("/iveg/rule", "iveg.Rule")


def test_inputs_are_the_same_behind_a_pipe_and_one_cut_short_is_none() -> None:
    packed = [
        pack(Sort.MEASURE, at(1.0), "/á", b"1"),
        pack(Sort.PICTURE, at(2.0), payload=b"{}"),
        pack(Sort.ROW, at(3.0), "Log", b"{}" * 50),
    ]
    whole = b"".join(packed)

    found = [*unpack(BytesIO(whole))]

    assert [one.at for one in found] == [at(1.0), at(2.0), at(3.0)]
    assert [one.channel.topic for one in found] == ["/á", "/iveg/pictures", "/iveg/log"]
    assert found[2].payload == b"{}" * 50
    for size in (len(whole) - 1, len(whole) - 110):
        assert [*unpack(BytesIO(whole[:size]))] == found[:2]


async def test_the_oldest_goes_where_the_disk_is_low_and_never_the_open_one(
    site: Site,
) -> None:
    for hour in range(3):
        site.hear(3600.0 * hour)
        site.recorder.picture(WHOLE + b'"at":0}', at(3600.0 * hour))
        site.write(3600.0 * hour)
    dropped = [await site.recorder.drop_oldest() for _ in range(5)]
    assert dropped == [True, True, True, True, False]
    assert [one.suffix for one in site.path.rglob("*.mcap*")] == [".open", ".open"]


class Running:
    """A recorder with a real process."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.space = DiskSpace(free=10**12, total=10**12)
        self.recorder = InputRecorder(
            WriterSetup(folder), clock.now, read_space=lambda _: self.space
        )
        self.part = asyncio.create_task(self.recorder.run())

    def hear(self, number: int) -> None:
        self.recorder.measure(ODOM, b"%d" % number, clock.now())

    async def until(self, holds: Callable[[], object]) -> None:
        async with asyncio.timeout(30.0):
            while not holds():  # noqa: ASYNC110 - another process does it
                await asyncio.sleep(0.02)

    async def close(self) -> None:
        self.part.cancel()
        await asyncio.gather(self.part, return_exceptions=True)
        await self.recorder.close()


async def test_a_process_that_hangs_and_is_killed_delays_nobody_and_another_goes_on(
    tmp_path: Path,
) -> None:
    running = Running(tmp_path)
    recorder = running.recorder
    running.hear(1)
    await running.until(lambda: recorder.counters["recordings_written"] == 1)
    assert recorder.pid is not None
    # It takes no other's place on a processor, and has its share of a crowded one.
    assert os.sched_getscheduler(recorder.pid) == os.SCHED_BATCH
    mine = os.getpriority(os.PRIO_PROCESS, 0)
    assert os.getpriority(os.PRIO_PROCESS, recorder.pid) == mine
    os.kill(recorder.pid, signal.SIGSTOP)
    fits = MOST_BYTES // 10**6
    for _ in range(fits + 8):
        recorder.measure(ODOM, b"0" * 10**6, clock.now())
    began = time.thread_time()
    await asyncio.sleep(2 * WRITE_S)
    assert time.thread_time() - began < 0.5
    dropped = recorder.counters["recordings_dropped"]
    assert 8 <= dropped <= 9
    os.kill(recorder.pid, signal.SIGKILL)
    with pytest.raises(HopError, match="ended: -9"):
        await running.part
    assert recorder.counters["recordings_dropped"] == fits + 8

    running.hear(2)
    running.part = asyncio.create_task(recorder.run())
    await running.until(lambda: [*tmp_path.glob("*.mcap")])
    await running.close()
    assert recorder.counters["recordings_written"] == 2
    assert [data for one in _inside(tmp_path) for _, _, data in privately(one)] == [
        b"1",
        b"2",
    ]


def _inside(folder: Path) -> list[Path]:
    return sorted(folder.iterdir())


async def test_a_small_disk_is_left_to_others_until_there_is_room(
    tmp_path: Path,
) -> None:
    running = Running(tmp_path)
    running.space = replace(running.space, free=19 * 10**9)
    with pytest.raises(HopError, match="less than 20 GB free"):
        await running.part
    running.hear(1)
    assert (running.recorder.waiting, running.recorder.pid) == (0, None)

    running.space = replace(running.space, free=20 * 10**9)
    running.part = asyncio.create_task(running.recorder.run())
    await running.until(lambda: running.recorder.pid)
    await running.close()


async def test_a_disk_that_refuses_is_told_and_hurts_nobody(tmp_path: Path) -> None:
    running = Running(tmp_path / "file" / "recordings")
    (tmp_path / "file").write_bytes(b"in the way")
    running.hear(1)
    with pytest.raises(HopError, match="disk: Not a directory"):
        await running.part
    running.hear(2)
    assert running.recorder.waiting == 2
    await running.close()
