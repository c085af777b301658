"""The one composition of iVeg's server: settings → parts, and their life.

Vital parts share one fate, comfort has none.  A vital part that ends takes the process
with it, after a last word to the fleet: a server that is half alive would look as if it
watched (docs/architecture.md, "Vital and comfort").
"""

import asyncio
import logging
import secrets
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

from fastapi import FastAPI

from iveg import __version__
from iveg.adapters import clock
from iveg.adapters.clock import new_id
from iveg.adapters.direct import DirectReader
from iveg.adapters.equipment_files import load_equipment
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.upkeep import PART as RETENTION
from iveg.adapters.history.upkeep import DiskWatch, HistoryUpkeep
from iveg.adapters.loop_watch import watch_loop
from iveg.adapters.messages import AppriseSender, load_messages
from iveg.adapters.provisioner import Provisioner
from iveg.adapters.recordings.pictures import PictureFiles
from iveg.adapters.recordings.recorder import PART as RECORDINGS
from iveg.adapters.transports import MqttTransport, OrionTransport
from iveg.adapters.worker import PACK_LIMIT_S, Worker
from iveg.app.accounts import PART as ACCOUNTS
from iveg.app.accounts import Accounts
from iveg.app.outside import Outside, site_of
from iveg.comfort.equipment import PART as EQUIPMENT
from iveg.comfort.equipment import TICK_S as EQUIPMENT_TICK_S
from iveg.comfort.maps import COVERAGE_TICK_S, SCAN_TICK_S
from iveg.comfort.messenger import PART as MESSAGES
from iveg.comfort.messenger import Messenger
from iveg.domain.alerts import MOST_KEPT, read_alert
from iveg.domain.errors import HopError, SettingsError, VitalPartError
from iveg.domain.fleet import FleetDescription
from iveg.domain.observations import Instant
from iveg.domain.transports import DIRECT, FIWARE
from iveg.pipeline import Choices, Pipeline
from iveg.settings import Settings
from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Ports
from iveg.vital.supervision import Supervision
from iveg.web.api import health
from iveg.web.build import WebParts
from iveg.web.live.encoder import Encoder
from iveg.web.live.pictures import Past, PictureRecorder
from iveg.web.notifications import Followers, NotificationEndpoint
from iveg.web.pages import sentences
from iveg.web.pages.contexts import Site
from iveg.web.views import Views

_log = logging.getLogger(__name__)
Work = Callable[[], Awaitable[object]]
_ASK_AGAIN_S = 5.0
LAST_WORD_S = 0.5
"""Time that the last word may take; robots slow by themselves half a second later."""


