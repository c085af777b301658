"""Types of settings: each a check of the value, followed by the check in words."""

from ipaddress import ip_address
from typing import Annotated, Any, Literal
from urllib.parse import urlsplit

from annotated_types import Interval
from pydantic import AfterValidator, BeforeValidator, StringConstraints

from iveg.domain.accounts import DEFAULT_NAME, PersonRole, is_name, is_reserved
from iveg.domain.fleet import split_word
from iveg.domain.parameters import CLASSES, ByClass, Parameter


def _address(*schemes: str) -> AfterValidator:
    def read(value: str) -> str:
        parts = urlsplit(value)
        if parts.scheme not in schemes or not parts.hostname or parts.port == 0:
            raise ValueError(value)
        # Paths are joined to it with a slash of their own.
        return value.rstrip("/")

    return AfterValidator(read)


def is_safe_address(url: str) -> bool:
    """Whether secrets may go to an address: https, or this very machine."""
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        return False
    if not host or port == 0 or parts.username is not None or parts.fragment:
        return False
    # Letters that look alike could lead a secret to another host.
    if not url.isascii() or not url.isprintable() or " " in url:
        return False
    return parts.scheme == "https" or (parts.scheme == "http" and is_loopback(host))


def is_loopback(host: str) -> bool:
    """Whether a host names this machine; names are not resolved."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _read_safe_address(url: str) -> str:
    # Not trimmed: an issuer is compared to the last slash.
    if not is_safe_address(url):
        raise ValueError(url)
    return url


def _split_roles(text: str) -> tuple[tuple[str, str], ...]:
    # The last equals sign: a value such as a group's name may hold some itself.
    rows = [row.rpartition("=") for row in text.split(",")]
    roles = {value.strip(): role.strip() for value, _, role in rows}
    # A value that gives two roles would leave it open which of them counts.
    if len(roles) < len(rows) or "" in roles:
        raise ValueError(text)
    return tuple(roles.items())


def _read_robots(text: str) -> tuple[str, ...]:
    words = tuple(word.strip() for word in text.split(","))
    names = {read[0] for word in words if (read := split_word(word)) is not None}
    if len(names) != len(words):
        raise ValueError(text)
    return words


def _read_name(text: str) -> str:
    if not is_name(text) or (is_reserved(text) and text != DEFAULT_NAME):
        raise ValueError(text)
    return text


Port = Annotated[int, Interval(ge=1, le=65535), "a port from 1 to 65535"]
Switch = Annotated[
    bool,
    BeforeValidator(lambda text: {"on": True, "off": False}.get(text.lower())),
    "on or off",
]
Broker = Annotated[
    str, _address("mqtt", "mqtts"), "an address such as mqtt://host:port"
]
Url = Annotated[str, _address("http", "https"), "an address such as http://host:port"]
SafeUrl = Annotated[
    str,
    AfterValidator(_read_safe_address),
    "an https address, or one of this machine",
]
RoleMap = Annotated[
    tuple[tuple[str, PersonRole], ...],
    BeforeValidator(_split_roles),
    "values of the claim and roles, such as growers=operator,owners=admin",
]
Line = Annotated[
    str,
    StringConstraints(pattern=r"^[^\x00-\x1f\x7f]{1,256}$"),
    "1 to 256 characters on one line",
]
Hex = Annotated[
    str,
    StringConstraints(pattern="^[0-9a-fA-F]{32,128}$"),
    "32 to 128 hexadecimal digits",
]
Name = Annotated[
    str,
    AfterValidator(_read_name),
    "1 to 64 visible characters, none of < > \" ' = ; ( )",
]
Service = Annotated[
    str, StringConstraints(pattern="^[a-z0-9_]{1,50}$"), "1 to 50 of a-z, 0-9 and _"
]
ServicePath = Annotated[
    str,
    StringConstraints(pattern="^(/[A-Za-z0-9_]{1,50}){1,10}$"),
    "a path such as /greenhouse",
]
ApiKey = Annotated[
    str,
    StringConstraints(pattern="^[A-Za-z0-9_-]{1,64}$"),
    "1 to 64 letters, digits, _ and -",
]
Token = Annotated[
    str,
    StringConstraints(pattern=r"^[\x21-\x7e]{16,256}$"),
    "16 to 256 visible characters",
]
Database = Annotated[
    str,
    StringConstraints(pattern=r"^(sqlite|postgresql)(\+\w+)?://.*$"),
    "an SQLAlchemy address",
]
Robots = Annotated[
    tuple[str, ...],
    BeforeValidator(_read_robots),
    "different names of letters, digits and hyphens, separated by commas, each with "
    ":recording behind it where a replay plays that robot",
]
DirectRead = Annotated[
    Literal["all", "safety", "off"],
    BeforeValidator(lambda text: {"on": "all"}.get(text.lower(), text.lower())),
    "one of all, safety, off, or on, which means all",
]
Days = Annotated[
    int, Interval(ge=0, le=36500), "a number of whole days from 0, for ever, to 36500"
]
Gigabytes = Annotated[
    int, Interval(ge=0, le=10**6), "a whole number of gigabytes from 0, any, to 10^6"
]


def rule_value(row: Parameter) -> Any:
    """Type of the setting of a parameter of the rule."""
    if row.unit == "switch":
        return Switch
    if row.class_key is None:
        return Annotated[float, Interval(ge=row.least, le=row.most)]

    def read(text: str) -> ByClass:
        every, *others = text.split(",")
        by_class = {}
        for other in others:
            class_, _, value = other.partition("=")
            own = next((own for own in CLASSES if own == class_.strip()), None)
            if own is None:
                raise ValueError(text)
            by_class[own] = float(value)
        numbers = ByClass(float(every), by_class)
        # A class that is named twice contradicts itself.
        if len(by_class) < len(others):
            raise ValueError(text)
        if not all(row.least <= value <= row.most for value in numbers.values):
            raise ValueError(text)
        return numbers

    allowed = f"a number from {row.least:g} to {row.most:g}, also by class (2,robot=3)"
    return Annotated[Any, BeforeValidator(read), allowed]
