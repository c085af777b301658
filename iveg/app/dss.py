"""The DSS with all its parts, wired; and its life."""

import asyncio
import contextlib
import logging
import secrets
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

from fastapi import FastAPI

from iveg import __version__
from iveg.adapters import clock, log_filter
from iveg.adapters.direct import DirectReader
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.ids import new_id
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.loop_watch import LoopWatch
from iveg.adapters.mail import MailSender
from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.adapters.orion import OrionClient
from iveg.adapters.outbound import OutboundHttp
from iveg.adapters.provisioner import Provisioner
from iveg.adapters.transports import MqttTransport, OrionTransport
from iveg.adapters.web_push import PushSender
from iveg.adapters.webhook import WebhookSender
from iveg.adapters.worker import Worker
from iveg.app.laboratory import find_laboratory
from iveg.app.life import Work, live
from iveg.app.stores import open_stores
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import HopError, VitalPartError
from iveg.domain.events import LogEvent
from iveg.domain.latency.segments import WINDOW_S
from iveg.domain.messages import Channel
from iveg.domain.observations import Instant, Observation
from iveg.domain.stop.drills import Drills
from iveg.domain.transports import DIRECT, FIWARE
from iveg.pipeline.build import Choices, KeptChoices, Ports, build, build_services
from iveg.pipeline.latency import hours_of
from iveg.pipeline.loop import reading_apart_s
from iveg.pipeline.ports import MessageSender
from iveg.pipeline.restore import remember
from iveg.settings import Settings
from iveg.web.api import messages, metrics
from iveg.web.build import Face
from iveg.web.notifications import NotificationEndpoint
from iveg.web.pages.contexts import Site
from iveg.web.security.authentication import Authenticator, NotifySecret
from iveg.web.views import Views

_log = logging.getLogger(__name__)