class Dss:
    """The decision-support system with all its parts, not yet running.

    Args:
        settings: An operator's choices.
        fleet: The robots.
        outside: Ports to network and disk.
        demo: Whether the robots are emulated; shown on the page.

    Attributes:
        failure: The error that ended a vital part; None while all is well.
        pipeline: From observations to feedback, and comfort beside it.
        web: The parts that the web shows.
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
        self.failure: VitalPartError | None = None
        # An empty token lets nobody in.
        by_link = settings.sign_in == "link" or demo
        link = settings.sign_in_token or secrets.token_hex(32)
        self.sign_in_token = link if by_link else ""
        self.notify_secret = settings.notify_token or secrets.token_hex(32)
        boot = secrets.token_hex(8)
        self.pipeline = Pipeline(
            fleet,
            load_greenhouse(settings.greenhouse),
            self._ports(),
            Choices(
                self.stores.kept_choices(settings),
                boot,
                f"-{boot[:8]}",
                load_equipment(settings.equipment, fleet.ids),
                settings.refused_robots,
            ),
        )
        self.core = core = self.pipeline.core
        self.supervision = core.supervision
        inputs = self.stores.inputs
        if settings.recordings:
            self.supervision.listen(
                RECORDINGS,
                measured=inputs.measure,
                notified=inputs.notification,
                arrived=inputs.draw,
            )
        plan = load_messages(settings.messages)
        write, alerts = sentences.writer(plan.language), self.pipeline.evaluator.alerts
        self.messenger = Messenger(plan, AppriseSender().send, write, alerts, core)
        self.trail = AuditTrail(self.stores.recorder, new_id)
        self.accounts = Accounts(
            self.stores.access,
            self.stores.queries.url,
            self.trail,
            self.supervision,
            clock.now,
        )
        self.upkeep = HistoryUpkeep(
            self.stores.recorder,
            self.stores.queries,
            settings.retention,
            core.event_log,
            self.trail,
            DiskWatch(self.stores.directory, inputs.drop_oldest, self.supervision),
        )
        failed = partial(self.supervision.failed, "worker")
        self.worker, self.packer = Worker(failed), Worker(failed, PACK_LIMIT_S)
        self._attach_reader()
        self.provisioner = self._provisioner()
        self.web = self._web(demo=demo)

    # --- wiring -------------------------------------------------------------------

    def _ports(self) -> Ports:
        mqtt = MqttTransport(self.outside.link, self.settings.apikey)
        direct = DIRECT.switched(on=self.settings.stop_direct)
        return Ports(
            mqtt,
            {direct: mqtt, FIWARE: OrionTransport(self.outside.orion)},
            self.stores.journal,
            self.stores.recorder,
            clock.now,
            new_id,
            self.stores.history_state,
        )

    def _attach_reader(self) -> None:
        """Have robots' own messages read from the broker."""
        ingest, monitor = self.pipeline.ingest, self.core.health_monitor
        reader = DirectReader(
            self.settings.apikey,
            self.fleet.ids,
            clock.now,
            ingest,
            self.settings.direct_read,
            partial(self.supervision.tell, "measured"),
        )

        def came_back() -> None:
            monitor.mqtt_connected = True
            self.pipeline.commander.broker_back()

        def was_lost() -> None:
            monitor.mqtt_connected = False

        self.outside.link.attach(
            {},
            reader.read,
            came_back,
            was_lost,
            reader.refuse_stored,
            reader.subscriptions(),
        )

    def _provisioner(self) -> Provisioner:
        outside, core = self.outside, self.core
        secret = self.notify_secret
        return Provisioner(
            outside.orion,
            outside.agent,
            outside.link,
            core.health_monitor,
            self.pipeline.ingest,
            replace(site_of(self.settings), notify_token=secret, boot=core.boot),
        )

    def _web(self, *, demo: bool) -> WebParts:
        parts, settings = self.pipeline, self.settings
        authenticator, self.sign_on = self.accounts.ways_in(
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
                partial(self.supervision.tell, "entity_read"),
                partial(self.supervision.tell, "notified"),
            ),
        )
        site = Site(
            self.core.greenhouse.name,
            self.fleet.ids,
            __version__,
            demo,
            link=bool(self.sign_in_token),
            sso=None if self.outside.provider is None else settings.sso_label,
        )
        views = Views(parts, self.counters)
        return WebParts(
            pipeline=parts,
            views=views,
            authenticator=authenticator,
            orion=orion,
            site=site,
            queues=self.queues,
            clock=clock.now,
            worker=self.worker,
            recordings=self.stores.inputs,
            trail=self.trail,
            past=Past(PictureFiles(self.stores.inputs.pictures)),
            encoder=Encoder(views, parts.hub, clock.now),
            accounts=lambda: self.accounts.state,
        )

    def _notified(self, at: Instant) -> None:
        self.core.health_monitor.notified_at = at.mono

    # --- counts -------------------------------------------------------------------

    def counters(self) -> Counter[str]:
        """All counters: of the pipeline, the history and the parts beside."""
        total = self.pipeline.counters()
        for counted in (
            self.stores.recorder.counters,
            self.messenger.counters,
            self.upkeep.counters,
            self.stores.inputs.counters,
        ):
            total.update(counted)
        return total

    def queues(self) -> health.Queues:
        """Depth of each queue, and messages dropped from it."""
        ingest, kept = self.pipeline.ingest, self.stores.recorder.counters
        link = self.outside.link
        dropped = {
            "ingest": sum(
                n for name, n in ingest.counters.items() if name.startswith("dropped.")
            ),
            "history": kept["history_dropped"],
            "mqtt_out": link.replaced,
        }
        depths = {
            "ingest": ingest.waiting,
            "history": kept["history_waiting"],
            "mqtt_out": link.offered,
        }
        return health.Queues(depths, dropped)

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
            for closed in (self.worker, self.packer, self.accounts):
                closed.close()

    async def _live(self) -> None:
        self.pipeline.commander.restore(self.stores.journal.read(), clock.now())
        await live(self.vital(), self.comfort(), self.supervision, self._last_word)

    def vital(self) -> dict[str, Work]:
        """Parts without which there is no STOP or no speed limit, by name."""
        link, loop = self.outside.link, self.pipeline.loop
        return {"mqtt": link.run, "rule-loop": loop.run}

    def comfort(self) -> dict[str, Work]:
        """All other parts, by name; each may fail by itself."""
        parts = self.pipeline
        return {
            "costmap": partial(_tick, parts.mapper.tick, SCAN_TICK_S),
            "peer-scans": partial(_tick, parts.peer_scans.tick, SCAN_TICK_S),
            "coverage": partial(_tick, parts.coverage.tick, COVERAGE_TICK_S),
            "provisioner": self.provisioner.run,
            "history": self.stores.recorder.run,
            EQUIPMENT: partial(_tick, parts.equipment.tick, EQUIPMENT_TICK_S),
            RETENTION: partial(self.upkeep.run, clock.now),
            RECORDINGS: self.stores.inputs.run,
            "pictures": self._take_pictures,
            MESSAGES: self.messenger.run,
            ACCOUNTS: self.accounts.run,
            "earlier": self._remember,
            "loop-watch": partial(watch_loop, self.supervision.note_turn),
        }

    async def _take_pictures(self) -> None:
        """Write down what pages are sent, where anything is recorded."""
        web, hub, write = self.web, self.pipeline.hub, self.stores.inputs.picture
        if self.settings.recordings:
            taken = PictureRecorder(web.encoder, web.views, hub, clock.now, write)
            await taken.run()

    async def _last_word(self) -> None:
        """Have every robot slow at once: nobody watches any more."""
        self.pipeline.evaluator.leave_unsupervised(clock.now())
        await self.outside.link.drained()

    async def _remember(self) -> None:
        """Take up what earlier runs left in the history, as soon as it answers."""
        await self.stores.recorder.caught_up()
        await remember(self.stores.queries, self.pipeline)

    def _ended(self, task: asyncio.Task[None]) -> None:
        """A vital part has ended: say so and leave; the robots slow down."""
        error = None if task.cancelled() else task.exception()
        _log.critical("iVeg stops", exc_info=error)
        self.failure = VitalPartError("dss")
        if isinstance(error, VitalPartError):
            self.failure = error


