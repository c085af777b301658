"""The DSS with all its parts, wired; and its life."""

import asyncio
import contextlib
import logging
import secrets
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial

from fastapi import FastAPI

from iveg import __version__
from iveg.adapters import clock, log_filter
from iveg.adapters.backfill import BackfillReader
from iveg.adapters.calibration_files import load_calibrations
from iveg.adapters.direct import DirectReader
from iveg.adapters.equipment_files import load_equipment
from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.ids import new_id
from iveg.adapters.loop_watch import LoopWatch
from iveg.adapters.provisioner import Provisioner
from iveg.adapters.recordings.recorded_sink import RecordedSink
from iveg.adapters.recordings.recorder import PART as RECORDINGS
from iveg.adapters.transports import MqttTransport, OrionTransport
from iveg.adapters.webauthn import has_passkeys
from iveg.adapters.worker import PACK_LIMIT_S, Worker
from iveg.app.agreement import picture
from iveg.app.counts import count_all, read_queues
from iveg.app.door import open_door
from iveg.app.laboratory import find_laboratory
from iveg.app.life import Work, live
from iveg.app.outside import Outside
from iveg.app.site import Site as PastSite
from iveg.app.viewers import Viewers
from iveg.app.what_if import WhatIfs
from iveg.domain.errors import HopError, VitalPartError
from iveg.domain.fleet import FleetDescription
from iveg.domain.latency.segments import WINDOW_S
from iveg.domain.observations import Instant
from iveg.domain.records import Record
from iveg.domain.stop.drills import Drills
from iveg.domain.transports import DIRECT, FIWARE
from iveg.pipeline.audit import AuditTrail
from iveg.pipeline.backfill import PART as BACKFILL
from iveg.pipeline.build import build
from iveg.pipeline.equipment import PART as EQUIPMENT
from iveg.pipeline.latency import hours_of
from iveg.pipeline.memory import Memory
from iveg.pipeline.parts import Choices, Ports
from iveg.pipeline.restore import remember
from iveg.pipeline.retention import PART as RETENTION
from iveg.pipeline.retention import HistoryUpkeep
from iveg.pipeline.services import build_services
from iveg.pipeline.trace import Chronicle, Trace
from iveg.settings import Settings
from iveg.web.build import Face
from iveg.web.notifications import NotificationEndpoint
from iveg.web.pages import message_texts
from iveg.web.pages.contexts import Site
from iveg.web.security.secrets import NotifySecret
from iveg.web.views import Views

_log = logging.getLogger(__name__)


