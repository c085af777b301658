"""The world as it was at any recorded second: the pipeline itself, run once more.

It takes over the memory that was recorded last before a moment, then the inputs since
then at the very moments at which the live loop took them.  After each memory the live
process recorded a hash of its world; here the same world must come out, else the next
memory is taken over as well, and whoever asked is told.
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final

import orjson

from iveg import __version__
from iveg.adapters.calibration_files import load_calibrations
from iveg.adapters.direct import DirectReader
from iveg.adapters.equipment_files import load_equipment
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.recordings.incoming import MEMORIES, NOTIFICATIONS
from iveg.adapters.recordings.memories import memory_in
from iveg.adapters.recordings.timeline import Found, Place, Timeline
from iveg.app.agreement import Agreement, picture
from iveg.app.site import Site
from iveg.app.virtual import VirtualPipeline
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import NotRecordedError, UnreadableError
from iveg.domain.observations import Instant
from iveg.domain.transports import DIRECT, FIWARE
from iveg.pipeline.memory import Memory
from iveg.pipeline.steps import Step
from iveg.pipeline.trace import KEYFRAMES_S, WALL_UNITS, CountedIds, digest, in_ns
from iveg.web.notifications import NotificationEndpoint
from iveg.web.security.secrets import NotifySecret
from iveg.web.views import Views

STEPS, MEMORY = "/iveg/steps", MEMORIES.topic
_NS = 10**9
_GAP_NS: Final = 2 * _NS
"""Where the loop told nothing for longer, nothing was recorded."""
_REACH_NS: Final = 7 * _NS
"""A memory that is older leads nowhere; one may be late where the loop has no time."""
_PLAY_ON_NS: Final = 2 * round(KEYFRAMES_S * _NS)
"""What is farther on is reached sooner from a memory."""
_COMPARED_NS: Final = round(KEYFRAMES_S * _NS)
"""Of what leads to a moment the newest hashes are compared: one costs a picture."""


@dataclass(slots=True)
class _Waiting:
    """Messages that were read and not heard yet."""

    messages: deque[tuple[int, str, bytes]] = field(default_factory=deque)

    def until(self, mono: int) -> Iterable[tuple[int, str, bytes]]:
        while self.messages and self.messages[0][0] <= mono:
            yield self.messages.popleft()


class Past:
    """One viewer's world, which moves along the recordings.

    Args:
        site: What it is made with.

    Attributes:
        now: The moment that it shows.
        agreement: Of its hashes with those of the live process.
    """

    def __init__(self, site: Site) -> None:
        self.agreement = Agreement()
        self.now = Instant(0.0, 0.0)
        self._timeline = Timeline(site.folder)
        self._ids = CountedIds(bytes(16))
        self._heard_at = self.now
        self._thinned = False
        self._place: Place | None = None
        self._at_ns = 0
        self._waiting = _Waiting()
        fleet = load_fleet(site.fleet, site.robots)
        direct = DIRECT.switched(on=site.stop_direct)
        self._pipeline = VirtualPipeline(
            fleet,
            load_greenhouse(site.greenhouse),
            DetectionRule(),
            tiles=load_equipment(site.equipment, fleet.ids),
            calibrations=load_calibrations(site.calibration),
            transports=(direct, FIWARE),
            new_id=self._ids,
        )
        self.parts = parts = self._pipeline.parts
        self._memory = Memory(parts)
        self.views = Views(parts)
        self._apikey, self._direct_read = site.apikey, site.direct_read
        self._robots = fleet.ids
        self._reader = self._new_reader()
        self._heard = self._reader.subscriptions()
        self._orion = NotificationEndpoint(
            parts.ingest,
            NotifySecret(""),
            lambda: self._heard_at,
            lambda _: True,
            ("", ""),
            lambda _: None,
            lambda _: self._thinned,
            parts.equipment.equipment.entities,
            parts.equipment.receive,
        )

    def _new_reader(self) -> DirectReader:
        ingest = self.parts.ingest
        return DirectReader(
            self._apikey,
            self._robots,
            lambda: self._heard_at,
            ingest.enqueue,
            ingest.reject,
            self._direct_read,
            ingest.is_past,
        )

    # --- moving -------------------------------------------------------------------

    @property
    def is_recorded_twice(self) -> bool:
        """Whether another file has this moment, too: the wall clock was set back."""
        return self._timeline.holding(round(self.now.wall * _NS)) > 1

    def look_through(self) -> None:
        """Know where what is in the file that is being written."""
        self._timeline.look_through()

    def move(self, wall: float) -> None:
        """Go to a moment (Unix s).

        Raises:
            NotRecordedError: nothing was recorded there.
            UnreadableError: it was recorded by another program or fleet.
            DataFileError: a file cannot be read.
        """
        at = round(wall * _NS)
        plays_on = self._place is not None and 0 <= at - self._at_ns <= _PLAY_ON_NS
        if plays_on:
            self._play(at)
        if not plays_on or at - self._at_ns > _GAP_NS:
            self._begin(at)
            self._play(at)
        if at - self._at_ns > _GAP_NS:
            raise self._gap(at)

    def _begin(self, at: int) -> None:
        """Take over the last memory by a moment."""
        found = self._timeline.latest(MEMORY, at, _REACH_NS)
        self._place = None
        if found is None:
            raise self._gap(at)
        self._take_over(orjson.loads(found.message.payload))
        self._place, self._at_ns = found.behind, found.message.log_time

    def _take_over(self, record: dict[str, Any]) -> None:
        version = record.get("version")
        if version != __version__:
            raise UnreadableError("other_version", f"recorded by iVeg {version}")
        self._waiting.messages.clear()
        # The one before would wait for the moments that it has heard to come again.
        self._reader = self._new_reader()
        self._memory.read(memory_in(record))
        self._ids.seed, self._ids.count = bytes.fromhex(record["seed"]), record["ids"]
        self._pass_to(Instant(record["mono"] / _NS, record["wall"]))
        self.agreement.newest = None

    def _play(self, at: int) -> None:
        assert self._place is not None  # noqa: S101 - begun before
        for found in self._timeline.messages(self._place):
            message = found.message
            if message.topic in (STEPS, MEMORY) and message.log_time > at:
                return
            self._play_message(found, compares=at - message.log_time < _COMPARED_NS)
            self._place = found.behind
            if message.topic == STEPS:
                self._at_ns = message.log_time

    def _play_message(self, found: Found, *, compares: bool) -> None:
        topic, log_time, payload = found.message
        if topic == STEPS:
            tick = orjson.loads(payload)
            self._repeat(tick)
            if compares and "hash" in tick:
                now = digest(picture(self.views, self.now))
                self.agreement.note(tick["hash"] == now)
        elif topic == MEMORY:
            memory = orjson.loads(payload)
            if memory["by_hand"] or self.agreement.newest is False:
                self._take_over(memory)
        elif topic == NOTIFICATIONS.topic or topic in self._heard:
            mono = in_ns(found.file.instant(log_time).mono)
            self._waiting.messages.append((mono, topic, payload))

    def _gap(self, at: int) -> NotRecordedError:
        seconds = [
            None if one is None else one / _NS for one in self._timeline.around(at)
        ]
        return NotRecordedError(at / _NS, *seconds)

    # --- what the loop did --------------------------------------------------------

    def _repeat(self, tick: dict[str, Any]) -> None:
        """The steps of one tick."""
        tick_mono, tick_wall = tick["mono"], tick["wall"]
        arrived = {
            tick_mono + mono: (tick_wall + wall / WALL_UNITS, bool(thinned))
            for mono, wall, thinned in tick["arrived"]
        }
        for mono, wall, kind in tick["steps"]:
            moment = Instant((tick_mono + mono) / _NS, tick_wall + wall / WALL_UNITS)
            if kind == Step.LOOKED:
                self._pass_to(moment)
                self.parts.second_witness.tick(moment)
                continue
            for heard_at, topic, payload in self._waiting.until(tick_mono + mono):
                known = arrived.get(heard_at)
                guess = moment.wall - moment.mono + heard_at / _NS
                heard_wall, self._thinned = known or (guess, False)
                self._hear(Instant(heard_at / _NS, heard_wall), topic, payload)
            self._pass_to(moment)
            self._step(moment, kind)
        # A press that joined a STOP has drawn one, and was no input.
        self._ids.count = tick["ids"]

    def _step(self, now: Instant, kind: int) -> None:
        loop, ingest = self.parts.loop, self.parts.ingest
        if kind == Step.AGED:
            loop.age(now)
        else:
            loop.step(ingest.drain(), now, judges=kind == Step.JUDGED)

    def _hear(self, at: Instant, topic: str, payload: bytes) -> None:
        self._heard_at = at
        self._pass_to(at)
        if topic == NOTIFICATIONS.topic:
            self._orion.receive(payload)
        else:
            self._reader.read(topic, payload)

    def _pass_to(self, now: Instant) -> None:
        self.now = self._ids.now = self._pipeline.now = now
