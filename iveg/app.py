"""Composition of iVeg's server: settings → connections → parts, and their life.

It wires and decides nothing.  When a vital part ends, the process ends with it, after a
last feedback to the fleet: a server that half works would look as if it supervised.  A
part of comfort that ends is started again (docs/architecture.md, "Vital and comfort").
"""

import asyncio
import logging
import secrets
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fastapi import FastAPI
from pydantic import TypeAdapter

from iveg import __version__
from iveg.adapters import clock
from iveg.adapters.access_file import AccessFile
from iveg.adapters.bounded_json import BoundedJson
from iveg.adapters.clock import new_id
from iveg.adapters.direct import DirectReader
from iveg.adapters.equipment_files import load_equipment
from iveg.adapters.extras import require_extra
from iveg.adapters.files import FileByRobot
from iveg.adapters.fiware_http import HOP, FiwareToken, TokenGrant
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.greenhouses import load_greenhouse
from iveg.adapters.history import lists
from iveg.adapters.history.engine import history_url, sqlite_file
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder, spilled_file
from iveg.adapters.history.upkeep import PART as RETENTION
from iveg.adapters.history.upkeep import DiskWatch, HistoryUpkeep
from iveg.adapters.identity_provider import Client
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.journal import FileJournal
from iveg.adapters.loop_watch import watch_loop
from iveg.adapters.messages import load_messages, send_message
from iveg.adapters.mqtt import BrokerAddress, MqttLink, TlsFiles
from iveg.adapters.orion import OrionClient
from iveg.adapters.provisioner import Provisioner
from iveg.adapters.reconciler import FiwareSite
from iveg.adapters.recordings.pictures import PictureFiles
from iveg.adapters.recordings.recorder import PART as RECORDINGS
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.rules import FileRules
from iveg.adapters.transports import MqttTransport, OrionTransport
from iveg.adapters.worker import PACK_LIMIT_S, Worker
from iveg.comfort.equipment import PART as EQUIPMENT
from iveg.comfort.equipment import TICK_S as EQUIPMENT_TICK_S
from iveg.comfort.maps import COVERAGE_TICK_S, SCAN_TICK_S
from iveg.comfort.messenger import PART as MESSAGES
from iveg.comfort.messenger import Messenger
from iveg.domain.accounts import ClaimReading
from iveg.domain.alerts import read_alert
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import OutOfService, WordAnswer
from iveg.domain.errors import HopError, SettingsError, VitalPartError
from iveg.domain.observations import Instant
from iveg.domain.transports import DIRECT, FIWARE
from iveg.pipeline import Choices, Pipeline
from iveg.settings import Settings
from iveg.vital.audit import AuditTrail
from iveg.vital.operators import Kept, KeptChoices
from iveg.vital.ports import Ports
from iveg.vital.supervision import Work
from iveg.web.live.encoder import Encoder
from iveg.web.live.pictures import Past, PictureRecorder
from iveg.web.notifications import NotificationEndpoint
from iveg.web.pages import sentences
from iveg.web.pages.contexts import Site
from iveg.web.security.accounts import PART as ACCOUNTS
from iveg.web.security.accounts import Accounts
from iveg.web.security.authentication import Authenticator, Credentials
from iveg.web.security.single_sign_on import SingleSignOn
from iveg.web.views import Views

if TYPE_CHECKING:
    from iveg.adapters.oidc import OpenIdProvider

ACCOUNTS_FILE: Final = "accounts.jsonl"
_ASK_AGAIN_S = 5.0
_OUT = TypeAdapter(tuple[str, OutOfService])
_WORD = TypeAdapter(tuple[str, WordAnswer])
_log = logging.getLogger(__name__)


