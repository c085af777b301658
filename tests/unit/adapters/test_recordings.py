"""Recordings of inputs, read back by the public tools of MCAP and by iVeg."""

import asyncio
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import orjson
import pytest
from mcap.reader import make_reader

from iveg.adapters.recordings.directory import RecordingDirectory, finish_broken
from iveg.adapters.recordings.mcap_file import CHUNK_BYTES, PADDING
from iveg.adapters.recordings.reading import is_own, read_messages
from iveg.adapters.recordings.recorder import MOST_WAITING, InputRecorder, RecordedSink
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.observations import Instant, UnreadScan
from iveg.domain.recordings import RecordingLimits
from iveg.domain.records import ClimateRecord, LogRecord
from tests.builders import (
    START,
    at,
    detection,
    detection_frame,
    odometry,
    received,
    scan,
)
from tests.fakes.clock import FakeClock
from tests.fakes.recorder import FakeRecorder

ODOM, SCAN = "/iveg/AGI_odom/attrs", "/iveg/AGI_lidar2D/attrs"


class Site:
    """A recorder whose clock is moved by hand."""

    def __init__(self, path: Path, *, is_on: bool = True) -> None:
        self.path, self.clock = path / "recordings", FakeClock()
        self.is_closed = False
        self.directory = RecordingDirectory(self.path)
        self.recorder = InputRecorder(
            self.directory, RecordingLimits(), self.clock, is_on=is_on
        )

    def hear(self, seconds: float, text: str = "{}", topic: str = ODOM) -> None:
        self.recorder.measure(topic, text.encode(), at(seconds), topic == SCAN)

    async def write(self, seconds: float) -> None:
        self.clock.now = seconds
        await self.recorder.write()

    async def close(self) -> None:
        if not self.is_closed:
            self.is_closed = True
            await self.recorder.close()

    def names(self) -> list[str]:
        return sorted(one.name for one in self.path.iterdir())

    def only(self) -> Path:
        (path,) = self.path.iterdir()
        return path


@pytest.fixture
async def site(tmp_path: Path) -> AsyncIterator[Site]:
    site = Site(tmp_path)
    yield site
    await site.close()


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
    site.hear(0.0, '{"x":  1}')
    site.recorder.notification(body, at(0.125), None)
    site.recorder.tick(Instant(START.mono + 0.25, START.wall + 1000.25))
    await site.write(0.3)
    await site.close()

    path = site.only()
    assert path.name == "2023-11-14T22-13-20Z.mcap"
    assert privately(path) == [
        (ODOM, 0.0, b'{"x":  1}'),
        ("/ngsi/notifications", 0.125, body),
        ("/iveg/ticks", 0.25, b'{"wall":1700001000.25,"mono":1000.25}'),
    ]
    assert [one[:2] for one in publicly(path)] == [
        (ODOM, "iveg.Measure"),
        ("/ngsi/notifications", "ngsi.Notification"),
        ("/iveg/ticks", "iveg.Tick"),
    ]
    assert site.recorder.counters["recordings_written"] == 3


async def test_viewers_draw_poses_scans_and_boxes_thinned(site: Site) -> None:
    for n in range(30):
        site.recorder.observed(received(odometry(x=n), after=n / 30))
        site.recorder.observed(
            received(detection_frame("AGI", detection(x=3.0)), after=n / 30)
        )
        lazy = UnreadScan("AGI", scan().origin, scan)
        site.recorder.observed(received(lazy, after=n / 30))
    await site.write(1.0)
    await site.close()

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


async def test_scans_are_kept_five_times_a_second(site: Site) -> None:
    for n in range(30):
        site.hear(n / 30, topic=SCAN)
        site.hear(n / 30)
        site.recorder.notification(b"{}", at(n / 30), "of scans")
    await site.write(1.0)
    await site.close()

    topics = [topic for topic, _, _ in privately(site.only())]
    assert topics.count(SCAN) == 5
    assert topics.count("/ngsi/notifications") == 5
    assert topics.count(ODOM) == 30


async def test_rows_of_the_history_are_recorded_but_no_telemetry(site: Site) -> None:
    history = FakeRecorder()
    sink = RecordedSink(history, site.recorder.row)
    row = LogRecord(id=1, at=1.0, kind="system", key="log.start")
    air = ClimateRecord(at=1.0, temperature=20.0, relative_humidity=0.5, co2=400.0)
    for one in (row, air):
        sink.enqueue(one)
    await site.write(1.0)
    await site.close()

    ((topic, schema, value),) = publicly(site.only())
    assert (topic, schema) == ("/iveg/log", "iveg.Log")
    assert value["key"] == "log.start"  # type: ignore[index]
    assert history.records == [row, air]


