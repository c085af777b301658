"""Documents that clients send: subscriptions, registrations, groups, devices."""

import secrets
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.alias_generators import to_camel

from iveg.lab.embedded.errors import bad_request, not_supported

_Read = TypeVar("_Read", bound="Document")


class Document(BaseModel):
    """A document with no other fields than the supported ones, in camelCase."""

    model_config = ConfigDict(extra="forbid", frozen=True, alias_generator=to_camel)

    def show(self) -> dict[str, object]:
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
        complaints = error.errors()
        unknown = [one for one in complaints if one["type"] == "extra_forbidden"]
        first = (unknown or complaints)[0]
        place = "/".join(map(str, first["loc"]))
        if unknown:
            raise not_supported(place) from error
        raise bad_request(f"{place}: {first['msg']}") from error
