"""Every setting: its variable, its default, and the values that it may have.

Built once from an environment that is handed in; read by ``cli`` and ``app`` alone.
``docs/settings.md`` is generated from the table below.
"""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, Final, Literal, get_args, get_type_hints

from annotated_types import Interval
from pydantic import ConfigDict, TypeAdapter, ValidationError

from iveg.domain.accounts import DEFAULT_NAME
from iveg.domain.errors import SettingsError
from iveg.domain.limits import LIMITS
from iveg.domain.parameters import PARAMETERS, ByClass, Parameters
from iveg.domain.recordings import RecordingLimits
from iveg.domain.retention import Retention
from iveg.setting_types import (
    ApiKey,
    Broker,
    Database,
    Days,
    DirectRead,
    Gigabytes,
    Hex,
    Line,
    Name,
    Port,
    Robots,
    RoleMap,
    SafeUrl,
    Service,
    ServicePath,
    Switch,
    Token,
    Url,
    rule_value,
)

_QUIET: Final = ConfigDict(hide_input_in_errors=True)
"""Keeps a secret that cannot be used out of tracebacks."""
_SECRETS: Final = frozenset(
    {
        "IVEG_NOTIFY_TOKEN",
        "IVEG_API_TOKEN",
        "IVEG_SIGN_IN_TOKEN",
        "IVEG_MQTT_PASSWORD",
        "IVEG_FIWARE_CLIENT_SECRET",
        "IVEG_FIWARE_PASSWORD",
        "IVEG_SSO_CLIENT_SECRET",
    }
)


GONE: Final = frozenset(
    {
        "IVEG_BROKER_ACCESS_COMMAND",
        "IVEG_CALIBRATION",
        "IVEG_DRILL_DAYS",
        "IVEG_FOXGLOVE",
        "IVEG_NOTIFY_TOKEN_PREVIOUS",
        "IVEG_ORION_THROTTLE",
        "IVEG_RELEASE_PROOF_MINUTES",
        "IVEG_SSO_HOURS",
        "IVEG_SSO_PROVIDER",
        "IVEG_TRUTH",
        "IVEG_UPLINK",
    }
)
"""Settings of earlier versions; docs/upgrading.md names their successors."""


def setting(variable: str, default: Any, help_: str) -> Any:
    """One row of the table: a dataclass field with its variable."""
    return field(default=default, metadata={"variable": variable, "help": help_})