class App:
    """The parts of one iVeg, not running yet.

    Args:
        settings: An operator's choices.
        data_directory: Directory of the database (unless set) and the journals.
        demo: Whether the robots are emulated; shown on the page.
        connections: Network and disk; by default those of the settings.

    Attributes:
        failure: The error that ended a vital part; None while all is well.
        pipeline: From observations to feedback, and comfort beside it.

    Raises:
        SettingsError: a refused robot is none of the fleet.
    """

    def __init__(
        self,
        settings: Settings,
        data_directory: Path,
        *,
        demo: bool = False,
        connections: "Connections | None" = None,
    ) -> None:
        self.settings = settings
        self.fleet = fleet = load_fleet(settings.fleet, settings.robots)
        # A misspelt id would leave the robot that an operator refuses accepted.
        if unknown := sorted({*settings.refused_robots} - {*fleet.ids}):
            raise SettingsError(
                "IVEG_REFUSED_ROBOTS", unknown[0], "robots of the fleet"
            )
        connections = connections or Connections(settings, data_directory)
        self.connections = connections
        self.failure: VitalPartError | None = None
        self.notify_secret = settings.notify_token or secrets.token_hex(32)
        boot, fiware = secrets.token_hex(8), site_of(settings)
        self.pipeline = Pipeline(
            fleet,
            load_greenhouse(settings.greenhouse),
            connections.ports(settings),
            Choices(
                connections.kept_choices(settings),
                boot,
                f"-{boot[:8]}",
                fiware.tiles,
                settings.refused_robots,
            ),
        )
        self.core = self.pipeline.core
        self.supervision = self.core.supervision
        self._attach_reader()
        self._add_comfort(fiware)
        self._add_sign_in(by_link=settings.sign_in == "link" or demo)
        self._add_web(demo=demo)

    # --- wiring -------------------------------------------------------------------

    def _attach_reader(self) -> None:
        """Attach the reader of robots' own messages to the broker's link."""
        reader = DirectReader(
            self.settings.apikey,
            self.fleet.ids,
            clock.now,
            self.pipeline.ingest,
            self.settings.direct_read,
            partial(self.supervision.tell, "measured"),
        )

        def on_change(connected: bool) -> None:
            self.core.health_monitor.mqtt_connected = connected
            if connected:
                self.pipeline.commander.broker_back()

        self.connections.link.attach(
            {},
            reader.read,
            on_change,
            reader.refuse_stored,
            reader.subscriptions(),
        )

    def _add_comfort(self, fiware: FiwareSite) -> None:
        """Parts of comfort that need network or disk; ``Pipeline`` has the others."""
        settings, connections, core = self.settings, self.connections, self.core
        inputs = connections.inputs
        if settings.recordings:
            self.supervision.listen(
                RECORDINGS,
                measured=inputs.measure,
                notified=inputs.notification,
                arrived=inputs.draw,
            )
        plan = load_messages(settings.messages)
        write, alerts = sentences.writer(plan.language), self.pipeline.evaluator.alerts
        self.messenger = Messenger(plan, send_message, write, alerts, core)
        self.trail = AuditTrail(connections.recorder, new_id)
        self.upkeep = HistoryUpkeep(
            connections.recorder,
            connections.queries,
            settings.retention,
            core.event_log,
            self.trail,
            DiskWatch(
                connections.directory,
                inputs.drop_oldest,
                lambda: settings.recordings and inputs.is_paused,
                self.supervision,
            ),
        )
        failed = partial(self.supervision.failed, "worker")
        self.worker, self.packer = Worker(failed), Worker(failed, PACK_LIMIT_S)
        self.provisioner = Provisioner(
            connections.orion,
            connections.agent,
            connections.link,
            core.health_monitor,
            self.pipeline.ingest,
            replace(fiware, notify_token=self.notify_secret, boot=core.boot),
        )

    def _add_sign_in(self, *, by_link: bool) -> None:
        """Accounts, and the ways in: sign-in link, API token, identity provider."""
        settings, provider = self.settings, self.connections.provider
        link = settings.sign_in_token or secrets.token_hex(32)
        # An empty token signs nobody in.
        self.sign_in_token = link if by_link else ""
        self.accounts = Accounts(
            self.connections.access,
            self.connections.queries.url,
            self.trail,
            self.supervision,
            clock.now,
        )
        credentials = Credentials(
            self.sign_in_token, settings.api_token, settings.sign_in_name
        )
        self.authenticator = Authenticator(
            credentials, self.accounts.people, self.trail
        )
        self.sign_on: SingleSignOn | None = None
        if provider is not None:
            reading = ClaimReading(
                settings.sso_role_claim,
                settings.sso_name_claim,
                dict(settings.sso_roles),
            )
            self.sign_on = SingleSignOn(provider, reading, self.authenticator)

    def _add_web(self, *, demo: bool) -> None:
        """Data of pages, and the endpoint of notifications."""
        parts, settings = self.pipeline, self.settings
        self.orion = NotificationEndpoint(
            self.core,
            parts.ingest,
            self.notify_secret,
            self.provisioner.subscriptions,
            (settings.fiware_service, settings.fiware_servicepath),
            parts.equipment.equipment.entities,
        )
        self.site = Site(
            self.core.greenhouse.name,
            self.fleet.ids,
            __version__,
            demo,
            link=bool(self.sign_in_token),
            sso=None if self.connections.provider is None else settings.sso_label,
        )
        self.views = Views(parts, self.counters)
        self.encoder = Encoder(self.views, parts.hub, clock.now)
        self.past = Past(PictureFiles(self.connections.inputs.pictures))

    def counters(self) -> Counter[str]:
        """Counters of pipeline, history and parts of comfort."""
        total = self.pipeline.counters()
        for counted in (
            self.connections.recorder.counters,
            self.messenger.counters,
            self.upkeep.counters,
            self.connections.inputs.counters,
        ):
            total.update(counted)
        return total

    # --- life ---------------------------------------------------------------------

    @asynccontextmanager
    async def running(self, _: FastAPI | None = None) -> AsyncIterator[None]:
        """Run all parts beside the requests while the block lasts."""
        living = asyncio.create_task(self._live(), name="parts")
        living.add_done_callback(self._ended)
        try:
            yield
        finally:
            # An intended end is no failure of a vital part.
            living.remove_done_callback(self._ended)
            living.cancel()
            await asyncio.gather(living, return_exceptions=True)
            self.pipeline.evaluator.leave(clock.now())
            # Connections last: sends that are under way use them.
            for part in (
                self.pipeline.commander,
                self.pipeline.goals,
                self.connections,
            ):
                await part.close()
            for closed in (self.worker, self.packer, self.accounts):
                closed.close()

    async def _live(self) -> None:
        # Before the first message: a robot that is to stand counts as stopped at once.
        desired = self.connections.journal.read()
        self.pipeline.commander.restore(desired, clock.now())
        vital, comfort = self.vital(), self.comfort()
        await self.supervision.run(vital, comfort, self._last_word)

    def vital(self) -> dict[str, Work]:
        """Parts that STOP and speed limits need, by name."""
        link, loop = self.connections.link, self.pipeline.loop
        return {"mqtt": link.run, "rule-loop": loop.run}

    def comfort(self) -> dict[str, Work]:
        """All other parts, by name; each may fail alone."""
        parts, connections = self.pipeline, self.connections
        return {
            "costmap": partial(_tick, parts.mapper.tick, SCAN_TICK_S),
            "peer-scans": partial(_tick, parts.peer_scans.tick, SCAN_TICK_S),
            "coverage": partial(_tick, parts.coverage.tick, COVERAGE_TICK_S),
            "provisioner": self.provisioner.run,
            "history": connections.recorder.run,
            EQUIPMENT: partial(_tick, parts.equipment.tick, EQUIPMENT_TICK_S),
            RETENTION: partial(self.upkeep.run, clock.now),
            RECORDINGS: connections.inputs.run,
            "pictures": self._take_pictures,
            MESSAGES: self.messenger.run,
            ACCOUNTS: self.accounts.run,
            "earlier": self._remember,
            "loop-watch": partial(watch_loop, self.supervision.note_turn),
        }

    async def _take_pictures(self) -> None:
        """Record the data that pages are sent, if recordings are on."""
        hub, write = self.pipeline.hub, self.connections.inputs.picture
        if self.settings.recordings:
            pages = PictureRecorder(self.encoder, self.views, hub, clock.now, write)
            await pages.run()

    async def _last_word(self) -> None:
        """Send the last feedback: every robot is unsupervised and slows at once."""
        self.pipeline.evaluator.leave_unsupervised(clock.now())
        await self.connections.link.drained.wait()

    async def _remember(self) -> None:
        """Take up open rows of earlier runs, as soon as the history answers."""
        # Their last states may still be in the journal.
        await self.connections.recorder.caught_up.wait()
        await remember(self.connections.queries, self.pipeline)

    def _ended(self, task: asyncio.Task[None]) -> None:
        """Log the end of a vital part, and end the process; the robots slow down."""
        error = None if task.cancelled() else task.exception()
        _log.critical("iVeg stops", exc_info=error)
        self.failure = VitalPartError("parts")
        if isinstance(error, VitalPartError):
            self.failure = error


