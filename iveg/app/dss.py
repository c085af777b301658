"""The DSS with all its parts, wired; and its life."""

import asyncio
import logging
import secrets
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial

from fastapi import FastAPI

from iveg import __version__
from iveg.adapters import clock, log_filter
from iveg.adapters.calibration_files import load_calibrations
from iveg.adapters.clock import new_id
from iveg.adapters.direct import DirectReader
from iveg.adapters.equipment_files import load_equipment
from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.loop_watch import LoopWatch
from iveg.adapters.messages import AppriseSender, load_messages
from iveg.adapters.provisioner import FiwareSite, Provisioner
from iveg.adapters.recordings.pictures import PictureFiles
from iveg.adapters.recordings.recorder import PART as RECORDINGS
from iveg.adapters.recordings.recorder import RecordedSink
from iveg.adapters.transports import MqttTransport, OrionTransport
from iveg.adapters.worker import PACK_LIMIT_S, Worker
from iveg.app.counts import count_all, read_queues
from iveg.app.door import PART as ACCOUNTS
from iveg.app.door import Door
from iveg.app.life import Work, live
from iveg.app.outside import Outside
from iveg.comfort.equipment import PART as EQUIPMENT
from iveg.comfort.messenger import Messenger
from iveg.comfort.restore import remember
from iveg.comfort.retention import PART as RETENTION
from iveg.comfort.retention import HistoryUpkeep
from iveg.domain.errors import VitalPartError
from iveg.domain.fleet import FleetDescription
from iveg.domain.observations import Instant
from iveg.domain.transports import DIRECT, FIWARE
from iveg.pipeline import Choices, Ports, build, build_services
from iveg.settings import Settings
from iveg.vital.audit import AuditTrail
from iveg.web.build import Face
from iveg.web.live.encoder import Encoder
from iveg.web.live.pictures import Past, PictureRecorder
from iveg.web.notifications import Followers, NotificationEndpoint
from iveg.web.pages import sentences
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
        # An empty token lets nobody in.
        by_link = settings.sign_in == "link" or demo
        link = settings.sign_in_token or secrets.token_hex(32)
        self.sign_in_token = link if by_link else ""
        notify_token = settings.notify_token or secrets.token_hex(32)
        previous = settings.notify_token_previous
        self.notify_secret = NotifySecret(notify_token, previous)
        self._boot, self._demo = secrets.token_hex(8), demo
        kept = self.stores.kept_choices(settings)
        era = f"-{self._boot[:8]}"
        tiles = load_equipment(settings.equipment, fleet.ids)
        rows = load_calibrations(settings.calibration)
        refused = settings.refused_robots
        choices = Choices(kept.rules[-1], self._boot, era, tiles, rows, refused)
        greenhouse = load_greenhouse(settings.greenhouse)
        self.pipeline = build(fleet, greenhouse, self._ports(), choices)
        self.stores.inputs.rule = lambda: self.pipeline.evaluator.rule
        self.services = build_services(self.pipeline, kept, clock.now)
        self.messenger = self._messenger()
        self.trail = AuditTrail(self.stores.recorder, new_id)
        self.door = Door(
            self.stores.access,
            self.stores.queries.url,
            self.trail,
            self.pipeline.supervision,
            clock.now,
        )
        self.upkeep = HistoryUpkeep(
            self.stores.retained(),
            settings.retention,
            self.pipeline.event_log,
            self.pipeline.supervision,
            self.trail,
        )
        self.counted: list[Counter[str]] = [
            log_filter.counted,
            self.messenger.counters,
            self.upkeep.counters,
            self.stores.inputs.counters,
        ]
        failed = partial(self.pipeline.supervision.failed, "worker")
        self.worker, self.packer = Worker(failed), Worker(failed, PACK_LIMIT_S)
        self._attach_reader()
        self.provisioner = self._provisioner()
        self.face = self._face()

    # --- wiring -------------------------------------------------------------------

    def _messenger(self) -> Messenger:
        plan, parts = load_messages(self.settings.messages), self.pipeline
        alerts = parts.evaluator.alerts
        messenger = Messenger(
            plan,
            AppriseSender(),
            sentences.writer(plan.language),
            lambda: alerts.waiting,
            clock.now,
        )
        alerts.on_raised = parts.supervision.guard("messages", messenger.enqueue_raised)
        return messenger

    def _ports(self) -> Ports:
        mqtt = MqttTransport(self.outside.link, self.settings.apikey)
        direct = DIRECT.switched(on=self.settings.stop_direct)
        return Ports(
            mqtt,
            {direct: mqtt, FIWARE: OrionTransport(self.outside.orion)},
            self.stores.journal,
            RecordedSink(self.stores.recorder, self.stores.inputs.row),
            clock.now,
            new_id,
            self.stores.history_state,
        )

    def _attach_reader(self) -> None:
        """Have robots' own messages read from the broker."""
        ingest = self.pipeline.ingest
        reader = DirectReader(
            self.settings.apikey,
            self.fleet.ids,
            clock.now,
            ingest,
            self.settings.direct_read,
            self.pipeline.supervision.guard(RECORDINGS, self.stores.inputs.measure),
        )
        self.outside.link.attach(
            {},
            reader.read,
            self._broker_back,
            self._broker_lost,
            reader.refuse_stored,
            [*reader.subscriptions().values()],
        )

    def _provisioner(self) -> Provisioner:
        settings, parts, outside = self.settings, self.pipeline, self.outside
        return Provisioner(
            outside.orion,
            outside.agent,
            outside.link,
            parts.health_monitor,
            parts.ingest,
            FiwareSite(
                self.fleet.ids,
                settings.apikey,
                context_broker_url=settings.iota_cb_url or settings.orion_url,
                notify_url=settings.notify_address,
                notify_token=self.notify_secret.current,
                boot=self._boot,
                tiles=parts.equipment.equipment.tiles,
            ),
        )

    def _face(self) -> Face:
        parts, settings, recorder = self.pipeline, self.settings, self.stores.recorder
        authenticator, self.sign_on = self.door.ways_in(
            settings, self.sign_in_token, self.outside.provider
        )
        orion = NotificationEndpoint(
            parts.ingest,
            self.notify_secret,
            clock.now,
            self.provisioner,
            (settings.fiware_service, settings.fiware_servicepath),
            Followers(
                self._notified,
                parts.equipment.equipment.entities,
                parts.supervision.guard(EQUIPMENT, parts.equipment.receive),
                parts.supervision.guard(RECORDINGS, self.stores.inputs.notification),
            ),
        )
        site = Site(
            parts.evaluator.greenhouse.name,
            self.fleet.ids,
            __version__,
            self._demo,
            link=bool(self.sign_in_token),
            sso=None if self.outside.provider is None else settings.sso_label,
        )
        views = Views(parts, partial(count_all, parts, recorder, self.counted))
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
            past=Past(PictureFiles(self.stores.inputs.pictures)),
            encoder=Encoder(views, parts.hub, clock.now),
            accounts=lambda: self.door.state,
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
            self.pipeline.evaluator.leave(clock.now())
            parts = self.pipeline.commander, self.pipeline.goals, self.outside
            for part in parts:
                await part.close()
            for one in (self.worker, self.packer, self.door):
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
            "peer-scans": lambda: self.pipeline.peer_scans.run(clock.now),
            "coverage": lambda: beside.coverage.run(clock.now),
            "provisioner": self.provisioner.run,
            "history": self.stores.recorder.run,
            EQUIPMENT: lambda: self.pipeline.equipment.run(clock.now),
            RETENTION: lambda: self.upkeep.run(clock.now),
            **self.stores.comfort(),
            "pictures": self._take_pictures,
            "shadow-rule": beside.trials.run,
            "messages": self.messenger.run,
            ACCOUNTS: self.door.run,
            "earlier": self._remember,
            "loop-watch": LoopWatch(self.pipeline.supervision.note_turn).run,
        }

    async def _take_pictures(self) -> None:
        """Write down what pages are sent, where anything is recorded."""
        face, hub, write = self.face, self.pipeline.hub, self.stores.inputs.picture
        if self.settings.recordings:
            taken = PictureRecorder(face.encoder, face.views, hub, clock.now, write)
            await taken.run()

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
