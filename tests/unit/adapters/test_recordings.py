"""Recordings, read back by the public tools of MCAP and by iVeg."""

import asyncio
import struct
import threading
from collections import Counter
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import orjson
import pytest
import zstandard
from mcap.reader import make_reader

from iveg.adapters.recordings import recorder as module
from iveg.adapters.recordings.mcap_file import read_messages
from iveg.adapters.recordings.pictures import WHOLE
from iveg.adapters.recordings.recorder import MOST_BYTES, MOST_WAITING, InputRecorder
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.observations import Instant, Observation, Received
from iveg.domain.retention import DiskSpace
from tests.builders import START, at, detection, detection_frame, odometry, origin, scan
from tests.fakes.clock import FakeClock
from tests.fakes.recordings import ROOMY, input_recorder
from tests.patience import until

ODOM = "/iveg/AGI_odom/attrs"


class Site:
    """A recorder whose clock is moved by hand."""

    def __init__(self, path: Path) -> None:
        self.path, self.clock = path / "recordings", FakeClock()
        self.space, self.is_closed = ROOMY, False
        self.recorder = input_recorder(
            self.path, self.clock, read_space=lambda _: self.space
        )

    def measure(self, seconds: float, payload: bytes = b"{}") -> None:
        self.recorder.measure(ODOM, payload, at(seconds))

    async def write(self, seconds: float) -> None:
        self.clock.now = seconds
        await self.recorder.write()

    async def close(self) -> None:
        self.is_closed = True
        await self.recorder.close()

    def names(self) -> list[str]:
        return sorted(one.name for one in self.path.iterdir())

    def only(self) -> Path:
        (path,) = self.path.iterdir()
        return path

    def counts(self) -> tuple[int, int]:
        """Messages that were written, and that were dropped."""
        counters = self.recorder.counters
        return counters["recordings_written"], counters["recordings_dropped"]


@pytest.fixture
async def site(tmp_path: Path) -> AsyncIterator[Site]:
    site = Site(tmp_path)
    yield site
    if not site.is_closed:
        await site.close()


def publicly(path: Path) -> Iterator[tuple[str, str, Any]]:
    """Topic, schema and value of each message, as MCAP's own reader has them."""
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_summary() is not None
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            assert schema.encoding == "jsonschema"
            assert orjson.loads(schema.data)["type"] == "object"
            yield channel.topic, schema.name, orjson.loads(message.data)


def payloads(path: Path) -> list[bytes]:
    """As iVeg reads them, as far as it can."""
    found = []
    with suppress(DataFileError):
        for _, _, payload in read_messages(path):
            found.append(payload)
    return found


# --- what is recorded -------------------------------------------------------------


async def test_what_came_in_is_there_byte_for_byte_with_its_time(site: Site) -> None:
    body = b'{ "subscriptionId": "1", "data": [] }'
    site.measure(0.0, b'{"x":  1}')
    site.recorder.notification(body, at(0.125))
    await site.write(0.3)
    await site.close()

    path = site.only()
    assert path.name == "2023-11-14T22-13-20Z.mcap"
    began = round(START.wall * 1e9)
    assert [
        (one.topic, one.schema, log_time - began, payload)
        for one, log_time, payload in read_messages(path)
    ] == [
        (ODOM, "iveg.Measure", 0, b'{"x":  1}'),
        ("/ngsi/notifications", "ngsi.Notification", 125_000_000, body),
    ]
    assert [one[0] for one in publicly(path)] == [ODOM, "/ngsi/notifications"]
    assert site.counts() == (2, 0)


async def test_viewers_draw_poses_scans_and_boxes_thinned(site: Site) -> None:
    def came(seconds: float, observation: Observation) -> None:
        site.recorder.draw(Received(observation, at(seconds)))

    site.recorder.draw(Received(odometry(x=99.0), at(0.0), is_query_answer=True))
    for n in range(30):
        came(n / 30, odometry(x=n, origin=origin(n)))
        came(n / 30, odometry(x=n, origin=origin(n)))
        came(n / 30, detection_frame("AGI", detection(x=3.0)))
        came(n / 30, scan(origin=origin(n)))
    await site.write(1.0)
    await site.close()

    found = list(publicly(site.only()))
    assert Counter(schema for _, schema, _ in found) == {
        "foxglove.PoseInFrame": 5,
        "foxglove.FrameTransform": 5,
        "foxglove.LaserScan": 5,
        "foxglove.SceneUpdate": 5,
    }
    values: Mapping[str, Any] = {schema: value for _, schema, value in found}
    assert values["foxglove.LaserScan"]["ranges"] == [1.0, 2.0, None, 4.0]
    (box,) = values["foxglove.SceneUpdate"]["entities"]
    assert box["frame_id"] == "map"
    assert box["cubes"][0]["pose"]["position"] == {"x": 3.0, "y": 0.0, "z": 0.9}


async def test_an_hour_has_a_file_of_its_own_and_a_clock_set_back_spoils_none(
    site: Site,
) -> None:
    site.measure(0.0)
    site.measure(3600.0)
    site.recorder.measure(ODOM, b"{}", Instant(START.mono + 3601.0, START.wall))
    await site.write(3601.0)
    await site.close()

    assert site.names() == [
        "2023-11-14T22-13-20Z.mcap",
        "2023-11-14T22-13-21Z.mcap",
        "2023-11-14T23-13-20Z.mcap",
    ]


