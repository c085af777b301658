"""Ports of the server to the world outside its process: network and disk."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter

from iveg.adapters import clock
from iveg.adapters.broker_access import BrokerAccessCommand
from iveg.adapters.broker_address import BrokerAddress
from iveg.adapters.by_robot import FileByRobot
from iveg.adapters.contacts import FileContacts
from iveg.adapters.history.accounts import AccountStore
from iveg.adapters.history.api_tokens import ApiTokenStore
from iveg.adapters.history.engine import history_url, sqlite_file
from iveg.adapters.history.passkeys import PasskeyStore
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder, journal_file
from iveg.adapters.history.upkeep import RecordedHistory
from iveg.adapters.identity_provider import IdentityProvider
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.journal import FileJournal
from iveg.adapters.mail import MailSender, Write
from iveg.adapters.mqtt import MqttLink
from iveg.adapters.orion import OrionClient
from iveg.adapters.outbound import OutboundHttp
from iveg.adapters.recordings.live_feed import PART as FOXGLOVE
from iveg.adapters.recordings.live_feed import DoorSetup, LiveFeed
from iveg.adapters.recordings.recorder import PART as RECORDINGS
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.recordings.writer import WriterSetup
from iveg.adapters.rules import FileRules
from iveg.adapters.sessions import FileSessions
from iveg.adapters.tls import TlsFiles
from iveg.adapters.trials import FileTrials
from iveg.adapters.web_push import PushSender
from iveg.adapters.webhook import WebhookSender
from iveg.app.fiware import open_fiware
from iveg.app.sign_on import open_provider
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import OutOfService
from iveg.domain.fleet import FleetDescription
from iveg.domain.messages import Channel
from iveg.domain.revocation import Revocation
from iveg.pipeline.health_monitor import HopState
from iveg.pipeline.loop import reading_apart_s
from iveg.pipeline.ports import MessageSender
from iveg.pipeline.services import KeptChoices
from iveg.settings import Settings

_OUT = TypeAdapter(tuple[str, OutOfService])
_REVOKED = TypeAdapter(tuple[str, Revocation])


@dataclass(frozen=True, slots=True)
class Stores:
    """Storage that outlives a restart: the history and the files beside it.

    Attributes:
        directory: Of the files: beside the database where that is a file.
    """

    directory: Path
    recorder: Recorder
    queries: Queries
    journal: FileJournal
    rules: FileRules
    contacts: FileContacts
    detectors: FileByRobot[OutOfService]
    trials: FileTrials
    revocations: FileByRobot[Revocation]
    sessions: FileSessions
    accounts: AccountStore
    api_tokens: ApiTokenStore
    passkeys: PasskeyStore
    inputs: InputRecorder
    live: LiveFeed | None

    def history_state(self) -> HopState:
        """State of the history."""
        return self.recorder.health(clock.now()).state

    def retained(self) -> RecordedHistory:
        """The history as its upkeep sees it."""
        return RecordedHistory(
            self.recorder,
            self.queries,
            self.directory,
            drop_recording=self.inputs.drop_oldest,
        )

    def comfort(self) -> dict[str, Callable[[], Awaitable[None]]]:
        """Parts that take in what comes, by name."""
        live = {} if self.live is None else {FOXGLOVE: self.live.run}
        return {RECORDINGS: self.inputs.run, **live}

    def kept_choices(self, settings: Settings) -> KeptChoices:
        """Choices of earlier runs; the settings have the rule where there is none."""
        first = DetectionRule(
            threshold=settings.confidence_threshold, radius_m=settings.safety_radius_m
        )
        return KeptChoices(
            self.rules,
            self.contacts,
            self.detectors,
            self.trials,
            self.revocations,
            BrokerAccessCommand(settings.broker_access_command),
            self.rules.load(first, clock.now()),
            self.contacts.load(),
            self.detectors.load(),
            self.trials.load(),
            self.revocations.load(),
        )

    async def close(self) -> None:
        """Write what waits, and close files and database."""
        await self.inputs.close()
        await self.recorder.close()
        self.queries.close()
        self.journal.close()
        self.sessions.close()
        self.accounts.close()
        self.api_tokens.close()
        self.passkeys.close()


@dataclass(frozen=True, slots=True)
class Outside:
    """Everything outside the process that the server needs.

    Attributes:
        link: Connection to the broker, still without readers.
        outbound: HTTP to addresses that a person has typed.
        provider: Vouches for people; None: nobody does.
    """

    stores: Stores
    link: MqttLink
    orion: OrionClient
    agent: IotAgentClient
    outbound: OutboundHttp
    provider: IdentityProvider | None = None

    def senders(self, write: Write) -> dict[Channel, MessageSender]:
        """The channels of messages to people."""
        return {
            "push": PushSender(self.outbound, write),
            "email": MailSender(self.outbound, write),
            "webhook": WebhookSender(self.outbound),
        }

    async def close(self) -> None:
        """Close all but the link, which ends with its task."""
        await self.stores.close()
        await self.orion.close()
        await self.agent.close()
        self.outbound.close()
        if self.provider is not None:
            await self.provider.close()


def open_outside(
    settings: Settings, data_directory: Path, fleet: FleetDescription
) -> Outside:
    """Open the ports that the settings name; nothing is connected yet."""
    orion, agent = open_fiware(settings)
    broker = BrokerAddress.from_url(
        settings.mqtt_url,
        settings.mqtt_user,
        settings.mqtt_password,
        TlsFiles(settings.mqtt_ca, settings.mqtt_cert, settings.mqtt_key),
    )
    return Outside(
        open_stores(settings, data_directory, fleet),
        MqttLink(broker, "iveg", apart_s=reading_apart_s(len(fleet.ids))),
        orion,
        agent,
        OutboundHttp(),
        open_provider(settings),
    )


def open_stores(
    settings: Settings, data_directory: Path, fleet: FleetDescription
) -> Stores:
    """Open the stores; a missing directory is created."""
    url = history_url(settings.database_url, data_directory)
    database = sqlite_file(url)
    directory = data_directory if database is None else database.parent
    directory.mkdir(parents=True, exist_ok=True)
    door = DoorSetup(settings.foxglove, settings.apikey, fleet.ids)
    live = LiveFeed(door) if settings.foxglove else None
    return Stores(
        directory,
        Recorder(url, journal_file(url, directory)),
        Queries(url),
        FileJournal(directory / "commands.jsonl"),
        FileRules(directory / "rules.jsonl"),
        FileContacts(directory / "contacts.jsonl"),
        FileByRobot(directory / "detectors.jsonl", "detectors", _OUT),
        FileTrials(directory / "trial.jsonl"),
        FileByRobot(directory / "revoked.jsonl", "revoked", _REVOKED),
        FileSessions(directory / "sessions.jsonl"),
        AccountStore(url),
        ApiTokenStore(url),
        PasskeyStore(url),
        InputRecorder(
            WriterSetup(
                (directory / "recordings").resolve(),
                settings.recording_limits,
                settings.apikey,
                fleet.ids,
            ),
            clock.now,
            is_on=settings.recordings,
            live=live,
        ),
        live,
    )