class Dss:
    """The decision-support system with all its parts, not yet running.

    Args:
        settings: An operator's choices.
        fleet: The robots.
        outside: Ports to network and disk.
        demo: Whether the robots are emulated; shown on the page.

    Attributes:
        on_failure: Called when a vital part has ended.
        failure: The error that ended it; None while all is well.
        on_close: Called when it ends, before its own parts do.
        counted: Counters of parts beside the pipeline.
        pipeline: From observations to feedback; ``services`` beside it.
        face: The parts that the web shows.
    """

    def __init__(
        self,
        settings: Settings,
        fleet: FleetDescription,
        outside: Outside,
        *,
        demo: bool = False,
    ) -> None:
        self.settings, self.fleet, self.outside = settings, fleet, outside
        self.stores = outside.stores
        self.on_failure: Callable[[], None] = lambda: None
        self.failure: VitalPartError | None = None
        self.on_close: list[Work] = []
        # An empty token lets nobody in.
        by_link = settings.sign_in == "link" or demo
        link = settings.sign_in_token or secrets.token_hex(32)
        self.sign_in_token = link if by_link else ""
        notify_token = settings.notify_token or secrets.token_hex(32)
        previous = settings.notify_token_previous
        self.notify_secret = NotifySecret(notify_token, previous)
        self._boot, self._demo = secrets.token_hex(8), demo
        self.chronicle = Chronicle(
            self.stores.inputs, __version__, secrets.token_bytes(16)
        )
        kept = self.stores.kept_choices(settings)
        drills, era = Drills(settings.drill_days), f"-{self._boot[:8]}"
        tiles = load_equipment(settings.equipment, fleet.ids)
        rows = load_calibrations(settings.calibration)
        choices = Choices(kept.rules[-1], drills, self._boot, era, tiles, rows)
        greenhouse = load_greenhouse(settings.greenhouse)
        self.pipeline = build(fleet, greenhouse, self._ports(), choices)
        self.stores.inputs.rule = lambda: self.pipeline.evaluator.rule
        if settings.recordings:
            self.chronicle.remember = Memory(self.pipeline).write
        self.services = build_services(
            self.pipeline, kept, outside.senders(message_texts.writer()), clock.now
        )
        self.door = open_door(self.stores, clock.now)
        self.trail = AuditTrail(self.stores.recorder, new_id)
        self.upkeep = HistoryUpkeep(
            self.stores.retained(),
            settings.retention,
            self.pipeline.event_log,
            self.pipeline.supervision,
            self.trail,
        )
        self.counted: list[Counter[str]] = [
            log_filter.counted,
            self.services.messenger.counters,
            self.upkeep.counters,
            self.stores.inputs.counters,
        ]
        site = PastSite.of(settings, self.stores.inputs.folder)
        self.past = Viewers(site, clock.now, has_spares=settings.recordings)
        self.what_ifs = WhatIfs.of(settings, self.stores.queries.url, fleet)
        failed = partial(self.pipeline.supervision.failed, "worker")
        self.worker, self.packer = Worker(failed), Worker(failed, PACK_LIMIT_S)
        self._attach_reader()
        self.provisioner = self._provisioner()
        self.face = self._face()

    # --- wiring -------------------------------------------------------------------

    def _ports(self) -> Ports:
        mqtt = MqttTransport(self.outside.link, self.settings.apikey)
        direct = DIRECT.switched(on=self.settings.stop_direct)
        return Ports(
            mqtt,
            {direct: mqtt, FIWARE: OrionTransport(self.outside.orion)},
            self.stores.journal,
            RecordedSink(self.stores.recorder, self._row),
            clock.now,
            self.chronicle.ids if self.settings.recordings else new_id,
            self.stores.history_state,
            self.stores.inputs.tick,
            self.chronicle if self.settings.recordings else Trace(),
        )

    def _row(self, record: Record) -> None:
        self.stores.inputs.row(record)
        self.chronicle.row(record)

    def _attach_reader(self) -> None:
        """Have robots' own messages read from the broker."""
        ingest, watch = self.pipeline.ingest, self.pipeline.latency.watch
        reader = DirectReader(
            self.settings.apikey,
            self.fleet.ids,
            clock.now,
            ingest.enqueue,
            ingest.reject,
            self.settings.direct_read,
            ingest.is_past,
            self.pipeline.supervision.guard("latency", watch.passed_over),
            self.pipeline.supervision.guard(RECORDINGS, self.stores.inputs.measure),
        )
        late = BackfillReader(
            self.fleet.ids,
            clock.now,
            self.pipeline.backfill.has_room,
            self.pipeline.supervision.guard(BACKFILL, self.pipeline.backfill.record),
            ingest.reject,
            self.pipeline.supervision.guard(RECORDINGS, self.stores.inputs.measure),
        )
        is_wanted = self.settings.direct_read == "all"
        self.outside.link.attach(
            reader.subscriptions() | (late.subscriptions() if is_wanted else {}),
            late.beside(reader.read),
            self._broker_back,
            self._broker_lost,
            reader.pass_over,
        )

    def _provisioner(self) -> Provisioner:
        settings, parts, outside = self.settings, self.pipeline, self.outside
        provisioner = Provisioner(
            outside.orion,
            outside.agent,
            outside.link,
            parts.health_monitor,
            parts.ingest,
            parts.world.feeds,
            robots=self.fleet.ids,
            apikey=settings.apikey,
            context_broker_url=settings.iota_cb_url or settings.orion_url,
            notify_url=settings.notify_address,
            notify_token=self.notify_secret.current,
            boot=self._boot,
            read_clock=clock.now,
            tiles=parts.equipment.equipment.tiles,
        )
        provisioner.throttle.allowed = settings.orion_throttle
        return provisioner

    def _face(self) -> Face:
        parts, settings, recorder = self.pipeline, self.settings, self.stores.recorder
        authenticator, self.sign_on = self.door.ways_in(
            settings,
            self.sign_in_token,
            self.stores.sessions,
            self.trail,
            self.outside.provider,
            clock.now,
        )
        orion = NotificationEndpoint(
            parts.ingest,
            self.notify_secret,
            clock.now,
            self.provisioner.is_ours,
            (settings.fiware_service, settings.fiware_servicepath),
            self._notified,
            self.provisioner.throttle.is_throttled,
            parts.equipment.equipment.entities,
            parts.supervision.guard(EQUIPMENT, parts.equipment.receive),
            parts.supervision.guard(RECORDINGS, self.stores.inputs.notification),
            self.provisioner.is_former,
        )
        site = Site(
            parts.evaluator.greenhouse.name,
            self.fleet.ids,
            __version__,
            self._demo,
            laboratory=find_laboratory("pages") is not None,
            link=bool(self.sign_in_token),
            sso=None if self.outside.provider is None else settings.sso_label,
            passkeys=has_passkeys(),
        )
        views = Views(parts, partial(count_all, parts, recorder, self.counted))
        self.chronicle.picture = partial(picture, views)
        return Face(
            pipeline=parts,
            services=self.services,
            views=views,
            authenticator=authenticator,
            orion=orion,
            site=site,
            boot=self._boot,
            queues=partial(read_queues, parts, recorder, self.outside.link),
            clock=clock.now,
            new_id=new_id,
            worker=self.worker,
            recordings=self.stores.inputs,
            trail=self.trail,
            past=self.past,
        )

    # --- life ---------------------------------------------------------------------

    @asynccontextmanager
    async def running(self, _: FastAPI | None = None) -> AsyncIterator[None]:
        """Everything that lives beside the requests."""
        living = asyncio.create_task(self._live(), name="dss")
        living.add_done_callback(self._ended)
        try:
            yield
        finally:
            living.remove_done_callback(self._ended)
            living.cancel()
            await asyncio.gather(living, return_exceptions=True)
            for close in self.on_close:
                await close()
            self.pipeline.evaluator.leave(clock.now())
            parts = self.pipeline.commander, self.pipeline.goals, self.outside
            for part in (*parts, self.past):
                await part.close()
            for one in (self.worker, self.packer, self.what_ifs, self.door):
                one.close()

    async def _live(self) -> None:
        parts = self.pipeline
        parts.commander.restore(self.stores.journal.read(), clock.now())
        await live(self.vital(), self.comfort(), parts.supervision, self._last_word)

    def vital(self) -> dict[str, Work]:
        """Parts without which there is no STOP or no speed limit, by name."""
        link, loop = self.outside.link, self.pipeline.loop
        return {"mqtt": link.run, "rule-loop": loop.run}

    def comfort(self) -> dict[str, Work]:
        """All other parts, by name; each may fail by itself."""
        beside = self.services
        return {
            "costmap": lambda: beside.mapper.run(clock.now),
            "second-witness": lambda: self.pipeline.second_witness.run(clock.now),
            "peer-scans": lambda: self.pipeline.peer_scans.run(clock.now),
            "coverage": lambda: beside.coverage.run(clock.now),
            "provisioner": self.provisioner.run,
            "history": self.stores.recorder.run,
            EQUIPMENT: lambda: self.pipeline.equipment.run(clock.now),
            RETENTION: lambda: self.upkeep.run(clock.now),
            **self.stores.comfort(),
            "past": self.past.run,
            "shadow-rule": beside.trials.run,
            "what-if": self.what_ifs.run,
            "messages": beside.messenger.run,
            **self.door.comfort(),
            "earlier": self._remember,
            "loop-watch": LoopWatch(self.pipeline.supervision.note_turn).run,
        }

    async def _last_word(self) -> None:
        """Have every robot slow at once: nobody watches any more."""
        self.pipeline.evaluator.leave_unsupervised(clock.now())
        await self.outside.link.drained()

    async def _remember(self) -> None:
        """Take up what earlier runs left in the history, as soon as it answers."""
        parts, queries = self.pipeline, self.stores.queries
        await self.stores.recorder.caught_up()
        await remember(
            queries,
            parts.commander,
            parts.goals,
            parts.evaluator,
            parts.event_log,
            parts.health_monitor,
            clock.now,
        )
        with contextlib.suppress(HopError):
            day = clock.wall() - WINDOW_S["24h"]
            measured = await queries.latency_minutes(day)
            # A day of twenty robots is half a million rows: not in the loop's thread.
            parts.latency.watch.remember(await asyncio.to_thread(hours_of, measured))

    def _ended(self, task: asyncio.Task[None]) -> None:
        """A vital part has ended: say so and leave; the robots slow down."""
        error = None if task.cancelled() else task.exception()
        _log.critical("iVeg stops", exc_info=error)
        self.failure = VitalPartError("dss")
        if isinstance(error, VitalPartError):
            self.failure = error
        self.on_failure()

    # --- what comes in ------------------------------------------------------------

    def _broker_back(self) -> None:
        self.pipeline.health_monitor.mqtt_connected = True
        self.pipeline.commander.broker_back()

    def _broker_lost(self) -> None:
        self.pipeline.health_monitor.mqtt_connected = False

    def _notified(self, at: Instant) -> None:
        self.pipeline.health_monitor.notified_at = at.mono
        if self.settings.recordings:
            self.chronicle.heard(at)

    def is_robot_there(self) -> bool:
        """Whether a robot is connected that is not known to be emulated."""
        now, robots = clock.now(), self.pipeline.world.live_robots()
        return not self._demo and any(
            robot.link(now) in ("LIVE", "LATE") for robot in robots
        )
