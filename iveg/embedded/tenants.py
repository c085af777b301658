"""Tenants with their data, and the scope of a request."""

from dataclasses import dataclass, field

from iveg.embedded.entities import EntityStore
from iveg.embedded.registrations import Asking, Registration
from iveg.embedded.subscriptions import Subscription


@dataclass(frozen=True, slots=True)
class Scope:
    """Tenant and service path of a request, and its time.

    Attributes:
        service: Tenant, lower case; empty for the default one.
        path: Service path, or several, or ``/#`` for reading.
        correlator: Correlator of the chain of requests.
        now: Seconds, Unix time.
    """

    service: str
    path: str
    correlator: str
    now: float

    @property
    def asking(self) -> Asking:
        """The same for a request to a provider."""
        return Asking(self.service, self.path, self.correlator)


@dataclass(slots=True)
class Tenant:
    """All data of one tenant."""

    entities: EntityStore = field(default_factory=EntityStore)
    subscriptions: dict[str, Subscription] = field(default_factory=dict)
    registrations: dict[str, Registration] = field(default_factory=dict)
    concerned: dict[tuple[str, str, str], list[Subscription]] = field(
        default_factory=dict
    )
    """Entity → its subscriptions; emptied whenever a subscription changes."""
