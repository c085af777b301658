"""What was recorded, played through the pipeline again, is the world that was."""

import asyncio
import gc
import multiprocessing
import os
import pickle
import re
import shutil
import zlib
from base64 import b64encode
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pytest

from iveg import __version__
from iveg.adapters import ids as ids_module
from iveg.adapters.direct import DirectReader
from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.recordings.chunks import ChunkedRecording
from iveg.adapters.recordings.memories import memory_in, packed, recorded
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.recordings.writer import WriterSetup
from iveg.app.agreement import picture
from iveg.app.past import Past
from iveg.app.site import Site
from iveg.app.viewers import IDLE_S, MOST_READY, MOST_VIEWERS, Viewers, picture_of
from iveg.domain.errors import NotRecordedError, TooManyLookError, UnreadableError
from iveg.domain.observations import Instant, Received
from iveg.domain.records import Record
from iveg.domain.robot_state import RobotState
from iveg.domain.transports import DIRECT, FIWARE
from iveg.lab.emulator.detector_model import DETECTORS
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.orders import FaultOrder
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.world import SimulatedWorld
from iveg.lab.experiment.stage import Stage
from iveg.lab.experiment.staged_robot import STEP_S
from iveg.ngsi import codec
from iveg.pipeline.build import build
from iveg.pipeline.memory import Memory
from iveg.pipeline.parts import Choices, Pipeline, Ports
from iveg.pipeline.trace import KEYFRAMES_S, Chronicle, CountedIds
from iveg.web.views import Views
from tests.builders import fleet_of
from tests.fakes.clock import FakeClock
from tests.fakes.context_broker import FakeContextBroker
from tests.fakes.fleet import FakeFleet
from tests.fakes.journal import FakeJournal
from tests.fakes.recorder import FakeRecorder
from tests.fakes.recordings import WriterInPlace
from tests.unit.pipeline.desk import settle

ROBOTS = ("AGI", "AGII")
SCENARIO = "demo"
SECONDS = int(os.environ.get("IVEG_PAST_SECONDS", "32"))
START = Instant(1000.0, 1_700_000_000.0)
SET_BY = -7200.0


class RunningClock:
    """Moved by hand, and a microsecond on with each reading, as no two are alike."""

    def __init__(self) -> None:
        self.now, self._read = 0.0, 0
        self.set_by = 0.0

    def __call__(self) -> Instant:
        self._read += 1
        seconds = round(self.now + 1e-6 * self._read, 9)
        # The wall clock runs a little faster, and never evenly.
        drift = 1e-5 * seconds + 1e-7 * (self._read % 7)
        return Instant(
            round(START.mono + seconds, 9), START.wall + self.set_by + seconds + drift
        )


class Orders(FakeFleet):
    """STOP reaches the robots of the stage."""

    stage: Stage
    clock: RunningClock

    async def stop(self, robot_id: str, hold_id: str, by: str) -> None:
        payload = codec.write_command(codec.write_stop(hold_id, by))
        self.stage.robots[robot_id].order(payload, self.clock())
        await super().stop(robot_id, hold_id, by)


class Sink(FakeRecorder):
    chronicle: Chronicle

    def enqueue(self, record: Record) -> None:
        super().enqueue(record)
        self.chronicle.row(record)