class Dss:
    """The decision-support system with all its parts, not yet running.

    Args:
        settings: What an operator chose.
        data_directory: Where the database (unless set) and the journals live.
        demo: Whether the robots are emulated; shown on the page.

    Attributes:
        on_failure: Called when a vital part has ended.
        failure: What ended it; None while all is well.
        on_close: Called when it ends, before its own parts do.
        counted: Counters of parts beside it, told with its own.
        stores: What outlives a restart.
        pipeline: Everything between the doors; ``services`` beside it.
        face: What the web is given of it.
    """

    def __init__(
        self,
        settings: Settings,
        data_directory: Path,
        *,
        demo: bool = False,
    ) -> None:
        self.settings = settings
        self.on_failure: Callable[[], None] = lambda: None
        self.failure: VitalPartError | None = None
        self.on_close: list[Work] = []
        self.counted: list[Counter[str]] = [log_filter.counted]
        self.sign_in_token = settings.sign_in_token or secrets.token_hex(32)
        notify_token = settings.notify_token or secrets.token_hex(32)
        previous = settings.notify_token_previous
        self.notify_secret = NotifySecret(notify_token, previous)
        self._boot, self._demo = secrets.token_hex(8), demo
        self.fleet = load_fleet(settings.fleet, settings.robots)
        self.stores = open_stores(settings, data_directory)
        self.link = self._mqtt_link()
        tenant = settings.fiware_service, settings.fiware_servicepath
        self.orion = OrionClient(settings.orion_url, *tenant)
        self.agent = IotAgentClient(settings.iota_url, *tenant)
        self.outbound = OutboundHttp()
        self.worker = Worker(lambda error: self._failed("worker", error))
        kept = self._kept_choices()
        choices = Choices(kept.rules[-1], Drills(settings.drill_days), self._boot)
        greenhouse = load_greenhouse(settings.greenhouse)
        self.pipeline = build(self.fleet, greenhouse, self._ports(), choices)
        self.services = build_services(self.pipeline, kept, self._senders(), clock.now)
        self.provisioner = self._provisioner()
        self.face = self._face(tenant)

    # --- what the parts are given -------------------------------------------------

    def _mqtt_link(self) -> MqttLink:
        """The connection to the broker; what it brings is read when parts are there."""
        settings = self.settings
        reader = DirectReader(
            settings.apikey,
            self.fleet.ids,
            clock.now,
            lambda received: self.pipeline.ingest.offer(received),
            lambda *told: self.pipeline.ingest.reject(*told),
            settings.direct_read,
            lambda *identity: self.pipeline.ingest.is_past(*identity),
            lambda *counted: self._passed_over(*counted),
        )
        return MqttLink(
            BrokerAddress.from_url(
                settings.mqtt_url, settings.mqtt_user, settings.mqtt_password
            ),
            "iveg",
            reader.subscriptions(),
            reader.read,
            self._broker_back,
            self._broker_lost,
            reader.pass_over,
            reading_apart_s(len(self.fleet.ids)),
        )

    def _kept_choices(self) -> KeptChoices:
        stores, settings = self.stores, self.settings
        first = DetectionRule(
            threshold=settings.confidence_threshold, radius_m=settings.safety_radius_m
        )
        return KeptChoices(
            stores.rules,
            stores.contacts,
            stores.detectors,
            stores.rules.load(first, clock.now()),
            stores.contacts.load(),
            stores.detectors.load(),
        )

    def _ports(self) -> Ports:
        mqtt = MqttTransport(self.link, self.settings.apikey)
        direct = DIRECT.switched(on=self.settings.stop_direct)
        recorder = self.stores.recorder
        return Ports(
            mqtt,
            {direct: mqtt, FIWARE: OrionTransport(self.orion)},
            self.stores.journal,
            recorder,
            clock.now,
            new_id,
            self._rejected,
            lambda: recorder.health(clock.now()).state,
        )

    def _senders(self) -> dict[Channel, MessageSender]:
        write = messages.writer()
        return {
            "push": PushSender(self.outbound, write),
            "email": MailSender(self.outbound, write),
            "webhook": WebhookSender(self.outbound),
        }

    def _provisioner(self) -> Provisioner:
        settings, parts = self.settings, self.pipeline
        provisioner = Provisioner(
            self.orion,
            self.agent,
            self.link,
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
        )
        provisioner.throttle.allowed = settings.orion_throttle
        return provisioner

    def _face(self, tenant: tuple[str, str]) -> Face:
        parts = self.pipeline
        authenticator = Authenticator(
            sign_in_token=self.sign_in_token,
            api_token=self.settings.api_token,
            clock=clock.now,
            store=self.stores.sessions,
        )
        orion = NotificationEndpoint(
            parts.ingest,
            self.notify_secret,
            clock.now,
            self.provisioner.is_ours,
            tenant,
            self._notified,
            self.provisioner.throttle.is_throttled,
        )
        greenhouse = parts.evaluator.greenhouse.name
        return Face(
            pipeline=parts,
            services=self.services,
            views=Views(parts, self.counters),
            authenticator=authenticator,
            orion=orion,
            site=Site(
                greenhouse,
                self.fleet.ids,
                __version__,
                self._demo,
                laboratory=find_laboratory("pages") is not None,
            ),
            boot=self._boot,
            queues=self.queues,
            clock=clock.now,
            new_id=new_id,
            worker=self.worker,
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
            await self.pipeline.commander.close()
            await self.stores.close()
            await self.orion.close()
            await self.agent.close()
            self.outbound.close()
            self.worker.close()

    async def _live(self) -> None:
        parts = self.pipeline
        parts.commander.restore(self.stores.journal.read(), clock.now())
        await live(self.vital(), self.comfort(), parts.supervision, self._last_word)

    def vital(self) -> dict[str, Work]:
        """Parts without which there is no STOP or no speed limit, by name."""
        return {"mqtt": self.link.run, "rule-loop": self.pipeline.loop.run}

    def comfort(self) -> dict[str, Work]:
        """All other parts, by name; each may fail by itself."""
        beside, supervision = self.services, self.pipeline.supervision
        return {
            "costmap": lambda: beside.mapper.run(clock.now),
            "coverage": lambda: beside.coverage.run(clock.now),
            "provisioner": self.provisioner.run,
            "history": self.stores.recorder.run,
            "messages": beside.messenger.run,
            "earlier": self._remember,
            "loop-watch": LoopWatch(supervision.note_turn).run,
        }

    async def _last_word(self) -> None:
        """Have every robot slow at once: nobody watches any more."""
        self.pipeline.evaluator.leave_unsupervised(clock.now())
        await self.link.drained()

    async def _remember(self) -> None:
        """Take up what earlier runs left in the history, as soon as it answers."""
        parts, queries = self.pipeline, self.stores.queries
        await self.stores.recorder.caught_up()
        await remember(
            queries,
            parts.commander,
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

    def _failed(self, part: str, error: Exception) -> None:
        self.pipeline.supervision.failed(part, error)

    def _passed_over(self, robot_id: str, kind: type[Observation], count: int) -> None:
        supervision, watch = self.pipeline.supervision, self.pipeline.latency.watch
        supervision.guard("latency", watch.passed_over)(robot_id, kind, count)

    def _notified(self, at: Instant) -> None:
        self.pipeline.health_monitor.notified_at = at.mono

    def _rejected(self, source: str, reason: str) -> None:
        event = LogEvent("system", "log.rejected", {"source": source, "reason": reason})
        self.pipeline.event_log.log(event, clock.now())

    def is_robot_there(self) -> bool:
        """Whether a robot is connected that is not known to be emulated."""
        now, robots = clock.now(), self.pipeline.world.live_robots()
        return not self._demo and any(
            robot.link(now) in ("LIVE", "LATE") for robot in robots
        )

    # --- what is counted ----------------------------------------------------------

    def counters(self) -> Counter[str]:
        """Everything that is counted."""
        total = self.pipeline.counters()
        total.update(self.stores.recorder.counters)
        for counted in self.counted:
            total.update(counted)
        total.update(self.services.messenger.counters)
        return total

    def queues(self) -> metrics.Queues:
        """How full the queues are, what gave way, what was done again."""
        ingest, kept = self.pipeline.ingest, self.stores.recorder.counters
        dropped = {
            "ingest": sum(
                n for name, n in ingest.counters.items() if name.startswith("dropped.")
            ),
            "history": kept["history_dropped"],
            "mqtt_out": self.link.replaced,
        }
        machines = self.pipeline.commander.machines.values()
        stops = [machine.stop for machine in machines]
        retries = {
            "broker_connect": max(0, self.link.connects - 1),
            "stop_send": sum(max(0, one.tries - 1) for one in stops if one is not None),
            "history_replay": kept["history_replayed"],
        }
        depths = {
            "ingest": ingest.waiting,
            "history": kept["history_waiting"],
            "mqtt_out": self.link.offered,
        }
        return metrics.Queues(depths, dropped, retries)
