"""What a client says of a subscription: changes to be told of, and to whom."""

import re
from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Literal
from urllib.parse import urlsplit

from pydantic import AfterValidator, Field, NonNegativeInt, model_validator

from iveg.lab.embedded.documents import Document
from iveg.lab.embedded.entities import Touched
from iveg.lab.embedded.errors import bad_request, not_supported
from iveg.lab.embedded.orion_dates import date_text
from iveg.lab.embedded.orion_text import FORBIDDEN, read_pattern
from iveg.lab.embedded.views import EntityView

_FORMATS = (
    "normalized", "simplifiedNormalized", "keyValues", "simplifiedKeyValues", "values",
)  # fmt: skip
_NOTIFIED_METADATA = {"previousValue", "actionType"}
_DEFAULT_TIMEOUT_MS = 5000
_Alteration = Literal["entityChange", "entityUpdate", "entityCreate", "entityDelete"]


def _read_description(text: str | None) -> str | None:
    if not FORBIDDEN.isdisjoint(text or ""):
        raise bad_request("forbidden characters in description")
    return text or None


def _read_date(text: str | None) -> str | None:
    return date_text(text).decode().strip('"') if text else None


def _read_url(text: str) -> str:
    parts = urlsplit(text)
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise bad_request("Invalid URL parsing notification url")
    return text


def _read_format(text: str) -> str:
    if text not in _FORMATS:
        raise bad_request(f"invalid attrsFormat, accepted: {', '.join(_FORMATS)}")
    return text


def _read_headers(headers: dict[str, str]) -> dict[str, str]:
    if any("${" in value for value in headers.values()):
        raise not_supported("a macro in a header")
    return headers


class SubscribedEntity(Document):
    """One entity, or those whose ids match a pattern."""

    id: str | None = None
    id_pattern: str | None = None
    type: str | None = None

    @model_validator(mode="after")
    def _check(self) -> "SubscribedEntity":
        read_pattern(self.id_pattern, "idPattern")
        if self.id is None and self.id_pattern is None:
            raise bad_request("subject entities element has neither id nor idPattern")
        if self.id is not None and self.id_pattern is not None:
            raise bad_request("/entities/ vector item has both /id/ and /idPattern/")
        return self

    def matches(self, entity_id: str, entity_type: str) -> bool:
        """Whether an entity is meant."""
        if self.type not in (None, entity_type):
            return False
        if self.id is not None:
            return self.id == entity_id
        return re.search(self.id_pattern or "", entity_id) is not None


class SubscriptionCondition(Document):
    """Changes that lead to a notification."""

    attrs: tuple[str, ...] = ()
    alteration_types: list[_Alteration] | None = None
    notify_on_metadata_change: bool = True

    @cached_property
    def watched(self) -> frozenset[str]:
        """Attributes that are watched; empty for all."""
        return frozenset(self.attrs)

    @cached_property
    def any_update(self) -> bool:
        """Whether an update counts that changes nothing."""
        return "entityUpdate" in (self.alteration_types or ())

    def wants(self, touched: Touched, alteration: str) -> bool:
        """Whether a change leads to a notification."""
        wanted = self.alteration_types
        if wanted is None:
            if alteration == "entityDelete":
                return False
        elif alteration not in wanted and not (
            alteration == "entityChange" and self.any_update
        ):
            return False
        if alteration == "entityDelete" or (self.any_update and touched.now):
            return True
        if not self.watched and alteration == "entityCreate":
            return True
        return any(
            touched.has_changed(name, metadata_too=self.notify_on_metadata_change)
            for name in self.watched or touched.now
        )


class Subject(Document):
    """Entities, and their changes."""

    entities: list[SubscribedEntity] = Field(min_length=1)
    condition: SubscriptionCondition = SubscriptionCondition()


class Endpoint(Document):
    """The receiver of the notifications."""

    url: Annotated[str, AfterValidator(_read_url)]
    timeout: NonNegativeInt | None = None

    @property
    def timeout_s(self) -> float:
        """Time limit of a response (s)."""
        return (self.timeout or _DEFAULT_TIMEOUT_MS) / 1000


class CustomEndpoint(Endpoint):
    """A receiver that gets headers of its own."""

    headers: Annotated[dict[str, str], AfterValidator(_read_headers)] | None = None


class Notification(Document):
    """Content and receiver of the notifications."""

    attrs: tuple[str, ...] = ()
    only_changed_attrs: bool = False
    attrs_format: Annotated[str, AfterValidator(_read_format)] = "normalized"
    http: Endpoint | None = None
    http_custom: CustomEndpoint | None = None
    metadata: tuple[str, ...] | None = None
    max_fails_limit: NonNegativeInt | None = None
    covered: Literal[False] = False

    @model_validator(mode="after")
    def _check(self) -> "Notification":
        if self.http is None and self.http_custom is None:
            raise bad_request(
                "http, httpCustom, mqtt, mqttCustom, kafka or kafkaCustom is missing"
            )
        if not _NOTIFIED_METADATA.isdisjoint(self.metadata or ()):
            raise not_supported("metadata previousValue and actionType")
        return self

    @property
    def endpoint(self) -> Endpoint:
        """The receiver."""
        return next(one for one in (self.http, self.http_custom) if one is not None)

    @property
    def headers(self) -> Mapping[str, str]:
        """Headers that the receiver asked for."""
        if self.http_custom is None:
            return {}
        return self.http_custom.headers or {}

    @cached_property
    def view(self) -> EntityView:
        """Representation of an entity in the notification."""
        return EntityView(self.attrs_format, self.attrs, self.metadata or ())

    def shown(self, touched: Touched) -> EntityView:
        """The same with the changed attributes alone, where that is wanted."""
        if not self.only_changed_attrs:
            return self.view
        names = self.view.names or touched.now
        chosen = tuple(name for name in names if touched.has_changed(name))
        return EntityView(self.view.form, chosen or ("",), self.view.metadata)


class SubscriptionDocument(Document):
    """What a client says of a subscription, with Orion's defaults."""

    description: Annotated[str | None, AfterValidator(_read_description)] = None
    subject: Subject
    notification: Notification
    expires: Annotated[str | None, AfterValidator(_read_date)] = None
    status: Literal["active", "inactive", "oneshot"] = "active"
    throttling: NonNegativeInt | None = None
