"""Documents that clients send: subscriptions, registrations, groups, devices."""

import secrets
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.alias_generators import to_camel
from pydantic_core import ErrorDetails

from iveg.lab.embedded.errors import bad_request, not_supported

_Read = TypeVar("_Read", bound="Document")


class Document(BaseModel):
    """A document with no other fields than the supported ones, in camelCase."""

    model_config = ConfigDict(extra="forbid", frozen=True, alias_generator=to_camel)

    def show(self) -> dict[str, Any]:
        """The document as a client gets it, with its defaults."""
        return self.model_dump(by_alias=True, exclude_none=True)


def new_id() -> str:
    """24 hexadecimal digits, as MongoDB names its documents."""
    return secrets.token_hex(12)


def read_document(kind: type[_Read], raw: object) -> _Read:
    """Read a document that Orion gets.

    Raises:
        FiwareError: 400, or 501 for a field that is not supported.
    """
    try:
        return kind.model_validate(raw)
    except ValidationError as error:
        complaints = {one["type"]: one for one in reversed(error.errors())}
        unknown = complaints.get("extra_forbidden")
        if unknown is not None:
            raise not_supported(_place(unknown)) from error
        first = error.errors()[0]
        raise bad_request(f"{_place(first)}: {first['msg']}") from error


def _place(complaint: ErrorDetails) -> str:
    return "/".join(map(str, complaint["loc"]))