async def _tick(tick: Callable[[Instant], None], period_s: float) -> None:
    """Call a part of comfort each period, until cancelled."""
    while True:
        tick(clock.now())
        await asyncio.sleep(period_s)


async def remember(history: Queries, parts: Pipeline) -> None:
    """Take up open rows of earlier runs, while STOP already works.

    A P1 that nobody acknowledged stays active, and rows that a crash left open are
    closed.  Nothing waits for this: until the history answers, the page shows earlier
    alerts as unknown.  Returns when all rows are taken up.
    """
    while True:
        try:
            left_open = await history.left_open(lists.COMMANDS)
            decisions = await history.left_open(lists.DECISIONS)
            alerted = await history.left_open(lists.ALERTS)
            unseen = await history.unseen_alerts()
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


# --- network and disk -------------------------------------------------------------


class Connections:
    """Connections and files of one iVeg; nothing is connected yet.

    A missing directory is created.

    Attributes:
        link: Connection to the broker, still without readers.
        provider: Identity provider; None: there is none.
    """

    def __init__(self, settings: Settings, data_directory: Path) -> None:
        url = history_url(settings.database_url, data_directory)
        self.directory = directory = files_of(url, data_directory)
        directory.mkdir(parents=True, exist_ok=True)
        if (revoked := directory / "revoked.jsonl").exists():
            text = "%s no longer counts: set IVEG_REFUSED_ROBOTS, delete the file"
            _log.warning(text, revoked)
        spilled = spilled_file(url, directory)
        self.journal = FileJournal(directory / "commands.jsonl", spilled)
        self.recorder, self.queries = Recorder(url, self.journal), Queries(url)
        self.rules = FileRules(directory / "rules.jsonl")
        self.detectors = FileByRobot(directory / "detectors.jsonl", "detectors", _OUT)
        self.words = FileByRobot(directory / "words.jsonl", "words", _WORD)
        self.access = AccessFile(directory / ACCOUNTS_FILE)
        self.inputs = InputRecorder(
            directory / "recordings", clock.now, settings.limits_of_recordings
        )
        broker = BrokerAddress.from_url(
            settings.mqtt_url,
            settings.mqtt_user,
            settings.mqtt_password,
            TlsFiles(settings.mqtt_ca, settings.mqtt_cert, settings.mqtt_key),
        )
        self.link = MqttLink(broker, "iveg")
        self.orion, self.agent = open_fiware(settings)
        self.provider = open_provider(settings)

    def ports(self, settings: Settings) -> Ports:
        """Ports of the pipeline."""
        mqtt = MqttTransport(self.link, settings.apikey)
        direct = DIRECT.switched(on=settings.stop_direct)
        return Ports(
            mqtt,
            {direct: mqtt, FIWARE: OrionTransport(self.orion)},
            self.journal,
            self.recorder,
            clock.now,
            new_id,
            self.recorder.state,
        )

    def kept_choices(self, settings: Settings) -> KeptChoices:
        """Choices of earlier runs; without a stored rule that of the settings."""
        return KeptChoices(
            self.rules.load(DetectionRule.from_parameters(settings.rule), clock.now()),
            self.rules.append,
            Kept(self.detectors.load(), self.detectors.save),
            Kept(self.words.load(), self.words.save),
        )

    async def close(self) -> None:
        """Write waiting data, and close all but the link, which ends with its task."""
        await self.inputs.close()
        # Before the journal, which stores the orders that the recorder still holds.
        await self.recorder.close()
        self.queries.close()
        self.journal.close()
        await self.orion.close()
        await self.agent.close()
        if self.provider is not None:
            await self.provider.close()