class Live:
    """A site that records: two robots among people, with faults."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.clock = folder, RunningClock()
        setup = WriterSetup(folder, robots=ROBOTS)
        self.recorder = InputRecorder(setup, self.clock)
        self._in_place = WriterInPlace(setup)
        chronicle = Chronicle(self.recorder, __version__, b"seed-of-a-test..")
        self.orders, sink = Orders(), Sink()
        self.orders.clock, sink.chronicle = self.clock, chronicle
        greenhouse = load_greenhouse(scenario_named(SCENARIO).greenhouse)
        ports = Ports(
            self.orders,
            {DIRECT: self.orders, FIWARE: FakeContextBroker()},
            FakeJournal(),
            sink,
            self.clock,
            chronicle.ids,
            trace=chronicle,
        )
        self.parts = build(fleet_of(*ROBOTS), greenhouse, ports, Choices())
        self.views = Views(self.parts)
        chronicle.remember = Memory(self.parts).write
        chronicle.picture = lambda now: picture(self.views, now)
        self.reader = DirectReader(
            "iveg",
            ROBOTS,
            self.clock,
            self.parts.ingest.enqueue,
            self.parts.ingest.reject,
            is_past=self.parts.ingest.is_past,
            recorded=self.recorder.measure,
        )
        layout = lay_out(scenario_named(SCENARIO), ROBOTS, greenhouse)
        world = SimulatedWorld(greenhouse, layout, DETECTORS["perfect"], 3)
        self.stage = self.orders.stage = Stage(
            world,
            layout.incidents,
            self.parts.ingest,
            self,  # type: ignore[arg-type]
            self.orders.told,
            self._move,
            self.reader.read,
            scan_every=4,
        )

    def step(self, arrived: Iterable[Received], _: Instant) -> None:
        """The loop's step, at a moment of its own."""
        self.parts.loop.step(arrived, self.clock())
        while self.parts.second_witness.tick(self.clock()):
            pass

    def _move(self, seconds: float) -> Instant:
        self.clock.now = seconds
        return self.clock()

    async def run(self, seconds: float) -> None:
        for number in range(round(seconds / STEP_S)):
            self.stage.step()
            await settle()
            if number % 5 == 0:
                self._in_place.write(self.recorder, self.clock().mono)

    async def close(self) -> None:
        self._in_place.write(self.recorder, self.clock().mono)
        self._in_place.writer.finish()
        await self.recorder.close()

    def world(self) -> bytes:
        """As it is at the newest tick."""
        return picture(self.views, self.clock())


def site_of(folder: Path, **differs: Any) -> Site:
    plain = {
        "folder": folder,
        "fleet": "",
        "robots": ROBOTS,
        "greenhouse": scenario_named(SCENARIO).greenhouse,
        "equipment": "",
        "calibration": "",
        "apikey": "iveg",
        "direct_read": "all",
        "stop_direct": True,
    }
    return Site(**{**plain, **differs})


