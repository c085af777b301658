"""Composition root of the DSS: settings → parts → FastAPI.  Wires, decides nothing."""

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
from iveg.adapters import clock, log_filter, web_push
from iveg.adapters.contacts import FileContacts
from iveg.adapters.direct import DirectReader
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.history.engine import sqlite_file, sqlite_url
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder, journal_file
from iveg.adapters.ids import new_id
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.journal import FileJournal
from iveg.adapters.mail import MailSender
from iveg.adapters.mqtt import BrokerAddress, MqttLink
from iveg.adapters.orion import OrionClient
from iveg.adapters.outside import Outside
from iveg.adapters.provisioner import Provisioner
from iveg.adapters.rules import FileRules
from iveg.adapters.sessions import FileSessions
from iveg.adapters.transports import MqttTransport, OrionTransport
from iveg.adapters.webhook import WebhookSender
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import HopError
from iveg.domain.events import LogEvent
from iveg.domain.latency.hops import WINDOW_S
from iveg.domain.observations import Instant
from iveg.domain.stop import Press
from iveg.domain.stop.drills import Drills
from iveg.domain.transports import DIRECT, FIWARE
from iveg.experiment.bench import Bench
from iveg.models.snapshot import Server, Snapshot, User
from iveg.ngsi.codec import format_stamp
from iveg.pipeline import topics
from iveg.pipeline.build import Choices, Ports, build
from iveg.pipeline.coverage import CoverageMonitor
from iveg.pipeline.latency import hours_of
from iveg.pipeline.loop import reading_apart_s
from iveg.pipeline.mapping import Mapper
from iveg.pipeline.messenger import Messenger
from iveg.pipeline.restore import remember
from iveg.pipeline.rules import Rules
from iveg.settings import Settings
from iveg.web.api import (
    messages,
    metrics,
)
from iveg.web.pages.contexts import Site
from iveg.web.security.authentication import (
    Authenticator,
    NotifySecret,
    Principal,
)
from iveg.web.views import Views

_log = logging.getLogger(__name__)