# --- the table ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Settings:
    """All settings of all parts."""

    host: str = setting("IVEG_HOST", "127.0.0.1", "Address of the page and API.")
    port: Port = setting("IVEG_PORT", 8000, "Port of the page and API.")
    mqtt_url: Broker = setting(
        "IVEG_MQTT_URL",
        "mqtt://127.0.0.1:1883",
        "MQTT broker; may carry user and password; `mqtts` for TLS.",
    )
    mqtt_user: str = setting("IVEG_MQTT_USER", "", "User at the broker.")
    mqtt_password: str = setting("IVEG_MQTT_PASSWORD", "", "Password at the broker.")
    mqtt_ca: str = setting(
        "IVEG_MQTT_CA",
        "",
        "File of certificates that are trusted with `mqtts`; empty: the system's.",
    )
    mqtt_cert: str = setting(
        "IVEG_MQTT_CERT",
        "",
        "File of the own certificate, by which the broker knows who comes. It and its "
        "key are read at each connection.",
    )
    mqtt_key: str = setting("IVEG_MQTT_KEY", "", "File of the key of `IVEG_MQTT_CERT`.")
    orion_url: Url = setting(
        "IVEG_ORION_URL", "http://127.0.0.1:1026", "Orion Context Broker, NGSI-v2."
    )
    iota_url: Url = setting(
        "IVEG_IOTA_URL", "http://127.0.0.1:4041", "North port of the IoT Agent JSON."
    )
    iota_cb_url: Url = setting(
        "IVEG_IOTA_CB_URL",
        "",
        "Orion as the IoT Agent reaches it; empty: `IVEG_ORION_URL`.",
    )
    notify_url: Url = setting(
        "IVEG_NOTIFY_URL",
        "",
        "Where Orion posts notifications; empty: this host and port, "
        "`/ngsi/notifications`.",
    )
    notify_token: Hex = setting(
        "IVEG_NOTIFY_TOKEN",
        "",
        "Secret that notifications must carry; empty: made at each start.",
    )
    fiware_service: Service = setting(
        "IVEG_FIWARE_SERVICE", "agroconnect", "Tenant at Orion and the agent."
    )
    fiware_servicepath: ServicePath = setting(
        "IVEG_FIWARE_SERVICEPATH", "/greenhouse", "Service path at Orion and the agent."
    )
    fiware_token_url: Url = setting(
        "IVEG_FIWARE_TOKEN_URL",
        "",
        "Token endpoint for a PEP proxy before Orion and the agent "
        "(docs/deployment.md); empty: none asks for a token.",
    )
    fiware_client_id: Line = setting(
        "IVEG_FIWARE_CLIENT_ID", "", "Name of this iVeg at the token endpoint."
    )
    fiware_client_secret: Line = setting(
        "IVEG_FIWARE_CLIENT_SECRET", "", "Its secret there."
    )
    fiware_user: Line = setting(
        "IVEG_FIWARE_USER",
        "",
        "User for whom iVeg gets a token (password grant); empty: for itself (client "
        "credentials).",
    )
    fiware_password: Line = setting(
        "IVEG_FIWARE_PASSWORD", "", "Password of that user."
    )
    fiware_scope: Line = setting(
        "IVEG_FIWARE_SCOPE", "", "Scope that is asked for; empty: none."
    )
    fiware_token_header: Literal["Authorization", "X-Auth-Token"] = setting(
        "IVEG_FIWARE_TOKEN_HEADER",
        "Authorization",
        "Header that carries it: `Authorization` (`Bearer …`) or `X-Auth-Token`.",
    )
    apikey: ApiKey = setting(
        "IVEG_APIKEY", "iveg", "First part of every measure topic."
    )
    fleet: str = setting(
        "IVEG_FLEET",
        "",
        "File that says what each robot is (docs/robots.md); empty: iVeg's own, which "
        "describes AGI and AGII.",
    )
    robots: Robots = setting(
        "IVEG_ROBOTS",
        (),
        "Who is in the fleet, such as `AGI,AGII`; `D1:recording` for a robot that "
        "`iveg replay` plays. Empty: every robot of `IVEG_FLEET`.",
    )
    refused_robots: Robots = setting(
        "IVEG_REFUSED_ROBOTS",
        (),
        "Robots of the fleet that are not heard, such as `AGI`: lost, sold, or with a "
        "password in wrong hands. STOP still goes to them.",
    )
    database_url: Database = setting(
        "IVEG_DATABASE_URL",
        "",
        "History; empty: an SQLite file in the user's data directory.",
    )
    data_directory: str = setting(
        "IVEG_DATA_DIRECTORY",
        "",
        "Where the database and the journals live; empty: the user's data directory.",
    )
    api_token: Token = setting(
        "IVEG_API_TOKEN",
        "",
        "One bearer token for programs: read and STOP; empty: none.",
    )
    sign_in_token: Hex = setting(
        "IVEG_SIGN_IN_TOKEN",
        "",
        "Token of the link that signs a browser in; empty: made at each start.",
    )
    sign_in: Literal["link", "accounts"] = setting(
        "IVEG_SIGN_IN",
        "link",
        "How people sign in: by the one `link` or a password, or by passwords alone "
        "(`accounts`), see `iveg user`.",
    )
    sign_in_name: Name = setting(
        "IVEG_SIGN_IN_NAME",
        DEFAULT_NAME,
        "Name of the person who signs in by the link, in all their acts.",
    )
    sso_issuer: SafeUrl = setting(
        "IVEG_SSO_ISSUER",
        "",
        "Identity provider at which people may sign in, by its address (`issuer`) to "
        "the last slash; empty: none (docs/deployment.md).",
    )
    sso_client_id: Line = setting(
        "IVEG_SSO_CLIENT_ID", "", "Name of this iVeg at the provider."
    )
    sso_client_secret: Line = setting(
        "IVEG_SSO_CLIENT_SECRET",
        "",
        "Secret of this iVeg at the provider; empty: a public client.",
    )
    sso_scopes: Line = setting(
        "IVEG_SSO_SCOPES", "openid profile", "What is asked of the provider."
    )
    sso_role_claim: Line = setting(
        "IVEG_SSO_ROLE_CLAIM",
        "roles",
        "Claim that holds a person's roles: a path such as `realm_access.roles`, "
        "`groups` or `roles[].name`.",
    )
    sso_roles: RoleMap = setting(
        "IVEG_SSO_ROLES",
        (),
        "What its values give here, such as `growers=operator,owners=admin`; the "
        "highest counts, and nobody comes in without one.",
    )
    sso_name_claim: Line = setting(
        "IVEG_SSO_NAME_CLAIM", "name", "Claim that holds a person's name."
    )
    sso_label: Line = setting(
        "IVEG_SSO_LABEL", "", "What the button says; empty: Single sign-on."
    )
    rule: Parameters = field(default_factory=Parameters)
    stop_direct: Switch = setting(
        "IVEG_STOP_DIRECT", True, "STOP, RELEASE and RESUME also straight over MQTT."
    )
    direct_read: DirectRead = setting(
        "IVEG_DIRECT_READ",
        "all",
        "What iVeg reads straight from MQTT as well as through FIWARE: `all` that "
        "robots send, `safety` (detections, safety reports and answers), or nothing "
        "(`off`); `on` means `all`.",
    )
    feedback_slow_s: Annotated[float, Interval(ge=0.1, le=10.0)] = setting(
        "IVEG_FEEDBACK_SLOW_S",
        LIMITS.feedback_slow_s,
        "Age of feedback at which a robot halves its speed (s).",
    )
    feedback_stand_s: Annotated[float, Interval(ge=0.2, le=60.0)] = setting(
        "IVEG_FEEDBACK_STAND_S",
        LIMITS.feedback_stand_s,
        "Age of feedback at which a robot stands (s).",
    )
    on_link_loss: Literal["stop", "slow"] = setting(
        "IVEG_ON_LINK_LOSS",
        "stop",
        "What a robot (`iveg robot`, emulated ones) does when feedback is older than "
        "`IVEG_FEEDBACK_STAND_S`: `stop`, or `slow`, which goes on at half speed while "
        "nobody supervises it.",
    )
    keep_positions_days: Days = setting(
        "IVEG_KEEP_POSITIONS_DAYS",
        Retention.positions,
        "Places of people in detections, decisions and log; the rows stay without them "
        "(days; 0: for ever).",
    )
    keep_telemetry_days: Days = setting(
        "IVEG_KEEP_TELEMETRY_DAYS",
        Retention.telemetry,
        "Odometry, detections, climate and readings of sensors (days; 0: for ever).",
    )
    keep_decisions_days: Days = setting(
        "IVEG_KEEP_DECISIONS_DAYS",
        Retention.decisions,
        "Decisions, commands, alerts and log (days; 0: for ever).",
    )
    keep_audit_days: Days = setting(
        "IVEG_KEEP_AUDIT_DAYS",
        Retention.audit,
        "The audit and the steps of orders (days; 0: for ever).",
    )
    recordings: Switch = setting(
        "IVEG_RECORDINGS",
        True,
        "Keep what comes in, byte for byte, and pictures of what pages are sent, while "
        "20 GB of the disk are free (docs/interfaces/recordings.md).",
    )
    keep_recordings_days: Days = setting(
        "IVEG_KEEP_RECORDINGS_DAYS",
        7,
        "Recordings of either sort (days with one; 0: for ever).",
    )
    keep_recordings_gb: Gigabytes = setting(
        "IVEG_KEEP_RECORDINGS_GB",
        6,
        "Recordings of what came in (10^9 bytes of all of them; 0: any).",
    )
    keep_pictures_gb: Gigabytes = setting(
        "IVEG_KEEP_PICTURES_GB",
        4,
        "Pictures of the past (the same).",
    )
    greenhouse: str = setting(
        "IVEG_GREENHOUSE",
        "mvsim-20x20",
        "`mvsim-20x20`, `agroconnect`, `none` (open field), or a file.",
    )
    messages: str = setting(
        "IVEG_MESSAGES_FILE",
        "",
        "File of addresses outside the page that receive alerts "
        '(docs/deployment.md, "Messages"); empty: none.',
    )
    equipment: str = setting(
        "IVEG_EQUIPMENT", "", "File of docs/equipment.md, or `demo`; empty: none."
    )

    @classmethod
    def from_environment(cls, environment: Mapping[str, str]) -> "Settings":
        """Read the settings that an environment holds; the rest keep their defaults.

        Raises:
            SettingsError: a value that cannot be used.
        """
        values, rule = dict[str, Any](), dict[str, Any]()
        for row in _rows():
            text = environment.get(row.variable, "")
            # Compose files pass on unset variables as empty ones.
            if text:
                into = rule if row.is_of_rule else values
                into[row.name] = _read(row, text)
        settings = cls(rule=Parameters(**rule), **values)
        settings._check_together()
        return settings

    def _check_together(self) -> None:
        """Raise SettingsError where two settings contradict each other."""
        # 0 days means for ever, which is longer than any number of days.
        kept_days, forever = self.retention, math.inf
        decisions = kept_days.decisions or forever
        for is_so, variable, value, allowed in (
            (
                # A robot that stood first would never slow down on the way there.
                self.feedback_stand_s > self.feedback_slow_s,
                "IVEG_FEEDBACK_STAND_S",
                f"{self.feedback_stand_s:g}",
                "more than IVEG_FEEDBACK_SLOW_S",
            ),
            (
                (kept_days.positions or forever) <= decisions,
                "IVEG_KEEP_POSITIONS_DAYS",
                str(kept_days.positions),
                "no longer than IVEG_KEEP_DECISIONS_DAYS",
            ),
            (
                # Steps of orders belong to commands, which are kept as decisions are.
                (kept_days.audit or forever) >= decisions,
                "IVEG_KEEP_AUDIT_DAYS",
                str(kept_days.audit),
                "no shorter than IVEG_KEEP_DECISIONS_DAYS",
            ),
            (
                self.fiware_client_id or not self.fiware_token_url,
                "IVEG_FIWARE_CLIENT_ID",
                "",
                "set where IVEG_FIWARE_TOKEN_URL is",
            ),
            (
                self.sso_client_id or not self.sso_issuer,
                "IVEG_SSO_CLIENT_ID",
                "",
                "set where IVEG_SSO_ISSUER is",
            ),
            (
                self.sso_roles or not self.sso_issuer,
                "IVEG_SSO_ROLES",
                "",
                "set where IVEG_SSO_ISSUER is",
            ),
        ):
            if not is_so:
                raise SettingsError(variable, value, allowed)

    @property
    def limits_of_recordings(self) -> tuple[RecordingLimits, RecordingLimits]:
        """Limits of the two kinds of recordings: inputs, and pictures."""
        days = self.keep_recordings_days
        return (
            RecordingLimits(days, self.keep_recordings_gb * 10**9),
            RecordingLimits(days, self.keep_pictures_gb * 10**9),
        )

    @property
    def retention(self) -> Retention:
        """Time that the history keeps rows of each kind."""
        return Retention(
            self.keep_positions_days,
            self.keep_telemetry_days,
            self.keep_decisions_days,
            self.keep_audit_days,
        )

    @property
    def notify_address(self) -> str:
        """URL to which Orion posts notifications."""
        return self.notify_url or f"http://{self.host}:{self.port}/ngsi/notifications"

    def without_secrets(self) -> dict[str, str]:
        """Settings by variable, with secrets and logins hidden."""
        values = self.to_environment()
        public_values = {name: _without_login(text) for name, text in values.items()}
        hidden = {name: "(hidden)" for name in _SECRETS if values[name]}
        return {**public_values, **hidden}

    def to_environment(self) -> dict[str, str]:
        """The environment that gives the same settings to a child process."""
        return {
            row.variable: _write(
                getattr(self.rule if row.is_of_rule else self, row.name)
            )
            for row in _rows()
        }