async def record(folder: Path, seconds: float) -> None:
    """So many seconds, with faults that a robot can have, and a STOP in each.

    At their end the wall clock is set back, which begins another file.
    """
    live = Live(folder)
    await live.run(8)
    part = (seconds - 8) / 6
    for order in (
        FaultOrder(robot="AGI", mute=True),
        FaultOrder(robot="AGI", mute=False, clock_offset_s=3.0),
        FaultOrder(robot="AGII", hide_people=True, deaf=True),
    ):
        live.stage.happen(order)
        await live.run(part)
        await live.parts.commander.stop(["AGII"], "ana", live.clock())
        await live.run(part)
    live.clock.set_by = SET_BY
    await live.run(5)
    await live.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recordings of some hours of the clock; only to be read."""
    found = tmp_path_factory.mktemp("recordings")
    asyncio.run(record(found, SECONDS))
    return found


@pytest.fixture
def copied(folder: Path, tmp_path: Path) -> Path:
    """The file in which they begin, to be spoiled."""
    longest = max(folder.iterdir(), key=lambda one: one.stat().st_size)
    return Path(shutil.copy(longest, tmp_path))


def moment(past: Past) -> bytes:
    return picture(past.views, past.now)


async def test_with_faults_it_is_the_same_world_each_second(folder: Path) -> None:
    past = Past(site_of(folder))
    for second in range(6, SECONDS, 2):
        past.move(START.wall + second)

    assert past.agreement.unequal == 0
    assert past.agreement.equal >= (SECONDS - 16) / KEYFRAMES_S


async def test_any_second_is_the_same_from_whichever_side_it_is_reached(
    folder: Path,
) -> None:
    played, sought = Past(site_of(folder)), Past(site_of(folder))
    for second in (9.0, 12.0, 14.5):
        played.move(START.wall + second)
    for second in (21.0, 14.5):
        sought.move(START.wall + second)

    assert moment(sought) == moment(played)
    assert abs(sought.now.wall - (START.wall + 14.5)) < 2 * STEP_S


async def test_a_world_that_differs_is_told_and_mended_by_the_next_memory(
    folder: Path,
) -> None:
    past = Past(site_of(folder))
    past.move(START.wall + 6.5)
    past.parts.world.robots["AGI"].command_status = "never"

    past.move(START.wall + 7.5)
    assert past.agreement.newest is False
    past.move(START.wall + 9.5)
    assert past.agreement.newest is True


async def test_what_was_not_recorded_has_no_picture(folder: Path) -> None:
    past = Past(site_of(folder))
    for second in (-3600.0, SECONDS + 3600.0):
        with pytest.raises(NotRecordedError):
            past.move(START.wall + second)
    with pytest.raises(NotRecordedError) as told:
        past.move(START.wall + SECONDS + 60.0)

    assert told.value.before == pytest.approx(START.wall + SECONDS, abs=1.0)
    assert told.value.after is None


async def test_a_clock_that_is_set_while_it_records_hides_nothing(folder: Path) -> None:
    past, ends = Past(site_of(folder)), START.wall + SECONDS
    for wall in (ends - 1, ends + SET_BY + 2, ends + SET_BY + 4, ends - 2):
        past.move(wall)
        assert abs(past.now.wall - wall) < 2 * STEP_S
        assert past.agreement.newest is True
        assert not past.is_recorded_twice

    assert past.agreement.unequal == 0
    with pytest.raises(NotRecordedError) as told:
        past.move(ends + SET_BY + 600)
    assert told.value.before == pytest.approx(ends + SET_BY + 5, abs=1.0)
    assert told.value.after == pytest.approx(START.wall, abs=1.0)


def test_a_truncated_file_is_read_as_far_as_it_goes(copied: Path) -> None:
    whole = copied.read_bytes()
    copied.write_bytes(whole[: 2 * len(whole) // 3])
    (copied.parent / "no.mcap").write_bytes(b"no recording")
    foreign = copied.read_bytes().replace(b"iveg", b"ours", 1)
    (copied.parent / "foreign.mcap").write_bytes(foreign)
    past = Past(site_of(copied.parent))

    past.move(START.wall + 10)

    assert past.agreement.newest is not False
    with pytest.raises(NotRecordedError):
        past.move(START.wall + SECONDS - 1)


def test_a_chunk_that_is_damaged_is_passed_over(copied: Path) -> None:
    place = ChunkedRecording(copied).chunks[1]
    data = bytearray(copied.read_bytes())
    data[place.offset + place.size // 2] ^= 0xFF
    copied.write_bytes(data)

    damaged = ChunkedRecording(copied)
    assert damaged.read(1) == []
    assert all(damaged.read(number) for number in (0, len(damaged.chunks) - 1))


async def test_of_another_version_there_is_one_clear_problem(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("iveg.app.past.__version__", "99")

    with pytest.raises(UnreadableError, match=f"recorded by iVeg {__version__}"):
        Past(site_of(folder)).move(START.wall + 9)


async def test_of_another_fleet_there_is_one_clear_problem(folder: Path) -> None:
    with pytest.raises(UnreadableError, match="other robots"):
        Past(site_of(folder, robots=("AGI", "X1"))).move(START.wall + 9)


def _place(robot: RobotState) -> tuple[float, float]:
    assert robot.odometry is not None
    return robot.odometry.pose.x, robot.odometry.pose.y


async def test_after_a_memory_a_laser_clears_the_same_places(tmp_path: Path) -> None:
    """Its scan is no second one that is equal: that would be a frozen laser."""
    live = Live(tmp_path / "live")
    memory = Memory(live.parts)
    await live.run(10)
    await live.close()
    around = np.indices((9, 9)).reshape(2, -1).T - 4.0
    ages = np.full(len(around), 2.0)

    def cleared(parts: Pipeline) -> list[list[int]]:
        sight, now = parts.evaluator.laser_sight, live.clock()
        return [
            sight.swept(one, np.add(around, _place(one)), ages, (), now).tolist()
            for one in parts.world.robots.values()
        ]

    before = cleared(live.parts)
    past = Past(site_of(tmp_path)).parts
    Memory(past).read(b"".join(memory.write()))
    assert any(before)
    assert cleared(past) == before


async def test_a_memory_that_is_written_later_is_of_the_moment_when_it_was_begun(
    tmp_path: Path,
) -> None:
    live = Live(tmp_path / "live")
    memory = Memory(live.parts)
    for _ in range(3):
        await live.run(1)
        at_once, later = b"".join(memory.write()), memory.write()
        await live.run(1)

        assert b"".join(later) == at_once
    await live.close()


async def test_of_a_memory_that_is_written_nothing_waits_for_the_garbage_collector(
    tmp_path: Path,
) -> None:
    live = Live(tmp_path / "live")
    memory = Memory(live.parts)
    await live.run(2)
    await live.close()

    gc.disable()
    try:
        gc.collect()
        assert b"".join(memory.write())
        assert gc.collect() == 0
    finally:
        gc.enable()


def test_a_memory_from_elsewhere_runs_nothing(folder: Path) -> None:
    class Evil:
        def __reduce__(self) -> tuple[Any, ...]:
            return os.system, ("true",)

    memory = Memory(Past(site_of(folder)).parts)

    with pytest.raises(UnreadableError, match="system"):
        memory.read(pickle.dumps(Evil()))


def test_a_memory_makes_nothing_that_a_module_of_ours_imports(tmp_path: Path) -> None:
    memory = Memory(Past(site_of(tmp_path)).parts)
    written = tmp_path / "written"
    path = f"V{written}\n".encode()
    through = b"\x80\x04\x8c\x15iveg.pipeline.command\x8c\x13logging.FileHandler\x93("

    with pytest.raises(UnreadableError, match="FileHandler"):
        memory.read(through + path + b"tR.")
    assert not written.exists()


@pytest.mark.parametrize(
    "make",
    [
        dict,
        lambda: {"memory": 3},
        lambda: {"memory": "nothing"},
        lambda: {"memory": b64encode(b"nothing").decode()},
        lambda: {"memory": b64encode(zlib.compress(b"N" * 1000)[:-9]).decode()},
        # Made where it is read: each worker collects this module.
        lambda: {"memory": b64encode(zlib.compress(bytes(1 << 27))).decode()},
    ],
    ids=["none", "no text", "no base64", "foreign", "cut off", "too large"],
)
def test_what_is_no_memory_is_one_clear_problem(make: Callable[[], Any]) -> None:
    with pytest.raises(UnreadableError, match="memory"):
        memory_in(make())


@pytest.mark.parametrize("memory", [b"", b"nothing", pickle.dumps({})])
def test_a_memory_that_is_no_memory_is_one_clear_problem(
    tmp_path: Path, memory: bytes
) -> None:
    with pytest.raises(UnreadableError, match="memory"):
        Memory(Past(site_of(tmp_path)).parts).read(memory)


def test_a_memory_is_recorded_as_json() -> None:
    about, memory = b'{"version":"1","by_hand":false}', b"\n\x00state\n"

    record = orjson.loads(recorded(packed(about, memory)))

    assert record.keys() == {"version", "by_hand", "memory"}
    assert memory_in(record) == memory


async def test_a_viewer_is_a_process_of_its_own_that_ends_when_idle(
    folder: Path,
) -> None:
    clock = FakeClock()
    viewers = Viewers(site_of(folder), clock, has_spares=True)
    try:
        others = set(multiprocessing.active_children())
        await viewers.keep_ready()
        assert viewers.count == 0
        ready = set(multiprocessing.active_children()) - others
        assert len(ready) == MOST_READY
        told = orjson.loads(await viewers.world("ana", START.wall + 9))
        here = Past(site_of(folder))
        here.move(START.wall + 9)
        assert orjson.loads(picture_of(here).model_dump_json()) == told
        # Who came first has one of the processes that were ready; none is needed more.
        await viewers.keep_ready()
        assert set(multiprocessing.active_children()) - others > ready
        for name in ("ben", "cleo"):
            viewers.viewer(name)
            await viewers.keep_ready()
        most = MOST_VIEWERS + 1
        assert len(set(multiprocessing.active_children()) - others) == most
        with pytest.raises(NotRecordedError):
            await viewers.world("ana", START.wall + 9999)
        clock.now += IDLE_S + 1
        viewers.tick(clock())
        assert viewers.count == 0
    finally:
        await viewers.close()


async def test_one_viewer_too_many_is_refused_while_the_others_look() -> None:
    clock = FakeClock()
    viewers = Viewers(site_of(Path("nowhere")), clock)
    first, *_ = [viewers.viewer(str(name)) for name in range(MOST_VIEWERS)]

    with pytest.raises(TooManyLookError):
        viewers.viewer("one more")
    clock.now += 11.0
    one_more = viewers.viewer("one more")
    assert viewers.count == MOST_VIEWERS
    # Who has not asked for longest leaves a process that has everything ready.
    assert one_more.worker is first.worker


def test_counted_ids_are_ulids_and_none_comes_twice() -> None:
    ids = CountedIds(b"seed")
    ids.now = START
    found = [ids() for _ in range(1000)]

    assert len(set(found)) == 1000
    assert all(re.fullmatch("[0-7][0-9A-HJKMNP-TV-Z]{25}", one) for one in found)
    assert {one[:10] for one in found} == {new_id_at(START.wall)[:10]}


def new_id_at(wall: float) -> str:
    return ids_module._of_moment(int(wall * 1000))