def files_of(url: str, data_directory: Path) -> Path:
    """Folder of iVeg's files: that of an SQLite history, or else the data directory."""
    database = sqlite_file(url)
    return data_directory if database is None else database.parent


def open_provider(settings: Settings) -> "OpenIdProvider | None":
    """Identity provider of the settings; None: there is none.

    Raises:
        MissingExtraError: its library is not installed.
    """
    if not settings.sso_issuer:
        return None
    client = Client(
        settings.sso_issuer,
        settings.sso_client_id,
        settings.sso_client_secret,
        settings.sso_scopes,
    )
    require_extra("sso", "IVEG_SSO_ISSUER")
    # Imported here: without the extra it would fail.
    from iveg.adapters.oidc import OpenIdProvider

    return OpenIdProvider(client)


def open_fiware(settings: Settings) -> tuple[OrionClient, IotAgentClient]:
    """Clients of Orion and the agent, with a shared token for a proxy, not connected.

    Both must be closed together: closing either also closes the token.
    """
    tenant = settings.fiware_service, settings.fiware_servicepath
    access = open_token(settings)
    return (
        OrionClient(settings.orion_url, *tenant, access),
        IotAgentClient(settings.iota_url, *tenant, access),
    )


def site_of(settings: Settings) -> FiwareSite:
    """Wanted state of FIWARE, from the settings."""
    robots = load_fleet(settings.fleet, settings.robots).ids
    return FiwareSite(
        robots,
        settings.apikey,
        settings.iota_cb_url or settings.orion_url,
        load_equipment(settings.equipment, robots),
        robots if settings.direct_read == "all" else (),
        settings.notify_address,
    )


def open_token(settings: Settings) -> FiwareToken | None:
    """Token for a proxy; None where the settings name no endpoint."""
    if not settings.fiware_token_url:
        return None
    grant = TokenGrant(
        settings.fiware_token_url,
        settings.fiware_client_id,
        settings.fiware_client_secret,
        settings.fiware_user,
        settings.fiware_password,
        settings.fiware_scope,
        settings.fiware_token_header,
    )
    return FiwareToken(grant, clock.mono, BoundedJson(HOP))