def open_dss(
    settings: Settings,
    data_directory: Path,
    *,
    demo: bool = False,
    make: type[Dss] = Dss,
) -> Dss:
    """A server as the settings say.

    Args:
        settings: An operator's choices.
        data_directory: Where the database (unless set) and the journals are.
        demo: Whether the robots are emulated.
        make: The class.
    """
    fleet = load_fleet(settings.fleet, settings.robots)
    if unknown := sorted({*settings.refused_robots} - {*fleet.ids}):
        raise SettingsError("IVEG_REFUSED_ROBOTS", unknown[0], "robots of the fleet")
    outside = Outside(settings, data_directory)
    return make(settings, fleet, outside, demo=demo)


async def live(
    vital: Mapping[str, Work],
    comfort: Mapping[str, Work],
    supervision: Supervision,
    last_word: Work,
) -> None:
    """Run all parts until cancelled.

    Args:
        vital: By name; none may end.
        comfort: By name; each is started again when it fails.
        supervision: Names what of comfort is down.
        last_word: Said to the fleet when a vital part has ended.

    Raises:
        VitalPartError: one has.
    """
    tasks = [asyncio.create_task(_run(work), name=name) for name, work in vital.items()]
    beside = [
        asyncio.create_task(supervision.keep_running(name, work), name=name)
        for name, work in comfort.items()
    ]
    try:
        ended, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        await _say(last_word)
        task = ended.pop()
        raise VitalPartError(task.get_name()) from task.exception()
    finally:
        for task in (*tasks, *beside):
            task.cancel()
        await asyncio.gather(*tasks, *beside, return_exceptions=True)


async def _run(work: Work) -> None:
    await work()


async def _tick(tick: Callable[[Instant], None], period_s: float) -> None:
    """Let time pass for a part of comfort, until cancelled."""
    while True:
        tick(clock.now())
        await asyncio.sleep(period_s)


async def _say(last_word: Work) -> None:
    try:
        async with asyncio.timeout(LAST_WORD_S):
            await last_word()
    except Exception:
        # The part that would say it may be the one that has failed.
        _log.exception("the last feedback failed; robots slow by themselves")


async def remember(history: Queries, parts: Pipeline) -> None:
    """Take up open rows of earlier runs, while STOP already works.

    A P1 that nobody acknowledged stays active, and rows that a crash left open are
    closed.  Nothing waits for this: until the history answers the page
    says that earlier alerts are unknown.  Returns when all of it is taken up.
    """
    while True:
        try:
            left_open = await history.open_commands()
            decisions = await history.open_decisions()
            alerted = await history.open_alerts()
            unseen = await history.unseen_alerts(MOST_KEPT)
        except HopError:
            await asyncio.sleep(_ASK_AGAIN_S)
            continue
        now = parts.core.ports.clock()
        parts.commander.close_earlier(left_open, now)
        parts.goals.close_earlier(left_open, now)
        parts.evaluator.close_earlier(decisions, alerted, now)
        parts.evaluator.alerts.remember(read_alert(row, now) for row in unseen)
        parts.core.health_monitor.earlier_read = True
        return