async def test_an_hour_has_a_file_of_its_own_and_a_clock_set_back_spoils_none(
    site: Site,
) -> None:
    site.hear(0.0)
    await site.write(0.0)
    site.hear(3600.0)
    await site.write(3600.0)
    back = Instant(START.mono + 3601.0, START.wall)
    site.recorder.measure(ODOM, b"{}", back, is_scan=False)
    await site.write(3601.0)
    await site.close()

    assert site.names() == [
        "2023-11-14T22-13-20Z.mcap",
        "2023-11-14T22-13-21Z.mcap",
        "2023-11-14T23-13-20Z.mcap",
    ]


async def test_a_clock_that_is_set_within_an_hour_reorders_nothing(site: Site) -> None:
    for n, wall in enumerate((0.0, 100.0, 50.0)):
        then = Instant(START.mono + n, START.wall + wall)
        site.recorder.measure(ODOM, b"{}", then, is_scan=False)
    await site.write(3.0)
    await site.close()
    assert [seconds for _, seconds, _ in privately(site.only())] == [0.0, 1.0, 2.0]


async def test_a_crash_costs_the_open_chunk_and_nothing_before(site: Site) -> None:
    site.hear(0.0, '{"n":1}')
    await site.write(2.0)
    site.hear(2.5, '{"n":2}')
    await site.write(3.0)
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


@pytest.mark.parametrize("cut", [0, 5, 40, 200])
async def test_a_file_that_broke_off_at_its_beginning_goes(
    site: Site, cut: int
) -> None:
    site.hear(0.0)
    await site.write(2.0)
    broken = site.path / "2023-11-14T21-00-00Z.mcap.open"
    broken.write_bytes(site.only().read_bytes()[:cut])
    finish_broken(broken)
    assert not broken.exists()


async def test_every_cut_of_a_file_is_read_as_far_as_it_goes(site: Site) -> None:
    pad = "x" * (CHUNK_BYTES // 9)
    for n in range(50):
        site.hear(0.04 * n, f'{{"n":{n},"pad":"{pad}"}}')
    await site.write(2.0)
    await site.close()
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


async def test_what_does_not_fit_is_counted_and_delays_nobody(site: Site) -> None:
    for n in range(MOST_WAITING + 7):
        site.hear(n / 1000)
    await site.write(30.0)
    assert site.recorder.counters["recordings_dropped"] == 7
    site.hear(31.0)
    await site.write(31.0)
    assert site.recorder.counters["recordings_written"] == MOST_WAITING + 1


async def test_a_disk_that_refuses_is_told_and_taken_up_again(site: Site) -> None:
    site.path.write_bytes(b"in the way")
    site.hear(0.0)
    with pytest.raises(HopError, match="disk"):
        await site.write(1.0)
    site.path.unlink()
    site.hear(2.0)
    await site.write(3.0)
    assert len(site.names()) == 1


async def test_recordings_that_are_off_make_no_file(tmp_path: Path) -> None:
    site = Site(tmp_path, is_on=False)
    site.hear(0.0)
    site.recorder.tick(START)
    await site.write(1.0)
    await site.close()
    assert not site.path.exists()


async def test_the_oldest_goes_where_the_disk_is_low_and_never_the_open_one(
    site: Site,
) -> None:
    for hour in range(3):
        site.hear(3600.0 * hour)
        await site.write(3600.0 * hour)
    assert [await site.recorder.drop_oldest() for _ in range(3)] == [True, True, False]
    assert len(site.names()) == 1


async def test_what_an_earlier_run_left_is_finished_beside_the_new_one(
    tmp_path: Path,
) -> None:
    first = Site(tmp_path)
    first.hear(0.0)
    await first.write(2.0)
    left = first.only()
    copied = left.read_bytes()
    await first.close()
    first.only().unlink()
    left.write_bytes(copied)
    second = Site(tmp_path)
    running = asyncio.create_task(second.recorder.run())
    async with asyncio.timeout(20.0):
        while left.exists():  # noqa: ASYNC110 - another process deletes it
            await asyncio.sleep(0.02)
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    await second.recorder.close()
    assert [topic for topic, _, _ in privately(second.only())] == [ODOM]