# --- what a crash leaves ----------------------------------------------------------


async def test_a_crash_costs_the_open_chunk_and_the_next_start_finishes_the_file(
    site: Site,
) -> None:
    site.measure(0.0, b'{"n":1}')
    await site.write(2.0)
    site.measure(2.5, b'{"n":2}')
    await site.write(3.0)
    left = site.only()
    assert left.name.endswith(".mcap.open")
    assert payloads(left) == [b'{"n":1}']
    again = input_recorder(site.path, FakeClock())

    async with _running(again):
        await until(lambda: not left.exists())

    assert [value for _, _, value in publicly(left.with_suffix(""))] == [{"n": 1}]


@pytest.mark.parametrize("zeros", [0, 1])
async def test_a_lost_end_is_read_as_far_as_it_goes(site: Site, zeros: int) -> None:
    for n in range(50):
        site.measure(2.0 * n, b'{"n":%d}' % n)
        await site.write(2.0 * n)
    await site.close()
    whole = site.only().read_bytes()
    cut = site.path / "cut.mcap"
    counts = []
    for size in range(300, len(whole), len(whole) // 40):
        cut.write_bytes(whole[:size] + bytes(zeros * (len(whole) - size)))
        counts.append(len(payloads(cut)))
    assert counts == sorted(counts)
    assert counts[-1] >= 40


# --- where there is no room -------------------------------------------------------


@pytest.mark.parametrize("way", [b"zstd", b"lz4"])
def test_a_chunk_that_may_be_gigabytes_is_not_unpacked(
    tmp_path: Path, way: bytes
) -> None:
    bomb = zstandard.compress(bytes(1 << 28))
    name = struct.pack(f"<I{len(way)}s", len(way), way)
    head = struct.pack("<QQQI", 0, 1, 1000, 0) + name + struct.pack("<Q", len(bomb))
    body = head + bomb
    path = tmp_path / "2023-11-14T22-13-20Z.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + struct.pack("<BQ", 6, len(body)) + body)

    with pytest.raises(DataFileError, match=r"268435456 bytes|, lz4"):
        list(read_messages(path))


async def test_what_does_not_fit_is_counted_and_told_once(
    site: Site, caplog: pytest.LogCaptureFixture
) -> None:
    for n in range(MOST_WAITING + 7):
        site.measure(n / 1000)
    await site.write(30.0)
    assert site.counts() == (MOST_WAITING, 7)
    assert len(caplog.records) == 1
    site.measure(31.0)
    await site.write(31.0)
    assert site.counts() == (MOST_WAITING + 1, 7)


async def test_nothing_is_recorded_below_20_gb_until_21_gb_are_free(site: Site) -> None:
    found = []
    for minute, free_gb in enumerate((30, 20, 19, 20, 0, 21, 20)):
        site.space = replace(ROOMY, free=free_gb * 10**9)
        site.measure(60.0 * minute)
        site.recorder.picture(WHOLE + b'"at":0}', at(60.0 * minute))
        await site.write(60.0 * minute)
        found.append(site.recorder.is_paused)
    assert found == [False, False, True, True, True, False, False]
    assert site.counts() == (8, 6)
    # The first was finished: a low disk may take it.
    assert [one.suffix for one in sorted(site.path.glob("*.mcap*"))] == [
        ".mcap",
        ".open",
    ]


async def test_the_oldest_goes_where_the_disk_is_low_and_never_the_open_one(
    site: Site,
) -> None:
    for hour in range(3):
        site.measure(3600.0 * hour)
        site.recorder.picture(WHOLE + b'"at":0}', at(3600.0 * hour))
    await site.write(7200.0)
    dropped = [await site.recorder.drop_oldest() for _ in range(5)]
    assert dropped == [True, True, True, True, False]
    assert [one.suffix for one in site.path.rglob("*.mcap*")] == [".open", ".open"]


async def test_a_disk_that_hangs_delays_nobody(
    site: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "GRACE_S", 0.1)
    goes_on = threading.Event()

    def hung(_: Path) -> DiskSpace:
        goes_on.wait()
        return site.space

    # The first thing that the thread does is to look at the disk.
    site.recorder = input_recorder(site.path, site.clock, read_space=hung)
    async with _running(site.recorder):
        await asyncio.sleep(0.1)
        for _ in range(MOST_BYTES // 10**6 + 8):
            site.measure(0.0, b"0" * 10**6)
        assert site.counts() == (0, 8)
        await site.close()
        goes_on.set()


async def test_a_disk_that_refuses_is_told_and_counted_and_hurts_nobody(
    tmp_path: Path,
) -> None:
    (tmp_path / "recordings").write_bytes(b"in the way")
    site = Site(tmp_path)
    site.measure(1.0)
    with pytest.raises(HopError, match="disk: File exists"):
        await site.recorder.run()
    assert site.counts() == (0, 1)

    (tmp_path / "recordings").unlink()
    site.measure(2.0)
    async with _running(site.recorder):
        await until(lambda: site.counts() == (1, 1))
    await site.close()


@asynccontextmanager
async def _running(recorder: InputRecorder) -> AsyncIterator[None]:
    part = asyncio.create_task(recorder.run())
    try:
        yield
    finally:
        part.cancel()
        await asyncio.gather(part, return_exceptions=True)
