"""Every setting, its variable, its default and what it may be.

Built once from an environment that is handed in; read by ``cli`` and ``app`` alone.
``docs/settings.md`` is generated from the table below.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as _field
from pathlib import Path
from typing import Any, Literal
from urllib.parse import urlsplit

from iveg.domain.errors import SettingsError
from iveg.domain.fleet import split_word
from iveg.domain.limits import LIMITS


class _NotAllowedError(Exception):
    """Says what a value must be."""


def setting(variable: str, read: Callable[[str], Any], default: Any, help_: str) -> Any:
    """One row of the table: a dataclass field with its variable and its reader."""
    metadata = {"variable": variable, "read": read, "help": help_}
    return _field(default=default, metadata=metadata)


def _text(value: str) -> str:
    return value


def _matching(pattern: str, allowed: str) -> Callable[[str], str]:
    def read(value: str) -> str:
        if re.fullmatch(pattern, value) is None:
            raise _NotAllowedError(allowed)
        return value

    return read


def _number(least: float, most: float) -> Callable[[str], float]:
    def read(value: str) -> float:
        try:
            number = float(value)
        except ValueError:
            number = float("nan")
        if not least <= number <= most:
            raise _NotAllowedError(f"a number from {least:g} to {most:g}")
        return number

    return read


def _port(value: str) -> int:
    if not value.isascii() or not value.isdigit() or not 1 <= int(value) <= 65535:
        raise _NotAllowedError("a port from 1 to 65535")
    return int(value)


def _switch(value: str) -> bool:
    if value.lower() not in ("on", "off"):
        raise _NotAllowedError("on or off")
    return value.lower() == "on"


def _direct_read(value: str) -> str:
    choice = {"on": "all"}.get(value.lower(), value.lower())
    if choice not in ("all", "safety", "off"):
        raise _NotAllowedError("one of all, safety, off, or on, which means all")
    return choice


def _choice(*choices: str) -> Callable[[str], str]:
    def read(value: str) -> str:
        if value not in choices:
            raise _NotAllowedError("one of " + ", ".join(choices))
        return value

    return read


def _url(*schemes: str) -> Callable[[str], str]:
    def read(value: str) -> str:
        try:
            parts = urlsplit(value)
            usable = parts.scheme in schemes and bool(parts.hostname)
            usable = usable and (parts.port is None or parts.port > 0)
        except ValueError:
            usable = False
        if not usable:
            raise _NotAllowedError(f"an address such as {schemes[0]}://host:port")
        return value.rstrip("/")

    return read


def _robots(value: str) -> tuple[str, ...]:
    words = tuple(word.strip() for word in value.split(","))
    names = {read[0] for word in words if (read := split_word(word)) is not None}
    if len(names) != len(words):
        raise _NotAllowedError(
            "different names of letters, digits and hyphens, separated by commas, "
            "each with :recording behind it where a replay plays that robot"
        )
    return words


_SECRETS = frozenset(
    {"IVEG_NOTIFY_TOKEN", "IVEG_API_TOKEN", "IVEG_SIGN_IN_TOKEN", "IVEG_MQTT_PASSWORD"}
)
_HEX = _matching(r"[0-9a-fA-F]{32,128}", "32 to 128 hexadecimal digits")


@dataclass(frozen=True, slots=True)
class Settings:
    """All settings of all parts."""

    host: str = setting("IVEG_HOST", _text, "127.0.0.1", "Address of the page and API.")
    port: int = setting("IVEG_PORT", _port, 8000, "Port of the page and API.")
    mqtt_url: str = setting(
        "IVEG_MQTT_URL",
        _url("mqtt", "mqtts"),
        "mqtt://127.0.0.1:1883",
        "MQTT broker; may carry user and password; `mqtts` for TLS.",
    )
    mqtt_user: str = setting("IVEG_MQTT_USER", _text, "", "User at the broker.")
    mqtt_password: str = setting(
        "IVEG_MQTT_PASSWORD", _text, "", "Password at the broker."
    )
    orion_url: str = setting(
        "IVEG_ORION_URL",
        _url("http", "https"),
        "http://127.0.0.1:1026",
        "Orion Context Broker, NGSI-v2.",
    )
    iota_url: str = setting(
        "IVEG_IOTA_URL",
        _url("http", "https"),
        "http://127.0.0.1:4041",
        "North port of the IoT Agent JSON.",
    )
    iota_cb_url: str = setting(
        "IVEG_IOTA_CB_URL",
        _url("http", "https"),
        "",
        "Orion as the IoT Agent reaches it; empty: `IVEG_ORION_URL`.",
    )
    notify_url: str = setting(
        "IVEG_NOTIFY_URL",
        _url("http", "https"),
        "",
        "Where Orion posts notifications; empty: this host and port, "
        "`/ngsi/notifications`.",
    )
    notify_token: str = setting(
        "IVEG_NOTIFY_TOKEN",
        _HEX,
        "",
        "Secret that notifications must carry; empty: made at each start.",
    )
    fiware_service: str = setting(
        "IVEG_FIWARE_SERVICE",
        _matching(r"[a-z0-9_]{1,50}", "1 to 50 of a-z, 0-9 and _"),
        "agroconnect",
        "Tenant at Orion and the agent.",
    )
    fiware_servicepath: str = setting(
        "IVEG_FIWARE_SERVICEPATH",
        _matching(r"(/[A-Za-z0-9_]{1,50}){1,10}", "a path such as /greenhouse"),
        "/greenhouse",
        "Service path at Orion and the agent.",
    )
    apikey: str = setting(
        "IVEG_APIKEY",
        _matching(r"[A-Za-z0-9_-]{1,64}", "1 to 64 letters, digits, _ and -"),
        "iveg",
        "First part of every measure topic.",
    )
    fleet: str = setting(
        "IVEG_FLEET",
        _text,
        "",
        "File that says what each robot is (docs/robots.md); empty: iVeg's own, which "
        "describes AGI and AGII.",
    )
    robots: tuple[str, ...] = setting(
        "IVEG_ROBOTS",
        _robots,
        (),
        "Who is in the fleet, such as `AGI,AGII`; `D1:recording` for a robot that "
        "`iveg replay` plays. Empty: every robot of `IVEG_FLEET`.",
    )
    database_url: str = setting(
        "IVEG_DATABASE_URL",
        _matching(r"(sqlite|postgresql)(\+\w+)?://.*", "an SQLAlchemy address"),
        "",
        "History; empty: an SQLite file in the user's data directory.",
    )
    data_directory: str = setting(
        "IVEG_DATA_DIRECTORY",
        _text,
        "",
        "Where the database and the journals live; empty: the user's data directory.",
    )
    api_token: str = setting(
        "IVEG_API_TOKEN",
        _matching(r"[\x21-\x7e]{16,256}", "16 to 256 visible characters"),
        "",
        "One bearer token for programs: read and STOP; empty: none.",
    )
    sign_in_token: str = setting(
        "IVEG_SIGN_IN_TOKEN",
        _HEX,
        "",
        "Token of the link that signs a browser in; empty: made at each start.",
    )
    confidence_threshold: float = setting(
        "IVEG_CONFIDENCE_THRESHOLD",
        _number(0.0, 1.0),
        LIMITS.detection_threshold,
        "Least confidence that raises an alert, inclusive.",
    )
    safety_radius_m: float = setting(
        "IVEG_SAFETY_RADIUS_M",
        _number(LIMITS.ring_least_m, LIMITS.ring_most_m),
        LIMITS.ring_default_m,
        "Ring round a person or peer, inclusive (m).",
    )
    stop_direct: bool = setting(
        "IVEG_STOP_DIRECT",
        _switch,
        True,
        "STOP, RELEASE and RESUME also straight over MQTT.",
    )
    orion_throttle: bool = setting(
        "IVEG_ORION_THROTTLE",
        _switch,
        True,
        "Orion leaves out copies of odometry and scans while they come straight; `off` "
        "measures every message at every hop, as `iveg experiment` does.",
    )
    direct_read: Literal["all", "safety", "off"] = setting(
        "IVEG_DIRECT_READ",
        _direct_read,
        "all",
        "What iVeg reads straight from MQTT as well as through FIWARE: `all` that "
        "robots send, `safety` (detections, safety reports and answers), or nothing "
        "(`off`); `on` means `all`.",
    )
    feedback_slow_s: float = setting(
        "IVEG_FEEDBACK_SLOW_S",
        _number(0.1, 10.0),
        LIMITS.feedback_slow_s,
        "Age of feedback at which a robot halves its speed (s).",
    )
    feedback_stand_s: float = setting(
        "IVEG_FEEDBACK_STAND_S",
        _number(0.2, 60.0),
        LIMITS.feedback_stand_s,
        "Age of feedback at which a robot stands (s).",
    )
    drill_days: float = setting(
        "IVEG_DRILL_DAYS",
        _number(0.0, 3650.0),
        30.0,
        "Remind of a STOP drill when a robot's last one is older than this (days); "
        "0: never. A robot that was never drilled is not reminded of.",
    )
    uplink: Literal["per-topic", "single"] = setting(
        "IVEG_UPLINK",
        _choice("per-topic", "single"),
        "per-topic",
        "How emulated robots send: one message a topic, or one a robot.",
    )
    greenhouse: str = setting(
        "IVEG_GREENHOUSE",
        _text,
        "mvsim-20x20",
        "`mvsim-20x20`, `agroconnect`, `none` (open field), or a file.",
    )

    @classmethod
    def from_environment(cls, environment: Mapping[str, str]) -> "Settings":
        """Read the settings that an environment holds; the rest keep their defaults.

        Raises:
            SettingsError: a value that cannot be used.
        """
        values = {}
        for name, row in cls.__dataclass_fields__.items():
            text = environment.get(row.metadata["variable"])
            if text is None or text == "":
                continue
            try:
                values[name] = row.metadata["read"](text)
            except _NotAllowedError as error:
                variable = row.metadata["variable"]
                shown = "(hidden)" if variable in _SECRETS else _without_login(text)
                raise SettingsError(variable, shown, str(error)) from error
        settings = cls(**values)
        if settings.feedback_stand_s <= settings.feedback_slow_s:
            raise SettingsError(
                "IVEG_FEEDBACK_STAND_S",
                f"{settings.feedback_stand_s:g}",
                "more than IVEG_FEEDBACK_SLOW_S",
            )
        return settings

    def to_environment(self) -> dict[str, str]:
        """The environment that gives the same settings to a child process."""
        return {
            row.metadata["variable"]: _write(getattr(self, name))
            for name, row in self.__dataclass_fields__.items()
        }


def _without_login(text: str) -> str:
    """An address without user and password, for a sentence that is shown."""
    return re.sub(r"//[^/]*@", "//(hidden)@", text)


def _write(value: Any) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, tuple):
        return ",".join(value)
    return str(value)


def default_data_directory(environment: Mapping[str, str], home: Path) -> Path:
    """The user's data directory for iVeg (XDG base directory specification)."""
    base = environment.get("XDG_DATA_HOME", "")
    return (Path(base) if base else home / ".local" / "share") / "iveg"


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
    for row in Settings.__dataclass_fields__.values():
        default = _write(row.default) or "(empty)"
        lines += [
            f"## `{row.metadata['variable']}`",
            "",
            f"{row.metadata['help']} Default: `{default}`.",
            "",
        ]
    return "\n".join(lines)
