"""Errors as Orion answers them: a status and ``{"error", "description"}``."""

import orjson

from iveg.domain.errors import IvegError

ENTITY_NOT_FOUND = "The requested entity has not been found. Check type and id"
ATTRIBUTE_NOT_FOUND = "The entity does not have such an attribute"


class NgsiError(IvegError):
    """A request that Orion would refuse.

    Attributes:
        status: HTTP status.
        error: Orion's error name, such as ``BadRequest``.
        description: Orion's sentence.
    """

    def __init__(
        self, status: int, error: str, description: str, allow: str = ""
    ) -> None:
        super().__init__(f"{status} {error}: {description}")
        self.status = status
        self.error = error
        self.description = description
        self.allow = allow

    @property
    def body(self) -> bytes:
        """The JSON body of the response."""
        return orjson.dumps({"error": self.error, "description": self.description})


def bad_request(description: str) -> NgsiError:
    """400, with Orion's sentence."""
    return NgsiError(400, "BadRequest", description)


def parse_error() -> NgsiError:
    """400 for a body that is not JSON, or not an object."""
    return NgsiError(400, "ParseError", "Errors found in incoming JSON buffer")


def not_found(description: str = ENTITY_NOT_FOUND) -> NgsiError:
    """404, by default for an entity."""
    return NgsiError(404, "NotFound", description)


def too_many() -> NgsiError:
    """409 for an id that matches several entities."""
    return NgsiError(
        409,
        "TooManyResults",
        "More than one matching entity. Please refine your query",
    )
