"""Common parts of NGSI-v2 requests: options, paging, body."""

from collections.abc import Mapping
from dataclasses import dataclass

from iveg.lab.embedded.changes import read_changes
from iveg.lab.embedded.entities import EntityChange, Scope
from iveg.lab.embedded.errors import (
    bad_request,
    not_supported,
    parse_error,
)
from iveg.lab.embedded.http_server import Request, Response
from iveg.lab.embedded.orion_text import check_given_name, load_json, looks_clean
from iveg.lab.embedded.views import EntityView

_OPTIONS = {
    "keyValues", "values", "count", "upsert", "skipForwarding", "forcedUpdate",
    "normalized", "skipInitialNotification",
}  # fmt: skip
_OPTIONS_NOT_DONE = {
    "append",
    "unique",
    "overrideMetadata",
    "flowControl",
    "noAttrDetail",
}


@dataclass(frozen=True, slots=True)
class NgsiCall:
    """One parsed request.

    Attributes:
        options: ``?options=``.
        parts: The path's parts after ``/v2``.
    """

    request: Request
    scope: Scope
    options: frozenset[str]
    parts: tuple[str, ...]

    @property
    def query(self) -> Mapping[str, str]:
        """Names and values after ``?``."""
        return self.request.query

    @property
    def kind(self) -> str:
        """``?type=``."""
        return self.query.get("type", "")

    def read_object(self) -> dict[str, object]:
        """The body, which must be an object.

        Raises:
            FiwareError: 400.
        """
        value = load_json(self.request.body)
        if not isinstance(value, dict):
            raise parse_error()
        return value

    def changes(self, raw: Mapping[str, object]) -> dict[str, EntityChange]:
        """Read attributes of the body.

        Raises:
            FiwareError: 400.
        """
        return read_changes(
            {name: one for name, one in raw.items() if name not in ("id", "type")},
            key_values="keyValues" in self.options,
            clean=looks_clean(self.request.body),
        )

    def view(self) -> EntityView:
        """The requested representation."""
        forms = self.options & {"keyValues", "values"}
        return EntityView(
            next(iter(forms), "normalized"),
            split_names(self.query.get("attrs")),
            split_names(self.query.get("metadata")),
        )

    def page(self, shown: list[bytes], total: int) -> Response:
        """The requested part of a list of JSON texts.

        Raises:
            FiwareError: 400, no such page.
        """
        limit, offset = _read_paging(self.query)
        body = b"[%b]" % b",".join(shown[offset : offset + limit])
        counted = {"Fiware-Total-Count": str(total)} if "count" in self.options else {}
        return Response(200, body, counted)


def _read_paging(query: Mapping[str, str]) -> tuple[int, int]:
    """``?limit=`` and ``?offset=``."""
    limit, offset = query.get("limit", "20"), query.get("offset", "0")
    for name, text in (("limit", limit), ("offset", offset)):
        wrong = f"Bad pagination {name}: /{text}/"
        if text.startswith("-"):
            raise bad_request(f"{wrong} [must be a positive integer number]")
        if not (text.isascii() and text.isdigit()):
            raise bad_request(f"{wrong} [must be a decimal number]")
    if int(limit) > 1000:
        raise bad_request(f"Bad pagination limit: /{limit}/ [max: 1000]")
    return int(limit), int(offset)


def read_options(request: Request) -> frozenset[str]:
    """``?options=``.

    Raises:
        FiwareError: 400, unknown to Orion; 501, not supported.
    """
    options = frozenset(split_names(request.query.get("options")))
    for one in options & _OPTIONS_NOT_DONE:
        raise not_supported(f"options={one}")
    if not options <= _OPTIONS:
        raise bad_request("Invalid value for URI param /options/")
    return options


def split_names(text: str | None) -> tuple[str, ...]:
    """A comma-separated list."""
    return tuple(name for name in (text or "").split(",") if name)


def read_id(raw: Mapping[str, object]) -> tuple[str, str]:
    """Id and type of an entity in a body; the type is empty where it has none.

    Raises:
        FiwareError: 400.
    """
    entity_id = check_given_name(raw.get("id", ""), "entity id")
    if "type" not in raw:
        return entity_id, ""
    return entity_id, check_given_name(raw["type"], "entity type")