class Dss:
    """The decision-support system with all its parts, not yet running.

    Args:
        settings: What an operator chose.
        data_directory: Where the database (unless set) and the journals live.
        demo: Whether the robots are emulated; shown on the page.
        on_failure: Called when a part that must live has died.
    """

    def __init__(
        self,
        settings: Settings,
        data_directory: Path,
        *,
        demo: bool = False,
        on_failure: Callable[[], None] | None = None,
    ) -> None:
        start = clock.now()
        self.settings = settings
        self.on_failure = on_failure
        self._boot = secrets.token_hex(8)
        self.sign_in_token = settings.sign_in_token or secrets.token_hex(32)
        self.notify_secret = NotifySecret(
            settings.notify_token or secrets.token_hex(32)
        )
        self._demo = demo
        self.fleet = load_fleet(settings.fleet, settings.robots)
        url = settings.database_url or sqlite_url(data_directory / "iveg.sqlite")
        beside = sqlite_file(url)
        directory = data_directory if beside is None else beside.parent
        directory.mkdir(parents=True, exist_ok=True)

        self.recorder = Recorder(url, journal_file(url, directory))
        self.queries = Queries(url)
        self.journal = FileJournal(directory / "commands.jsonl")
        self._direct = DirectReader(
            settings.apikey,
            self.fleet.ids,
            clock.now,
            lambda received: self.ingest.offer(received),
            lambda *told: self.ingest.reject(*told),
            settings.direct_read,
            lambda *identity: self.ingest.is_past(*identity),
            lambda *told: self.latency.watch.passed_over(*told),
        )
        self.link = MqttLink(
            BrokerAddress.from_url(
                settings.mqtt_url, settings.mqtt_user, settings.mqtt_password
            ),
            "iveg",
            self._direct.subscriptions(),
            self._direct.read,
            self._broker_back,
            self._broker_lost,
            self._direct.pass_over,
            reading_apart_s(len(self.fleet.ids)),
        )
        self.orion = OrionClient(
            settings.orion_url, settings.fiware_service, settings.fiware_servicepath
        )
        self.agent = IotAgentClient(
            settings.iota_url, settings.fiware_service, settings.fiware_servicepath
        )
        mqtt = MqttTransport(self.link, settings.apikey)
        rule_store = FileRules(directory / "rules.jsonl")
        versions = rule_store.load(
            DetectionRule(
                threshold=settings.confidence_threshold,
                radius_m=settings.safety_radius_m,
            ),
            start,
        )
        parts = build(
            self.fleet,
            load_greenhouse(settings.greenhouse),
            Ports(
                mqtt,
                {
                    DIRECT.switched(on=settings.stop_direct): mqtt,
                    FIWARE: OrionTransport(self.orion),
                },
                self.journal,
                self.recorder,
                clock.now,
                new_id,
                format_stamp,
                self._rejected,
                lambda: self.recorder.health(clock.now()).state,
            ),
            Choices(
                versions[-1],
                Drills(settings.drill_days),
                self._boot,
            ),
        )
        self.hub, self.event_log, self.health_monitor = (
            parts.hub,
            parts.event_log,
            parts.health_monitor,
        )
        self.latency, self.ingest, self.loop = parts.latency, parts.ingest, parts.loop
        self.evaluator, self.commander = parts.evaluator, parts.commander
        world = parts.world
        self.rules = Rules(self.evaluator, rule_store, self.event_log, versions)
        self.outside = Outside()
        contacts, write = FileContacts(directory / "contacts.jsonl"), messages.writer()
        self.messenger = Messenger(
            contacts.load(),
            contacts,
            {
                "push": web_push.PushSender(self.outside, write),
                "email": MailSender(self.outside, write),
                "webhook": WebhookSender(self.outside),
            },
            self.evaluator.alerts,
            self.event_log,
            clock.now,
        )
        self.evaluator.alerts.on_raised = self.messenger.offer
        self.provisioner = Provisioner(
            self.orion,
            self.agent,
            self.link,
            self.health_monitor,
            self.ingest,
            world.feeds,
            robots=self.fleet.ids,
            apikey=settings.apikey,
            context_broker_url=settings.iota_cb_url or settings.orion_url,
            notify_url=settings.notify_address,
            notify_token=self.notify_secret.current,
            boot=self._boot,
            read_clock=clock.now,
        )
        self.provisioner.throttle.allowed = settings.orion_throttle
        self.mapper = Mapper(world, self.evaluator.greenhouse.bounds)
        self.coverage = CoverageMonitor(world, self.evaluator.greenhouse)
        self.views = Views(
            self.evaluator,
            self.commander,
            self.event_log,
            self.health_monitor,
            self.counters,
        )
        self.bench = Bench(directory / "experiments", self.is_robot_there)
        self.sessions = FileSessions(directory / "sessions.jsonl")
        self.authenticator = Authenticator(
            sign_in_token=self.sign_in_token,
            api_token=settings.api_token,
            clock=clock.now,
            store=self.sessions,
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
            await self.bench.close()
            self.evaluator.leave(clock.now())
            await self.commander.close()
            await self.recorder.close()
            await self.orion.close()
            await self.agent.close()
            self.outside.close()
            self.queries.close()
            self.journal.close()
            self.sessions.close()

    async def _live(self) -> None:
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self.link.run(), name="mqtt")
            tasks.create_task(self.loop.run(), name="rule-loop")
            tasks.create_task(self.mapper.run(clock.now), name="costmap")
            tasks.create_task(self.coverage.run(clock.now), name="coverage")
            tasks.create_task(self.provisioner.run(), name="provisioner")
            tasks.create_task(self.recorder.run(), name="recorder")
            tasks.create_task(self.messenger.run(), name="messages")
            self.commander.restore(self.journal.read(), clock.now())
            tasks.create_task(self._remember(), name="remember")

    async def _remember(self) -> None:
        """Take up what earlier runs left in the history, as soon as it answers."""
        await self.recorder.caught_up()
        await remember(
            self.queries,
            self.commander,
            self.evaluator,
            self.event_log,
            self.health_monitor,
            clock.now,
        )
        with contextlib.suppress(HopError):
            day = clock.now().wall - WINDOW_S["24h"]
            measured = await self.queries.latency_minutes(day)
            # A day of twenty robots is half a million rows: not in the loop's thread.
            self.latency.remember(await asyncio.to_thread(hours_of, measured))

    def _ended(self, task: asyncio.Task[None]) -> None:
        """A part that must live has died: say so and stop; the robots slow down."""
        if not task.cancelled():
            _log.critical("iVeg stops", exc_info=task.exception())
        if self.on_failure is not None:
            self.on_failure()

    def _broker_back(self) -> None:
        self.health_monitor.mqtt_connected = True
        self.commander.broker_back()

    def _broker_lost(self) -> None:
        self.health_monitor.mqtt_connected = False

    def _rejected(self, source: str, reason: str) -> None:
        event = LogEvent("system", "log.rejected", {"source": source, "reason": reason})
        self.event_log.log(event, clock.now())

    # --- what the web asks --------------------------------------------------------

    def counters(self) -> Counter[str]:
        """Everything that is counted."""
        total = Counter(self.ingest.counters)
        total.update(self.evaluator.world.counters)
        total.update(self.commander.counters)
        total.update(self.recorder.counters)
        total.update(log_filter.counted)
        total.update(self.messenger.counters)
        total["live.browsers"] = self.hub.watchers
        total["nlos.protected"] = self.evaluator.protected_unseen
        return total

    def queues(self) -> metrics.Queues:
        """How full the queues are, what gave way, what was done again."""
        kept = self.recorder.counters
        counted = self.ingest.counters
        dropped = {
            "ingest": sum(
                n for name, n in counted.items() if name.startswith("dropped.")
            ),
            "history": kept["history_dropped"],
            "mqtt_out": self.link.replaced,
        }
        stops = [machine.stop for machine in self.commander.machines.values()]
        retries = {
            "broker_connect": max(0, self.link.connects - 1),
            "stop_send": sum(max(0, one.tries - 1) for one in stops if one is not None),
            "history_replay": kept["history_replayed"],
        }
        depths = {
            "ingest": self.ingest.waiting,
            "history": kept["history_waiting"],
            "mqtt_out": self.link.offered,
        }
        return metrics.Queues(depths, dropped, retries)

    def snapshot(self, principal: Principal, now: Instant) -> Snapshot:
        """Everything that is known, for a browser that has just come."""
        return Snapshot(
            t=format_stamp(now.wall),
            server=Server(
                boot=self._boot, version=__version__, demo=self._demo, wall=now.wall
            ),
            user=User(name=principal.name, role=principal.role),
            **topics.read_all(self.views, now),
        )

    async def stop(self, robot_id: str | None, by: str, press: Press) -> None:
        """STOP one robot, or all."""
        targets = self.commander.machines if robot_id is None else [robot_id]
        await self.commander.stop(targets, by, clock.now(), press)

    def is_robot_there(self) -> bool:
        """Whether a robot is connected that is not known to be emulated."""
        now, robots = clock.now(), self.evaluator.world.live_robots()
        return not self._demo and any(
            robot.link(now) in ("LIVE", "LATE") for robot in robots
        )

    def is_ours(self, subscription_id: str) -> bool:
        """Whether a subscription is one that this DSS keeps."""
        return self.provisioner.is_ours(subscription_id)

    def is_thinned(self, subscription_id: str) -> bool:
        """Whether Orion was told to leave out most of what a subscription is about."""
        return self.provisioner.throttle.is_throttled(subscription_id)

    def notified(self, at: Instant) -> None:
        """A notification of Orion's came in."""
        self.health_monitor.notified_at = at.mono

    def site(self) -> Site:
        """What every page says of this server."""
        return Site(
            self.evaluator.greenhouse.name,
            self.fleet.ids,
            __version__,
            self._demo,
        )