@dataclass(frozen=True, slots=True)
class _Row:
    """One setting.

    Attributes:
        hint: Type, with a check of the value and the check in words.
        is_of_rule: A parameter of the rule (``domain/parameters.py``).
    """

    variable: str
    name: str
    hint: Any
    default: object
    help: str
    is_of_rule: bool = False


def _rows() -> Iterator[_Row]:
    """Every setting; the parameters of the rule take the place of its field."""
    hints = get_type_hints(Settings, include_extras=True)
    for field_ in fields(Settings):
        if field_.name == "rule":
            for row in PARAMETERS:
                type_, default = rule_value(row), row.default
                yield _Row(row.variable, row.name, type_, default, row.says, True)
        else:
            name, about = field_.name, field_.metadata
            yield _Row(
                about["variable"], name, hints[name], field_.default, about["help"]
            )


def _read(row: _Row, text: str) -> Any:
    try:
        return TypeAdapter(row.hint, config=_QUIET).validate_python(text)
    except ValidationError as error:
        public_value = "(hidden)" if row.variable in _SECRETS else _without_login(text)
        raise SettingsError(row.variable, public_value, _allowed(row.hint)) from error


def _allowed(hint: Any) -> str:
    """Allowed values in words, from the annotation of the type."""
    rule = getattr(hint, "__metadata__", ("",))[-1]
    if isinstance(rule, Interval):
        return f"a number from {rule.ge:g} to {rule.le:g}"
    return rule or "one of " + ", ".join(get_args(hint))


def _without_login(text: str) -> str:
    """An address without user and password, for a sentence that is shown."""
    return re.sub(r"//[^/]*@", "//(hidden)@", text)


def _write(value: object) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, tuple):
        return ",".join(x if isinstance(x, str) else "=".join(x) for x in value)
    if isinstance(value, ByClass):
        by_class = (f"{class_}={number}" for class_, number in value.by_class.items())
        return ",".join((str(value.every), *by_class))
    return str(value)


def default_data_directory(environment: Mapping[str, str], home: Path) -> Path:
    """The user's data directory for iVeg (XDG base directory specification)."""
    base = environment.get("XDG_DATA_HOME") or home / ".local" / "share"
    return Path(base) / "iveg"


def describe() -> str:
    """``docs/settings.md``, generated from the table."""
    lines = [
        "# Settings",
        "",
        "All by environment; an empty value means the default. A bad value stops "
        "the start with one sentence that names the setting, the value and what is "
        "allowed.",
        "This page is generated: `python -m iveg settings > docs/settings.md`.",
        "",
    ]
    for row in _rows():
        default = _write(row.default) or "(empty)"
        lines += [f"## `{row.variable}`", "", f"{row.help} Default: `{default}`.", ""]
    return "\n".join(lines)
