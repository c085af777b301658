"""Registrations: which attributes of which entities another context provider has."""

from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from iveg.lab.embedded.documents import Document, new_id, read_document


class RegisteredEntity(Document):
    """One entity with attributes of a provider; without a type, of any type."""

    id: str
    type: str | None = None

    def matches(self, entity_id: str, entity_type: str) -> bool:
        """Whether an entity is meant."""
        return self.id == entity_id and self.type in (None, entity_type)


class DataProvided(Document):
    """Entities, and the attributes of each that a provider has."""

    entities: list[RegisteredEntity]
    attrs: list[str] = Field(min_length=1)

    def concerns(self, entity_id: str, entity_type: str) -> bool:
        """Whether an entity is among them."""
        return any(one.matches(entity_id, entity_type) for one in self.entities)


class _Address(Document):
    url: str = Field(pattern="^https?://[^/]")


class _Provider(Document):
    http: _Address
    supported_forwarding_mode: Literal["all"] = "all"
    legacy_forwarding: Literal[False] = False


class RegistrationDocument(Document):
    """What a client says of a registration."""

    description: str | None = None
    data_provided: DataProvided
    provider: _Provider


@dataclass(frozen=True, slots=True)
class Registration:
    """One context provider with its attributes.

    Attributes:
        path: Service path.
    """

    id: str
    path: str
    document: RegistrationDocument

    @property
    def provided(self) -> DataProvided:
        """Its entities and attributes."""
        return self.document.data_provided

    @property
    def url(self) -> str:
        """Address of the provider."""
        return self.document.provider.http.url

    def show(self) -> dict[str, object]:
        """The registration as a client gets it."""
        return {"id": self.id, **self.document.show(), "status": "active"}


def read_registration(raw: object, path: str) -> Registration:
    """Read a registration from a ``POST``.

    Raises:
        FiwareError: 400 or 501.
    """
    return Registration(new_id(), path, read_document(RegistrationDocument, raw))
