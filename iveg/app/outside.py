"""Ports of the server to the world outside its process: network and disk."""

import logging
from pathlib import Path

from pydantic import TypeAdapter

from iveg.adapters import clock
from iveg.adapters.access_file import AccessFile
from iveg.adapters.bounded_json import BoundedJson
from iveg.adapters.equipment_files import load_equipment
from iveg.adapters.extras import require_extra
from iveg.adapters.files import FileByRobot
from iveg.adapters.fiware_http import HOP, FiwareToken, TokenGrant
from iveg.adapters.fleet_files import load_fleet
from iveg.adapters.history.engine import history_url, sqlite_file
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder, spilled_file
from iveg.adapters.identity_provider import Client, IdentityProvider
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.journal import FileJournal
from iveg.adapters.mqtt import BrokerAddress, MqttLink, TlsFiles
from iveg.adapters.orion import OrionClient
from iveg.adapters.reconciler import FiwareSite
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.rules import FileRules
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import OutOfService
from iveg.domain.words import WordAnswer
from iveg.settings import Settings
from iveg.vital.health_monitor import HopState
from iveg.vital.operators import Kept, KeptChoices

ACCOUNTS = "accounts.jsonl"
_log = logging.getLogger(__name__)
_OUT = TypeAdapter(tuple[str, OutOfService])
_WORD = TypeAdapter(tuple[str, WordAnswer])


class Stores:
    """Storage that outlives a restart: the history and the files beside it.

    A missing directory is created; nothing is connected yet.
    """

    def __init__(self, settings: Settings, data_directory: Path) -> None:
        url = history_url(settings.database_url, data_directory)
        self.directory = directory = files_of(url, data_directory)
        directory.mkdir(parents=True, exist_ok=True)
        if (revoked := directory / "revoked.jsonl").exists():
            says = "%s counts no more: set IVEG_REFUSED_ROBOTS, delete it"
            _log.warning(says, revoked)
        spilled = spilled_file(url, directory)
        self.journal = FileJournal(directory / "commands.jsonl", spilled)
        self.recorder, self.queries = Recorder(url, self.journal), Queries(url)
        self.rules = FileRules(directory / "rules.jsonl")
        self.detectors = FileByRobot(directory / "detectors.jsonl", "detectors", _OUT)
        self.words = FileByRobot(directory / "words.jsonl", "words", _WORD)
        self.access = AccessFile(directory / ACCOUNTS)
        self.inputs = InputRecorder(
            directory / "recordings", clock.now, settings.limits_of_recordings
        )

    def history_state(self) -> HopState:
        """State of the history."""
        return self.recorder.state(clock.now())

    def kept_choices(self, settings: Settings) -> KeptChoices:
        """Choices of earlier runs; the settings have the rule where there is none."""
        first = DetectionRule.of(settings.rule)
        return KeptChoices(
            self.rules.load(first, clock.now()),
            self.rules.append,
            Kept(self.detectors.load(), self.detectors.save),
            Kept(self.words.load(), self.words.save),
        )

    async def close(self) -> None:
        """Write what waits, and close files and database."""
        await self.inputs.close()
        await self.recorder.close()
        self.queries.close()
        self.journal.close()


class Outside:
    """Everything outside the process that the server needs.

    Attributes:
        link: Connection to the broker, still without readers.
        provider: Vouches for people; None: nobody does.
    """

    def __init__(self, settings: Settings, data_directory: Path) -> None:
        self.stores = Stores(settings, data_directory)
        broker = BrokerAddress.from_url(
            settings.mqtt_url,
            settings.mqtt_user,
            settings.mqtt_password,
            TlsFiles(settings.mqtt_ca, settings.mqtt_cert, settings.mqtt_key),
        )
        self.link = MqttLink(broker, "iveg")
        self.orion, self.agent = open_fiware(settings)
        self.provider = open_provider(settings)

    async def close(self) -> None:
        """Close all but the link, which ends with its task."""
        await self.stores.close()
        await self.orion.close()
        await self.agent.close()
        if self.provider is not None:
            await self.provider.close()


def files_of(url: str, data_directory: Path) -> Path:
    """Folder of the files beside a history: beside its own where that is one."""
    database = sqlite_file(url)
    return data_directory if database is None else database.parent


def open_provider(settings: Settings) -> IdentityProvider | None:
    """The identity provider that the settings name; None: none.

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
    # Only here: without the extra the module cannot be imported.
    from iveg.adapters.oidc import OpenIdProvider

    return OpenIdProvider(client)


def open_fiware(settings: Settings) -> tuple[OrionClient, IotAgentClient]:
    """Both, with one token where a proxy asks for it; nothing is connected yet.

    Who closes one of them closes the other, too.
    """
    tenant = settings.fiware_service, settings.fiware_servicepath
    access = open_token(settings)
    return (
        OrionClient(settings.orion_url, *tenant, access),
        IotAgentClient(settings.iota_url, *tenant, access),
    )


def site_of(settings: Settings) -> FiwareSite:
    """Facts of the settings that FIWARE should know."""
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
    """The token that a proxy asks for; None where the settings name no endpoint."""
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
